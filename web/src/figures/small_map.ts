// The light probe as the lecture's figures draw and read it.

import { colorBar } from "../direction";
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
  let element = stage.drawing.querySelector<HTMLCanvasElement>("canvas.map");
  if (!element) {
    const frame: Frame = { left: 0, right: WIDTH, top: 0, bottom: HEIGHT, xs: [0, 1], ys: [1, 0] };
    element = h("canvas", { class: "map", width: String(WIDTH), height: String(HEIGHT), role: "img", "data-frame": JSON.stringify(frame) });
  }
  element.setAttribute("aria-label", label);
  const context = element.getContext("2d")!;
  context.clearRect(0, 0, WIDTH, HEIGHT);
  return context;
}

/** The byte of light, scaled to a middle of 1, and the light of a byte's share of white. */
const toByte = (x: number) => 255 * WHITE * (x / (1 + x)) ** (1 / GAMMA);
const fromShare = (share: number) => ((t) => t / (1 - t))((share / WHITE) ** GAMMA);
const GAMMA = 2.2, WHITE = 1.3;

/** The map that the figures draw and read. */
export class SmallMap {
  /** What scales its light to a middle of 1. */
  private scale: number;
  /** The luminances of its grays. */
  readonly bar = h("div");

  private constructor(private rgb: Float32Array, private solidAngles: Float64Array, private total: number) {
    this.scale = 2 ** Film.fromRgb(COLUMNS, COLUMNS / 2, rgb).exposure();
    const value = (share: number) => short(Number((fromShare(share) / this.scale).toPrecision(2)));
    colorBar(this.bar, "Luminance of the map", "linear-gradient(to right, #000, #fff)", [[0, "L = 0"], [0.5, value(0.5)], [1, `${value(1)} or more`]]);
  }

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

  /** The place of the brightest texel. */
  get brightest(): Point {
    let best = 0;
    for (let i = 1; i < COLUMNS * COLUMNS / 2; i++) if (this.luminance(i) > this.luminance(best)) best = i;
    return [(best % COLUMNS + 0.5) / COLUMNS, (Math.floor(best / COLUMNS) + 0.5) / (COLUMNS / 2)];
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
    context.imageSmoothingEnabled = true;
    context.drawImage(this.picture(COLUMNS, COLUMNS / 2, (x, y) => [x, y]), 0, 0, WIDTH, HEIGHT);
  }

  /** A picture of the light at the places of its pixels, clear where there is none. */
  picture(width: number, height: number, place: (x: number, y: number) => Point | null, exposure = 1): HTMLCanvasElement {
    const { rgb } = this, scale = exposure * this.scale, canvas = h("canvas", { width: String(width), height: String(height) }), context = canvas.getContext("2d")!;
    const image = context.createImageData(width, height);
    for (let i = 0; i < width * height; i++) {
      const at = place((i % width + 0.5) / width, (Math.floor(i / width) + 0.5) / height), texel = at && this.texel(at);
      if (texel === null) continue;
      for (let c = 0; c < 3; c++) image.data[4 * i + c] = toByte(scale * rgb[3 * texel + c]);
      image.data[4 * i + 3] = 255;
    }
    context.putImageData(image, 0, 0);
    return canvas;
  }
}

/** The sphere of directions beside the map, as an angular map: straight ahead is in the middle, behind is the rim. */
export class Ball {
  readonly element: HTMLElement;
  private context: CanvasRenderingContext2D;
  private picture: HTMLCanvasElement | null = null;

  constructor() {
    const frame: Frame = { left: 0, right: BALL, top: 0, bottom: BALL, xs: [-1, 1], ys: [-1, 1] };
    const canvas = h("canvas", { width: String(BALL), height: String(BALL), role: "img", "aria-label": "The same light on the sphere of directions, as an angular map", "data-frame": JSON.stringify(frame) });
    this.context = canvas.getContext("2d")!;
    this.element = h("figure", {}, canvas, h("figcaption", {}, "the sphere of directions"));
  }

  /** Draws the light, or only its disc. */
  paint(map: SmallMap | null) {
    const { context } = this;
    context.clearRect(0, 0, BALL, BALL);
    context.fillStyle = "#000";
    context.beginPath();
    context.arc(BALL / 2, BALL / 2, BALL / 2, 0, 2 * Math.PI);
    context.fill();
    if (map) context.drawImage((this.picture ??= map.picture(BALL, BALL, (x, y) => fromBall([2 * x - 1, 1 - 2 * y]))), 0, 0);
  }

  dot(place: Point, radius: number, style: string) {
    const [x, y] = onBall(place);
    circle(this.context, BALL * (0.5 + 0.5 * x), BALL * (0.5 - 0.5 * y), radius, style);
  }
}
/** Pixels along an edge of the sphere. */
const BALL = 320;

/** The direction at a place of an angular map in [-1, 1]²; null outside. */
export function ofAngular([x, y]: Point): Vector | null {
  const r = Math.hypot(x, y), theta = Math.PI * r, s = r > 0 ? Math.sin(theta) / r : 0;
  return r < 1 ? [s * x, s * y, -Math.cos(theta)] : null;
}

/** The place of a direction on an angular map. */
export function onAngular([x, y, z]: Vector): Point {
  const across = Math.hypot(x, y) || 1, r = Math.acos(Math.min(Math.max(-z, -1), 1)) / Math.PI;
  return [r * x / across, r * y / across];
}

/** The place of the map that is at a place of the sphere in [-1, 1]²; null outside. */
export function fromBall(place: Point): Point | null {
  const wi = ofAngular(place);
  return wi && placeOf(wi);
}

/** The place on the sphere of a place on the map. */
export const onBall = (place: Point): Point => onAngular(direction(place));

/** The place of a direction. */
export const placeOf = ([x, y, z]: Vector): Point => [(Math.atan2(-x, z) / (2 * Math.PI) + 1) % 1, Math.acos(Math.min(Math.max(y, -1), 1)) / Math.PI];

export type Vector = [number, number, number];
export const direction = ([u, v]: Point): Vector => [-Math.sin(Math.PI * v) * Math.sin(2 * Math.PI * u), Math.cos(Math.PI * v), Math.sin(Math.PI * v) * Math.cos(2 * Math.PI * u)];
export const cosine = (a: Vector, b: Vector) => a.reduce((sum, c, k) => sum + c * b[k], 0);

/** A dot on the map with a dark rim. */
export const dot = (context: CanvasRenderingContext2D, [u, v]: Point, radius: number, style: string) => circle(context, WIDTH * u, HEIGHT * v, radius, style);

export function circle(context: CanvasRenderingContext2D, x: number, y: number, radius: number, style: string) {
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  context.fillStyle = style;
  context.fill();
  context.strokeStyle = "#000";
  context.lineWidth = 1;
  context.stroke();
}
