// The error of one sample in each of k × k strata of the unit square, exactly.

import type { Point } from "./curves";

/** A function on the unit square, by its mean and mean square over a square of edge `h` at a corner. */
export interface Integrand {
  moments(x: number, y: number, h: number): [mean: number, square: number];
}

/** The indicator of a half plane x cos φ + y sin φ < c, with φ in [0, 90°]. */
export class HalfPlane implements Integrand {
  readonly a: number;
  readonly b: number;
  readonly c: number;

  /** At `edge` of the square's diagonal, turned by `tilt` degrees. */
  constructor(edge: number, tilt: number) {
    // An edge along an axis is a limit.
    [this.a, this.b] = [Math.cos, Math.sin].map((f) => Math.max(f(tilt * Math.PI / 180), 1e-4));
    this.c = edge * (this.a + this.b);
  }

  has(x: number, y: number): boolean {
    return this.a * x + this.b * y < this.c;
  }

  moments(x: number, y: number, h: number): [number, number] {
    const { a, b } = this, t = (this.c - a * x - b * y) / h, half = (s: number) => Math.max(s, 0) ** 2 / (2 * a * b);
    // The part of a square below a line, from the triangles that the line cuts.
    const share = Math.min(Math.max(half(t) - half(t - a) - half(t - b) + half(t - a - b), 0), 1);
    return [share, share];
  }

  /** The corners of the part of the unit square in the half plane. */
  get polygon(): Point[] {
    const corners: Point[] = [[0, 0], [1, 0], [1, 1], [0, 1]], value = ([x, y]: Point) => this.c - this.a * x - this.b * y;
    return corners.flatMap((p, i) => {
      const q = corners[(i + 1) % 4], [u, v] = [value(p), value(q)], t = u / (u - v);
      return [...(u >= 0 ? [p] : []), ...(u * v < 0 ? [[p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])] as Point] : [])];
    });
  }
}

/** y (1 + sin 2πx): light without an edge. */
export class Smooth implements Integrand {
  at(x: number, y: number): number {
    return y * (1 + Math.sin(2 * Math.PI * x));
  }

  moments(x: number, y: number, h: number): [number, number] {
    const { PI, sin, cos } = Math;
    const first = (x: number) => x - cos(2 * PI * x) / (2 * PI), second = (x: number) => 1.5 * x - cos(2 * PI * x) / PI - sin(4 * PI * x) / (8 * PI);
    const mean = (of: (x: number) => number, from: number) => (of(from + h) - of(from)) / h;
    return [mean(first, x) * mean((y) => y * y / 2, y), mean(second, x) * mean((y) => y ** 3 / 3, y)];
  }
}

/** The variance of the integrand in each of k × k strata, row by row. */
export function variances(f: Integrand, k: number): number[] {
  return Array.from({ length: k * k }, (_, i) => {
    const [mean, square] = f.moments(i % k / k, Math.floor(i / k) / k, 1 / k);
    return Math.max(square - mean * mean, 0);
  });
}

/** The standard deviations of the mean of k² samples: one in each stratum, and all at random. */
export function deviations(f: Integrand, k: number): { stratified: number; random: number } {
  const n = k * k, sum = variances(f, k).reduce((a, b) => a + b, 0);
  return { stratified: Math.sqrt(sum) / n, random: Math.sqrt(variances(f, 1)[0] / n) };
}
