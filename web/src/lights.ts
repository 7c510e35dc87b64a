// The Lights panel: a probe as a rig, its regions, how it shades, and its files.

import type { App, Change } from "./app";
import { $, h, latest, percentage, save, short, words } from "./dom";
import { Film, FilmView } from "./film";
import { isBuiltinProbe, quoted } from "./state";

const WIDTH = 768, SPHERE = 160;

/** Numbers of lights that the slider goes through: one by one up to 16, then four in each doubling, up to 1024. */
const COUNTS = [
  ...Array.from({ length: 16 }, (_, i) => i + 1),
  ...[16, 32, 64, 128, 256, 512].flatMap((n) => [1.25, 1.5, 1.75, 2].map((k) => k * n)),
];
/** How long a step is seen when they are played [ms]. */
const STEP = 700;

/** Which regions the methods divide, and where. */
const RULES: Record<string, string> = {
  "median-cut": "across its longer side, so that both parts have the same light",
  "variance-minimization": "where the variance of both parts adds up to the least",
};

/** What reads the formats. */
const READERS: Record<string, string> = {
  json: "domelight", csv: "spreadsheets", gltf: "glTF", glb: "glTF", usd: "OpenUSD", blender: "Blender", mitsuba: "Mitsuba", pbrt: "pbrt",
  three: "three.js", radiance: "Radiance", sibl: "sIBL",
};

interface Rig {
  lights: { name: string; uv: [number, number]; irradiance: number[]; share: number; radius: number; kind: string }[];
  diffuse: number;
  glossy: number;
  residual: boolean;
  formats: { name: string; extension: string; dome: string | null }[];
}

/** The place of a number of lights on the slider: that of the nearest. */
const place = (lights: number) => COUNTS.reduce((best, n, i) => (Math.abs(n - lights) < Math.abs(COUNTS[best] - lights) ? i : best), 0);

/** The regions of the first division that have parts in more than one of the second. */
function splits(before: Uint32Array, after: Uint32Array): Set<number> {
  const part = new Map<number, number>(), divided = new Set<number>();
  for (let i = 0; i < before.length; i++) {
    const known = part.get(before[i]);
    if (known === undefined) part.set(before[i], after[i]);
    else if (known !== after[i]) divided.add(before[i]);
  }
  return divided;
}

/** Whether a number of lights has regions of its own instead of those of the number before with one divided. */
const isRefined = (method: string, refine: boolean) => refine && method === "variance-minimization";

/** An error; less says nothing. */
const percent = (x: number) => (x < 1e-5 ? "< 0.001 %" : `${short(100 * x)} %`);

export class LightsPanel {
  private map = new FilmView($<HTMLCanvasElement>("rig-film"), false);
  private truth = new FilmView($<HTMLCanvasElement>("sphere-truth"), false);
  private approximate = new FilmView($<HTMLCanvasElement>("sphere-rig"), false);
  private rig: Rig | null = null;
  /** The regions of the last step, and what they were made of. */
  private before: { regions: Uint32Array; lights: number; of: string } | null = null;
  private timer = 0;

