// Pictures as they were at whole passes, on a lattice of their pixels, to measure errors whenever a reference is ready.

import { luminance, type Film } from "./film";
import type { Update } from "./protocol";

/** The most points of a lattice. */
const POINTS = 1 << 18;
/** Blocks of points are dealt to so many groups, whose differences show how certain a mean over all points is. */
const GROUPS = 20, BLOCK = 8;

/** Every `stride`-th pixel of a picture, in both directions. */
export class Lattice {
  readonly stride: number;
  readonly columns: number;
  readonly size: number;

  constructor(readonly width: number, readonly height: number) {
    this.stride = Math.ceil(Math.sqrt(width * height / POINTS));
    this.columns = Math.ceil(width / this.stride);
    this.size = this.columns * Math.ceil(height / this.stride);
  }

  private known: Uint8Array | null = null;
  /** The group of each point. */
  get groups(): Uint8Array {
    return (this.known ??= Uint8Array.from({ length: this.size }, (_, i) => {
      const [x, y] = [i % this.columns, Math.floor(i / this.columns)].map((c) => Math.floor(c / BLOCK));
      return (Math.imul(x * 73856093 ^ y * 19349663, 0x9e3779b1) >>> 8) % GROUPS;
    }));
  }

  /** The luminances of a picture. */
  of(film: Film): Float32Array {
    const values = new Float32Array(this.size);
    for (let i = 0; i < values.length; i++) values[i] = luminance(film.pixels, 4 * this.pixel(i));
    return values;
  }

  /** The pixel at a point. */
  pixel(i: number): number {
    return Math.floor(i / this.columns) * this.stride * this.width + (i % this.columns) * this.stride;
  }

  /** The points in a rectangle of pixels. */
  *inside([x, y, width, height]: Uint32Array): Generator<number> {
    const first = (c: number) => Math.ceil(c / this.stride), end = (c: number) => Math.ceil(c / this.stride);
    for (let row = first(y); row < end(y + height); row++) {
      for (let column = first(x); column < end(x + width); column++) yield row * this.columns + column;
    }
  }
}

/** A mean over the points of a lattice, and over those of each group. */
export class GroupedMean {
  private sums = new Float64Array(GROUPS);
  private counts = new Float64Array(GROUPS);

  add(group: number, value: number) {
    this.sums[group] += value;
    this.counts[group]++;
  }

  /** Without one of the groups, or with all of them. */
  mean(without = -1): number {
    let [sum, count] = [0, 0];
    this.sums.forEach((s, g) => { if (g !== without) [sum, count] = [sum + s, count + this.counts[g]]; });
    return count ? sum / count : 0;
  }
}

/** A function of grouped means, and its standard error by the jackknife. */
export function jackknife(of: (without: number) => number): [value: number, standardError: number] {
  const parts = Array.from({ length: GROUPS }, (_, g) => of(g)), mean = parts.reduce((a, b) => a + b, 0) / GROUPS;
  const squares = parts.reduce((sum, part) => sum + (part - mean) ** 2, 0);
  return [of(-1), Math.sqrt(squares * (GROUPS - 1) / GROUPS)];
}

/** A picture at the end of a pass. */
export interface Pass {
  /** Shadow rays up to here. */
  rays: number;
  /** Luminances at the lattice's points. */
  values: Float32Array;
}

/** What one engine renders of a picture: its tiles, their points, and the passes that not all engines have finished. */
interface Part {
  windows: Map<string, Uint32Array>;
  points: Uint32Array | null;
  passes: Pass[];
}

/** The whole passes of a picture that several engines render. */
export class Passes {
  readonly lattice: Lattice;
  /** Whole passes of all engines. */
  readonly whole: Pass[] = [];
  private parts = new Map<object, Part>();

  constructor(width: number, height: number, private nHosts: number) {
    this.lattice = new Lattice(width, height);
  }

  /** Takes what an engine has rendered into a film. */
  note(host: object, { windows, whole, statistics }: Update, film: Film) {
    const { lattice } = this;
    const part: Part = this.parts.get(host) ?? { windows: new Map(), points: null, passes: [] };
    this.parts.set(host, part);
    // In the first pass, every tile appears.
    if (!part.points) for (let i = 0; i < windows.length; i += 4) part.windows.set(`${windows[i]},${windows[i + 1]}`, windows.slice(i, i + 4));
    if (!whole) return;
    part.points ??= Uint32Array.from([...part.windows.values()].flatMap((window) => [...lattice.inside(window)]));
    const values = Float32Array.from(part.points, (i) => luminance(film.pixels, 4 * lattice.pixel(i)));
    part.passes.push({ rays: statistics.shadowRays, values });
    this.join();
  }

  /** Joins the parts of the passes that all engines have finished. */
  private join() {
    const parts = [...this.parts.values()];
    while (parts.length === this.nHosts && parts.every((part) => part.passes.length)) {
      const pass: Pass = { rays: 0, values: new Float32Array(this.lattice.size) };
      for (const { points, passes } of parts) {
        const { rays, values } = passes.shift()!;
        pass.rays += rays;
        points!.forEach((point, k) => { pass.values[point] = values[k]; });
      }
      this.whole.push(pass);
    }
  }
}
