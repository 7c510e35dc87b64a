// The light probe as the lecture's figures draw and read it.

import { h, short } from "../dom";
import { Film } from "../film";
import type { Frame } from "../pointer";
import type { Stage } from "../stage";
import type { Point } from "./curves";

/** The size of a map in a figure. */
export const WIDTH = 640, HEIGHT = 320;
/** Columns of the map that is drawn and read. */
export const COLUMNS = 320;

/** The figure's map, cleared; its units are columns and rows of the whole, from 0 to 1. */
export function canvas(stage: Stage, label: string): CanvasRenderingContext2D {
  let element = stage.drawing.querySelector("canvas");
  if (!element) {
    const frame: Frame = { left: 0, right: WIDTH, top: 0, bottom: HEIGHT, xs: [0, 1], ys: [1, 0] };
    element = h("canvas", { width: String(WIDTH), height: String(HEIGHT), role: "img", "data-frame": JSON.stringify(frame) });
    stage.drawing.replaceChildren(element);
  }
  element.setAttribute("aria-label", label);
  const context = element.getContext("2d")!;
  context.clearRect(0, 0, WIDTH, HEIGHT);
  return context;
}

/** The map that the figures draw and read. */
export class SmallMap {
  private constructor(private rgb: Float32Array, private solidAngles: Float64Array, private total: number) {}

  static async of(stage: Stage): Promise<SmallMap> {
    const rgb = (await stage.app.engines.call("map", COLUMNS)) as Float32Array, rows = COLUMNS / 2;
    const edge = (y: number) => Math.cos(Math.PI * y / rows);
    const solidAngles = Float64Array.from({ length: rows }, (_, y) => (edge(y) - edge(y + 1)) * 2 * Math.PI / COLUMNS);
    const map = new SmallMap(rgb, solidAngles, 1);
    map.total = map.sum(() => true);
    return map;
  }

  private luminance(i: number) {
    return 0.2126 * this.rgb[3 * i] + 0.7152 * this.rgb[3 * i + 1] + 0.0722 * this.rgb[3 * i + 2];
  }

  /** The light in a texel. */
  power(i: number): number {
    return this.luminance(i) * this.solidAngles[Math.floor(i / COLUMNS)];
  }

  /** The light in the texels of a set. */
  private sum(has: (i: number) => boolean): number {
    let sum = 0;
    for (let i = 0; i < COLUMNS * COLUMNS / 2; i++) if (has(i)) sum += this.power(i);
    return sum;
  }

  /** The share of the light in the texels of a set. */
  share(has: (i: number) => boolean): number {
    return this.sum(has) / (this.total || 1);
  }

  /** The texel at a place. */
  texel([u, v]: Point): number {
    const at = (c: number, n: number) => Math.min(Math.floor(c * n), n - 1);
    return at(v, COLUMNS / 2) * COLUMNS + at(u, COLUMNS);
  }

  /** Light and its density at a place, in words. */
  read(place: Point): string {
    const l = this.luminance(this.texel(place));
    return `Under the pointer, L = ${short(l)}, its density is ${short(l / (this.total || 1))} per steradian`;
  }

  /** Draws the map in the background of a figure. */
  paint(context: CanvasRenderingContext2D) {
    const { rgb } = this, rows = COLUMNS / 2, scale = 2 ** Film.fromRgb(COLUMNS, rows, rgb).exposure();
    const small = h("canvas", { width: String(COLUMNS), height: String(rows) }), inner = small.getContext("2d")!;
    const image = inner.createImageData(COLUMNS, rows);
    for (let i = 0; i < COLUMNS * rows; i++) {
      for (let c = 0; c < 3; c++) {
        const x = scale * rgb[3 * i + c];
        image.data[4 * i + c] = 255 * (x / (1 + x)) ** (1 / 2.2) * 1.3;
      }
      image.data[4 * i + 3] = 255;
    }
    inner.putImageData(image, 0, 0);
    context.imageSmoothingEnabled = true;
    context.drawImage(small, 0, 0, WIDTH, HEIGHT);
  }
}

export type Vector = [number, number, number];
export const direction = ([u, v]: Point): Vector => [Math.sin(Math.PI * v) * Math.cos(2 * Math.PI * u), Math.cos(Math.PI * v), Math.sin(Math.PI * v) * Math.sin(2 * Math.PI * u)];
export const cosine = (a: Vector, b: Vector) => a.reduce((sum, c, k) => sum + c * b[k], 0);

/** A dot with a dark rim. */
export function dot(context: CanvasRenderingContext2D, [u, v]: Point, radius: number, style: string) {
  context.beginPath();
  context.arc(WIDTH * u, HEIGHT * v, radius, 0, 2 * Math.PI);
  context.fillStyle = style;
  context.fill();
  context.strokeStyle = "#000";
  context.lineWidth = 1;
  context.stroke();
}
