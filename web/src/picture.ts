// The Picture panel: the progressive picture, its camera, material, strategies and cost.

import type { App, Change } from "./app";
import { colorBar, placeOf } from "./direction";
import { $, color, count, degrees, fill, save, short, signed, stops, words } from "./dom";
import { strategyEditor } from "./editors";
import type { Camera, Host, Job, RenderSettings } from "./engines";
import { ErrorPlot, type Measured } from "./errors";
import { Film, FilmView, luminance } from "./film";
import { onFigureWidth } from "./plot";
import type { Update } from "./protocol";
import { MaterialControls } from "./materials";
import { Reference } from "./reference";
import { DEFAULT, PROBES, SCENES, addressOf, command, commandWords, fileName, isBuiltinProbe, type State } from "./state";
import { CURVES, CURVE_NAMES, type Curve } from "./tone";

type Vec = [number, number, number];
const sub = (a: number[], b: number[]): Vec => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const add = (a: number[], b: number[], k = 1): Vec => [a[0] + k * b[0], a[1] + k * b[1], a[2] + k * b[2]];
const dot = (a: number[], b: number[]) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a: number[], b: number[]): Vec => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const scale = (a: number[], k: number): Vec => [a[0] * k, a[1] * k, a[2] * k];
const unit = (a: number[]): Vec => scale(a, 1 / Math.hypot(...a));
const turned = (v: number[], axis: number[], angle: number): Vec =>
  add(add(scale(v, Math.cos(angle)), cross(axis, v), Math.sin(angle)), axis, dot(axis, v) * (1 - Math.cos(angle)));

/** The edge length of the preview while the camera moves [pixels]. */
const PREVIEW = 128;
/** The automatic exposure of the default picture, for which most visitors need not wait [stops]. */
const DEFAULT_EXPOSURE = 0.52;
/** When a reference starts beside a picture that takes long [ms]. */
const PATIENCE = 3000;
/** Renders of a reference while the picture is not done. */
const RENDERS_BEFORE = 4;
/** At equal rays, the right picture may have this many more samples than expected, and is stopped before. */
const SPARE = 1.04;
/** The distances that zooming reaches [radii of the scene]. */
const NEAREST = 1e-3, FARTHEST = 1e3;

/** Scene and light; for these, automatic exposures are similar for all views and materials. */
const lightKey = ({ scene, env, rows, ev, scale }: State, missing: App["missing"]) => JSON.stringify([scene, env, rows, ev, scale, missing]);

export class PicturePanel {
  private view: FilmView;
  private jobs: Job[] = [];
  private films: Film[] = [];
  private histories: { rays: number; error: number; samples: number }[][] = [[], []];
  private errors = new ErrorPlot();
  private preview = false;
  private settle = 0;
  /** Whether the whole picture starts as soon as its preview is done. */
  private followsAtOnce = false;
  /** Counts the started renders. */
  private turn = 0;
  /** The last automatic exposure, the view that it belongs to, and the light and scene for which it is a good guess. */
  private automatic = { exposure: DEFAULT_EXPOSURE, view: "", light: lightKey(DEFAULT, { scene: "", env: "" }) };
  private reference: Reference;
  private materials: MaterialControls;
  private referTimer = 0;
  private lastPlot = 0;
  /** The settings that determine the rendered picture. */
  private renderedKey = "";
  /** Times of the last change that asks for a picture, of the first pixels after it, and of the last start and end of a
   *  render [ms]. */
  readonly times = { asked: 0, shown: 0, start: 0, done: 0 };

