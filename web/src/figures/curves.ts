// Functions and densities on [0, 1], for the one-dimensional figures.

export type Point = [number, number];

/** A generator of reproducible uniform numbers. */
export function generator(seed: number): () => number {
  let s = seed >>> 0;
  return () => {
    s = (s + 0x6d2b79f5) | 0;
    let t = Math.imul(s ^ (s >>> 15), 1 | s);
    t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
    return ((t ^ (t >>> 14)) >>> 0) / 4294967296;
  };
}

export const line = (n: number, f: (x: number) => number, [low, high]: Point = [0, 1]): Point[] =>
  Array.from({ length: n + 1 }, (_, i) => low + (high - low) * i / n).map((x) => [x, f(x)]);
export const integral = (f: (x: number) => number, n = 2000) =>
  Array.from({ length: n }, (_, i) => f((i + 0.5) / n)).reduce((a, b) => a + b, 0) / n;
export const gauss = (x: number, mean: number, width: number) => Math.exp(-0.5 * ((x - mean) / width) ** 2);
export const normalized = (f: (x: number) => number) => {
  const total = integral(f);
  return (x: number) => f(x) / total;
};

/** A function on [0, 1] as a table that can be sampled. */
export class Table {
  private cdf: Float64Array;
  constructor(f: (x: number) => number, private n = 1000) {
    this.cdf = new Float64Array(n + 1);
    for (let i = 0; i < n; i++) this.cdf[i + 1] = this.cdf[i] + f((i + 0.5) / n);
    const total = this.cdf[n] || 1;
    this.cdf = this.cdf.map((c) => c / total);
  }
  at(x: number) {
    const i = Math.min(Math.floor(x * this.n), this.n - 1);
    return this.cdf[i] + (this.cdf[i + 1] - this.cdf[i]) * (x * this.n - i);
  }
  sample(u: number) {
    let [low, high] = [0, this.n];
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (this.cdf[middle] <= u) low = middle;
      else high = middle;
    }
    const width = this.cdf[low + 1] - this.cdf[low];
    return (low + (width > 0 ? (u - this.cdf[low]) / width : 0.5)) / this.n;
  }
}

/** Light with a small bright lamp, on [0, 1]. */
export const lightAt = (lamp: number) => (x: number) => 0.15 + 4 * gauss(x, lamp, 0.02) + 0.7 * gauss(x, 0.75, 0.15);
export const light = lightAt(0.35);

/** The maximum of a function on [0, 1]. */
export const top = (f: (x: number) => number) => Math.max(...line(400, f).map(([, y]) => y));
export const clamp = (x: number, low = 0, high = 1) => Math.min(Math.max(x, low), high);
