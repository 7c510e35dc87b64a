// What all panels share: the engines, the state, and what is loaded.

import { $, latest } from "./dom";
import type { Camera, Engines, Host } from "./engines";
import { fromHash, isBuiltinProbe, toHash, type State } from "./state";

export interface SceneReport {
  triangles: number;
  warnings: string[];
  camera: Camera;
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

/** Files that are too large for an instance of WebAssembly with what is made of them. */
const MAX_FILES = 1 << 30;

export class App {
  state: State;
  scene: SceneReport | null = null;
  probe: ProbeReport | null = null;
  /** Names of dropped files that can be a scene or a probe. */
  files = { scenes: [] as string[], probes: [] as string[] };
  /** What was dropped with the scene and with the probe. */
  private drops = { scene: [] as Contents, probe: [] as Contents };
  /** What was loaded last without an error. */
  private good: { state: State; files: App["files"]; drops: App["drops"]; loaded: App["loaded"] } | null = null;
  private listeners: ((what: Change) => void)[] = [];
  private hashTimer = 0;
  private loaded = { scene: "", env: "", rotate: NaN };

  constructor(readonly engines: Engines) {
    this.state = fromHash(location.hash);
    engines.onRestart = () => {
      this.loaded = { scene: "", env: "", rotate: NaN };
      void this.provide().then(() => this.load());
    };
    addEventListener("hashchange", () => {
      if (location.hash.replace(/^#/, "") === toHash(this.state)) return;
      this.state = fromHash(location.hash);
      this.emit("all");
      this.load();
    });
  }

  on(listener: (what: Change) => void) {
    this.listeners.push(listener);
  }

  emit(what: Change) {
    this.listeners.forEach((listener) => listener(what));
  }

  /** Changes the state; what must be loaded again is. */
  set(change: Partial<State>, what: Change = "render") {
    Object.assign(this.state, change);
    clearTimeout(this.hashTimer);
    this.hashTimer = setTimeout(() => history.replaceState(null, "", `#${toHash(this.state)}`), 200) as unknown as number;
    if (["scene", "material", "ground", "env", "rows", "rotate", "ev"].some((key) => key in change)) this.load();
    else this.emit(what);
  }

  /** Loads what the state names and is not loaded yet, then says so. */
  readonly load = latest(async () => {
    const { scene, material, ground, env, rows, rotate, ev } = this.state;
    const sceneKey = JSON.stringify({ scene, material, ground });
    const envKey = JSON.stringify({ probe: env, rows, exposure: ev });
    let what: Change = "render";
    try {
      if (this.loaded.scene !== sceneKey) {
        this.scene = JSON.parse(await this.engines.all("loadScene", sceneKey));
        this.loaded.scene = sceneKey;
        what = "scene";
        if (this.scene!.warnings.length) this.tell(this.scene!.warnings.join("; "));
      }
      if (this.loaded.env !== envKey) {
        const light = { ...JSON.parse(envKey), rotate, scale: 1 };
        this.probe = JSON.parse(await this.engines.all("loadEnvironment", JSON.stringify(light)));
        this.loaded.env = envKey;
        this.loaded.rotate = rotate;
        if (what === "render") what = "light";
        if (this.probe!.warnings.length) this.tell(this.probe!.warnings.join("; "));
      } else if (this.loaded.rotate !== rotate) {
        await this.engines.all("turnEnvironment", rotate);
        this.loaded.rotate = rotate;
        if (what === "render") what = "turn";
      }
    } catch (error) {
      await this.goBack();
      this.tell((error as Error).message, true);
      return;
    }
    this.good = { state: { ...this.state }, files: this.files, drops: this.drops, loaded: { ...this.loaded } };
    this.emit(what);
  });

  /** After a file that cannot be loaded: what the engines still have. */
  private async goBack() {
    const { good, state } = this;
    if (!good || (good.drops === this.drops && good.state.scene === state.scene && good.state.env === state.env)) return;
    const { scene, material, camera, pixel, env, rotate, ev, exposure } = good.state;
    Object.assign(state, { scene, material, camera, pixel, env, rotate, ev, exposure });
    this.files = good.files;
    this.drops = good.drops;
    this.loaded = { ...good.loaded };
    await this.provide();
    this.emit("files");
  }

  tell(text: string, isError = false) {
    const status = $("status");
    status.textContent = text;
    status.classList.toggle("error", isError);
  }

  /** An engine for a reference, with what is loaded. */
  async reference(): Promise<Host> {
    const [host, isNew] = this.engines.reference();
    if (isNew && this.loaded.scene && this.loaded.env) {
      const { scene, env, rotate } = this.loaded;
      // All are sent before anything else is: an engine answers in order.
      const files = this.contents().map(({ path, bytes }) => host.call("addFile", path, bytes));
      const light = { ...JSON.parse(env), rotate, scale: 1 };
      await Promise.all([...files, host.call("loadScene", scene), host.call("loadEnvironment", JSON.stringify(light))]);
    }
    return host;
  }

  /** All files that scene and probe may want. */
  private contents(): Contents {
    const { scene, probe } = this.drops;
    return scene === probe ? scene : [...scene, ...probe];
  }

  /** Gives the engines the dropped files. */
  private async provide() {
    await this.engines.all("clearFiles");
    for (const { path, bytes } of this.contents()) await this.engines.all("addFile", path, bytes);
  }

  /** Takes files over and shows the first scene and the first probe among them. */
  async open(files: { path: string; file: File }[]) {
    const total = files.reduce((sum, { file }) => sum + file.size, 0);
    if (total > MAX_FILES) {
      this.tell(`${(total / 2 ** 30).toFixed(1)} GiB are more than this page can hold; 1 GiB is the most. Use the program`, true);
      return;
    }
    this.tell("Reading …");
    const isScene = (path: string) => /\.(glb|gltf|obj|ply|stl|off|toml)$/i.test(path);
    const isProbe = (path: string) => /\.(hdr|exr|pfm|pic|rgbe)$/i.test(path);
    const paths = files.map(({ path }) => path);
    const scenes = paths.filter(isScene), probes = paths.filter(isProbe);
    if (!scenes.length && !probes.length) {
      this.tell(`${paths[0] ?? "nothing"} is neither a scene (GLB, glTF, OBJ, PLY, STL, OFF, TOML) nor a light probe (HDR, EXR, PFM)`, true);
      return;
    }
    const contents = await Promise.all(files.map(async ({ path, file }) => ({ path, bytes: new Uint8Array(await file.arrayBuffer()) })));
    // A probe that is dropped leaves the scene's files, and a scene the probe's.
    this.drops = { scene: scenes.length ? contents : this.drops.scene, probe: probes.length ? contents : this.drops.probe };
    this.files = { scenes: scenes.length ? scenes : this.files.scenes, probes: probes.length ? probes : this.files.probes };
    this.loaded = { scene: scenes.length ? "" : this.loaded.scene, env: probes.length ? "" : this.loaded.env, rotate: this.loaded.rotate };
    try {
      await this.provide();
    } catch (error) {
      this.tell((error as Error).message, true);
      return;
    }
    const change: Partial<State> = {
      ...(scenes.length ? { scene: scenes[0], camera: null, material: "", pixel: null } : {}),
      ...(probes.length ? { env: probes[0], rotate: 0, ev: 0, exposure: null } : {}),
    };
    Object.assign(this.state, change);
    this.emit("files");
    this.set(change);
  }

  get envName() {
    return isBuiltinProbe(this.state.env) ? this.state.env : this.state.env.split("/").pop()!;
  }

  /** The pixel that was picked, for the engine. */
  pixel(): string | null {
    const { pixel, size, camera } = this.state;
    if (!pixel || pixel[0] >= size || pixel[1] >= size) return null;
    return JSON.stringify({ x: Math.floor(pixel[0]), y: Math.floor(pixel[1]), width: size, height: size, camera });
  }
}

/** What has changed, from most to least. */
export type Change = "all" | "files" | "scene" | "light" | "turn" | "render" | "camera" | "view" | "pixel" | "panel";