  constructor(private app: App) {
    this.view = new FilmView($<HTMLCanvasElement>("film"), !new URLSearchParams(location.search).has("2d"));
    app.engines.events = {
      update: (job, host, update) => this.update(job, host, update),
      ended: (job) => {
        if (!this.jobs.includes(job)) return;
        this.pace();
        if (this.jobs.includes(job)) this.finish(job);
      },
      failed: (job, error) => this.failed(job, error),
    };
    this.reference = new Reference(app, () => this.referenceChanged(), () => this.isReferred());
    this.materials = new MaterialControls(app);
    app.on((what) => this.changed(what));
    // From full color to black at an error of 2⁻⁸, as the view has it.
    const errors: [number, string][] = [[0, "−100 %"], [0.25, "−6 %"], [0.5, "0.4 % or less"], [0.75, "6 %"], [1, "100 %"]];
    colorBar($("error-bar"), "Relative error", "linear-gradient(to right, rgb(89 166 255), rgb(13 13 13), rgb(255 140 38))", errors);
    this.wireControls();
    this.wireCamera();
    this.wireDivider();
    this.fillControls();
    if (this.isShown) this.view.prepare();
    onFigureWidth(() => { if (this.jobs.length) this.report(true); });
  }

  private changed(what: Change) {
    if (what === "all" || what === "files") this.fillControls();
    if (what === "scene" || what === "camera") this.fillCameras();
    if (what === "scene") this.materials.refresh();
    if (what === "panel" && this.postponed) this.render(true);
    if (what === "files" || what === "panel") return;
    if (what === "pixel" || what === "view") {
      this.showView();
      return;
    }
    this.showView();
    if (!this.app.scene || !this.app.probe || this.app.waits(what)) return;
    const { panel, step, figure, pixel, compared, exposure, curve, view, mapping, layer, samples, method, refine, lights, sun, lamps, leave, gloss, ...rendered } = this.app.state;
    const key = JSON.stringify(rendered);
    // A changed hash may concern only another panel.
    if (what === "all" && key === this.renderedKey && !this.postponed) return;
    this.renderedKey = key;
    this.render(what !== "render");
  }

  /** Whether the panel of the state shows the picture. */
  private get isShown() {
    return !this.app.embeds && ["picture", "xray"].includes(this.app.state.panel);
  }

  /** Whether the picture waits for a panel that shows it. */
  private postponed = false;

  /** Renders the picture. Other panels do not share the computer with a picture that nobody sees. */
  private render(atOnce: boolean) {
    this.postponed = !this.isShown;
    if (!this.postponed) void this.restart(atOnce);
  }

  // ---- rendering

  /** A link with a bad strategy shows the usual one. */
  private failed(job: Job, error: string) {
    // The message of the parser has a place in the settings, which nobody wrote.
    this.app.tell(error.replace(/^settings: /, "").replace(/ at line \d+ column \d+$/, ""), true);
    const side = this.jobs.indexOf(job);
    if (side < 0 || this.preview || this.times.done) return;
    const key = side ? "beside" : "strategy";
    if (this.app.state[key] !== DEFAULT[key]) this.app.replace(key);
  }

  /** Restarts the render. After a change of the view, first renders a small preview for an immediate response. */
  async restart(atOnce: boolean) {
    clearTimeout(this.settle);
    this.times.asked = performance.now();
    this.times.shown = 0;
    // A new scene or light waits for its exposure; a new view starts with the last exposure.
    const turn = ++this.turn;
    if (this.app.state.exposure === null) {
      if (this.automatic.light === this.lightKey) this.showExposure(this.automatic.exposure);
      else await this.expose();
      if (turn !== this.turn) return;
    }
    const small = atOnce && this.app.state.size > 1.5 * PREVIEW;
    if (small) {
      // Views that follow may be of a drag, which the whole picture would delay.
      this.followsAtOnce = !this.view.films[0];
      this.start(true);
      this.settle = setTimeout(() => {
        // A preview that takes longer is waited for.
        if (this.jobs.every((job) => job.complete)) this.start(false);
        else this.followsAtOnce = true;
      }, 150) as unknown as number;
    } else this.start(false);
  }

  /** The render settings for a strategy. */
  private settings(strategy: string): RenderSettings {
    const { size, spp, seed, hide } = this.app.state;
    return { width: size, height: size, spp, strategy, seed, hideEnvironment: hide, camera: this.app.camera };
  }

