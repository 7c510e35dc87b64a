// Step 15, from near: the surroundings of the brightest light, divided by several methods.

import { h } from "../dom";
import type { Stage } from "../stage";
import type { Point } from "./curves";
import { circle, type SmallMap } from "./small_map";

/** The part of the map, as a share of its width, and the pixels of its picture. */
const PART = 0.14, SIZE = 192;
/** Columns of the map of regions, and how much darker the light is shown. */
const REGIONS = 1280, DARKER = 1 / 8;

interface Division { name: string; settings: string; lights: { uv: Point; share: number }[] }

export class Detail {
  readonly element = h("div", { class: "quartet" });
  private contexts: CanvasRenderingContext2D[] = [];
  /** The upper left corner. */
  private corner: Point;

  constructor(private stage: Stage, private map: SmallMap) {
    const [u, v] = map.brightest;
    this.corner = [u - PART / 2, Math.min(Math.max(v - PART, 0), 1 - 2 * PART)];
  }

  /** The place on the map at a place of the picture. */
  place({ x, y }: { x: number; y: number }): Point {
    return [((this.corner[0] + PART * x) % 1 + 1) % 1, this.corner[1] + 2 * PART * y];
  }

  /** Draws the divisions; returns how many of their lights are in the part. */
  async draw(divisions: Division[]): Promise<number[]> {
    const { map, stage, element } = this, picture = map.picture(SIZE, SIZE, (x, y) => this.place({ x, y }), DARKER), counts: number[] = [];
    if (!this.contexts.length) this.contexts = divisions.map(({ name }) => {
      const frame = { left: 0, right: SIZE, top: 0, bottom: SIZE, xs: [0, 1], ys: [1, 0] };
      const canvas = h("canvas", { width: String(SIZE), height: String(SIZE), role: "img", "aria-label": `The surroundings of the brightest light, divided by ${name}`, "data-frame": JSON.stringify(frame) });
      element.append(h("figure", {}, canvas, h("figcaption", {}, name)));
      return canvas.getContext("2d")!;
    });
    for (const [i, { settings, lights }] of divisions.entries()) {
      const context = this.contexts[i], regions = (await stage.app.engines.call("regions", settings, REGIONS)) as Uint32Array;
      const label = (x: number, y: number) => {
        const [u, v] = this.place({ x: (x + 0.5) / SIZE, y: (y + 0.5) / SIZE });
        return regions[Math.min(Math.floor(v * REGIONS / 2), REGIONS / 2 - 1) * REGIONS + Math.min(Math.floor(u * REGIONS), REGIONS - 1)];
      };
      context.drawImage(picture, 0, 0);
      context.fillStyle = "rgb(255 255 255 / 0.8)";
      for (let y = 0; y < SIZE; y++) for (let x = 0; x < SIZE; x++) if (label(x, y) !== label(x + 1, y) || label(x, y) !== label(x, y + 1)) context.fillRect(x, y, 1, 1);
      const inside = lights.map(({ uv, share }) => ({ x: ((uv[0] - this.corner[0]) % 1 + 1) % 1 / PART, y: (uv[1] - this.corner[1]) / (2 * PART), share })).filter(({ x, y }) => x < 1 && y >= 0 && y < 1);
      for (const { x, y, share } of inside) circle(context, SIZE * x, SIZE * y, 2 + 8 * Math.sqrt(share), "#ffd34d");
      counts.push(inside.length);
    }
    return counts;
  }
}
