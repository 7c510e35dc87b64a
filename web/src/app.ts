// Shared by all panels: the engines, the state, and the loaded scene and light.

import { $, h, latest } from "./dom";
import type { Camera, Engines, Host } from "./engines";
import { History } from "./history";
import * as native from "./native";
import { DEFAULT, SCENES, fileName, fromHash, isBuiltinProbe, toHash, type State } from "./state";

export interface SceneReport {
  triangles: number;
  warnings: string[];
  camera: Camera;
  cameras: { name: string; camera: Camera }[];
  /** The materials that it uses; `text` is empty where the notation has no such material. */
  materials: { index: number; name: string; text: string }[];
  center: number[];
  radius: number;
  up: number[];
  environment: { probe: string; rotate: number; scale: number; exposure: number } | null;
}

export interface ProbeReport {
  size: [number, number];
  warnings: string[];
}

type Contents = { path: string; bytes: Uint8Array }[];

/** A configuration whose map is too large, and the sizes at which it fits, the largest first. */
interface Offer {
  state: State;
  files: App["files"];
  drops: { scene: Contents; probe: Contents };
  sizes: { reduce: number; size: [number, number] }[];
}

const LOADING = "Loading …";

/** The maximum total size of files [bytes]: WebAssembly must also hold the data decoded from them. */
const MAX_FILES = 1 << 30;
/** The memory of an engine without files [bytes], and the memory of loaded files relative to their size: an initial
 *  guess, replaced by measurements. */
const ENGINE_MEMORY = 40 * 2 ** 20, DECODED = 8;

const isScene = (path: string) => /\.(glb|gltf|obj|ply|stl|off|toml)$/i.test(path);
const isProbe = (path: string) => /\.(hdr|exr|pfm|pic|rgbe)$/i.test(path);

/** The engine's settings of a light. */
const withTurn = (env: string, rotate: number) => JSON.stringify({ ...JSON.parse(env), rotate });

export class App {
  state: State;
  scene: SceneReport | null = null;
  probe: ProbeReport | null = null;
  /** Names of the scene and probe files that were dropped, or that the program opens. */
  files = { scenes: native.files?.filter(isScene) ?? [], probes: native.files?.filter((path) => !isScene(path)) ?? [] };
  /** The files dropped with the scene and with the probe. */
  private drops = { scene: [] as Contents, probe: [] as Contents };
  /** The last configuration that loaded without errors. */
  private good: { state: State; files: App["files"]; drops: App["drops"]; loaded: App["loaded"] } | null = null;
  private listeners: ((what: Change) => void)[] = [];
  private hashTimer = 0;
  private loaded = { scene: "", env: "", rotate: NaN };
  /** The drops that the engines hold, and the drops with measured memory use. */
  private provided: App["drops"] | null = null;
  private measured: App["drops"] | null = null;
  /** Whether another page shows a step of the lecture alone: `?embed=step`. */
  readonly embeds = document.documentElement.dataset.embed === "step";
  /** Counts the changes of the dropped files. */
  revision = 0;
  /** Counts the lights that the engines have held. */
  lightRevision = 0;
  /** What the reference's engine holds. */
  private held: { host: Host | null; drops: App["drops"] | null; scene: string; env: string; rotate: number } = { host: null, drops: null, scene: "", env: "", rotate: NaN };
  /** Whether to adopt the light of the next loaded scene. */
  private adopts = false;