  private start(preview: boolean) {
    const { state, engines } = this.app;
    const size = preview ? PREVIEW : state.size;
    const settings = (strategy: string): RenderSettings =>
      (preview ? { ...this.settings("mis:1:1:no-compensation"), width: size, height: size, spp: 1 } : this.settings(strategy));
    const pair = !preview && state.beside && engines.active > 1;
    if (state.beside && !pair && !preview) this.app.tell("Two pictures side by side need two Workers, but memory suffices only for one", true);
    if (!preview && state.exposure === null) void this.expose();
    this.preview = preview;
    this.calibrated = false;
    this.times.start = performance.now();
    this.times.done = 0;
    const right = () => ({ ...settings(state.beside), ...(state.equal === "time" ? { spp: 65536 } : {}) });
    this.jobs = engines.render(pair ? [settings(state.strategy), right()] : [settings(state.strategy)]);
    // The old picture stays until there are new pixels.
    this.films = this.jobs.map(() => new Film(size, size));
    this.histories = [[], []];
    this.chooseReference();
    if (!preview) this.app.progress("Rendering …");
    $("viewer").toggleAttribute("data-busy", true);
  }

  private update(job: Job, host: Host, update: Update) {
    const { windows, pixels } = update;
    const side = this.jobs.indexOf(job);
    if (side < 0) return;
    const film = this.films[side];
    const isFirst = this.view.films[side] !== film;
    if (isFirst) {
      // The old picture fills the rest until it is rendered.
      const before = this.view.films[side] ?? this.view.films[0];
      if (before) film.underlay(before);
      film.put(windows, pixels);
      this.view.show(side, film);
      if (side === 0 && this.jobs.length === 1) this.view.show(1, null);
      this.times.shown ||= performance.now();
    } else this.view.update(side, windows, pixels);
    if (!this.preview) job.passes.note(host, update, film);
    this.pace();
    if (this.preview) {
      document.documentElement.dataset.preview = String(Math.round(performance.now() - this.times.start));
      if (job.complete && this.followsAtOnce) {
        clearTimeout(this.settle);
        this.start(false);
      }
      return;
    }
    const { measured } = job;
    const history = this.histories[side];
    const last = history.at(-1)?.rays ?? 0;
    if (measured && measured.samples >= 2 && measured.rays > (job.complete ? last : 1.15 * last)) history.push(measured);
    this.finish(job);
    document.documentElement.dataset.ready = "true";
  }

  /** Reports what is done, and what follows when all is. */
  private finish(job: Job) {
    this.report(job.complete);
    if (!this.jobs.every((j) => j.complete)) return;
    this.times.done = performance.now();
    this.app.progress(`Done in ${((this.times.done - this.times.start) / 1000).toFixed(1)} s${this.app.engines.shortage}`);
    $("viewer").toggleAttribute("data-busy", false);
    document.documentElement.dataset.complete = String(job.token);
    this.refer();
  }

  // ---- the error

  /** Chooses the reference of the picture, which is made when the picture is done or takes long. */
  private chooseReference() {
    clearTimeout(this.referTimer);
    if (this.preview) {
      this.reference.stop();
      return;
    }
    this.reference.choose(this.jobs[0].settings);
    this.showReference();
    this.tellError();
    const isTimed = this.jobs.length > 1 && this.app.state.equal === "time";
    if (this.app.state.view === "error") this.refer();
    // A reference beside pictures of equal time would take time from them.
    else if (!isTimed) this.referTimer = setTimeout(() => this.refer(), PATIENCE) as unknown as number;
  }

  private refer() {
    if (!this.preview && this.jobs.length) this.reference.run();
  }

  private referenceChanged() {
    this.showReference();
    this.report(true);
  }

  /** Gives the view the reference if it shows errors. */
  private showReference() {
    const film = this.view.look.errors ? this.reference.film : null;
    if (film || this.view.films[2]) this.view.show(2, film);
  }

