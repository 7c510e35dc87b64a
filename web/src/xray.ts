// The X-ray panel: the hemisphere above a pixel, the rays of each strategy, and the causes of noise.

import type { App, Change } from "./app";
import { colorBar, mark, placeOf, readByKeys, toneBar, type Direction } from "./direction";
import { $, color, h, latest, percentage, short } from "./dom";
import { Film, FilmView, luminance } from "./film";
import { explain } from "./glossary";

const SIZE = 160, DENSITY = 48;
const LAYERS = ["light L", "reflectance f · cos θ", "visibility V", "integrand f · cos θ · L · V"];
const COMPARED = ["brdf:1", "environment:1", "mis:1:1", "product:8", "sir:2/32", "rejection:16"];

interface Report {
  summary: { pixel: [number, number]; coverage: number };
  strategies: {
    name: string; mean: number; variance: number; raysPerSample: number; variancePerRay: number; diagnosis: string;
    causes: [string, number][]; samples: { place: [number, number]; weight: number; visibility: number }[]; density: number[];
  }[];
  advice: string;
}

const percent = (x: number) => `${short(100 * x)} %`;

export class XrayPanel {
  private views: FilmView[] = [];
  private bars = LAYERS.map(() => h("div"));
  private map = new FilmView($<HTMLCanvasElement>("xray-map-film"), false);
  private marks: ((place: [number, number] | null) => void)[];
  private markMap: (place: [number, number] | null) => void;
  /** The maps of the hemisphere, and the rays of each strategy with its mark. */
  private maps: Float32Array = new Float32Array();
  private rays: { name: string; density: number[]; mark: (place: [number, number] | null) => void }[] = [];

  constructor(private app: App, private direction: Direction) {
    app.on((what) => this.changed(what));
    this.fillCompared();
    new PixelPicker(app);
    const hemispheres = LAYERS.map((name) => {
      const canvas = h("canvas", { width: String(SIZE), height: String(SIZE), role: "img", "aria-label": `Hemisphere: ${name}` });
      this.views.push(new FilmView(canvas, false));
      return { marked: this.touchable(canvas), name };
    });
    this.marks = hemispheres.map(({ marked }) => mark(marked));
    $("hemispheres").replaceChildren(...hemispheres.map(({ marked, name }, i) => h("figure", {}, marked, this.bars[i], h("figcaption", {}, name))));
    const map = $("xray-map").querySelector<HTMLElement>(".marked")!;
    this.markMap = mark(map);
    readByKeys(map, "The map", (place) => this.point("lat-long", place));
    for (const event of ["pointerdown", "pointermove"] as const) map.addEventListener(event, (event) => this.point("lat-long", placeOf(event, map)));
  }

  /** A picture of the hemisphere that is pointed at. */
  private touchable(canvas: HTMLCanvasElement): HTMLElement {
    const marked = h("div", { class: "marked" }, canvas), above = ([u, v]: [number, number]) => this.point("hemisphere", [2 * u - 1, 1 - 2 * v]);
    for (const event of ["pointerdown", "pointermove"] as const) marked.addEventListener(event, (event) => {
      above(placeOf(event, marked));
    });
    readByKeys(marked, canvas.getAttribute("aria-label")!, above);
    return marked;
  }

  private point(from: string, at: [number, number]) {
    if (from === "hemisphere" && Math.hypot(...at) >= 1) return;
    this.direction.point(from, at);
    this.follow();
  }

  /** Marks the direction that was pointed at, here or in the Map panel, in all pictures, and reads their values. */
  private readonly follow = latest(async () => {
    try {
      const places = await this.direction.places("lat-long"), above = places?.hemisphere;
      const place: [number, number] | null = above ? [0.5 + 0.5 * above[0], 0.5 - 0.5 * above[1]] : null;
      for (const show of [...this.marks, ...this.rays.map(({ mark }) => mark)]) show(place);
      this.markMap(places?.map ?? null);
      $("xray-readout").textContent = place ? this.values(place) : places ? "This direction is below the surface." : "";
    } catch (error) {
      this.app.tell((error as Error).message, true);
    }
  });

