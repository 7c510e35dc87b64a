// References of the picture's scene, to measure errors: independent renders, made in the background and kept.

import type { App } from "./app";
import type { Host, RenderSettings } from "./engines";
import { Film, luminance } from "./film";
import { GroupedMean, Lattice } from "./passes";
import type { FromWorker } from "./protocol";

/** The strategy of all renders: unbiased, with the least noise in most scenes. */
const STRATEGY = "product:16";
/** Samples per pixel of each render. */
const SAMPLES = 4;
/** The most renders: for a measurement, and for the picture of errors. */
const MOST = 16, MOST_SHOWN = 64;
/** A measurement has converged when the reference's noise is this fraction of the error, and the picture of errors when
 *  the reference's variance is. */
const CONVERGED = 0.02, CONVERGED_SHOWN = 0.01;
/** References of other scenes and views that are kept, while together they have at most so many pixels. */
const KEPT = 4, KEPT_PIXELS = 1 << 21;

/** Independent renders of one scene and view. */
interface Kept {
  key: string;
  renders: number;
  lattice: Lattice;
  /** Σ b and Σ b² over the renders' luminances b at the lattice's points. */
  sums: Float64Array;
  squares: Float64Array;
  /** The mean of the renders. */
  film: Film;
}

export class Reference {
  private kept: Kept[] = [];
  private current: Kept | null = null;
  private settings: RenderSettings | null = null;
  private token = 0;
  private host: Host | null = null;
  private running = false;
  /** Why there is no reference; empty if nothing failed. */
  failure = "";

  /** `changed` is called after each render; then `isEnough` says whether another one would change what is shown. */
  constructor(private app: App, private changed: () => void, private isEnough: () => boolean) {}

  /** Chooses the reference of a picture, without rendering. */
  choose(of: RenderSettings) {
    const { scene, material, materials, ground, env, rows, reduce, rotate, ev, scale } = this.app.state, { width, height, hideEnvironment, camera } = of;
    const key = JSON.stringify([this.app.revision, this.app.missing, scene, material, materials, ground, env, rows, reduce, rotate, ev, scale, width, height, hideEnvironment, camera]);
    if (this.current?.key === key) return;
    this.stop();
    this.settings = of;
    this.failure = "";
    const lattice = () => new Lattice(width, height), known = this.kept.find((other) => other.key === key);
    const fresh = (lattice: Lattice): Kept => ({ key, renders: 0, lattice, sums: new Float64Array(lattice.size), squares: new Float64Array(lattice.size), film: new Film(width, height) });
    this.current = known ?? fresh(lattice());
    this.kept = [this.current, ...this.kept.filter((other) => other !== known && other.renders)].slice(0, KEPT);
    const pixels = () => this.kept.reduce((sum, { film }) => sum + film.width * film.height, 0);
    while (this.kept.length > 1 && pixels() > KEPT_PIXELS) this.kept.pop();
  }

  /** Renders in the background until there is enough. */
  run() {
    if (!this.running && this.current && !this.failure && !this.isEnough()) void this.render();
  }

  private async render() {
    const token = --this.token, of = this.current!, settings = this.settings!;
    this.running = true;
    try {
      const host = (this.host = await this.app.reference());
      if (token !== this.token) return;
      const film = new Film(settings.width, settings.height);
      host.onRender = (message) => this.receive(message, token, of, film);
      const seed = Math.imul(of.renders + 1, 0x9e3779b1) >>> 0;
      host.send({ kind: "render", token, settings: JSON.stringify({ ...settings, strategy: STRATEGY, seed, spp: SAMPLES, shard: [0, 1] }) });
    } catch (error) {
      if (token === this.token) this.fail((error as Error).message);
    }
  }

  stop() {
    this.token--;
    if (this.running) this.host?.send({ kind: "stop" });
    this.running = false;
  }

  private fail(why: string) {
    this.stop();
    this.failure = why;
    this.changed();
  }

  private receive(message: Extract<FromWorker, { token: number }>, token: number, of: Kept, film: Film) {
    if (message.token !== token || token !== this.token) return;
    if (message.kind === "failed") return this.fail(message.error);
    if (message.kind !== "update") return;
    film.put(message.windows, message.pixels);
    if (!message.complete) return;
    of.renders++;
    of.lattice.of(film).forEach((b, i) => {
      of.sums[i] += b;
      of.squares[i] += b * b;
    });
    of.film.average(film, of.renders);
    this.running = false;
    this.changed();
    this.run();
  }

  /** Identifies scene and view. */
  get name() {
    return this.current?.key ?? "";
  }

  /** The number of independent renders so far, and of samples per pixel of all of them. */
  get renders() {
    return this.current?.renders ?? 0;
  }
  get samples() {
    return SAMPLES * this.renders;
  }

  /** The mean of the renders; null before the first. */
  get film(): Film | null {
    return this.renders ? this.current!.film : null;
  }

  /** Whether errors can be measured: that takes two renders. */
  get isReady() {
    return this.renders >= 2;
  }

  /** The mean relative squared error of luminances a at the lattice's points. For each pair of independent renders,
   *  (a − b)(a − b′) has the squared error as its expectation, without the renders' own variance. */
  error(values: Float32Array): GroupedMean {
    const { renders: m, lattice, sums, squares } = this.current!, { groups } = lattice, mean = new GroupedMean();
    for (let i = 0; i < values.length; i++) {
      const a = values[i], s = sums[i], d = m * a - s, y = s / m;
      const squared = m * a * a - 2 * a * s + squares[i];
      mean.add(groups[i], (d * d - squared) / (m * (m - 1)) / (y * y + 0.01));
    }
    return mean;
  }

  private varianceOf: { renders: number; of: Kept; variance: number } | null = null;
  /** The relative variance of one render, averaged over the points. */
  private get variance(): number {
    const { renders: m, sums, squares } = this.current!;
    if (this.varianceOf?.of === this.current && this.varianceOf.renders === m) return this.varianceOf.variance;
    const variance = sums.reduce((sum, s, i) => sum + (squares[i] - s * s / m) / (m - 1) / ((s / m) ** 2 + 0.01), 0) / sums.length;
    this.varianceOf = { renders: m, of: this.current!, variance };
    return variance;
  }

  /** The standard deviation of a measured error that is due to the reference's noise alone. */
  noise(error: number): number {
    const { variance: v, renders: m } = this, n = this.current!.lattice.size;
    return Math.sqrt((4 * Math.max(error, 0) * v / m + 2 * v * v / (m * (m - 1))) / n);
  }

  /** Whether more renders would hardly change a measured error, or the picture of errors. */
  settles(error: number, isShown: boolean): boolean {
    if (!this.isReady) return false;
    const { renders } = this;
    if (isShown) return renders >= MOST_SHOWN || (this.variance / renders < CONVERGED_SHOWN * error);
    return renders >= MOST || this.noise(error) < CONVERGED * error;
  }
}