  /** Whether the reference suffices for what is shown. */
  private isReferred(): boolean {
    const isShown = this.app.state.view === "error";
    // How much is enough is known when the pictures are done.
    if (!this.jobs.every((job) => job.complete)) return this.reference.renders >= RENDERS_BEFORE;
    if (!this.reference.isReady) return false;
    return this.measured().every((passes) => this.reference.settles(passes.at(-1)?.error ?? 0, isShown));
  }

  /** The errors of the pictures at their passes, and where they were stopped. */
  private measured(): Measured[][] {
    return this.jobs.map((job, i) => this.errors.measure(job, this.films[i], this.reference));
  }

  /** Shows the error under the picture. */
  private tellError() {
    const { reference } = this, legend = $("error-legend");
    legend.hidden = $("error-bar").hidden = this.app.state.view !== "error";
    if (legend.hidden) return;
    if (reference.failure) legend.textContent = `There is no reference: ${reference.failure}.`;
    else if (!reference.film) legend.textContent = "Rendering a reference …";
    else legend.textContent = `Blue pixels are too dark, orange pixels too bright. The reference has ${reference.samples} samples per pixel.`;
  }

  private calibrated = false;

  /** At equal rays, gives the right picture slightly more samples than it should need, pauses the picture that is ahead,
   *  and stops the right one when it has the left one's rays. At equal time, stops the right picture when the left one
   *  ends. */
  private pace() {
    if (this.jobs.length < 2) return;
    const { engines, state } = this.app, [a, b] = this.jobs;
    if (state.equal !== "rays") {
      if (a.complete && !b.complete) engines.end(b);
      return;
    }
    const both = this.jobs.map((job) => job.statistics), rays = both.map((s) => s.shadowRays);
    // Short passes may ask for other numbers of rays than long ones.
    const known = (job: Job, i: number) => job.complete || both[i].samples >= Math.max(1, a.settings.spp / 4);
    if (!this.calibrated && this.jobs.every(known)) {
      this.calibrated = true;
      // Compare rays per hit: hits per sample are the same for both, and tiles may be in different passes.
      const [ofLeft, ofRight] = both.map((s) => s.shadowRays / Math.max(s.shadingPoints, 1));
      this.replaceRight(a.settings.spp * ofLeft / Math.max(ofRight, 1e-3));
      return;
    }
    if (!this.calibrated) return;
    if (a.complete && b.complete) {
      // The estimate was too low: now the number of rays per sample is known.
      if (b.isWhole && rays[1] < 0.98 * rays[0]) this.replaceRight(b.settings.spp * rays[0] / Math.max(rays[1], 1));
      // A busy page has heard too late that the left picture is done: the right one starts anew, and knows its end.
      else if (!b.begunWithBudget && b.settings.spp > 1 && rays[1] > 1.02 * rays[0]) {
        this.replaceRight(b.settings.spp, 1);
        this.jobs[1].begunWithBudget = engines.endAt(this.jobs[1], rays[0], b);
      }
      return;
    }
    if (a.complete) {
      // Where the left picture ends first, the right one may not have begun.
      if (!engines.endAt(b, rays[0])) engines.pause(b, false);
      return;
    }
    engines.pause(a, rays[0] > 1.02 * Math.max(1, rays[1]) + 20_000);
    engines.pause(b, rays[1] > rays[0]);
  }

  /** Starts the right picture anew for a number of samples, and some to spare, unless it has them. */
  private replaceRight(spp: number, reserve = SPARE) {
    const { engines } = this.app, b = this.jobs[1], spare = Math.min(Math.max(1, Math.ceil(reserve * spp)), 65536);
    if (spare === b.settings.spp && reserve > 1) return;
    this.jobs[1] = engines.again(b, { spp: spare });
    this.histories[1] = [];
    engines.pause(this.jobs[0], false);
  }