  private values([u, v]: [number, number]): string {
    const at = (n: number) => Math.min(Math.floor(v * n), n - 1) * n + Math.min(Math.floor(u * n), n - 1);
    const of = (layer: number) => this.maps.subarray(3 * (layer * SIZE * SIZE + at(SIZE))).slice(0, 3);
    const [light, reflectance, visibility, product] = LAYERS.map((_, layer) => of(layer)), unoccluded = luminance(light.map((l, i) => l * reflectance[i]), 0);
    const rays = this.rays.map(({ name, density }) => {
      const p = density[at(DENSITY)];
      return `${name} ${short(p)}${p > 0 ? `, weight ${short(unoccluded / p)}` : ""}`;
    });
    return `In this direction, L = ${short(luminance(light, 0))}, f · cos θ = ${short(luminance(reflectance, 0))}, V = ${short(visibility[0])}, their product ${short(luminance(product, 0))}. Counted rays per steradian, and the weights f · cos θ · L / p: ${rays.join("; ")}.`;
  }

  /** The strategies compared with the picture's. */
  private get compared(): string[] {
    return this.app.state.compared.split(" ").filter(Boolean);
  }

  private fillCompared() {
    const { app, compared } = this;
    $("compared").replaceChildren(...[...new Set([...COMPARED, ...compared])].map((name) => {
      const input = h("input", { type: "checkbox" });
      input.checked = compared.includes(name);
      input.addEventListener("change", () => {
        const others = this.compared.filter((other) => other !== name);
        app.set({ compared: [...others, ...(input.checked ? [name] : [])].join(" ") }, "pixel");
      });
      return h("label", { class: "check" }, input, name);
    }));
  }

  private changed(what: Change) {
    if (what === "all") this.fillCompared();
    if (this.app.state.panel === "xray" && this.app.probe && what !== "view" && !this.app.waits(what)) this.look();
  }

  private readonly look = latest(async () => {
    const { app } = this, pixel = app.pixel();
    $("xray-hint").hidden = !!pixel;
    $("xray-found").hidden = !pixel;
    if (!pixel) return;
    $("xray-found").setAttribute("aria-busy", "true");
    const own = app.state.strategy;
    const strategies = [own, ...this.compared.filter((name) => name !== own)];
    const settings = (names: string[]) => JSON.stringify({ ...JSON.parse(pixel), seed: app.state.seed, strategies: names });
    try {
      const maps = (await app.engines.call("hemisphere", settings([]), SIZE)) as Float32Array;
      const report = JSON.parse(await app.engines.call("inspect", settings(strategies))) as Report;
      const { pixel: [x, y], coverage } = report.summary;
      $("xray-summary").textContent = `Pixel ${x}, ${y} of ${app.state.size} × ${app.state.size}: ${percent(coverage)} of its camera samples show the scene.`;
      $("xray-advice").textContent = sentence(report.advice);
      $("hemispheres").hidden = $("directions").hidden = $("xray-map").hidden = !maps.length;
      this.maps = maps;
      if (maps.length) this.paint(maps);
      await this.paintMap();
      this.rays = [];
      $("densities").replaceChildren(...report.strategies.filter(({ density }) => density.length).map((strategy) => this.density(strategy)));
      this.tell(report);
      this.follow();
    } catch (error) {
      app.tell((error as Error).message, true);
    }
    $("xray-found").setAttribute("aria-busy", "false");
    document.documentElement.dataset.xray = pixel;
  });

  private paint(maps: Float32Array) {
    const n = 3 * SIZE * SIZE;
    this.views.forEach((view, i) => {
      const film = Film.fromRgb(SIZE, SIZE, maps.subarray(i * n, (i + 1) * n));
      // Visibility has a fixed range; the others have their own exposure.
      const isVisibility = i === 2, tone = { exposure: isVisibility ? 0 : film.exposure() + (i === 3 ? 1 : 0), curve: isVisibility ? "standard" as const : "agx" as const };
      view.set(tone);
      view.show(0, film);
      if (isVisibility) colorBar(this.bars[i], LAYERS[i], "linear-gradient(to right, #000, #fff)", [[0, "0"], [1, "1"]]);
      else toneBar(this.bars[i], `Luminance of ${LAYERS[i]}`, tone);
    });
  }