  constructor(private app: App) {
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
      app.set({ sun, leave: app.state.leave && sun }, "panel");
    });
    $("leave").addEventListener("change", () => {
      const leave = $<HTMLInputElement>("leave").checked;
      app.set({ leave, sun: app.state.sun || leave }, "panel");
    });
    $("gloss").addEventListener("change", () => app.set({ gloss: Number($<HTMLSelectElement>("gloss").value) }, "panel"));
  }

  /** Goes to the next number of lights, or the one before; whether there is one. */
  private step(by: number): boolean {
    const at = place(this.app.state.lights) + by;
    if (at < 0 || at >= COUNTS.length) return false;
    this.app.set({ lights: COUNTS[at] }, "panel");
    return true;
  }

  /** Plays the steps from here, from the first if here is the last, or stops. */
  private play(on: boolean) {
    const { state } = this.app;
    clearTimeout(this.timer);
    this.timer = 0;
    $("play-lights").textContent = on ? "Pause" : "Play";
    $("play-lights").setAttribute("aria-pressed", String(on));
    if (!on) return;
    if (place(state.lights) === COUNTS.length - 1) this.app.set({ lights: 1 }, "panel");
    const next = () => {
      // A step is seen before the next one comes.
      if (this.drawn !== state.lights) this.timer = setTimeout(next, 50) as unknown as number;
      else if (state.panel !== "lights" || !this.step(1)) this.play(false);
      else this.timer = setTimeout(next, STEP) as unknown as number;
    };
    this.timer = setTimeout(next, STEP) as unknown as number;
  }

  /** The number of lights that is shown. */
  private drawn = 0;

  private changed(what: Change) {
    const { state, probe } = this.app;
    if (state.panel !== "lights" && this.timer) this.play(false);
    if (state.panel !== "lights" || !probe || what === "pixel" || what === "view") return;
    $<HTMLSelectElement>("method").value = state.method;
    $<HTMLInputElement>("sun").checked = state.sun;
    $<HTMLInputElement>("leave").checked = state.leave;
    const gloss = $<HTMLSelectElement>("gloss"), exponent = String(state.gloss);
    if (![...gloss.options].some(({ value }) => value === exponent)) gloss.append(new Option(`glossy, cosⁿ with n = ${exponent}`, exponent));
    gloss.value = exponent;
    $<HTMLInputElement>("refine").checked = state.refine;
    $<HTMLInputElement>("refine").disabled = state.method !== "variance-minimization";
    $<HTMLInputElement>("n-lights").value = String(place(state.lights));
    this.draw();
  }

  private readonly draw = latest(async () => {
    const { app } = this, { state } = app;
    $("n-lights-value").textContent = String(state.lights);
    const { leave } = state;
    for (const id of ["n-lights", "fewer-lights", "more-lights", "play-lights"]) $<HTMLInputElement>(id).disabled = leave;
    if (leave) this.play(false);
    const settings = { method: state.method, refine: state.refine, n: leave ? null : state.lights, sun: state.sun, lamps: state.lamps };
    let rig: Rig, regions: Uint32Array, view, spheres: Float32Array;
    try {
      rig = JSON.parse(await app.engines.call("lights", JSON.stringify(settings)));
      regions = (await app.engines.call("regions", WIDTH)) as Uint32Array;
      view = await app.engines.call("mapView", "lat-long", 0, WIDTH);
      spheres = (await app.engines.call("spheres", SPHERE, state.gloss)) as Float32Array;
    } catch (error) {
      app.tell((error as Error).message, true);
      return;
    }
    this.rig = rig;
    const film = new Film(view.width, view.height);
    film.pixels = view.pixels;
    this.map.set({ exposure: film.exposure() });
    this.map.show(0, film);
    const of = JSON.stringify({ ...settings, n: 0, env: state.env, rows: state.rows, rotate: state.rotate });
    const divided = leave || isRefined(state.method, state.refine) || this.before?.of !== of || this.before.lights >= rig.lights.length ? new Set<number>() : splits(this.before.regions, regions);
    this.mark(regions, leave, divided);
    this.tellStep(divided, rig.lights.length);
    this.before = { regions, lights: rig.lights.length, of };
    this.drawn = state.lights;
    const n = 3 * SPHERE * SPHERE;
    const [truth, approximate] = [0, 1].map((i) => Film.fromRgb(SPHERE, SPHERE, spheres.subarray(i * n, (i + 1) * n)));
    const exposure = truth.exposure();
    for (const [sphere, picture] of [[this.truth, truth], [this.approximate, approximate]] as const) {
      sphere.set({ exposure, curve: "standard" });
      sphere.show(0, picture);
    }
    const lights = rig.lights.length;
    $("rig-caption").textContent = `${lights} light${lights === 1 ? "" : "s"} of ${app.envName}${rig.residual ? `, beside what ${lights === 1 ? "it leaves" : "they leave"} on the map` : ""}. Error of shading: matte ${percent(rig.diffuse)}, glossy ${percent(rig.glossy)}.`;
    $("rig-table").querySelector("tbody")!.replaceChildren(...rig.lights.slice(0, 6).map((light) =>
      h("tr", {}, h("th", { scope: "row" }, light.name.replace("_", " ")), h("td", {}, percentage(light.share)), h("td", {}, `${light.radius.toFixed(1)}°`))));
    this.offer(leave);
    document.documentElement.dataset.rig = `${state.method}:${lights}`;
  });

  /** What the last step did. */
  private tellStep(divided: Set<number>, lights: number) {
    const { method, refine, leave } = this.app.state;
    const before = this.before ? lights - this.before.lights : 0;
    $("rig-step").textContent = leave ? "Suns and lamps become lights; the rest of the light stays on the map, which goes along as a dome."
      : isRefined(method, refine) ? "The map is cut into twice as many parts as there are lights; those that belong together are joined, and the lights move to the centers of their light. Without Refine, each step divides a region."
      : divided.size === 0 ? `Each step divides a region ${RULES[method]}.`
        : before === 1 ? `This step divided the region along the orange line ${RULES[method]}.`
          : `These ${before} steps divided regions along the orange lines, each ${RULES[method]}.`;
    document.documentElement.dataset.divided = String(divided.size);
  }

  /** Draws the borders of the regions, those that are new in orange, and the lights. */
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
        // Twice as wide.
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

  /** Buttons of all files, and the command that makes them. */
  private offer(leave: boolean) {
    const { app } = this, { state } = app, rig = this.rig!;
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
      button(`rig.${format.extension}`, () => app.engines.call("rigFile", format.name, app.envName) as Promise<Uint8Array>, READERS[format.name])));
    const domes = [...new Set(rig.formats.flatMap((format) => format.dome ?? []))];
    $("dome-files").replaceChildren(...domes.map((name) => button(name, () => app.engines.call("domeFile", name) as Promise<Uint8Array>)));
    const command = ["domelight", "lights", state.env, ...(isBuiltinProbe(state.env) ? [`--env-rows=${state.rows}`] : []),
      ...(state.rotate ? [`--env-rotate=${state.rotate}`] : []), ...(state.scale === 1 ? [] : [`--env-scale=${state.scale}`]), ...(state.ev ? [`--env-exposure=${state.ev}`] : []), ...(state.sun ? ["--sun"] : []),
      ...(leave ? ["--keep-residual", "dome.exr"] : ["-n", String(state.lights)]), "--method", state.method, "-o", "rig.json"];
    // The program refines.
    $("rig-command").hidden = state.method === "variance-minimization" && !state.refine;
    $("rig-command").replaceChildren(...words(command.map(quoted)));
  }
}
