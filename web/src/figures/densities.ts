// Steps 8 to 11 and 13 without their drawings: combination, the product, rejection, resampling and bias, in one dimension.

import { Table, gauss, generator, integral, light, lightAt, line, normalized, type Point } from "./curves";

type Density = (x: number) => number;

/** Intervals of integrals over narrow lobes. */
const FINE = 8000;
const MEDIUM = 4000;

/** Step 8: `m` samples of the light and `n` of a lobe, weighted by the balance (`beta` 1) or power heuristic (2). */
export class Combination {
  readonly light = normalized(light);
  readonly lobe: Density;
  readonly exact: number;
  /** The variances of the estimates with all samples of one technique, and of both. */
  readonly variances: Record<"light alone" | "lobe alone" | "both", number>;

  constructor(width: number, private m: number, private n: number, private beta: number) {
    this.lobe = normalized((x) => gauss(x, 0.5, width));
    this.exact = integral(this.f, FINE);
    const all = m + n;
    this.variances = {
      "light alone": this.variance(this.light, () => 1) / all,
      "lobe alone": this.variance(this.lobe, () => 1) / all,
      both: this.variance(this.light, this.weight) / m + this.variance(this.lobe, (x) => 1 - this.weight(x)) / n,
    };
  }

  readonly f: Density = (x) => light(x) * this.lobe(x);

  /** The weight of a light sample. */
  readonly weight: Density = (x) => {
    const [a, b] = [(this.m * this.light(x)) ** this.beta, (this.n * this.lobe(x)) ** this.beta];
    return a / (a + b);
  };

  /** That of one sample of a technique. */
  private variance(p: Density, weight: Density): number {
    const part = (x: number) => weight(x) * this.f(x);
    return integral((x) => (part(x) > 0 ? part(x) ** 2 / p(x) : 0), FINE) - integral(part, FINE) ** 2;
  }
}

/** Step 9: light times a lobe, in shadow from `edge` on. */
export class Shadowed {
  readonly light: Density;
  readonly lobe: Density;
  /** The densities in proportion to light, lobe and their product. */
  readonly densities: Record<"light" | "lobe" | "product", Density>;
  /** The unoccluded radiance, and the share of it that is visible. */
  readonly total: number;
  readonly visible: number;

  constructor(center: number, width: number, private edge: number, sun: number) {
    const light = (this.light = lightAt(sun)), lobe = (this.lobe = (x) => gauss(x, center, width));
    const f = (x: number) => light(x) * lobe(x), total = (this.total = integral(f, MEDIUM));
    this.densities = { light: normalized(light), lobe: normalized(lobe), product: (x) => f(x) / total };
    this.visible = Math.min(integral((x) => (this.isVisible(x) ? f(x) / total : 0), MEDIUM), 1);
  }

  isVisible(x: number): boolean {
    return x < this.edge;
  }

  /** The estimate of one sample. */
  value(x: number, density: Density): number {
    return this.isVisible(x) && density(x) > 0 ? this.light(x) * this.lobe(x) / density(x) : 0;
  }

  /** The standard deviation of one sample, relative to the unoccluded radiance. */
  deviation(name: keyof Shadowed["densities"]): number {
    const { visible, total } = this, density = this.densities[name];
    // A binary variable, without the rounding errors of an integral.
    if (name === "product") return Math.sqrt(visible * (visible < 1 - 1e-9 ? 1 - visible : 0));
    const second = integral((x) => this.value(x, density) ** 2 * density(x), MEDIUM);
    return Math.sqrt(Math.max(second - (visible * total) ** 2, 0)) / total;
  }
}

/** The product of the light and a lobe about a center, as a density. */
export const targetAt = (center: number): Density => normalized((x) => light(x) * gauss(x, center, 0.12));

/** Step 10: tries under an envelope of the target, `bound` times as high as the tightest. */
export class Envelope {
  readonly target = targetAt(0.5);
  readonly proposal = normalized(light);
  /** The factor of the tightest envelope, and of this one. */
  readonly tightest = Math.max(...line(2000, (x) => this.target(x) / this.proposal(x)).map(([, y]) => y));
  readonly c: number;
  /** The share of the target above the envelope, which is lost. */
  readonly lost: number;

