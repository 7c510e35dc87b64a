// One direction, pointed at in any picture of directions, and its places in the others.

import type { App } from "./app";
import { h, short } from "./dom";
import { isArrow, moved } from "./pointer";
import { develop, type Curve } from "./tone";

/** Places on the map, and on the hemisphere above the picked pixel unless it is below the horizon. */
export interface Places {
  map: [number, number];
  hemisphere: [number, number] | null;
}

/** A direction in the world, which the panels share. */
export class Direction {
  private pointed: { from: string; at: [number, number]; pixel: string | null } | null = null;

  constructor(private app: App) {}

  /** Points at u, v on a map, or, `from` the hemisphere, at x to the right and y up in [-1, 1]. */
  point(from: string, at: [number, number]) {
    this.pointed = { from, at, pixel: this.app.pixel() };
  }

  /** The direction's places on the map in a layout and on the hemisphere; null if nothing was pointed at. */
  async places(mapping: string): Promise<Places | null> {
    const { app, pointed } = this, pixel = app.pixel();
    // A place on a hemisphere is a direction only above its own pixel.
    if (!pointed || (pointed.from === "hemisphere" && pointed.pixel !== pixel)) return null;
    const of = pixel ? JSON.stringify({ ...JSON.parse(pixel), seed: 0, strategies: [] }) : "";
    const [u, v, x, y] = (await app.engines.call("directionAt", of, pointed.from, ...pointed.at, mapping)) as Float32Array;
    return u === undefined ? null : { map: [u, v], hemisphere: isNaN(x) ? null : [x, y] };
  }
}

/** A mark over a picture: shown at a place of it, from the upper left corner in parts of its size, or hidden. */
export function mark(picture: HTMLElement): (place: [number, number] | null) => void {
  const cross = h("span", { class: "mark", hidden: "" });
  picture.append(cross);
  return (place) => {
    cross.hidden = !place;
    if (place) Object.assign(cross.style, { left: `${100 * place[0]}%`, top: `${100 * place[1]}%` });
  };
}

/** Where the pointer is in a picture, in parts of its size. */
export function placeOf(event: PointerEvent, picture: HTMLElement): [number, number] {
  const box = picture.getBoundingClientRect(), within = (x: number) => Math.min(Math.max(x, 0), 0.999999);
  return [within((event.clientX - box.left) / box.width), within((event.clientY - box.top) / box.height)];
}

/** Reads a picture with a mark by keys: arrows move the mark from where it is shown, in small steps with Shift. */
export function readByKeys(picture: HTMLElement, label: string, point: (place: [number, number]) => void) {
  for (const [name, value] of Object.entries({ tabindex: "0", role: "application", "aria-label": label, "aria-describedby": "keys-of-pictures" })) picture.setAttribute(name, value);
  // The mark follows later, but keys may be fast.
  let at: [number, number] | null = null;
  for (const kind of ["focus", "pointermove"]) picture.addEventListener(kind, () => { at = null; });
  picture.addEventListener("keydown", (event) => {
    if (!isArrow(event.key) || event.ctrlKey || event.altKey || event.metaKey) return;
    event.preventDefault();
    const { hidden, style } = picture.querySelector<HTMLElement>(".mark")!, [u, v] = at ?? (hidden ? [0.5, 0.5] : [parseFloat(style.left) / 100, parseFloat(style.top) / 100]);
    const [x, y] = moved([u, 1 - v], event), most = 0.999999;
    point((at = [Math.min(x, most), Math.min(1 - y, most)]));
  });
}

/** A scale of colors with its values. */
export function colorBar(place: HTMLElement, label: string, gradient: string, values: [at: number, text: string][]) {
  const ramp = h("div", { class: "ramp" });
  ramp.style.background = gradient;
  place.className = "colorbar";
  place.setAttribute("role", "img");
  place.setAttribute("aria-label", `${label}: ${values.map(([, text]) => text).join(", ")}`);
  place.replaceChildren(ramp, h("div", { class: "values" }, ...values.map(([at, text]) => {
    const value = h("span", {}, text);
    value.style.left = `${100 * at}%`;
    // The outer values stay within the bar.
    value.style.translate = `${-100 * at}%`;
    return value;
  })));
}

/** The luminances of a picture under an exposure and a curve, `STOPS` below middle gray to as many above. */
export function toneBar(place: HTMLElement, label: string, { exposure, curve }: { exposure: number; curve: Curve }) {
  const byte = new Uint8ClampedArray(4), grays = Array.from({ length: 17 }, (_, i) => {
    const gray = MIDDLE * 2 ** (STOPS * (i / 8 - 1));
    develop(gray, gray, gray, curve, byte, 0);
    return `rgb(${byte[0]} ${byte[0]} ${byte[0]})`;
  });
  const value = (stops: number) => short(Number((MIDDLE * 2 ** (stops - exposure)).toPrecision(2)));
  colorBar(place, label, `linear-gradient(to right, ${grays.join(", ")})`, [[0, value(-STOPS)], [0.5, value(0)], [1, value(STOPS)]]);
}
const MIDDLE = 0.18, STOPS = 5;
