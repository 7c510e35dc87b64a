// The Lights panel: a probe as a rig, with its regions, its shading and its files.

import type { App, Change } from "./app";
import { mark, placeOf, readByKeys } from "./direction";
import { $, degrees, h, latest, percentage, save, short, words } from "./dom";
import { Film, FilmView, luminance } from "./film";
import { lightWords, quoted } from "./state";

const WIDTH = 768, SPHERE = 160;

/** The slider's light counts: one by one up to 16, then four per doubling, up to 1024. */
const COUNTS = [
  ...Array.from({ length: 16 }, (_, i) => i + 1),
  ...[16, 32, 64, 128, 256, 512].flatMap((n) => [1.25, 1.5, 1.75, 2].map((k) => k * n)),
];
/** The duration of a step in playback [ms]. */
const STEP = 700;

/** How the methods divide a region. */
const RULES: Record<string, string> = {
  "median-cut": "across its longer side, into parts of equal energy",
  "variance-minimization:2009": "where the larger of both parts’ variances on the map is smallest",
  "variance-minimization": "where the sum of both parts’ variances is smallest",
};

/** The programs that read the formats. */
const READERS: Record<string, string> = {
  json: "domelight", csv: "spreadsheets", gltf: "glTF", glb: "glTF", usd: "OpenUSD", blender: "Blender", mitsuba: "Mitsuba", pbrt: "pbrt",
  three: "three.js", radiance: "Radiance", sibl: "sIBL", godot: "Godot", unreal: "Unreal", unity: "Unity", bevy: "Bevy", babylon: "Babylon.js",
};

interface Rig {
  lights: { name: string; uv: [number, number]; irradiance: number[]; share: number; radius: number; kind: string }[];
  diffuse: number;
  glossy: number;
  residual: boolean;
  formats: { name: string; extension: string; dome: string | null }[];
}

/** The slider position of the nearest light count. */
const place = (lights: number) => COUNTS.reduce((best, n, i) => (Math.abs(n - lights) < Math.abs(COUNTS[best] - lights) ? i : best), 0);

/** The regions of the first division that overlap more than one region of the second. */
function splits(before: Uint32Array, after: Uint32Array): Set<number> {
  const part = new Map<number, number>(), divided = new Set<number>();
  for (let i = 0; i < before.length; i++) {
    const known = part.get(before[i]);
    if (known === undefined) part.set(before[i], after[i]);
    else if (known !== after[i]) divided.add(before[i]);
  }
  return divided;
}

/** Whether each light count has its own regions, instead of dividing one region of the previous count. */
const isRefined = (method: string, refine: boolean) => refine && method === "variance-minimization";

/** An error in percent; smaller errors are not meaningful. */
const percent = (x: number) => (x < 1e-5 ? "< 0.001 %" : `${short(100 * x)} %`);

export class LightsPanel {
  private map = new FilmView($<HTMLCanvasElement>("rig-film"), false);
  private truth = new FilmView($<HTMLCanvasElement>("sphere-truth"), false);
  private approximate = new FilmView($<HTMLCanvasElement>("sphere-rig"), false);
  private rig: Rig | null = null;
  /** The regions of the last step, and their settings. */
  private before: { regions: Uint32Array; lights: number; of: string } | null = null;
  private timer = 0;

  private showMark: (place: [number, number] | null) => void;
  private pointed: [number, number] | null = null;