  /** Computes the program's automatic exposure for the state, unless it is known. */
  private async expose() {
    const view = JSON.stringify([this.lightKey, this.app.state.material, this.app.state.materials, this.app.state.ground, this.app.state.rotate, this.app.camera]);
    const light = this.lightKey;
    if (this.automatic.view === view) {
      this.showExposure(this.automatic.exposure);
      return;
    }
    try {
      const exposure = (await this.app.engines.call("automaticExposure", JSON.stringify({ ...this.settings(this.app.state.strategy), shard: [0, 1] }))) as number;
      this.automatic = { exposure, view, light };
      if (this.app.state.exposure === null) this.showExposure(exposure);
    } catch (error) {
      this.app.tell((error as Error).message, true);
    }
  }

  private get lightKey() {
    return lightKey(this.app.state, this.app.missing);
  }

  private showExposure(exposure: number) {
    this.view.set({ exposure });
    $<HTMLInputElement>("exposure").value = String(exposure);
    $("exposure-value").textContent = stops(exposure);
  }

  private report(force: boolean) {
    const now = performance.now();
    if (!force && now - this.lastPlot < 200) return;
    this.lastPlot = now;
    const progress = this.jobs.reduce((sum, job) => sum + job.progress, 0) / this.jobs.length;
    $<HTMLProgressElement>("progress").value = progress;
    const one = (job: Job) => {
      const s = job.statistics;
      const bad = s.nonFinite ? `, ${s.nonFinite} not finite` : "";
      return `${s.samples.toFixed(s.samples < 10 ? 1 : 0)} samples per pixel, ${count(s.shadowRays)} shadow rays${bad}`;
    };
    $("counts").textContent = this.jobs.map((job) => (this.jobs.length > 1 ? `${job.strategy}: ` : "") + one(job)).join(" · ");
    this.tellError();
    const estimates = this.jobs.map((_, i) => this.histories[i]).map((history) => history.map(({ rays, error }) => ({ rays, error, isWhole: true })));
    this.errors.show(this.jobs, this.measured(), estimates, this.reference);
    $("command").replaceChildren(...words(commandWords(this.app.state)));
  }

  // ---- display

  private showView() {
    const { state } = this.app;
    this.view.look.curve = state.curve as Curve;
    this.view.look.errors = state.view === "error";
    this.showReference();
    this.tellError();
    if (this.view.look.errors) this.refer();
    if (state.exposure !== null) this.showExposure(state.exposure);
    else this.view.set({});
    const split = !!state.beside;
    $("divider").hidden = !split;
    if (!split) this.view.set({ divider: 1 });
    else if (this.view.look.divider === 1) this.setDivider(0.5);
    for (const [id, text] of [["tag-left", state.strategy], ["tag-right", state.beside]]) {
      $(id).hidden = !split;
      $(id).textContent = text;
    }
    $("command").replaceChildren(...words(commandWords(state)));
    const marks = $<HTMLCanvasElement>("film-marks"), context = marks.getContext("2d")!;
    context.clearRect(0, 0, marks.width, marks.height);
    if (state.pixel) {
      const [x, y] = state.pixel.map((c) => (c + 0.5) / state.size * marks.width);
      for (const [width, style] of [[4, "#000"], [1.75, "#fff"]] as const) {
        context.lineWidth = width;
        context.strokeStyle = style;
        context.beginPath();
        context.arc(x, y, 9, 0, 2 * Math.PI);
        context.stroke();
      }
    }
  }

  private setDivider(share: number) {
    const clamped = Math.min(Math.max(share, 0), 1);
    this.view.set({ divider: clamped });
    const divider = $("divider");
    divider.style.left = `${100 * clamped}%`;
    divider.setAttribute("aria-valuenow", String(Math.round(100 * clamped)));
  }

