// One direction, pointed at in any picture of directions, and its places in the others.

import type { App } from "./app";
import { h } from "./dom";

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
