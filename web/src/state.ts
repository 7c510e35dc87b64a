// The page's state, in the URL's hash and as the program's command line.

import { $ } from "./dom";
import type { Camera } from "./engines";
import { STEPS } from "./steps";
import { CURVES } from "./tone";

export interface State {
  panel: string;
  scene: string;
  material: string;
  /** Single materials of the scene by their index, which `material` leaves alone. */
  materials: Record<string, string>;
  ground: boolean;
  hide: boolean;
  env: string;
  rows: number;
  /** How many columns and rows of a file's map become one, where the map is too large for the page. */
  reduce: number;
  rotate: number;
  ev: number;
  /** A factor on the light. */
  scale: number;
  size: number;
  spp: number;
  seed: number;
  strategy: string;
  /** The strategy on the right; empty for one picture. */
  beside: string;
  /** The budget that both strategies share: rays or time. */
  equal: string;
  camera: Camera | null;
  exposure: number | null;
  curve: string;
  /** The displayed quantity: the picture, or its error against a reference. */
  view: string;
  mapping: string;
  /** The overlay on the map, see `LAYERS`; empty for none. */
  layer: string;
  /** The number of camera samples whose rays are drawn on the map, as a power of two's exponent. */
  samples: number;
  method: string;
  /** Whether variance minimization refines its rectangles. */
  refine: boolean;
  lights: number;
  sun: boolean;
  lamps: number;
  /** Whether light outside compact sources stays on the map. */
  leave: boolean;
  /** The exponent of the lobe of the spheres' surface; 0 is matte. */
  gloss: number;
  pixel: number[] | null;
  /** The strategies that the X-ray compares with the picture's, separated by spaces. */
  compared: string;
  step: number;
  /** The values of the lecture figure's controls, separated by semicolons; empty values mean the defaults. */
  figure: string;
}

export const DEFAULT: State = {
  panel: "picture", scene: "statue", material: "", materials: {}, ground: false, hide: false,
  env: "sky", rows: 256, reduce: 1, rotate: 125, ev: 0, scale: 1, size: 640, spp: 32, seed: 0,
  strategy: "product:8", beside: "", equal: "rays", camera: null, exposure: null, curve: "agx", view: "picture",
  mapping: "lat-long", layer: "", samples: 4, method: "variance-minimization", refine: true, lights: 64, sun: false, lamps: 0, leave: false, gloss: 0,
  pixel: null, compared: "brdf:1 environment:1 mis:1:1 product:8", step: 1, figure: "",
};

/** The mappings of the map, and their names. */
export const MAPPINGS: [string, string][] = [
  ["lat-long", "latitude and longitude"], ["angular", "angular, light probe"], ["mirror-ball", "mirror ball"],
  ["octahedral", "octahedral"], ["cross-horizontal", "cube, horizontal cross"], ["cross-vertical", "cube, vertical cross"], ["strip-horizontal", "cube, strip"],
];

const optionsOf = (id: string) => [...$<HTMLSelectElement>(id).options].map(({ value }) => value);

export const PANELS = ["picture", "map", "xray", "lights", "lecture"];

/** The texts that the state may have where only a few are possible. */
const CHOICES: Partial<Record<keyof State, readonly string[]>> = {
  panel: PANELS, curve: CURVES, mapping: MAPPINGS.map(([name]) => name),
  equal: optionsOf("equal"), view: optionsOf("view"), layer: optionsOf("layer"), method: optionsOf("method"),
};

/** The differences to the defaults, as text after `#`. */
export function toHash(state: State): string {
  const parts = new URLSearchParams();
  for (const [key, value] of Object.entries(state)) {
    const fallback = DEFAULT[key as keyof State];
    if (JSON.stringify(value) === JSON.stringify(fallback)) continue;
    parts.set(key, typeof value === "string" ? value : JSON.stringify(value));
  }
  return parts.toString();
}