  constructor(private app: App) {
    const viewer = $("rig-film").parentElement!;
    this.showMark = mark(viewer);
    for (const event of ["pointerdown", "pointermove"] as const) viewer.addEventListener(event, (event) => {
      this.pointed = placeOf(event, viewer);
      this.read();
    });
    readByKeys(viewer, "The light probe divided into regions", (place) => {
      this.pointed = place;
      this.read();
    });
    app.on((what) => this.changed(what));
    $("method").addEventListener("change", () => app.set({ method: $<HTMLSelectElement>("method").value }, "panel"));
    const slider = $<HTMLInputElement>("n-lights");
    slider.max = String(COUNTS.length - 1);
    slider.addEventListener("input", () => {
      this.play(false);
      app.set({ lights: COUNTS[Number(slider.value)] }, "panel");
    });
    for (const [id, by] of [["fewer-lights", -1], ["more-lights", 1]] as const) {
      $(id).addEventListener("click", () => {
        this.play(false);
        this.step(by);
      });
    }
    $("play-lights").addEventListener("click", () => this.play(!this.timer));
    $("refine").addEventListener("change", () => app.set({ refine: $<HTMLInputElement>("refine").checked }, "panel"));
    $("sun").addEventListener("change", () => {
      const sun = $<HTMLInputElement>("sun").checked;
      app.set({ sun, leave: app.state.leave && (sun || app.state.lamps > 0) }, "panel");
    });
    $("lamps").addEventListener("change", () => {
      const lamps = Math.min(Math.max(Math.round(Number($<HTMLInputElement>("lamps").value)) || 0, 0), 64);
      app.set({ lamps, leave: app.state.leave && (app.state.sun || lamps > 0) }, "panel");
    });
    $("leave").addEventListener("change", () => {
      const leave = $<HTMLInputElement>("leave").checked;
      app.set({ leave, sun: app.state.sun || (leave && !app.state.lamps) }, "panel");
    });
    $("gloss").addEventListener("change", () => app.set({ gloss: Number($<HTMLSelectElement>("gloss").value) }, "panel"));
  }

  /** Goes to the next or previous light count; returns whether it exists. */
  private step(by: number): boolean {
    const at = place(this.app.state.lights) + by;
    if (at < 0 || at >= COUNTS.length) return false;
    this.app.set({ lights: COUNTS[at] }, "panel");
    return true;
  }

  /** Plays the steps from here (from the start if this is the last), or stops. */
  private play(on: boolean) {
    const { state } = this.app;
    clearTimeout(this.timer);
    this.timer = 0;
    $("play-lights").textContent = on ? "Pause" : "Play";
    $("play-lights").setAttribute("aria-pressed", String(on));
    if (!on) return;
    if (place(state.lights) === COUNTS.length - 1) this.app.set({ lights: 1 }, "panel");
    const next = () => {
      // Show each step before the next one.
      if (this.drawn !== state.lights) this.timer = setTimeout(next, 50) as unknown as number;
      else if (state.panel !== "lights" || !this.step(1)) this.play(false);
      else this.timer = setTimeout(next, STEP) as unknown as number;
    };
    this.timer = setTimeout(next, STEP) as unknown as number;
  }

  /** The displayed number of lights. */
  private drawn = 0;

  private changed(what: Change) {
    const { state, probe } = this.app;
    if (state.panel !== "lights" && this.timer) this.play(false);
    if (state.panel !== "lights" || !probe || what === "pixel" || what === "view") return;
    $<HTMLSelectElement>("method").value = state.method;
    $<HTMLInputElement>("sun").checked = state.sun;
    $<HTMLInputElement>("leave").checked = state.leave;
    $<HTMLInputElement>("lamps").value = String(state.lamps);
    const gloss = $<HTMLSelectElement>("gloss"), exponent = String(state.gloss);
    if (![...gloss.options].some(({ value }) => value === exponent)) gloss.append(new Option(`glossy, cosⁿ with n = ${exponent}`, exponent));
    gloss.value = exponent;
    $<HTMLInputElement>("refine").checked = state.refine;
    $<HTMLInputElement>("refine").disabled = state.method !== "variance-minimization";
    $<HTMLInputElement>("n-lights").value = String(place(state.lights));
    if (!this.app.waits(what)) this.draw();
  }

