// What learned visibility adds to the product of light and reflectance, in one dimension: the terms of the default
// strategy's estimate, and its variance by quadrature.

import { clamp, gauss, generator, integral } from "./curves";

/** Strata of the candidates, one in each. */
export const STRATA = 16;
const WIDTH = 1 / STRATA;

/** Light times reflectance times cosine. */
export const unoccluded = (x: number) => (0.3 + 1.2 * gauss(x, 0.35, 0.07) + 0.7 * gauss(x, 0.75, 0.15)) * gauss(x, 0.5, 0.3);

/** A stratum: the light in it, its linear control variate about its center, and what is known of its visibility. */
export interface Stratum {
  center: number;
  light: number;
  /** The mean and the slope of the control variate h. */
  mean: number;
  slope: number;
  /** V̂ and its standard deviation. */
  visibility: number;
  deviation: number;
}

/** The mean over a stratum. */
const over = (k: number, f: (x: number) => number) => integral((t) => f((k + t) * WIDTH), 200);

/** A pixel whose points see the light up to a shadow's edge, which differs between them by a penumbra. */
export class Pixel {
  readonly strata: Stratum[];

  /** Without learned visibility, V̂ is 0 and nothing is known of its deviation. */
  constructor(readonly edge: number, readonly penumbra: number, learns = true) {
    this.strata = Array.from({ length: STRATA }, (_, k) => {
      const center = (k + 0.5) * WIDTH, mean = over(k, unoccluded), visibility = learns ? over(k, (x) => this.visible(x)) : 0;
      const slope = 12 * over(k, (x) => unoccluded(x) * (x - center)) / WIDTH ** 2;
      return { center, light: mean * WIDTH, mean, slope, visibility, deviation: learns ? Math.sqrt(Math.max(visibility * (1 - visibility), 0)) : 1 };
    });
  }

  /** The share of the pixel's points that see direction x. */
  visible(x: number): number {
    return clamp((this.edge + this.penumbra / 2 - x) / this.penumbra);
  }

  /** The control variate in the stratum of a direction. */
  control(x: number): number {
    const { center, mean, slope } = this.of(x);
    return mean + slope * (x - center);
  }

  of(x: number): Stratum {
    return this.strata[Math.min(Math.floor(x * STRATA), STRATA - 1)];
  }

  /** The light with and without shadows. */
  get total(): number {
    return this.strata.reduce((sum, { light }) => sum + light, 0);
  }
  get shadowed(): number {
    return this.strata.reduce((sum, _, k) => sum + WIDTH * over(k, (x) => unoccluded(x) * this.visible(x)), 0);
  }

  /** The probability that the candidate at x is traced, in proportion to its weight and to the uncertainty of V, so that
   *  at most `rays` are expected. */
  probability(x: number, rays: number): number {
    const whole = this.strata.reduce((sum, { light, deviation }) => sum + light * deviation, 0);
    return whole > 0 ? Math.min(rays * unoccluded(x) * WIDTH * this.of(x).deviation / whole, 1) : 0;
  }

  /** The expected number of rays. */
  expected(rays: number): number {
    return this.strata.reduce((sum, _, k) => sum + over(k, (x) => this.probability(x, rays)), 0);
  }

  /** The variance of the estimate Σ V̂ ∫ h + Σ V̂ (W − h) + Σ B W / π (V − V̂), where B selects with probability π. */
  variance(rays: number): number {
    return this.strata.reduce((sum, { visibility: v }, k) => {
      const known = (x: number) => v * WIDTH * (unoccluded(x) - this.control(x)), weight = (x: number) => unoccluded(x) * WIDTH;
      const first = over(k, (x) => known(x) + weight(x) * (this.visible(x) - v));
      const second = over(k, (x) => {
        const seen = this.visible(x), w = weight(x), chance = this.probability(x, rays);
        const squared = seen * (1 - v) ** 2 + (1 - seen) * v ** 2;
        return known(x) ** 2 + 2 * known(x) * w * (seen - v) + (squared > 0 && w > 0 ? w * w * squared / chance : 0);
      });
      return sum + Math.max(second - first * first, 0);
    }, 0);
  }

  /** One estimate: its candidates, and which of them were traced and saw the light. */
  estimate(rays: number, seed: number): { value: number; candidates: { x: number; isTraced: boolean; isSeen: boolean }[] } {
    const random = generator(seed);
    let value = 0;
    const candidates = this.strata.map(({ light, visibility: v }, k) => {
      const x = (k + random()) * WIDTH, w = unoccluded(x) * WIDTH, chance = this.probability(x, rays);
      const isTraced = random() < chance, isSeen = random() < this.visible(x);
      value += v * (light + w - WIDTH * this.control(x)) + (isTraced ? w / chance * (Number(isSeen) - v) : 0);
      return { x, isTraced, isSeen };
    });
    return { value, candidates };
  }
}
