// The Map panel: the probe in any mapping, and how the picked pixel samples it.

import type { App, Change } from "./app";
import { colorBar, mark, placeOf, readByKeys, type Direction } from "./direction";
import { $, degrees, fill, h, latest, short, stops } from "./dom";
import { Film, FilmView, luminance } from "./film";
import type { MapPicture } from "./protocol";
import { MAPPINGS } from "./state";

/** Columns of the map and of the layers over it; powers of two divide evenly into the engine’s cells. */
const WIDTH = 768, LAYER = 256;
/** Layers of the engine's `importance`, in their order. */
const IMPORTANCE = ["light", "reflectance", "visibility", "environment", "brdf", "mis", "target"];
/** The strategies whose rays the counted layers show. */
const COUNTED: Record<string, string> = { product: "product:8", sir: "sir:2/32", rejection: "rejection:16" };
/** What overlays that are no densities are integrals of, and their units. */
const INTEGRALS: Record<string, [string, string]> = { reflectance: ["f · cos θ", ""], visibility: ["V", " sr"] };
/** The duration of the samples' animation [ms]. */
const ARRIVAL = 900;

export class MapPanel {
  private view = new FilmView($<HTMLCanvasElement>("map-film"), !new URLSearchParams(location.search).has("2d"));
  private exposed = "";
  private samples: Float32Array = new Float32Array();
  /** What is known of the pixel: names and values. */
  private found: [string, string][] = [];
  /** The number of samples shown so far. */
  private arrived = 0;
  /** The layers of `importance`, and one layer of counted rays with its settings. */
  private layers: MapPicture | null = null;
  private counted: { of: string; density: MapPicture } | null = null;
  private size = [WIDTH, WIDTH / 2];
  /** A circle around the sun on the unrotated map, and its position on the displayed one. */
  private sun: Float32Array | null = null;
  private outline: Float32Array | null = null;
  private sunOf = "";

  private showMark: (place: [number, number] | null) => void;

  constructor(private app: App, private direction: Direction) {
    this.showMark = mark($("map-viewer"));
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
    for (const id of ["show-samples", "show-sun"]) $(id).addEventListener("change", () => this.mark());
    $("layer").addEventListener("change", () => app.set({ layer: $<HTMLSelectElement>("layer").value }, "view"));
    $("n-samples").addEventListener("input", () => app.set({ samples: Number($<HTMLInputElement>("n-samples").value) }, "pixel"));
    const viewer = $("map-viewer");
    let last: number | null = null;
    viewer.addEventListener("pointerdown", (event) => {
      viewer.setPointerCapture(event.pointerId);
      last = event.clientX;
      this.point(placeOf(event, viewer));
    });
    viewer.addEventListener("pointermove", (event) => {
      if (last === null) return this.point(placeOf(event, viewer));
      const turn = (event.clientX - last) / viewer.clientWidth * 360;
      if (Math.abs(turn) < 0.5) return;
      last = event.clientX;
      rotate(Math.round(app.state.rotate - turn));
    });
    for (const end of ["pointerup", "pointercancel"]) viewer.addEventListener(end, () => { last = null; });
    viewer.addEventListener("keydown", (event) => {
      const step = event.shiftKey && { ArrowLeft: 5, ArrowRight: -5 }[event.key];
      if (!step) return;
      event.preventDefault();
      event.stopImmediatePropagation();
      rotate(app.state.rotate + step);
    });
    readByKeys(viewer, "Light probe. Drag it, or use Shift with the left and right arrow keys, to rotate it.", (place) => this.point(place));
  }

  private get nSamples() {
    return 2 ** this.app.state.samples;
  }

  private changed(what: Change) {
    if (this.app.state.panel !== "map" || !this.app.probe) return;
    const { state } = this.app;
    $<HTMLInputElement>("map-rotate").value = String(state.rotate);
    $("map-rotate-value").textContent = degrees(state.rotate);
    $<HTMLSelectElement>("mapping").value = state.mapping;
    $<HTMLSelectElement>("layer").value = state.layer;
    $<HTMLInputElement>("n-samples").value = String(state.samples);
    $("n-samples-value").textContent = String(this.nSamples);
    if (this.app.waits(what)) return;
    if (what === "view") {
      this.mark();
      this.lay();
      return;
    }
    if (what !== "pixel") this.draw();
    this.ask();
  }