  private readonly draw = latest(async () => {
    const { app } = this, { state } = app;
    $("n-lights-value").textContent = String(state.lights);
    const { leave } = state;
    for (const id of ["n-lights", "fewer-lights", "more-lights", "play-lights"]) $<HTMLInputElement>(id).disabled = leave;
    if (leave) this.play(false);
    const settings = JSON.stringify({ method: state.method, refine: state.refine, n: leave ? null : state.lights, sun: state.sun, lamps: state.lamps });
    let rig: Rig, regions: Uint32Array, spheres: Float32Array;
    try {
      const view = await app.engines.call("mapView", "lat-long", 0, WIDTH), film = new Film(view.width, view.height);
      film.pixels = view.pixels;
      this.map.set({ exposure: film.exposure() });
      this.map.show(0, film);
      rig = JSON.parse(await app.engines.call("lights", settings));
      regions = (await app.engines.call("regions", settings, WIDTH)) as Uint32Array;
      spheres = (await app.engines.call("spheres", settings, SPHERE, state.gloss)) as Float32Array;
    } catch (error) {
      this.clear((error as Error).message);
      return;
    }
    this.rig = rig;
    const of = JSON.stringify([state.method, state.refine, leave, state.sun, state.lamps, state.env, state.rows, state.rotate]);
    const divided = leave || isRefined(state.method, state.refine) || this.before?.of !== of || this.before.lights >= rig.lights.length ? new Set<number>() : splits(this.before.regions, regions);
    this.mark(regions, leave, divided);
    this.tellStep(divided, rig.lights.length);
    this.before = { regions, lights: rig.lights.length, of };
    this.drawn = state.lights;
    this.read();
    const n = 3 * SPHERE * SPHERE;
    const [truth, approximate] = [0, 1].map((i) => Film.fromRgb(SPHERE, SPHERE, spheres.subarray(i * n, (i + 1) * n)));
    const exposure = truth.exposure();
    for (const [sphere, picture] of [[this.truth, truth], [this.approximate, approximate]] as const) {
      sphere.set({ exposure, curve: "standard" });
      sphere.show(0, picture);
    }
    const lights = rig.lights.length;
    $("rig-caption").textContent = `${lights} light${lights === 1 ? "" : "s"} of ${app.envName}${rig.residual ? `; the rest of the light stays on the map` : ""}${state.rotate ? `. The map is drawn unrotated; files have the rotation of ${degrees(state.rotate)}, except for sIBL, which cannot state it` : ""}. Shading error: matte ${percent(rig.diffuse)}, glossy ${percent(rig.glossy)}.`;
    $("rig-table").querySelector("tbody")!.replaceChildren(...rig.lights.slice(0, 6).map((light) =>
      h("tr", {}, h("th", { scope: "row" }, light.name.replace("_", " ")), h("td", {}, percentage(light.share)), h("td", {}, `${light.radius.toFixed(1)}°`))));
    $("rig-shading").hidden = false;
    this.offer(settings);
    document.documentElement.dataset.rig = `${state.method}:${lights}`;
    document.documentElement.dataset.ready = "true";
  });

  /** Shows why there is no rig. */
  private clear(reason: string) {
    this.rig = this.before = null;
    this.drawn = this.app.state.lights;
    $<HTMLCanvasElement>("rig-marks").getContext("2d")!.clearRect(0, 0, WIDTH, WIDTH / 2);
    this.showMark(null);
    for (const id of ["rig-step", "rig-readout", "formats", "dome-files"]) $(id).replaceChildren();
    $("rig-shading").hidden = $("rig-command").hidden = true;
    $("rig-caption").textContent = `There are no lights: ${reason.replace(/\.$/, "")}.`;
    document.documentElement.dataset.rig = "none";
  }

  /** Shows the light of the region that was pointed at. */
  private read() {
    const { pointed, before, rig, map: { films: [film] } } = this;
    if (!pointed || !before || !rig || !film) return;
    const i = Math.floor(pointed[1] * WIDTH / 2) * WIDTH + Math.floor(pointed[0] * WIDTH), light = rig.lights[before.regions[i]];
    this.showMark(light?.uv ?? pointed);
    const region = light ? `its region’s light, ${light.name.replace("_", " ")}, has ${percentage(light.share)} of all light, spread like a disc of radius ${light.radius.toFixed(1)}°` : "no light stands for it";
    $("rig-readout").textContent = `In this direction, L = ${short(luminance(film.pixels, 4 * i))}; ${region}.`;
  }

