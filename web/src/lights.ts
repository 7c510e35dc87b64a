// The Lights panel: a probe as a rig, its regions, how it shades, and its files.

import type { App, Change } from "./app";
import { $, h, latest, save, short } from "./dom";
import { Film, FilmView } from "./film";
import { isBuiltinProbe } from "./state";

const WIDTH = 768, SPHERE = 160;

interface Rig {
  lights: { name: string; uv: [number, number]; irradiance: number[]; share: number; radius: number; kind: string }[];
  diffuse: number;
  glossy: number;
  residual: boolean;
  formats: { name: string; extension: string; dome: string | null }[];
}

const percent = (x: number) => `${short(100 * x)} %`;

export class LightsPanel {
  private map = new FilmView($<HTMLCanvasElement>("rig-film"), false);
  private truth = new FilmView($<HTMLCanvasElement>("sphere-truth"), false);
  private approximate = new FilmView($<HTMLCanvasElement>("sphere-rig"), false);
  private rig: Rig | null = null;

  constructor(private app: App) {
    app.on((what) => this.changed(what));
    $("method").addEventListener("change", () => app.set({ method: $<HTMLSelectElement>("method").value }, "panel"));
    $("n-lights").addEventListener("input", () => app.set({ lights: 2 ** Number($<HTMLInputElement>("n-lights").value) }, "panel"));
    $("sun").addEventListener("change", () => {
      const sun = $<HTMLInputElement>("sun").checked;
      if (!sun) $<HTMLInputElement>("leave").checked = false;
      app.set({ sun }, "panel");
    });
    $("leave").addEventListener("change", () => {
      if ($<HTMLInputElement>("leave").checked) $<HTMLInputElement>("sun").checked = app.state.sun = true;
      this.draw();
    });
    $("gloss").addEventListener("change", () => this.draw());
  }

  private changed(what: Change) {
    const { state, probe } = this.app;
    if (state.panel !== "lights" || !probe || what === "pixel" || what === "view") return;
    $<HTMLSelectElement>("method").value = state.method;
    $<HTMLInputElement>("sun").checked = state.sun;
    $<HTMLInputElement>("n-lights").value = String(Math.round(Math.log2(state.lights)));
    this.draw();
  }

  private readonly draw = latest(async () => {
    const { app } = this, { state } = app;
    $("n-lights-value").textContent = String(state.lights);
    const leave = $<HTMLInputElement>("leave").checked;
    $<HTMLInputElement>("n-lights").disabled = leave;
    const settings = { method: state.method, n: leave ? null : state.lights, sun: state.sun, lamps: state.lamps };
    let rig: Rig, regions: Uint32Array, view, spheres: Float32Array;
    try {
      rig = JSON.parse(await app.engines.call("lights", JSON.stringify(settings)));
      regions = (await app.engines.call("regions", WIDTH)) as Uint32Array;
      view = await app.engines.call("mapView", "lat-long", 0, WIDTH);
      spheres = (await app.engines.call("spheres", SPHERE, Number($<HTMLSelectElement>("gloss").value))) as Float32Array;
    } catch (error) {
      app.tell((error as Error).message, true);
      return;
    }
    this.rig = rig;
    const film = new Film(view.width, view.height);
    film.pixels = view.pixels;
    this.map.set({ exposure: film.exposure() });
    this.map.show(0, film);
    this.mark(regions, leave);
    const n = 3 * SPHERE * SPHERE;
    const [truth, approximate] = [0, 1].map((i) => Film.fromRgb(SPHERE, SPHERE, spheres.subarray(i * n, (i + 1) * n)));
    const exposure = truth.exposure();
    for (const [sphere, picture] of [[this.truth, truth], [this.approximate, approximate]] as const) {
      sphere.set({ exposure, curve: "standard" });
      sphere.show(0, picture);
    }
    const lights = rig.lights.length;
    $("rig-caption").textContent = `${lights} light${lights === 1 ? "" : "s"} of ${app.envName}${rig.residual ? ", beside what they leave on the map" : ""}. Error of shading: matte ${percent(rig.diffuse)}, glossy ${percent(rig.glossy)}.`;
    $("rig-table").querySelector("tbody")!.replaceChildren(...rig.lights.slice(0, 6).map((light) =>
      h("tr", {}, h("th", { scope: "row" }, light.name.replace("_", " ")), h("td", {}, percent(light.share)), h("td", {}, `${short(light.radius)}°`))));
    this.offer(leave);
    document.documentElement.dataset.rig = `${state.method}:${lights}`;
  });

  private mark(regions: Uint32Array, leave: boolean) {
    const canvas = $<HTMLCanvasElement>("rig-marks"), context = canvas.getContext("2d")!;
    const height = WIDTH / 2, image = context.createImageData(WIDTH, height);
    for (let y = 0; y < height; y++) {
      for (let x = 0; x < WIDTH; x++) {
        const i = y * WIDTH + x;
        const differs = (y + 1 < height && regions[i] !== regions[i + WIDTH]) || regions[i] !== regions[y * WIDTH + (x + 1) % WIDTH];
        if (differs) image.data.set([255, 255, 255, 190], 4 * i);
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
    const button = (name: string, bytes: () => Promise<Uint8Array>) => {
      const element = h("button", { type: "button" }, name);
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
      button(`rig.${format.extension}`, () => app.engines.call("rigFile", format.name, app.envName) as Promise<Uint8Array>)));
    const domes = [...new Set(rig.formats.flatMap((format) => format.dome ?? []))];
    $("dome-files").replaceChildren(...domes.map((name) => button(name, () => app.engines.call("domeFile", name) as Promise<Uint8Array>)));
    const words = ["domelight", "lights", state.env, ...(isBuiltinProbe(state.env) ? [`--env-rows=${state.rows}`] : []),
      ...(state.rotate ? [`--env-rotate=${state.rotate}`] : []), ...(state.sun ? ["--sun"] : []),
      ...(leave ? ["--keep-residual", "dome.exr"] : ["-n", String(state.lights)]), "--method", state.method, "-o", "rig.json"];
    $("rig-command").textContent = words.map((w) => (/^[\w@%+=:,./-]+$/.test(w) ? w : `'${w}'`)).join(" ");
  }
}