  readonly draw = latest(async () => {
    try {
      await this.show();
    } catch (error) {
      this.app.tell((error as Error).message, true);
    }
  });

  private async show() {
    const { app } = this, { state } = app;
    const { width, height, pixels } = await app.engines.call("mapView", state.mapping, state.rotate, WIDTH);
    const film = new Film(width, height);
    film.pixels = pixels;
    this.view.show(0, film);
    $("map-viewer").style.aspectRatio = `${width} / ${height}`;
    $("map-viewer").classList.toggle("tall", height >= width);
    this.size = [width, height];
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
        const sun = JSON.stringify({ method: "median-cut", refine: true, n: null, sun: true, lamps: 0 });
        this.sun = circle((await app.engines.call("regions", sun, WIDTH)) as Uint32Array);
      } catch {
        this.sun = null;
      }
    }
    this.outline = this.sun && ((await app.engines.call("placesOf", state.mapping, state.rotate, this.sun)) as Float32Array);
    const size = app.probe!.size;
    $("map-caption").textContent = `${app.envName}, ${size[0]} × ${size[1]} texels, rotated by ${degrees(state.rotate)}; ${this.sun ? `${state.env === "sky" ? "the sun" : "the brightest compact light"} is outlined` : "no compact light found"}.`;
    this.mark();
    document.documentElement.dataset.map = key;
    document.documentElement.dataset.ready = "true";
    this.follow();
  }

  /** Points at a direction, whose values are then shown. */
  private point(place: [number, number]) {
    this.direction.point(this.app.state.mapping, place);
    this.showAt(place);
  }

  /** Shows the direction that was pointed at, here or in the X-ray panel. */
  private readonly follow = latest(async () => {
    try {
      this.showAt((await this.direction.places(this.app.state.mapping))?.map ?? null);
    } catch (error) {
      this.app.tell((error as Error).message, true);
    }
  });

  private showAt(place: [number, number] | null) {
    const values = place && this.values(place);
    this.showMark(values ? place : null);
    $("map-readout").textContent = values;
  }

  /** What is known of the direction at a place; null beside the layout's picture. */
  private values([u, v]: [number, number]): string | null {
    const film = this.view.films[0], { layers, counted } = this;
    const at = ({ width, height }: { width: number; height: number }) => Math.floor(v * height) * width + Math.floor(u * width);
    if (!film || !film.pixels[4 * at(film) + 3]) return null;
    if (!layers?.pixels.length) return `In this direction, L = ${short(luminance(film.pixels, 4 * at(film)))}.`;
    const [light, reflectance, visibility, ofLight, ofLobe, ofBoth, product] = IMPORTANCE.map((_, k) => layers.pixels[k * layers.width * layers.height + at(layers)]);
    const strategy = this.countedStrategy, { layer } = this.app.state;
    const ofRays = strategy && counted?.density.pixels.length ? counted.density.pixels[at(counted.density)] : undefined;
    const chosen = ofRays ?? { environment: ofLight, brdf: ofLobe, mis: ofBoth, target: product }[layer];
    const weight = chosen ? ` The weight f · cos θ · L / p of a sample is ${short(reflectance * light / chosen)} there.` : "";
    return `In this direction, L = ${short(light)}, f · cos θ = ${short(reflectance)}, V = ${short(visibility)}; densities: environment ${short(ofLight)}, BRDF ${short(ofLobe)}, half of each ${short(ofBoth)}, product ${short(product)}${ofRays === undefined ? "" : `, ${strategy} ${short(ofRays)}`} per steradian.${weight}`;
  }

  /** Requests the pixel's layers, samples and radiance. */
  private readonly ask = latest(async () => {
    const { app } = this, { state } = app, pixel = app.pixel();
    $("map-hint").hidden = !!pixel;
    if (!pixel) {
      this.samples = new Float32Array();
      this.layers = this.counted = null;
      this.found = [];
      this.tellLayer();
      this.mark();
      return;
    }
    try {
      this.layers = await app.engines.call("importance", pixel, state.mapping, LAYER);
      await this.countRays(pixel);
      this.samples = (await app.engines.call("samples", pixel, state.strategy, state.mapping, this.nSamples, state.seed)) as Float32Array;
      const point = JSON.parse(await app.engines.call("point", pixel)) as { shadowed: number; unshadowed: number } | null;
      this.found = this.rows(point);
    } catch (error) {
      app.tell((error as Error).message, true);
    }
    this.arrive();
    document.documentElement.dataset.samples = String(this.samples.length / 4);
    this.tellLayer();
  });

  /** Overlays another layer on the map; the samples stay. */
  private readonly lay = latest(async () => {
    const { app } = this, pixel = app.pixel();
    try {
      if (pixel) await this.countRays(pixel);
    } catch (error) {
      app.tell((error as Error).message, true);
    }
    this.mark();
    this.tellLayer();
  });

  private tellLayer() {
    const { layer, mapping } = this.app.state, integral = this.layer()?.integral;
    const [what, unit] = INTEGRALS[layer] ?? ["p", ""];
    const found = integral === undefined ? this.found : [...this.found, [`The overlay’s integral, ∫ ${what} dω`, `${Number(integral.toPrecision(3)).toFixed(2)}${unit}`]];
    $("point-table").querySelector("tbody")!.replaceChildren(...found.map(([name, value]) => h("tr", {}, h("th", { scope: "row" }, name), h("td", {}, value))));
    this.follow();
    // Another request may still count the layer's rays.
    if (!layer || this.layer()) document.documentElement.dataset.layer = `${layer} ${mapping}`;
  }

  /** The strategy whose rays the chosen layer counts, if any. */
  private get countedStrategy(): string | undefined {
    const { layer, strategy } = this.app.state;
    return layer === "own" || (COUNTED[layer] && strategy.startsWith(`${layer}:`)) ? strategy : COUNTED[layer];
  }

  private async countRays(pixel: string) {
    const strategy = this.countedStrategy, { engines, state } = this.app;
    const { env, ev, rows, rotate, scene, material, materials } = state;
    const of = JSON.stringify([strategy, pixel, state.mapping, env, ev, rows, rotate, scene, material, materials]);
    if (!strategy || this.counted?.of === of) return;
    this.counted = null;
    this.counted = { of, density: await engines.call("rayDensity", pixel, strategy, state.mapping, LAYER) };
  }

  /** The table's rows for the pixel. */
  private rows(point: { shadowed: number; unshadowed: number } | null): [string, string][] {
    if (!point) return [["This pixel shows", "the background"]];
    const { strategy } = this.app.state, rays = this.samples.length / 4;
    let sum = 0, free = 0;
    for (let i = 0; i < this.samples.length; i += 4) {
      sum += this.samples[i + 2] * this.samples[i + 3];
      free += this.samples[i + 3];
    }
    return [
      ["Radiance, by quadrature", short(point.shadowed)], ["without shadows", short(point.unshadowed)],
      [`${strategy}, ${this.nSamples} camera samples`, strategy.startsWith("product") ? "—" : short(sum / this.nSamples)],
      ["shadow rays", String(rays)], ["unoccluded", rays ? `${Math.round(100 * free / rays)} %` : "—"],
    ];
  }

  /** Shows the samples one after the other, or at once if the user prefers reduced motion. */
  private arrive() {
    const all = this.samples.length / 4, start = performance.now(), of = this.samples;
    const still = matchMedia("(prefers-reduced-motion: reduce)").matches || document.hidden || this.app.state.panel !== "map";
    this.arrived = still ? all : 0;
    this.mark();
    if (still || !all) return;
    const canvas = $<HTMLCanvasElement>("map-marks"), context = canvas.getContext("2d")!;
    canvas.toggleAttribute("data-stale", true);
    const next = (now: number) => {
      if (this.samples !== of) return;
      const until = Math.min(all, Math.ceil(all * Math.max(now - start, 0) / ARRIVAL));
      if ($<HTMLInputElement>("show-samples").checked) this.dots(context, this.arrived, until);
      this.arrived = Math.max(this.arrived, until);
      if (until < all) requestAnimationFrame(next);
      else canvas.removeAttribute("data-stale");
    };
    requestAnimationFrame(next);
  }

  private mark() {
    const canvas = $<HTMLCanvasElement>("map-marks"), context = canvas.getContext("2d")!;
    [canvas.width, canvas.height] = this.size;
    this.heat(context);
    if (this.outline && $<HTMLInputElement>("show-sun").checked) this.circle(context, this.outline);
    if ($<HTMLInputElement>("show-samples").checked) this.dots(context, 0, this.arrived);
  }

  /** The layer overlaid on the map, and its integral over the sphere. */
  private layer(): { values: Float32Array; width: number; height: number; integral: number } | null {
    const { layers, counted } = this, at = IMPORTANCE.indexOf(this.app.state.layer);
    if (this.countedStrategy && counted) return { ...counted.density, values: counted.density.pixels, integral: counted.density.integrals[0] };
    if (at < 0 || !layers?.pixels.length) return null;
    const n = layers.width * layers.height;
    return { ...layers, values: layers.pixels.subarray(at * n, (at + 1) * n), integral: layers.integrals[at] };
  }

  /** A density as the opacity of one color. The square root makes tails visible; full opacity is at the 99th percentile
   *  of the map, because otherwise a sun would make everything else invisible. */
  private heat(context: CanvasRenderingContext2D) {
    const layer = this.layer();
    $("map-bar").hidden = !layer?.values.length;
    if (!layer?.values.length) return;
    const { values, width, height } = layer, sorted = values.filter((value) => value > 0).sort();
    const most = sorted[Math.floor(0.99 * (sorted.length - 1))] ?? 0;
    const { selectedOptions: [chosen] } = $<HTMLSelectElement>("layer"), unit = this.app.state.layer === "visibility" ? "" : " sr⁻¹";
    colorBar($("map-bar"), `The overlay, ${chosen.textContent}`, "linear-gradient(to right, transparent, rgb(255 64 160 / 0.92)), #000", [[0, "0"], [0.5, short(most / 4)], [1, `${short(most)}${unit}${most < 1 || unit ? " or more" : ""}`]]);
    const image = new ImageData(width, height);
    values.forEach((value, i) => image.data.set([255, 64, 160, most > 0 ? 235 * Math.sqrt(Math.min(value / most, 1)) : 0], 4 * i));
    const small = h("canvas", { width: String(width), height: String(height) });
    small.getContext("2d")!.putImageData(image, 0, 0);
    context.imageSmoothingEnabled = true;
    context.drawImage(small, 0, 0, ...(this.size as [number, number]));
  }

  /** Draws a closed line, with gaps at the layout's seams. */
  private circle(context: CanvasRenderingContext2D, places: Float32Array) {
    const [width, height] = this.size;
    for (const [line, style] of [[4, "#000"], [2, "#ffd34d"]] as const) {
      context.lineWidth = line;
      context.strokeStyle = style;
      context.beginPath();
      for (let i = 0; i <= places.length; i += 2) {
        const [u, v] = [places[i % places.length], places[(i + 1) % places.length]];
        const torn = i > 0 && Math.hypot(u - places[i - 2], v - places[i - 1]) > 0.1;
        if (i === 0 || torn) context.moveTo(u * width, v * height);
        else context.lineTo(u * width, v * height);
      }
      context.stroke();
    }
  }

  /** Draws the samples in an index range. */
  private dots(context: CanvasRenderingContext2D, from: number, to: number) {
    let mean = 0;
    for (let i = 2; i < this.samples.length; i += 4) mean += this.samples[i];
    mean /= this.samples.length / 4 || 1;
    const [free, blocked] = ["#1f9d57", "#ff6b5e"], [width, height] = this.size;
    for (let i = 4 * from; i < 4 * to; i += 4) {
      const [u, v, weight, visible] = this.samples.subarray(i, i + 4);
      const radius = Math.min(Math.max(4 * Math.sqrt(Math.abs(weight) / (mean || 1)), 1.5), 16);
      context.beginPath();
      context.arc(u * width, v * height, radius, 0, 2 * Math.PI);
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

/** A circle around the first region of a map of `WIDTH` columns, as positions on the map; null without a region. */
function circle(regions: Uint32Array): Float32Array | null {
  let x = 0, y = 0, far = 0;
  const cells: [number, number][] = [];
  regions.forEach((label, i) => { if (label === 0) cells.push([i % WIDTH + 0.5, Math.floor(i / WIDTH) + 0.5]); });
  if (!cells.length) return null;
  for (const [cx, cy] of cells) { x += cx / cells.length; y += cy / cells.length; }
  for (const [cx, cy] of cells) far = Math.max(far, Math.hypot(cx - x, cy - y));
  const points = Array.from({ length: 64 }, (_, i) => 2 * Math.PI * i / 64);
  return Float32Array.from(points.flatMap((t) => [
    (((x + (far + 7) * Math.cos(t)) / WIDTH) % 1 + 1) % 1, Math.min(Math.max((y + (far + 7) * Math.sin(t)) / (WIDTH / 2), 0.001), 0.999),
  ]));
}