  /** Describes the last step. */
  private tellStep(divided: Set<number>, lights: number) {
    const { method, refine, leave } = this.app.state;
    const before = this.before ? lights - this.before.lights : 0;
    $("rig-step").textContent = leave ? "Suns and lamps become lights; the rest of the light stays on the map, which is exported as a dome light."
      : isRefined(method, refine) ? "The map is cut into twice as many regions as lights; then matching regions are joined, and the lights move to the centroids of their regions’ light. Without Refine, each step divides one region."
      : divided.size === 0 ? `Each step divides one region ${RULES[method]}.`
        : before === 1 ? `This step divided the region along the orange line ${RULES[method]}.`
          : `These ${before} steps divided regions along the orange lines, each ${RULES[method]}.`;
    document.documentElement.dataset.divided = String(divided.size);
  }

  /** Draws the borders of the regions (new ones in orange) and the lights. */
  private mark(regions: Uint32Array, leave: boolean, divided: Set<number>) {
    const before = this.before?.regions;
    const canvas = $<HTMLCanvasElement>("rig-marks"), context = canvas.getContext("2d")!;
    const height = WIDTH / 2, image = context.createImageData(WIDTH, height);
    for (let y = 0; y < height; y++) {
      for (let x = 0; x < WIDTH; x++) {
        const i = y * WIDTH + x;
        const below = y + 1 < height ? i + WIDTH : i, right = y * WIDTH + (x + 1) % WIDTH;
        const other = regions[i] !== regions[below] ? below : regions[i] !== regions[right] ? right : i;
        if (other === i) continue;
        const isNew = divided.size > 0 && before![i] === before![other] && divided.has(before![i]);
        image.data.set(isNew ? [255, 140, 0, 255] : [255, 255, 255, 190], 4 * i);
        // Double width.
        if (isNew) for (const j of [i - 1, i - WIDTH]) if (j >= 0) image.data.set([255, 140, 0, 255], 4 * j);
      }
    }
    context.putImageData(image, 0, 0);
    for (const light of this.rig!.lights.slice(0, 512)) {
      const [r, g, b] = light.irradiance, most = Math.max(r, g, b) || 1;
      context.beginPath();
      context.arc(light.uv[0] * WIDTH, light.uv[1] * height, leave ? 6 : Math.min(3 + 9 * Math.sqrt(light.share), 10), 0, 2 * Math.PI);
      context.fillStyle = `rgb(${[r, g, b].map((c) => 255 * (c / most) ** (1 / 2.2)).join(" ")})`;
      context.fill();
      context.lineWidth = 1.5;
      context.strokeStyle = "#000";
      context.stroke();
    }
  }

  /** Shows buttons for all files of the rig of these settings, and the command that writes them. */
  private offer(settings: string) {
    const { app } = this, { state } = app, { leave } = state, rig = this.rig!;
    const button = (name: string, bytes: () => Promise<Uint8Array>, reader = "") => {
      const element = h("button", { type: "button" }, name, ...(reader ? [h("small", {}, reader)] : []));
      element.addEventListener("click", async () => {
        try {
          save(name, await bytes());
          app.tell(`${name} is saved`);
        } catch (error) {
          app.tell((error as Error).message, true);
        }
      });
      return element;
    };
    $("formats").replaceChildren(...rig.formats.map((format) =>
      button(`rig.${format.extension}`, () => app.engines.call("rigFile", settings, format.name, app.envName) as Promise<Uint8Array>, READERS[format.name])));
    const domes = [...new Set(rig.formats.flatMap((format) => format.dome ?? []))];
    $("dome-files").replaceChildren(...domes.map((name) => button(name, () => app.engines.call("domeFile", settings, name) as Promise<Uint8Array>)));
    const command = ["domelight", "lights", ...lightWords(state), ...(state.sun ? ["--sun"] : []), ...(state.lamps ? [`--lamps=${state.lamps}`] : []),
      ...(leave ? [] : ["-n", String(state.lights)]), ...(rig.residual ? ["--keep-residual", "dome.exr"] : []), "--method", state.method, "-o", "rig.json"];
    // The program refines.
    $("rig-command").hidden = state.method === "variance-minimization" && !state.refine;
    $("rig-command").replaceChildren(...words(command.map(quoted)));
  }
}
