// A room with a window, in two dimensions: what finds the light, by quadrature.

import { Table, gauss } from "./curves";

/** The room [meters]: a floor along x, with a window in the wall at x = 0. */
export const ROOM = { width: 5, height: 3 };
const HALF = Math.PI / 2;

export type Way = "light" | "lobe" | "both" | "product" | "window";
export const WAYS: Record<Way, string> = { light: "light", lobe: "lobe", both: "both", product: "product", window: "points on the window" };

/** A point on the floor and what it sees through the window. Angles are from the normal, negative toward the window. */
export class Plan {
  /** Integrals over the upper half circle. */
  private ofLight: number;
  private ofProduct: number;
  readonly seen: number;

  /** Where the point is, and the window from `low` to `high`. */
  constructor(readonly x: number, readonly low: number, readonly high: number, readonly sun: number) {
    this.ofLight = this.integral((t) => this.light(t)) + Math.PI * GROUND;
    this.ofProduct = this.integral((t) => this.light(t) * this.lobe(t));
    this.seen = this.integral((t) => this.light(t) * this.lobe(t) * this.visible(t));
  }

  /** An integral over the upper half circle, exact at the window's edges. */
  integral(f: (angle: number) => number, n = 2000): number {
    const [from, to] = this.window, parts = [-HALF, from, to, HALF];
    return parts.slice(1).reduce((sum, end, i) => {
      const begin = parts[i], h = (end - begin) / n;
      for (let k = 0; k < n; k++) sum += f(begin + (k + 0.5) * h) * h;
      return sum;
    }, 0);
  }

  /** The angles between which the window is seen. */
  get window(): [number, number] {
    return [-Math.atan2(this.x, this.low), -Math.atan2(this.x, this.high)];
  }

  /** The sky with a sun. */
  light(angle: number): number {
    return 1 + 20 * gauss(angle, this.sun, 0.06);
  }
  /** Reflectance times cosine. */
  lobe(angle: number): number {
    return Math.abs(angle) < HALF ? Math.cos(angle) / 2 : 0;
  }
  visible(angle: number): number {
    const [from, to] = this.window;
    return angle > from && angle < to ? 1 : 0;
  }

  /** A density of directions; that of the light also has the ground's half of the circle, which is lost. */
  density(way: Way, t: number): number {
    switch (way) {
      case "light": return this.light(t) / this.ofLight;
      case "lobe": return this.lobe(t);
      case "both": return (this.density("light", t) + this.density("lobe", t)) / 2;
      case "product": return this.light(t) * this.lobe(t) / this.ofProduct;
      case "window": return this.visible(t) * this.x / Math.sin(t) ** 2 / (this.high - this.low);
    }
  }

  /** The share of the rays that leave through the window. */
  share(way: Way): number {
    return this.integral((t) => this.density(way, t) * this.visible(t));
  }

  /** The standard deviation of one ray, relative to the light that arrives. */
  deviation(way: Way): number {
    const second = this.integral((t) => (this.visible(t) ? (this.light(t) * this.lobe(t)) ** 2 / this.density(way, t) : 0));
    return Math.sqrt(Math.max(second / this.seen ** 2 - 1, 0));
  }

  /** Directions drawn by a density from uniform numbers; those below the floor are null. */
  sampler(way: Way): (u: number) => number | null {
    const inside = this.integral((t) => this.density(way, t)), [from, to] = way === "window" ? this.window : [-HALF, HALF];
    const table = new Table((x) => this.density(way, from + x * (to - from)), 4000);
    return (u) => (u < inside ? from + (to - from) * table.sample(Math.min(u / inside, 1 - 1e-9)) : null);
  }

  /** Where a ray ends: at a wall, at the ceiling, or outside the window. */
  end(angle: number): [number, number] {
    const [dx, dy] = [Math.sin(angle), Math.cos(angle)];
    if (this.visible(angle)) return [-0.6, (this.x + 0.6) * dy / -dx];
    const length = Math.min(dx < 0 ? this.x / -dx : dx > 0 ? (ROOM.width - this.x) / dx : Infinity, dy > 1e-9 ? ROOM.height / dy : Infinity);
    return [this.x + length * dx, length * dy];
  }
}
/** The light of the ground. */
const GROUND = 0.3;