  constructor(bound: number) {
    this.c = bound * this.tightest;
    this.lost = integral((x) => Math.max(this.target(x) - this.height(x), 0));
  }

  height(x: number): number {
    return this.c * this.proposal(x);
  }

  /** The share of tries that is kept. */
  get acceptance(): number {
    return (1 - this.lost) / this.c;
  }

  tries(n: number, seed: number): { kept: Point[]; rejected: Point[] } {
    const table = new Table(this.proposal), random = generator(seed), kept: Point[] = [], rejected: Point[] = [];
    for (let k = 0; k < n; k++) {
      const x = table.sample(random()), y = random() * this.height(x);
      (y < this.target(x) ? kept : rejected).push([x, y]);
    }
    return { kept, rejected };
  }
}

/** Step 11: directions picked from sets of `m` candidates, as a histogram. */
export class Resampling {
  static readonly BINS = 50;
  readonly target: Density;
  readonly proposal = normalized(light);
  readonly picks: number;
  /** The density of the picks in each bin, at its middle. */
  readonly bars: Point[];

  constructor(center: number, m: number, seed: number) {
    const { BINS } = Resampling, table = new Table(light), random = generator(seed);
    this.target = targetAt(center);
    this.picks = Math.min(20000, Math.floor(2e6 / m));
    const histogram = new Array<number>(BINS).fill(0);
    for (let k = 0; k < this.picks; k++) {
      let chosen = 0, sum = 0;
      for (let j = 0; j < m; j++) {
        const x = table.sample(random()), w = this.weight(x);
        sum += w;
        if (random() * sum < w) chosen = x;
      }
      histogram[Math.min(Math.floor(chosen * BINS), BINS - 1)]++;
    }
    this.bars = histogram.map((count, i): Point => [(i + 0.5) / BINS, count * BINS / this.picks]);
  }

  /** The weight of a candidate. */
  weight(x: number): number {
    return this.target(x) / this.proposal(x);
  }

  /** The density of the picks in the bin of a place. */
  pickedAt(x: number): number {
    const { BINS } = Resampling;
    return this.bars[Math.min(Math.floor(x * BINS), BINS - 1)][1];
  }

  /** The mean of the target over each bin. */
  private get targets(): number[] {
    return this.bars.map(([x]) => integral((u) => this.target(x + (u - 0.5) / Resampling.BINS), 20));
  }

  /** Half the sum of absolute differences to the target. */
  get distance(): number {
    const { bars, targets } = this;
    return 0.5 * bars.reduce((sum, [, y], i) => sum + Math.abs(y - targets[i]), 0) / Resampling.BINS;
  }

  /** The expected distance of a histogram of as many samples of the target itself. */
  get noise(): number {
    const deviation = (p: number) => Math.sqrt(2 * p * (1 - p) / (Math.PI * this.picks));
    return 0.5 * this.targets.reduce((sum, mean) => sum + deviation(mean / Resampling.BINS), 0);
  }
}

/** Step 13: lights in a row, of which those beyond `edge` are in shadow. */
export class FixedLights {
  constructor(private edge: number) {}

  visibility(x: number): number {
    return x < this.edge ? 1 : 0;
  }

  places(n: number): number[] {
    return Array.from({ length: n }, (_, i) => (i + 0.5) / n);
  }

  /** The share that `n` fixed lights find visible. */
  share(n: number): number {
    return this.places(n).reduce((sum, x) => sum + this.visibility(x), 0) / n;
  }

  /** The RMSE of means of random samples, at each of some counts, over `runs` runs. */
  noise(counts: number[], runs: number, seed: number): Point[] {
    const random = generator(seed);
    const mean = (n: number) => Array.from({ length: n }, () => this.visibility(random())).reduce((a, b) => a + b, 0) / n;
    return counts.map((n): Point => {
      let squares = 0;
      for (let run = 0; run < runs; run++) squares += (mean(n) - this.edge) ** 2;
      return [n, Math.sqrt(squares / runs)];
    });
  }
}