  private wireDivider() {
    const divider = $("divider");
    divider.addEventListener("pointerdown", (event) => {
      event.stopPropagation();
      divider.setPointerCapture(event.pointerId);
    });
    divider.addEventListener("pointermove", (event) => {
      if (!divider.hasPointerCapture(event.pointerId)) return;
      const box = $("viewer").getBoundingClientRect();
      this.setDivider((event.clientX - box.left) / box.width);
    });
    divider.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: -0.02, ArrowRight: 0.02, Home: -1, End: 1 }[event.key];
      if (step === undefined) return;
      event.preventDefault();
      event.stopPropagation();
      this.setDivider(this.view.look.divider + step);
    });
  }

  // ---- camera

  private camera(): Camera | null {
    return this.app.camera ?? this.app.scene?.camera ?? null;
  }

  private orbit(yaw: number, pitch: number, zoom = 1) {
    const camera = this.camera(), scene = this.app.scene;
    // The picture of a link stays until its files are loaded.
    if (!camera || !scene || this.app.missing.scene) return;
    const up = unit(scene.up), center = scene.center;
    const turn = (point: number[]) => add(center, turned(sub(point, center), up, yaw));
    let origin = turn(camera.origin), target = turn(camera.target);
    const forward = unit(sub(target, origin)), right = unit(cross(forward, up));
    const elevation = Math.asin(Math.min(Math.max(-dot(forward, up), -1), 1));
    const limited = Math.min(Math.max(elevation + pitch, -1.5), 1.5) - elevation;
    const tilt = (point: number[]) => add(center, turned(sub(point, center), right, -limited));
    origin = tilt(origin);
    target = tilt(target);
    const zoomed = (size: number) => Math.min(Math.max(size * zoom, NEAREST * scene.radius), FARTHEST * scene.radius);
    const distance = Math.hypot(...sub(origin, target));
    origin = add(target, sub(origin, target), zoomed(distance) / distance);
    const ortho = camera.ortho === null ? null : Math.fround(zoomed(camera.ortho));
    const rounded = (v: Vec) => v.map(Math.fround);
    this.app.state.camera = { origin: rounded(origin), target: rounded(target), up: rounded(turned(camera.up, up, yaw)), fov: camera.fov, ortho };
    this.app.set({ pixel: null }, "camera");
  }

  private wireCamera() {
    const viewer = $("viewer");
    const pointers = new Map<number, { x: number; y: number }>();
    let moved = 0;
    viewer.addEventListener("pointerdown", (event) => {
      viewer.setPointerCapture(event.pointerId);
      pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
      moved = 0;
    });
    viewer.addEventListener("pointermove", (event) => {
      const last = pointers.get(event.pointerId);
      if (!last) return this.read(placeOf(event, viewer));
      const dx = event.clientX - last.x, dy = event.clientY - last.y;
      moved += Math.abs(dx) + Math.abs(dy);
      if (pointers.size === 2) {
        const [a, b] = [...pointers.values()];
        const before = Math.hypot(a.x - b.x, a.y - b.y);
        pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
        const [c, d] = [...pointers.values()];
        this.orbit(0, 0, before / Math.max(Math.hypot(c.x - d.x, c.y - d.y), 1));
        return;
      }
      if (moved < 4) return;
      pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
      this.orbit(-dx * 0.01, dy * 0.01);
    });
    const end = (event: PointerEvent) => {
      const was = pointers.delete(event.pointerId);
      if (was && event.type === "pointerup" && moved < 4 && pointers.size === 0) this.pick(event);
    };
    viewer.addEventListener("pointerup", end);
    viewer.addEventListener("pointercancel", end);
    viewer.addEventListener("pointerleave", () => this.read(null));
    viewer.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.orbit(0, 0, Math.exp(Math.min(Math.max(event.deltaY, -100), 100) * 0.002));
    }, { passive: false });
    viewer.addEventListener("keydown", (event) => {
      const step = 0.1;
      const moves: Record<string, [number, number, number]> = {
        ArrowLeft: [-step, 0, 1], ArrowRight: [step, 0, 1], ArrowUp: [0, step, 1], ArrowDown: [0, -step, 1],
        "+": [0, 0, 0.9], "=": [0, 0, 0.9], "-": [0, 0, 1 / 0.9],
      };
      const move = moves[event.key];
      if (!move || event.target !== viewer) return;
      event.preventDefault();
      this.orbit(...move);
    });
  }

  /** Shows the values of the pixel under the pointer. */
  private read(place: [number, number] | null) {
    const [left, right, reference] = this.view.films, film = right && place && place[0] >= this.view.look.divider ? right : left;
    if (!film || !place) {
      $("pixel-readout").textContent = "";
      return;
    }
    const x = Math.floor(place[0] * film.width), y = Math.floor(place[1] * film.height), at = 4 * (y * film.width + x);
    const rgb = [...film.pixels.subarray(at, at + 3)], value = luminance(film.pixels, at);
    const truth = this.view.look.errors && reference?.width === film.width ? luminance(reference.pixels, at) : 0;
    const error = truth > 0 ? `; its error is ${short(100 * (value / truth - 1))} % of the reference’s ${short(truth)}` : "";
    $("pixel-readout").classList.toggle("above", place[1] > 0.8);
    $("pixel-readout").textContent = `Column ${x}, row ${y}: R, G, B ${rgb.map(short).join(", ")}; luminance ${short(value)}${error}.`;
  }

  private pick(event: PointerEvent) {
    const box = $("viewer").getBoundingClientRect(), { size } = this.app.state;
    const at = (x: number, n: number) => Math.min(Math.max(Math.floor(x / n * size), 0), size - 1);
    this.app.set({ pixel: [at(event.clientX - box.left, box.width), at(event.clientY - box.top, box.height)] }, "pixel");
    void this.materials.choose().then((name) => this.app.tell(`Pixel picked: the X-ray and Map panels show its samples${name && `; its material is ${name}`}`));
  }

  // ---- controls

  private fillControls() {
    const { app } = this, { state } = app;
    const withFile = (known: string[], files: string[], chosen: string) => [...known, ...files, ...([...known, ...files].includes(chosen) ? [] : [chosen])];
    fill($("scene"), withFile(SCENES, app.files.scenes, state.scene), state.scene);
    fill($("env"), withFile(PROBES, app.files.probes, state.env), state.env);
    this.fillCameras();
    fill($("curve"), CURVES.map((curve): [string, string] => [curve, CURVE_NAMES[curve]]), state.curve);
    $<HTMLSelectElement>("view").value = state.view;
    $<HTMLInputElement>("ground").checked = state.ground;
    $<HTMLInputElement>("hide").checked = state.hide;
    for (const id of ["spp", "size", "seed", "rotate", "ev"] as const) $<HTMLInputElement>(id).value = String(state[id]);
    $("rotate-value").textContent = degrees(state.rotate);
    $("ev-value").textContent = stops(state.ev);
    $<HTMLSelectElement>("equal").value = state.equal;
    $<HTMLInputElement>("split").checked = !!state.beside;
    $("beside").hidden = !state.beside;
    this.materials.fill();
    strategyEditor($("strategy-editor"), state.strategy, (strategy) => app.set({ strategy }));
    strategyEditor($("beside-editor"), state.beside || "mis:1:1", (beside) => app.set({ beside }));
  }

  /** Lists the cameras of a file, if any. */
  private fillCameras() {
    const { scene, camera } = this.app, cameras = scene?.cameras ?? [];
    $("cameras").hidden = !cameras.length;
    const chosen = camera ? cameras.findIndex((of) => JSON.stringify(of.camera) === JSON.stringify(camera)) : 0;
    const names = cameras.map(({ name }, i): [string, string] => [String(i), name]);
    fill($("camera"), chosen < 0 ? [...names, ["-1", "custom"]] : names, String(chosen));
  }

  private wireControls() {
    const { app } = this;
    const on = (id: string, event: string, f: (input: HTMLInputElement) => void) =>
      $(id).addEventListener(event, () => f($<HTMLInputElement>(id)));
    on("scene", "change", (i) => {
      app.set({ scene: i.value, camera: null, material: "", materials: {}, pixel: null });
    });
    on("env", "change", (i) => app.set({ env: i.value, reduce: 1, exposure: null }));
    on("ground", "change", (i) => app.set({ ground: i.checked }));
    on("hide", "change", (i) => app.set({ hide: i.checked }));
    on("rotate", "input", (i) => {
      $("rotate-value").textContent = degrees(Number(i.value));
      app.set({ rotate: Number(i.value) });
    });
    on("ev", "input", (i) => {
      $("ev-value").textContent = stops(Number(i.value));
      app.set({ ev: Number(i.value) });
    });
    const number = (id: "spp" | "size" | "seed", most: number) => on(id, "change", (i) => {
      const least = id === "seed" ? 0 : id === "size" ? 16 : 1;
      i.value = String(Math.min(Math.max(Math.round(Number(i.value)) || least, least), most));
      app.set({ [id]: Number(i.value), ...(id === "size" ? { pixel: null } : {}) });
    });
    number("spp", 65536);
    number("size", 2048);
    number("seed", 4294967295);
    on("split", "change", (i) => {
      $("beside").hidden = !i.checked;
      app.set({ beside: i.checked ? "mis:1:1" : "" });
      if (i.checked) strategyEditor($("beside-editor"), "mis:1:1", (beside) => app.set({ beside }));
    });
    on("equal", "change", (i) => app.set({ equal: i.value }));
    on("exposure", "input", (i) => app.set({ exposure: Number(i.value) }, "view"));
    on("view", "change", (i) => app.set({ view: i.value }, "view"));
    on("curve", "change", (i) => app.set({ curve: i.value }, "view"));
    on("camera", "change", (i) => app.set({ camera: app.scene?.cameras[Number(i.value)]?.camera ?? null, pixel: null }, "camera"));
    $("auto").addEventListener("click", () => {
      app.set({ exposure: null }, "view");
      void this.expose();
    });
    $("reset-camera").addEventListener("click", () => {
      app.state.camera = null;
      app.set({ pixel: null }, "camera");
    });
    on("files", "change", (i) => {
      void app.open([...(i.files ?? [])].map((file) => ({ path: file.webkitRelativePath || file.name, file })));
      i.value = "";
    });
    $("save-exr").addEventListener("click", () => this.save("exr"));
    $("save-png").addEventListener("click", () => this.save("png"));
    $("copy-link").addEventListener("click", () => app.copy(addressOf(app.state), `Link copied${this.notInLinks}`));
    $("copy-command").addEventListener("click", () => app.copy(command(app.state), "Command copied"));
  }

  /** What a link does not carry. */
  private get notInLinks(): string {
    const { scene, env } = this.app.state;
    const files = [...(SCENES.includes(scene) ? [] : [scene]), ...(isBuiltinProbe(env) ? [] : [env])].map(fileName);
    return files.length ? `; it names ${files.join(" and ")}, to be dropped there` : "";
  }

  /** The picture as the bytes of a file. */
  async file(kind: "exr" | "png"): Promise<Uint8Array> {
    const { engines, state } = this.app;
    const { scene, env, spp, seed } = state, settings = JSON.stringify({ ...this.settings(state.strategy), shard: [0, 1] });
    const automatic = (await engines.call("automaticExposure", settings)) as number;
    await engines.gather(this.jobs[0]);
    if (kind === "png") return engines.call("png", state.exposure ?? automatic, state.curve) as Promise<Uint8Array>;
    return engines.call("exr", JSON.stringify({ scene: fileName(scene), environment: fileName(env), samples: spp, seed, exposure: automatic })) as Promise<Uint8Array>;
  }

  private async save(kind: "exr" | "png") {
    if (this.preview || !this.jobs.length) return;
    try {
      save(`domelight.${kind}`, await this.file(kind));
      this.app.tell(`Saved domelight.${kind}`);
    } catch (error) {
      this.app.tell((error as Error).message, true);
    }
  }
}

/** Redraws canvases when the theme changes. */
export const themed = (draw: () => void) => matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
export { color };
