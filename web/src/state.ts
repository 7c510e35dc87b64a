// What the page shows, in the URL's hash and as the program's command line.

import type { Camera } from "./engines";

export interface State {
  panel: string;
  scene: string;
  material: string;
  ground: boolean;
  hide: boolean;
  env: string;
  rows: number;
  rotate: number;
  ev: number;
  size: number;
  spp: number;
  seed: number;
  strategy: string;
  /** The strategy on the right; empty for one picture. */
  beside: string;
  /** What both have as much of: rays or time. */
  equal: string;
  camera: Camera | null;
  exposure: number | null;
  curve: string;
  /** What is shown: the picture, or its error against a reference. */
  view: string;
  mapping: string;
  method: string;
  /** Variance minimization gives up the rectangles of its cuts. */
  refine: boolean;
  lights: number;
  sun: boolean;
  lamps: number;
  pixel: number[] | null;
  step: number;
}

export const DEFAULT: State = {
  panel: "picture", scene: "statue", material: "", ground: false, hide: false,
  env: "sky", rows: 256, rotate: 125, ev: 0, size: 640, spp: 32, seed: 0,
  strategy: "product:8", beside: "", equal: "rays", camera: null, exposure: null, curve: "agx", view: "picture",
  mapping: "lat-long", method: "variance-minimization", refine: true, lights: 64, sun: false, lamps: 0, pixel: null, step: 1,
};

/** What differs from the defaults, as text after `#`. */
export function toHash(state: State): string {
  const parts = new URLSearchParams();
  for (const [key, value] of Object.entries(state)) {
    const fallback = DEFAULT[key as keyof State];
    if (JSON.stringify(value) === JSON.stringify(fallback)) continue;
    parts.set(key, typeof value === "string" ? value : JSON.stringify(value));
  }
  return parts.toString();
}

/** The state of a hash; what is not understood stays at its default. */
export function fromHash(hash: string): State {
  const state: Record<string, unknown> = { ...DEFAULT };
  for (const [key, text] of new URLSearchParams(hash.replace(/^#/, ""))) {
    if (!(key in DEFAULT)) continue;
    const fallback = DEFAULT[key as keyof State];
    if (typeof fallback === "string") {
      state[key] = text;
      continue;
    }
    try {
      const value = JSON.parse(text);
      if (isOfKind(key, value, fallback)) state[key] = value;
    } catch { /* Not JSON: the default. */ }
  }
  const clamp = (key: "size" | "spp" | "rows" | "lights", most: number) => {
    state[key] = Math.min(Math.max(1, Math.round(state[key] as number)), most);
  };
  clamp("size", 2048);
  clamp("spp", 1 << 16);
  clamp("rows", 4096);
  clamp("lights", 4096);
  return state as unknown as State;
}

function isOfKind(key: string, value: unknown, fallback: unknown): boolean {
  const numbers = (x: unknown, n: number) => Array.isArray(x) && x.length === n && x.every((c) => Number.isFinite(c));
  if (key === "pixel") return numbers(value, 2);
  if (key === "exposure") return Number.isFinite(value);
  if (key === "camera") {
    const camera = value as Camera | null;
    return !!camera && numbers(camera.origin, 3) && numbers(camera.target, 3) && numbers(camera.up, 3);
  }
  return typeof value === typeof fallback && (typeof value !== "number" || Number.isFinite(value));
}

const quoted = (word: string) => (/^[\w@%+=:,./-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`);

/** The command that renders the same picture. */
export function command(state: State): string {
  const words = ["domelight", "render", state.scene, "--env", state.env];
  const option = (name: string, value: string) => words.push(`--${name}=${value}`);
  if (isBuiltinProbe(state.env)) option("env-rows", String(state.rows));
  if (state.rotate || state.scene === "statue") option("env-rotate", String(state.rotate));
  if (state.ev) option("env-exposure", String(state.ev));
  if (state.material) option("material", state.material);
  if (state.ground) words.push("--ground");
  if (state.hide) words.push("--hide-env");
  option("size", `${state.size}x${state.size}`);
  if (state.camera) {
    const { origin, target, up, fov, ortho } = state.camera;
    option("origin", origin.join(","));
    option("target", target.join(","));
    option("up", up.join(","));
    if (ortho !== null) option("ortho", String(ortho));
    else if (fov !== null) option("fov", String(fov));
  }
  option("strategy", state.strategy);
  option("spp", String(state.spp));
  option("passes", "doubling");
  if (state.seed) option("seed", String(state.seed));
  words.push("-o", "domelight.exr", "-o", "domelight.png");
  return words.map(quoted).join(" ");
}

export const PROBES = ["sky", "studio", "cathedral", "constant"];
export const SCENES = ["statue", "spheres", "material-ball", "sphere", "sphere-orthographic"];
export const isBuiltinProbe = (name: string) => PROBES.includes(name);
