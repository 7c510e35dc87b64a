// What renders the pictures of figures: scenes of their own, on an engine beside the page's.

import { whileBusy } from "../busy";
import type { App } from "../app";
import type { Host } from "../engines";
import { Film, luminance } from "../film";
import type { Arguments, Call, Result } from "../protocol";

/** The most pixels along an edge of a figure's picture, which is no larger than that of the Picture panel. */
const MOST = 96;
export const sizeOf = (app: App) => Math.min(app.state.size, MOST);

/** What is rendered: scene, light, and the pictures' edge [pixels]. */
export interface Situation {
  scene: string;
  material: string;
  ground: boolean;
  probe: string;
  rows: number;
  rotate: number;
  hidesEnvironment: boolean;
  size: number;
}

/** The rows of a light probe, which has no more than that of the Picture panel. */
export const rowsOf = (app: App) => Math.min(app.state.rows, 128);

/** The lecture's sphere with a share of diffuse reflectance, in a nave. */
export const sphere = (app: App, share: number): Situation =>
  ({ scene: "sphere-orthographic", material: `phong:50:1:${share}`, ground: false, probe: "cathedral", rows: rowsOf(app), rotate: 0, hidesEnvironment: true, size: sizeOf(app) });

/** The settings of the reference pictures, of which there are two. */
const TRUTH = { strategy: "product:16", spp: 16 };

export interface Rendered {
  film: Film;
  rays: number;
  /** The time in the engine [ms], which is CPU time where the Worker has a core for itself. */
  time: number;
}

/** The mean relative squared error of a picture against two independent references, without their variance; pixels below a
 *  tenth of the mean count as if they had that, because a dim room's errors would vanish beside the program's 0.01. */
export function errorOf({ film }: Rendered, [a, b]: Rendered[]): number {
  let sum = 0, mean = 0;
  for (let i = 0; i < a.film.pixels.length; i += 4) mean += luminance(a.film.pixels, i) / (a.film.pixels.length / 4);
  for (let i = 0; i < film.pixels.length; i += 4) {
    const [x, y, z] = [film, a.film, b.film].map((of) => luminance(of.pixels, i)), truth = (y + z) / 2;
    sum += (x - y) * (x - z) / (truth * truth + 0.01 * mean * mean);
  }
  return sum / (film.pixels.length / 4);
}

/** Renders one picture after the other. */
export class Lab {
  private static all = new WeakMap<App, Lab>();
  static of(app: App): Lab {
    const lab = Lab.all.get(app) ?? new Lab(app.engines.extra());
    Lab.all.set(app, lab);
    return lab;
  }

  private truths = new Map<string, Promise<Rendered[]>>();
  private last: Promise<unknown> = Promise.resolve();
  private token = 0;
  private loaded = { scene: "", light: "" };
  private constructor(private host: Host) {}

  /** Two reference pictures, kept as long as the page is open. */
  truth(of: Situation): Promise<Rendered[]> {
    const { strategy, spp } = TRUTH, key = JSON.stringify(of), found = this.truths.get(key) ?? Promise.all([1, 2].map(() => this.render(of, strategy, spp)));
    this.truths.set(key, found);
    return found;
  }

  /** Renders a picture, stopped after so much of the engine's time if it is timed. */
  render(of: Situation, strategy: string, spp: number, milliseconds = Infinity): Promise<Rendered> {
    return this.next(of, () => this.start(of, strategy, spp, milliseconds));
  }

  /** Asks the engine about a situation. */
  ask<C extends Call>(of: Situation, call: C, ...args: Arguments<C>): Promise<Result<C>> {
    return this.next(of, () => this.host.call(call, ...args));
  }

  /** Does what is asked when all before it is done. */
  private next<T>(of: Situation, act: () => Promise<T>): Promise<T> {
    const next = whileBusy(this.last.then(() => this.load(of)).then(act));
    this.last = next.catch(() => {});
    return next;
  }

  private async load({ scene, material, ground, probe, rows, rotate }: Situation) {
    const wanted = { scene: JSON.stringify({ scene, material, ground }), light: JSON.stringify({ probe, rows, rotate, scale: 1, exposure: 0 }) };
    if (this.loaded.scene !== wanted.scene) await this.host.call("loadScene", wanted.scene);
    this.loaded.scene = wanted.scene;
    if (this.loaded.light !== wanted.light) await this.host.call("loadEnvironment", wanted.light);
    this.loaded.light = wanted.light;
  }

  private start({ size, hidesEnvironment }: Situation, strategy: string, spp: number, milliseconds: number) {
    return new Promise<Rendered>((resolve, reject) => {
      const { host } = this, film = new Film(size, size), token = ++this.token;
      let time = 0;
      host.onRender = (message) => {
        if (message.token !== token) return;
        if (message.kind === "failed") reject(new Error(message.error));
        if (message.kind !== "update") return;
        film.put(message.windows, message.pixels);
        time += message.milliseconds;
        // Every pixel has at least one sample.
        if (message.complete || (time >= milliseconds && message.statistics.samples >= 1)) {
          host.send({ kind: "stop" });
          resolve({ film, rays: message.statistics.shadowRays, time });
        }
      };
      host.send({ kind: "render", token, settings: JSON.stringify({ width: size, height: size, spp, strategy, seed: token, hideEnvironment: hidesEnvironment, camera: null, shard: [0, 1] }) });
    });
  }
}
