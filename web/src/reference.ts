// A reference that converges alongside the displayed picture, to measure its error.

import type { App } from "./app";
import type { Host, RenderSettings } from "./engines";
import { Film } from "./film";
import type { FromWorker, Statistics } from "./protocol";

/** The reference's strategy: unbiased, with the least noise in most scenes. */
const STRATEGY = "product:16";
/** The reference has converged when its variance is this fraction of the picture's error. */
const CONVERGED = 0.01;
/** The number of samples per pixel from which the variance estimate is reliable. */
const RELIABLE = 16;

export class Reference {
  film: Film | null = null;
  statistics: Statistics | null = null;
  private token = 0;
  private host: Host | null = null;
  isStarted = false;

  constructor(private app: App, private changed: (windows: Uint32Array | "all") => void) {}

  /** Starts the reference of a picture, with different random numbers. */
  async start(of: RenderSettings) {
    const token = --this.token;
    this.isStarted = true;
    this.film = this.statistics = null;
    const host = (this.host = await this.app.reference());
    if (token !== this.token) return;
    const film = new Film(of.width, of.height);
    host.onRender = (message) => this.receive(message, film);
    const settings = { ...of, strategy: STRATEGY, seed: (of.seed + 1) % 2 ** 32, spp: 65536, shard: [0, 1] };
    host.send({ kind: "render", token, settings: JSON.stringify(settings) });
  }

  stop() {
    this.token--;
    this.isStarted = false;
    this.film = this.statistics = null;
    this.host?.send({ kind: "stop" });
  }

  /** Whether every pixel has samples. */
  get isReady() {
    return !!this.film && (this.statistics?.samples ?? 0) >= 1;
  }

  private receive(message: Extract<FromWorker, { token: number }>, film: Film) {
    if (message.token !== this.token) return;
    if (message.kind === "failed") this.app.tell(message.error, true);
    if (message.kind !== "update") return;
    const { windows, pixels, statistics } = message;
    const before = this.statistics;
    // An estimate of before is of fewer samples.
    const relativeVariance = statistics.relativeVariance ?? (before && before.relativeVariance !== null ? before.relativeVariance * before.samples / statistics.samples : null);
    this.statistics = { ...statistics, relativeVariance };
    const isFirst = this.film !== film;
    this.film = film;
    film.put(windows, pixels);
    this.changed(isFirst ? "all" : windows);
  }

  /** The reference's own relative variance, averaged over the pixels. */
  get variance(): number {
    const { relativeVariance, pixels } = this.statistics ?? {};
    return relativeVariance === null || relativeVariance === undefined ? NaN : relativeVariance / Math.max(pixels ?? 1, 1);
  }

  /** The mean relative squared error of a picture's pixels, without the reference's own variance. */
  error(of: Film): number {
    const { film } = this;
    if (!film || film.width !== of.width || film.height !== of.height) return NaN;
    let sum = 0;
    const a = of.pixels, b = film.pixels;
    for (let i = 0; i < a.length; i += 4) {
      const y = 0.2126 * b[i] + 0.7152 * b[i + 1] + 0.0722 * b[i + 2];
      const d = 0.2126 * a[i] + 0.7152 * a[i + 1] + 0.0722 * a[i + 2] - y;
      sum += d * d / (y * y + 0.01);
    }
    return Math.max(4 * sum / a.length - this.variance, 0);
  }

  /** Stops the reference when more samples would not change the measured error. */
  settle(error: number) {
    if ((this.statistics?.samples ?? 0) >= RELIABLE && this.variance < CONVERGED * error) this.host?.send({ kind: "stop" });
  }
}