  private async paintMap() {
    const { width, height, pixels } = await this.app.engines.call("mapView", "lat-long", this.app.state.rotate, $<HTMLCanvasElement>("xray-map-film").width);
    const film = new Film(width, height);
    film.pixels = pixels;
    this.map.set({ exposure: film.exposure(), curve: "agx" });
    this.map.show(0, film);
  }

  private density(strategy: Report["strategies"][0]) {
    const { density } = strategy;
    const canvas = h("canvas", { width: String(SIZE), height: String(SIZE), role: "img", "aria-label": `Directions of ${strategy.name}` });
    const context = canvas.getContext("2d")!;
    const small = h("canvas", { width: String(DENSITY), height: String(DENSITY) }), inner = small.getContext("2d")!;
    const image = inner.createImageData(DENSITY, DENSITY), sorted = Float32Array.from(density).filter((value) => value > 0).sort();
    // Full opacity is at the 99th percentile, because otherwise a sun would make everything else invisible.
    const most = sorted[Math.floor(0.99 * (sorted.length - 1))] ?? 1;
    density.forEach((value, i) => image.data.set([255, 96, 176, 255 * Math.sqrt(Math.min(value / most, 1))], 4 * i));
    inner.putImageData(image, 0, 0);
    context.drawImage(small, 0, 0, SIZE, SIZE);
    const mean = strategy.samples.reduce((sum, s) => sum + Math.abs(s.weight), 0) / (strategy.samples.length || 1) || 1;
    for (const { place: [x, y], weight, visibility } of strategy.samples.slice(0, 96)) {
      context.beginPath();
      context.arc((x + 1) / 2 * SIZE, (1 - y) / 2 * SIZE, Math.min(Math.max(2 * Math.sqrt(Math.abs(weight) / mean), 1), 9), 0, 2 * Math.PI);
      context.lineWidth = 1.25;
      context.strokeStyle = visibility > 0 ? "#fff" : "#ff8a80";
      context.stroke();
      if (visibility > 0) {
        context.fillStyle = color("free");
        context.fill();
      }
    }
    const marked = this.touchable(canvas), bar = h("div");
    this.rays.push({ name: strategy.name, density, mark: mark(marked) });
    colorBar(bar, `Rays of ${strategy.name}`, "linear-gradient(to right, transparent, rgb(255 96 176)), #000", [[0, "0"], [1, `${short(most)} sr⁻¹ or more`]]);
    return h("figure", {}, marked, bar, h("figcaption", {}, strategy.name));
  }

  private tell(report: Report) {
    $("xray-table").querySelector("tbody")!.replaceChildren(...report.strategies.map((s) =>
      h("tr", {}, h("th", { scope: "row" }, s.name), h("td", {}, short(s.variance)), h("td", {}, short(s.raysPerSample)), h("td", {}, short(s.variancePerRay)))));
    $("causes").replaceChildren(...report.strategies.flatMap((s) => [
      h("h3", {}, s.name), h("p", { class: "sentence" }, sentence(s.diagnosis)),
      ...shown(s.causes).map(([name, share]) => {
        const bar = h("div", { class: "bar" });
        bar.style.width = `${Math.max(0, Math.min(100, 100 * share))}%`;
        return h("div", { class: "cause" }, h("span", {}, name), h("div", {}, bar), h("span", {}, percentage(share)));
      }),
    ]));
    explain($("xray-advice"));
    explain($("causes"));
    explain($("xray-table").querySelector("tbody")!);
  }
}

