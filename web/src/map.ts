// The Map panel: the probe in any mapping, and what the picked pixel makes of it.

import type { App, Change } from "./app";
import { $, color, degrees, fill, h, latest, short, stops } from "./dom";
import { Film, FilmView } from "./film";

const MAPPINGS: [string, string][] = [
  ["lat-long", "latitude and longitude"], ["angular", "angular, light probe"], ["mirror-ball", "mirror ball"],
  ["octahedral", "octahedral"], ["cross-horizontal", "cube, lying cross"], ["cross-vertical", "cube, standing cross"], ["strip-horizontal", "cube, strip"],
];
const WIDTH = 768, LAYER = 192;

export class MapPanel {
  private view = new FilmView($<HTMLCanvasElement>("map-film"), !new URLSearchParams(location.search).has("2d"));
  private exposed = "";
  private samples: Float32Array = new Float32Array();
  private layers: Float32Array = new Float32Array();
  private sun: Uint32Array | null = null;
  private sunOf = "";

  constructor(private app: App) {
    fill($("mapping"), MAPPINGS, app.state.mapping);
    app.on((what) => this.changed(what));
    const rotate = (value: number) => {
      const wrapped = ((value + 540) % 360 + 360) % 360 - 180;
      $<HTMLInputElement>("map-rotate").value = $<HTMLInputElement>("rotate").value = String(wrapped);
      $("map-rotate-value").textContent = $("rotate-value").textContent = degrees(wrapped);
      app.set({ rotate: wrapped });
      this.draw();
    };
    $("map-rotate").addEventListener("input", () => rotate(Number($<HTMLInputElement>("map-rotate").value)));
    $("mapping").addEventListener("change", () => app.set({ mapping: $<HTMLSelectElement>("mapping").value }, "panel"));
    $("map-exposure").addEventListener("input", () => {
      const exposure = Number($<HTMLInputElement>("map-exposure").value);
      $("map-exposure-value").textContent = stops(exposure);
      this.view.set({ exposure });
    });
    for (const id of ["layer", "show-samples", "show-sun"]) $(id).addEventListener("change", () => this.mark());
    $("n-samples").addEventListener("input", () => {
      $("n-samples-value").textContent = String(this.nSamples);
      this.ask();
    });
    const viewer = $("map-viewer");
    let last: number | null = null;
    viewer.addEventListener("pointerdown", (event) => {
      viewer.setPointerCapture(event.pointerId);
      last = event.clientX;
    });
    viewer.addEventListener("pointermove", (event) => {
      if (last === null) return;
      const turn = (event.clientX - last) / viewer.clientWidth * 360;
      if (Math.abs(turn) < 0.5) return;
      last = event.clientX;
      rotate(Math.round(app.state.rotate - turn));
    });
    for (const end of ["pointerup", "pointercancel"]) viewer.addEventListener(end, () => { last = null; });
    viewer.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: 5, ArrowRight: -5 }[event.key];
      if (!step) return;
      event.preventDefault();
      rotate(app.state.rotate + step);
    });
  }

  private get nSamples() {
    return 2 ** Number($<HTMLInputElement>("n-samples").value);
  }

  private changed(what: Change) {
    if (this.app.state.panel !== "map" || !this.app.probe) return;
    const { state } = this.app;
    $<HTMLInputElement>("map-rotate").value = String(state.rotate);
    $("map-rotate-value").textContent = degrees(state.rotate);
    $<HTMLSelectElement>("mapping").value = state.mapping;
    if (what !== "view" && what !== "pixel") this.draw();
    this.ask();
  }

  readonly draw = latest(async () => {
    const { app } = this, { state } = app;
    const { width, height, pixels } = await app.engines.call("mapView", state.mapping, state.rotate, WIDTH);
    const film = new Film(width, height);
    film.pixels = pixels;
    this.view.show(0, film);
    $("map-viewer").style.aspectRatio = `${width} / ${height}`;
    const key = `${state.env} ${state.ev} ${state.rows}`;
    if (this.exposed !== key) {
      this.exposed = key;
      const exposure = Math.min(Math.max(film.exposure(), -10), 10);
      $<HTMLInputElement>("map-exposure").value = String(exposure);
      $("map-exposure-value").textContent = stops(exposure);
      this.view.set({ exposure });
    }
    if (this.sunOf !== key) {
      this.sunOf = key;
      try {
        await app.engines.call("lights", JSON.stringify({ method: "median-cut", refine: true, n: null, sun: true, lamps: 0 }));
        this.sun = (await app.engines.call("regions", WIDTH)) as Uint32Array;
      } catch {
        this.sun = null;
      }
    }
    const size = app.probe!.size;
    $("map-caption").textContent = `${app.envName}, ${size[0]} × ${size[1]} texels, turned by ${degrees(state.rotate)}${this.sun ? "; its sun is outlined" : "; no sun stands out"}.`;
    this.mark();
    document.documentElement.dataset.map = key;
  });

  /** Asks what the pixel makes of the light. */
  private readonly ask = latest(async () => {
    const { app } = this, pixel = app.pixel();
    $("map-hint").hidden = !!pixel;
    const body = $("point-table").querySelector("tbody")!;
    if (!pixel) {
      this.samples = this.layers = new Float32Array();
      body.replaceChildren();
      this.mark();
      return;
    }
    try {
      this.layers = (await app.engines.call("importance", pixel, LAYER)) as Float32Array;
      this.samples = (await app.engines.call("samples", pixel, app.state.strategy, this.nSamples, app.state.seed)) as Float32Array;
      const point = JSON.parse(await app.engines.call("point", pixel)) as { shadowed: number; unshadowed: number } | null;
      const rays = this.samples.length / 4;
      let sum = 0, free = 0;
      for (let i = 0; i < this.samples.length; i += 4) {
        sum += this.samples[i + 2] * this.samples[i + 3];
        free += this.samples[i + 3];
      }
      const rows: [string, string][] = point ? [
        ["Radiance, by quadrature", short(point.shadowed)], ["without shadows", short(point.unshadowed)],
        [`${app.state.strategy}, ${this.nSamples} camera samples`, app.state.strategy.startsWith("product") ? "—" : short(sum / this.nSamples)],
        ["shadow rays", String(rays)], ["of these free", rays ? `${Math.round(100 * free / rays)} %` : "—"],
      ] : [["This pixel shows", "the background"]];
      body.replaceChildren(...rows.map(([name, value]) => h("tr", {}, h("th", { scope: "row" }, name), h("td", {}, value))));
    } catch (error) {
      app.tell((error as Error).message, true);
    }
    this.mark();
    document.documentElement.dataset.samples = String(this.samples.length / 4);
  });

  private mark() {
    const canvas = $<HTMLCanvasElement>("map-marks"), context = canvas.getContext("2d")!;
    const isLatLong = this.app.state.mapping === "lat-long";
    canvas.width = WIDTH;
    canvas.height = WIDTH / 2;
    canvas.hidden = !isLatLong;
    if (!isLatLong) return;
    const layer = Number($<HTMLSelectElement>("layer").value);
    if (layer >= 0 && this.layers.length) this.heat(context, layer);
    if (this.sun && $<HTMLInputElement>("show-sun").checked) this.outline(context);
    if ($<HTMLInputElement>("show-samples").checked) this.dots(context);
  }

  /** A density as the opacity of one color, by the square root: tails are seen, too. */
  private heat(context: CanvasRenderingContext2D, layer: number) {
    const n = LAYER * LAYER / 2, values = this.layers.subarray(layer * n, (layer + 1) * n);
    const most = values.reduce((a, b) => Math.max(a, b), 0);
    const image = new ImageData(LAYER, LAYER / 2);
    values.forEach((value, i) => image.data.set([255, 64, 160, most > 0 ? 235 * Math.sqrt(value / most) : 0], 4 * i));
    const small = h("canvas", { width: String(LAYER), height: String(LAYER / 2) });
    small.getContext("2d")!.putImageData(image, 0, 0);
    context.imageSmoothingEnabled = true;
    context.drawImage(small, 0, 0, WIDTH, WIDTH / 2);
  }

  private outline(context: CanvasRenderingContext2D) {
    let x = 0, y = 0, count = 0, far = 0;
    const cells: [number, number][] = [];
    this.sun!.forEach((label, i) => { if (label === 0) cells.push([i % WIDTH, Math.floor(i / WIDTH)]); });
    for (const [cx, cy] of cells) { x += cx; y += cy; count++; }
    if (!count) return;
    [x, y] = [x / count + 0.5, y / count + 0.5];
    for (const [cx, cy] of cells) far = Math.max(far, Math.hypot(cx + 0.5 - x, cy + 0.5 - y));
    const shifted = ((x - this.app.state.rotate / 360 * WIDTH) % WIDTH + WIDTH) % WIDTH;
    for (const [width, style] of [[4, "#000"], [2, "#ffd34d"]] as const) {
      context.lineWidth = width;
      context.strokeStyle = style;
      context.beginPath();
      context.arc(shifted, y, far + 7, 0, 2 * Math.PI);
      context.stroke();
    }
  }

  private dots(context: CanvasRenderingContext2D) {
    let mean = 0;
    for (let i = 2; i < this.samples.length; i += 4) mean += this.samples[i];
    mean /= this.samples.length / 4 || 1;
    const [free, blocked] = [color("free"), color("blocked")];
    for (let i = 0; i < this.samples.length; i += 4) {
      const [u, v, weight, visible] = this.samples.subarray(i, i + 4);
      const radius = Math.min(Math.max(4 * Math.sqrt(Math.abs(weight) / (mean || 1)), 1.5), 16);
      context.beginPath();
      context.arc(u * WIDTH, v * WIDTH / 2, radius, 0, 2 * Math.PI);
      context.lineWidth = 3;
      context.strokeStyle = "#000";
      context.stroke();
      context.lineWidth = 1.5;
      context.strokeStyle = visible > 0 ? "#fff" : blocked;
      context.stroke();
      if (visible > 0) {
        context.globalAlpha = 0.75;
        context.fillStyle = free;
        context.fill();
        context.globalAlpha = 1;
      }
    }
  }
}