/** Parses the state from a hash. Invalid parts keep their defaults and are returned as `wrong`. */
export function fromHash(hash: string): { state: State; wrong: string[] } {
  const state: Record<string, unknown> = { ...DEFAULT }, wrong: string[] = [];
  for (const [key, text] of new URLSearchParams(hash.replace(/^#/, ""))) {
    const value = Object.hasOwn(DEFAULT, key) ? parsed(key as keyof State, text) : undefined;
    if (value === undefined) wrong.push(`${key}=${text}`);
    else state[key] = value;
  }
  const clamp = (key: "size" | "spp" | "seed" | "rows" | "lights" | "samples" | "lamps" | "gloss" | "step", most: number, least = 1) => {
    const given = state[key] as number;
    state[key] = Math.min(Math.max(least, Math.round(given)), most);
    if (state[key] !== given) wrong.push(`${key}=${given}`);
  };
  clamp("size", 2048);
  clamp("spp", 1 << 16);
  clamp("seed", Number.MAX_SAFE_INTEGER, 0);
  clamp("rows", 4096);
  clamp("lights", 4096);
  clamp("samples", 8, 0);
  clamp("lamps", 4096, 0);
  clamp("gloss", 100, 0);
  clamp("step", STEPS.length);
  if (![1, 2, 4, 8].includes(state.reduce as number)) {
    wrong.push(`reduce=${state.reduce}`);
    state.reduce = 1;
  }
  if (!((state.scale as number) >= 0)) {
    wrong.push(`scale=${state.scale}`);
    state.scale = 1;
  }
  return { state: state as unknown as State, wrong };
}

/** A part of the state from its text; undefined if it is none. */
function parsed(key: keyof State, text: string): unknown {
  const fallback = DEFAULT[key];
  if (typeof fallback === "string") return CHOICES[key]?.includes(text) ?? true ? text : undefined;
  try {
    const value = JSON.parse(text);
    return isOfKind(key, value, fallback) ? value : undefined;
  } catch {
    return undefined;
  }
}

function isOfKind(key: string, value: unknown, fallback: unknown): boolean {
  const numbers = (x: unknown, n: number) => Array.isArray(x) && x.length === n && x.every((c) => Number.isFinite(c));
  if (key === "pixel") return numbers(value, 2);
  if (key === "exposure") return Number.isFinite(value);
  if (key === "materials") {
    return !!value && typeof value === "object" && Object.entries(value).every(([index, text]) => /^\d{1,9}$/.test(index) && typeof text === "string");
  }
  if (key === "camera") {
    const camera = value as Camera | null;
    return !!camera && numbers(camera.origin, 3) && numbers(camera.target, 3) && numbers(camera.up, 3)
      && [camera.fov, camera.ortho].some(Number.isFinite);
  }
  return typeof value === typeof fallback && (typeof value !== "number" || Number.isFinite(value));
}

export const quoted = (word: string) => (/^[\w@%+=:,./-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`);

/** A file's name as a word of a command, where it must not look like an option. */
export const fileWord = (name: string) => (name.startsWith("-") ? `./${name}` : name);

/** The light as the program's commands about maps take it, word by word. */
export function lightWords({ env, rows, rotate, scale, ev }: State): string[] {
  return [fileWord(env), ...(isBuiltinProbe(env) ? [`--env-rows=${rows}`] : []), ...(rotate ? [`--env-rotate=${rotate}`] : []),
    ...(scale === 1 ? [] : [`--env-scale=${scale}`]), ...(ev ? [`--env-exposure=${ev}`] : [])];
}

/** The command that renders the same picture, word by word. */
export function commandWords(state: State): string[] {
  const words = ["domelight", "render", fileWord(state.scene), "--env", fileWord(state.env)];
  const option = (name: string, value: string) => words.push(`--${name}=${value}`);
  if (isBuiltinProbe(state.env)) option("env-rows", String(state.rows));
  if (state.rotate || state.scene === "statue") option("env-rotate", String(state.rotate));
  if (state.ev) option("env-exposure", String(state.ev));
  if (state.scale !== 1) option("env-scale", String(state.scale));
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
  if (state.exposure !== null) option("exposure", String(state.exposure));
  if (state.curve !== "agx") option("tone", state.curve);
  words.push("-o", "domelight.exr", "-o", "domelight.png");
  return words.map(quoted);
}
export const command = (state: State) => commandWords(state).join(" ");

export const PROBES = ["sky", "studio", "cathedral", "constant"];
export const SCENES = ["statue", "spheres", "material-ball", "room", "sphere", "sphere-orthographic"];
export const isBuiltinProbe = (name: string) => PROBES.includes(name);

/** The address of this page for other people: the one that was built in, or where the page is. */
export function addressOf(state: State, query = ""): string {
  const base = document.querySelector<HTMLMetaElement>("meta[name=base]")!.content || location.href.replace(/[?#].*/, "");
  return `${base}${query}#${toHash(state)}`;
}

/** The last part of a path. */
export const fileName = (path: string) => path.split("/").pop()!;
