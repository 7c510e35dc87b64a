// The X-ray panel: the hemisphere above a pixel, the rays of each strategy, and the causes of noise.

import type { App, Change } from "./app";
import { $, color, h, latest, percentage, short } from "./dom";
import { Film, FilmView } from "./film";
import { explain } from "./glossary";

const SIZE = 160, DENSITY = 48;
const LAYERS = ["light L", "reflectance f · cos θ", "visibility V", "integrand f · cos θ · L · V"];
const COMPARED = ["brdf:1", "environment:1", "mis:1:1", "product:8", "sir:2/32", "rejection:16"];

interface Report {
  summary: { pixel: [number, number]; coverage: number };
  strategies: {
    name: string; mean: number; variance: number; raysPerSample: number; variancePerRay: number; diagnosis: string;
    causes: [string, number][]; samples: { place: [number, number]; weight: number; visibility: number }[];
  }[];
  advice: string;
}

const percent = (x: number) => `${short(100 * x)} %`;

export class XrayPanel {
  private views: FilmView[] = [];

  constructor(private app: App) {
    app.on((what) => this.changed(what));
    this.fillCompared();
    new PixelPicker(app);
    $("hemispheres").replaceChildren(...LAYERS.map((name) => {
      const canvas = h("canvas", { width: String(SIZE), height: String(SIZE), role: "img", "aria-label": `Hemisphere: ${name}` });
      this.views.push(new FilmView(canvas, false));
      return h("figure", {}, canvas, h("figcaption", {}, name));
    }));
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
    if (this.app.state.panel === "xray" && this.app.probe && what !== "view") this.look();
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
      $("hemispheres").hidden = $("directions").hidden = !maps.length;
      if (maps.length) this.paint(maps);
      const densities: Float32Array[] = [];
      for (const { name } of report.strategies) densities.push((await app.engines.call("directions", settings([name]), DENSITY)) as Float32Array);
      $("densities").replaceChildren(...report.strategies.flatMap((strategy, i) => (densities[i].length ? [this.density(strategy, densities[i])] : [])));
      this.tell(report);
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
      // Visibility and reflectance have fixed ranges; light has its own exposure.
      view.set({ exposure: i === 2 ? 0 : film.exposure() + (i === 3 ? 1 : 0), curve: i === 2 ? "standard" : "agx" });
      view.show(0, film);
    });
  }

  private density(strategy: Report["strategies"][0], density: Float32Array) {
    const canvas = h("canvas", { width: String(SIZE), height: String(SIZE), role: "img", "aria-label": `Directions of ${strategy.name}` });
    const context = canvas.getContext("2d")!;
    const small = h("canvas", { width: String(DENSITY), height: String(DENSITY) }), inner = small.getContext("2d")!;
    const image = inner.createImageData(DENSITY, DENSITY), sorted = density.filter((value) => value > 0).sort();
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
    return h("figure", {}, canvas, h("figcaption", {}, strategy.name));
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