  constructor(readonly engines: Engines) {
    this.state = this.fromAddress();
    this.history = new History(this.state);
    engines.onRestart = () => {
      this.loaded = { scene: "", env: "", rotate: NaN };
      void this.provide().then(() => this.load());
    };
    engines.onChanged = () => this.reload();
    engines.onLost = (why) => this.tell(why, true);
    this.adoptFromProgram();
    addEventListener("hashchange", () => {
      this.address = location.hash;
      if (location.hash.replace(/^#/, "") === toHash(this.state)) return;
      this.state = this.fromAddress();
      this.history.note(this.state);
      this.forgetError();
      this.emit("all");
      this.load(true);
    });
  }

  /** Without a light in the address, a file that the program opens brings its own, or stands under the sky as it is. */
  private adoptFromProgram() {
    const given = new URLSearchParams(location.hash.replace(/^#/, ""));
    if (!native.files?.includes(this.state.scene) || ["env", "rotate", "scale", "ev"].some((key) => given.has(key))) return;
    this.state.rotate = 0;
    this.adopts = true;
  }

  /** Loads the files that the program opens again. The camera and the exposure stay. */
  private reload() {
    this.revision++;
    this.loaded = { scene: "", env: "", rotate: NaN };
    this.held.host = null;
    this.forgetError();
    this.load();
  }

  /** The part of the address that the state was read from or written to. */
  private address = location.hash;

  /** The state in the address; what is wrong there is said. */
  private fromAddress(): State {
    const { state, wrong } = fromHash(location.hash);
    if (this.embeds) state.panel = "lecture";
    this.tellWrong(wrong);
    return state;
  }

  /** The parts of the link that are not understood. */
  private wrong: string[] = [];

  private tellWrong(parts: string[]) {
    this.wrong = parts;
    const notice = $("wrong");
    notice.hidden = !parts.length;
    const shortened = parts.map((part) => (part.length > 60 ? `${part.slice(0, 57)}…` : part));
    notice.textContent = `This link has parts that this page does not know: ${shortened.join(", ")}. The defaults are shown in their place.`;
  }

  /** Replaces a part of the state that the engine refuses by its default. */
  replace(key: "strategy" | "beside") {
    const wrong = [...this.wrong, `${key}=${this.state[key]}`];
    this.set({ [key]: DEFAULT[key] });
    this.tellWrong(wrong);
  }

  on(listener: (what: Change) => void) {
    this.listeners.push(listener);
  }

  emit(what: Change) {
    this.listeners.forEach((listener) => listener(what));
  }

  /** Restores the state before the last change, or after the last one that was undone. */
  undo() {
    this.restore(this.history.undo());
  }
  redo() {
    this.restore(this.history.redo());
  }
  readonly history: History;

  /** Shows another state, as a link to it would. */
  private restore(state: State | null) {
    if (!state) return;
    this.state = state;
    this.forgetError();
    this.keepInAddress();
    this.emit("all");
    this.load(true);
  }

  /** The state in which the lecture was left for a panel that shows its situation. */
  left: State | null = null;

  /** Shows a step's situation in another panel; `comeBack` returns to the step and to what was there before. */
  leaveFor(change: Partial<State>) {
    this.left = { ...this.state };
    this.go({ ...this.state, ...change });
  }
  comeBack() {
    if (this.left) this.go(this.left);
    this.left = null;
    this.emit("panel");
  }

  /** Shows another state; the browser's Back leads to the one before. */
  private go(state: State) {
    history.pushState(null, "", `#${toHash(state)}`);
    this.address = location.hash;
    this.history.note(state);
    this.restore(state);
  }

  /** Changes the state, and reloads scene and light if necessary. */
  set(change: Partial<State>, what: Change = "render") {
    Object.assign(this.state, change);
    this.history.note(this.state);
    this.forgetError();
    $("wrong").hidden = true;
    if ("env" in change || "scene" in change || "reduce" in change) $("smaller").hidden = true;
    // The browser's Back leads to the last panel or step.
    const hash = `#${toHash(this.state)}`;
    if (("panel" in change || "step" in change) && hash !== location.hash) {
      history.pushState(null, "", hash);
      this.address = location.hash;
    } else this.keepInAddress();
    if (["scene", "material", "materials", "ground", "env", "rows", "reduce", "rotate", "ev", "scale"].some((key) => key in change)) this.load();
    else this.emit(what);
  }

  private keepInAddress() {
    clearTimeout(this.hashTimer);
    this.hashTimer = setTimeout(() => {
      // An address that somebody has changed meanwhile is about to be read.
      if (location.hash !== this.address) return;
      history.replaceState(null, "", `#${toHash(this.state)}`);
      this.address = location.hash;
    }, 200) as unknown as number;
  }

  /** The files named by the state that have not been dropped yet. */
  get missing(): { scene: string; env: string } {
    const { scene, env } = this.state;
    const has = (name: string) => this.contents().some(({ path }) => fileName(path) === fileName(name)) || this.isOpened(name);
    return { scene: SCENES.includes(scene) || has(scene) ? "" : scene, env: isBuiltinProbe(env) || has(env) ? "" : env };
  }

  /** Whether the program opens a file: one that was named to it, or the light that such a scene names. */
  private isOpened(name: string): boolean {
    return !!native.files && (native.files.includes(name) || name === this.scene?.environment?.probe);
  }

  /** The state's camera; null while its scene is missing. */
  get camera(): Camera | null {
    return this.missing.scene ? null : this.state.camera;
  }

  /** The engine's settings for scene and light, with stand-ins for missing files. */
  private keys() {
    const { material, materials, ground, rows, reduce, rotate, ev, scale } = this.state, { missing } = this;
    const scene = missing.scene ? DEFAULT.scene : this.state.scene, probe = missing.env ? DEFAULT.env : this.state.env;
    return { scene: JSON.stringify({ scene, material, materials: missing.scene ? {} : materials, ground }), env: JSON.stringify({ probe, rows, reduce: isBuiltinProbe(probe) ? 1 : reduce, exposure: ev, scale }), rotate };
  }

  /** Whether the engines hold the state's light, and its scene, too. */
  get holdsLight(): boolean {
    return this.loaded.env === this.keys().env && this.loaded.rotate === this.state.rotate;
  }
  get holdsAll(): boolean {
    return this.holdsLight && this.loaded.scene === this.keys().scene;
  }

  /** Whether another change follows, when scene and light of a new state are loaded. */
  waits(what: Change): boolean {
    return what === "all" && !this.holdsAll;
  }

  /** Loads the parts of the state that are not loaded yet, then notifies the panels. If they know of the state, what
   *  they need not wait for is done. */
  readonly load = latest(async (isKnown = false) => {
    let what: Change = "render";
    // What takes long is said before it has taken a fifth of a second.
    const busy = setTimeout(() => this.progress(LOADING), 150);
    try {
      const { scene, env } = this.keys();
      if (this.loaded.scene !== scene || this.loaded.env !== env) what = await this.loadWhatFits();
      const { rotate } = this.state;
      if (this.loaded.rotate !== rotate) {
        await this.engines.all("turnEnvironment", rotate);
        this.loaded.rotate = rotate;
        this.lightRevision++;
        if (what === "render") what = "turn";
      }
    } catch (error) {
      const offer = await this.smallerMaps();
      await this.goBack();
      this.tell((error as Error).message, true);
      this.offerSmaller(offer);
      // A link with a bad material shows the scene's own.
      if (!this.good && (this.state.material || Object.keys(this.state.materials).length)) {
        Object.assign(this.state, { material: "", materials: {} });
        this.load();
      }
      if (isKnown) this.emit("render");
      return;
    } finally {
      clearTimeout(busy);
      if ($("status").textContent === LOADING) this.tell("");
    }
    this.good = { state: { ...this.state }, files: this.files, drops: this.drops, loaded: { ...this.loaded } };
    this.tellMissing();
    this.tellWarnings();
    if (what !== "render" || !isKnown) this.emit(what);
  });

  /** Loads scene and light into as many engines as fit into memory. */
  private async loadWhatFits(): Promise<Change> {
    const { engines } = this, all = engines.hosts.length;
    const bytes = this.contents().reduce((sum, { bytes }) => sum + bytes.length, 0);
    // One engine more renders references.
    // Of a map that is too large as a whole, the size of the file says little.
    const isSmall = this.state.reduce === 1 && (all + 1) * (ENGINE_MEMORY + DECODED * bytes) <= engines.memory;
    const isMeasured = isSmall || this.measured === this.drops;
    const fresh = engines.use(isSmall ? all : isMeasured ? engines.active : 1);
    if (fresh.length) this.loaded = { scene: "", env: "", rotate: NaN };
    if (this.provided !== this.drops || fresh.length) await this.provide();
    const what = await this.loadInto(engines.working);
    if (isMeasured) return what;
    // The first engine shows how much memory each needs; a reference needs one more engine.
    this.measured = this.drops;
    const more = engines.use(Math.min(Math.max(Math.floor(engines.memory / engines.hosts[0].memory) - 1, 1), all));
    await this.provide(more);
    const { scene, env, rotate } = this.loaded;
    await Promise.all(more.flatMap((host) => [host.call("loadScene", scene), host.call("loadEnvironment", withTurn(env, rotate))]));
    return what;
  }

  /** Loads the new scene or light into engines that have the files, and returns the change. */
  private async loadInto(hosts: Host[]): Promise<Change> {
    const { rotate } = this.state, { scene } = this.keys();
    let what: Change = "render";
    const all = async (call: "loadScene" | "loadEnvironment", settings: string) =>
      JSON.parse((await Promise.all(hosts.map((host) => host.call(call, settings))))[0]);
    if (this.loaded.scene !== scene) {
      this.scene = (await all("loadScene", scene)) as SceneReport;
      this.loaded.scene = scene;
      what = "scene";
      this.adopt(this.scene);
    }
    const { env } = this.keys();
    if (this.loaded.env !== env) {
      this.probe = (await all("loadEnvironment", withTurn(env, rotate))) as ProbeReport;
      this.loaded = { ...this.loaded, env, rotate };
      this.lightRevision++;
      if (what === "render") what = "light";
    }
    return what;
  }

  /** Adopts the light named by a dropped scene. */
  private adopt({ environment }: SceneReport) {
    if (this.adopts && environment) {
      const { probe, rotate, scale, exposure } = environment;
      Object.assign(this.state, { env: probe, reduce: 1, rotate, scale, ev: exposure });
      this.keepInAddress();
    }
    if (this.adopts) this.emit("files");
    this.adopts = false;
  }

  /** Shows what was repaired or left out of the scene and the light. */
  private tellWarnings() {
    const warnings = [...this.scene?.warnings ?? [], ...this.probe?.warnings ?? []];
    $("warnings").hidden = !warnings.length;
    $("warnings").querySelector("ul")!.replaceChildren(...warnings.map((warning) => h("li", {}, warning)));
  }

  /** Shows which files a link needs. */
  private tellMissing() {
    const names = Object.values(this.missing).filter(Boolean).map(fileName);
    const wanted = $("wanted");
    wanted.hidden = !names.length;
    if (names.length) wanted.textContent = `This link contains no files: drop ${names.join(" and ")} here. Until then the page shows ${this.missing.scene ? DEFAULT.scene : this.state.scene} under ${this.missing.env ? DEFAULT.env : this.envName}.`;
  }

  /** What failed to load, if its map fits at a smaller size. */
  private async smallerMaps(): Promise<Offer | null> {
    const { state, files, drops } = this;
    if (isBuiltinProbe(state.env) || this.missing.env || this.loaded.env === this.keys().env) return null;
    const all = JSON.parse(await this.engines.call("smallerMaps", state.env).catch(() => "[]")) as Offer["sizes"];
    const sizes = all.filter(({ reduce }) => reduce > state.reduce);
    return sizes.length ? { state: { ...state }, files, drops, sizes } : null;
  }

  /** Offers a map at the sizes at which it fits. */
  private offerSmaller(offer: Offer | null) {
    const notice = $("smaller");
    notice.hidden = !offer;
    if (!offer) return;
    const { state: { env }, sizes } = offer, size = ({ size: [width, height] }: Offer["sizes"][0], by = 1) => `${by * width} × ${by * height}`;
    const buttons = sizes.slice(0, 2).map((smaller) => {
      const name = { 2: "Half", 4: "A quarter", 8: "An eighth" }[smaller.reduce];
      const button = h("button", { type: "button" }, `${name}: ${size(smaller)}`);
      button.addEventListener("click", () => this.take(offer, smaller.reduce));
      return button;
    });
    notice.replaceChildren(h("p", {}, `${fileName(env)} has ${size(sizes[0], sizes[0].reduce)} texels, which this page cannot hold. Averaged, its light stays the same:`), h("div", { class: "row" }, ...buttons));
  }

  /** Loads what failed to load with a smaller map. */
  private take({ state, files, drops }: Offer, reduce: number) {
    const { scene, material, materials, camera, pixel, env, rotate, ev, scale, exposure } = state;
    Object.assign(this.state, { scene, material, materials, camera, pixel, env, rotate, ev, scale, exposure });
    Object.assign(this, { files, drops });
    this.revision++;
    this.emit("files");
    this.tell("Reading …");
    this.set({ reduce });
  }

  /** Restores the last good configuration after a file fails to load. */
  private async goBack() {
    const { good, state } = this;
    this.adopts = false;
    if (!good) return;
    if (good.drops === this.drops && good.state.scene === state.scene && good.state.env === state.env) {
      // Only the material fails. Its text stays in the field, to be corrected.
      Object.assign(state, { material: good.state.material, materials: good.state.materials });
      this.keepInAddress();
      return;
    }
    const { scene, material, materials, camera, pixel, env, reduce, rotate, ev, scale, exposure } = good.state;
    Object.assign(state, { scene, material, materials, camera, pixel, env, reduce, rotate, ev, scale, exposure });
    this.files = good.files;
    this.drops = good.drops;
    this.revision++;
    this.loaded = { ...good.loaded };
    await this.provide();
    this.emit("files");
    // Engines emptied for the failed load restart.
    if (this.engines.active < this.engines.hosts.length && this.measured !== this.drops) this.load();
  }

  tell(text: string, isError = false) {
    const status = $("status");
    status.textContent = text;
    status.classList.toggle("error", isError);
  }

  /** Copies text, and says so. */
  async copy(text: string, told: string) {
    try {
      await navigator.clipboard.writeText(text);
    } catch {
      // Without clipboard permission, use the legacy command.
      const area = document.createElement("textarea");
      area.value = text;
      document.body.append(area);
      area.select();
      document.execCommand("copy");
      area.remove();
    }
    this.tell(told);
  }

  /** Tells the progress of a render, which does not replace an error. */
  progress(text: string) {
    if (!$("status").classList.contains("error")) this.tell(text);
  }

  /** The next progress replaces an error. */
  private forgetError() {
    $("status").classList.remove("error");
  }

  /** An engine for references, with the loaded scene and light. */
  async reference(): Promise<Host> {
    const { scene, env, rotate } = this.loaded;
    if (!scene || !env) throw new Error("the scene is not loaded");
    const host = this.engines.reference();
    const before = this.held.host === host ? this.held : { drops: null, scene: "", env: "", rotate: NaN };
    this.held = { host, drops: this.drops, scene, env, rotate };
    const isSame = before.drops === this.drops;
    // Send all calls first: an engine answers in order.
    const calls: Promise<unknown>[] = isSame ? [] : [host.call("clearFiles"), ...this.contents().map(({ path, bytes }) => host.call("addFile", path, bytes))];
    if (!isSame || before.scene !== scene) calls.push(host.call("loadScene", scene));
    if (!isSame || before.env !== env) calls.push(host.call("loadEnvironment", withTurn(env, rotate)));
    else if (before.rotate !== rotate) calls.push(host.call("turnEnvironment", rotate));
    try {
      await Promise.all(calls);
    } catch (error) {
      this.held.host = null;
      throw error;
    }
    return host;
  }

  /** All files that scene and probe may refer to. */
  private contents(): Contents {
    const { scene, probe } = this.drops;
    return scene === probe ? scene : [...scene, ...probe];
  }

  /** Sends the dropped files to engines. */
  private async provide(hosts = this.engines.working) {
    this.provided = this.drops;
    await Promise.all(hosts.map((host) => host.call("clearFiles")));
    for (const { path, bytes } of this.contents()) await Promise.all(hosts.map((host) => host.call("addFile", path, bytes)));
  }

  /** Opens files, and shows the first scene and the first probe among them. */
  async open(files: { path: string; file: File }[]) {
    const total = files.reduce((sum, { file }) => sum + file.size, 0);
    if (total > MAX_FILES) {
      this.tell(`${(total / 2 ** 30).toFixed(1)} GiB exceed this page’s limit of 1 GiB; ${native.files ? "name the files to domelight view" : "use the program"}`, true);
      return;
    }
    this.tell("Reading …");
    const paths = files.map(({ path }) => path);
    // Scene files come before the meshes that they name.
    const scenes = paths.filter(isScene).sort((a, b) => Number(/\.toml$/i.test(b)) - Number(/\.toml$/i.test(a))), radiance = paths.filter(isProbe);
    // Pictures dropped with a scene are its textures.
    const probes = scenes.length || radiance.length ? radiance : paths.filter((path) => /\.(ktx2|dds|png|jpe?g)$/i.test(path));
    if (!scenes.length && !probes.length) {
      this.tell(`${paths[0] ?? "nothing"} is neither a scene (GLB, glTF, OBJ, PLY, STL, OFF, TOML) nor a light probe (HDR, EXR, PFM, KTX2, DDS, PNG, JPEG)`, true);
      return;
    }
    const contents = await Promise.all(files.map(async ({ path, file }) => ({ path, bytes: new Uint8Array(await file.arrayBuffer()) })));
    const { missing } = this;
    this.revision++;
    // A dropped probe keeps the scene's files, and a dropped scene the probe's.
    this.drops = { scene: scenes.length ? contents : this.drops.scene, probe: probes.length ? contents : this.drops.probe };
    this.files = { scenes: scenes.length ? scenes : this.files.scenes, probes: probes.length ? probes : this.files.probes };
    this.loaded = { scene: scenes.length ? "" : this.loaded.scene, env: probes.length ? "" : this.loaded.env, rotate: this.loaded.rotate };
    const wanted = (paths: string[], name: string) => paths.find((path) => name && fileName(path) === fileName(name));
    // Files that a link was waiting for are shown with the link's settings.
    const [scene, probe] = [wanted(scenes, missing.scene), wanted(probes, missing.env)];
    this.adopts = scenes.length > 0 && !scene;
    const change: Partial<State> = {
      ...(scene ? { scene } : scenes.length ? { scene: scenes[0], camera: null, material: "", materials: {}, pixel: null } : {}),
      ...(probe ? { env: probe } : probes.length ? { env: probes[0], reduce: 1, rotate: 0, ev: 0, scale: 1, exposure: null } : {}),
    };
    Object.assign(this.state, change);
    this.emit("files");
    this.set(change);
  }

  get envName() {
    return fileName(this.state.env);
  }

  /** The picked pixel, as engine settings. */
  pixel(): string | null {
    const { state: { pixel, size }, camera } = this;
    if (!pixel || pixel[0] >= size || pixel[1] >= size) return null;
    return JSON.stringify({ x: Math.floor(pixel[0]), y: Math.floor(pixel[1]), width: size, height: size, camera });
  }
}

/** Kinds of changes, from largest to smallest. */
export type Change = "all" | "files" | "scene" | "light" | "turn" | "render" | "camera" | "view" | "pixel" | "panel";