/** The largest causes, and the remaining ones together. */
function shown(causes: [string, number][]): [string, number][] {
  const [largest, others] = [causes.slice(0, 4), causes.slice(4)];
  const rest = others.reduce((sum, [, share]) => sum + share, 0);
  return Math.abs(rest) < 5e-4 ? largest : [...largest, ["others", rest]];
}

/** Adds a period, and a capital unless the text begins with a strategy's name. */
const sentence = (text: string) => {
  const begin = /^[a-z-]+:/.test(text) ? text.slice(0, 1) : text.slice(0, 1).toUpperCase();
  return text && begin + text.slice(1).replace(/\.?$/, ".");
};

/** The picture with a crosshair, to pick a pixel by pointer or keys. */
class PixelPicker {
  /** The pixel under the cross. */
  private at: [number, number] | null = null;
  private timer = 0;

  constructor(private app: App) {
    const viewer = $("xray-viewer");
    app.on((what) => {
      if (what === "pixel" || what === "all" || what === "scene") this.at = null;
      if (app.state.panel === "xray") this.show();
    });
    viewer.addEventListener("keydown", (event) => {
      const { size } = app.state, step = event.shiftKey ? 1 : Math.max(1, Math.round(size / 64));
      const move = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, -step], ArrowDown: [0, step] }[event.key];
      if (!move && event.key !== "Enter" && event.key !== " ") return;
      event.preventDefault();
      const [x, y] = this.cross();
      if (move) this.move(x + move[0], y + move[1]);
      else app.set({ pixel: [x, y] }, "pixel");
    });
    viewer.addEventListener("click", (event) => {
      const box = viewer.getBoundingClientRect(), { size } = app.state;
      this.move(Math.floor((event.clientX - box.left) / box.width * size), Math.floor((event.clientY - box.top) / box.height * size));
      app.set({ pixel: this.cross() }, "pixel");
    });
    $("film").addEventListener("painted", () => {
      if (app.state.panel === "xray") this.timer ||= setTimeout(() => this.show(), 300) as unknown as number;
    });
    viewer.addEventListener("focus", () => this.mark());
    viewer.addEventListener("blur", () => this.mark());
  }

  private cross(): [number, number] {
    const { pixel, size } = this.app.state;
    return this.at ?? (pixel as [number, number] | null) ?? [size >> 1, size >> 1];
  }

  private move(x: number, y: number) {
    const inside = (c: number) => Math.min(Math.max(c, 0), this.app.state.size - 1);
    this.at = [inside(x), inside(y)];
    this.mark();
  }

  /** Copies the picture. */
  private show() {
    clearTimeout(this.timer);
    this.timer = 0;
    const film = $<HTMLCanvasElement>("film"), context = $<HTMLCanvasElement>("xray-film").getContext("2d")!;
    const { width, height } = context.canvas;
    context.drawImage(film, 0, 0, width, height);
    this.mark();
  }

  private mark() {
    const canvas = $<HTMLCanvasElement>("xray-marks"), context = canvas.getContext("2d")!, { size, pixel } = this.app.state;
    const { width, height } = canvas, place = (c: number, n: number) => (c + 0.5) / size * n;
    context.clearRect(0, 0, width, height);
    const isAiming = document.activeElement === $("xray-viewer");
    const draw = (path: () => void) => {
      for (const [line, style] of [[4, "#000"], [1.75, "#fff"]] as const) {
        context.lineWidth = line;
        context.strokeStyle = style;
        context.beginPath();
        path();
        context.stroke();
      }
    };
    if (pixel) draw(() => context.arc(place(pixel[0], width), place(pixel[1], height), 9, 0, 2 * Math.PI));
    const [x, y] = this.cross();
    if (isAiming) {
      draw(() => {
        for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
          context.moveTo(place(x, width) + 5 * dx, place(y, height) + 5 * dy);
          context.lineTo(place(x, width) + 16 * dx, place(y, height) + 16 * dy);
        }
      });
    }
    $("xray-place").textContent = isAiming || pixel ? `Column ${x}, row ${y}` : "";
  }
}
