/**
 * Light from an HDRI: `load` reads a map, and `lights`, `sg`, `sh`, `ibl` and `render` make of it what programs need.
 *
 * The world is right-handed with +Y up, and colors are linear Rec. 709. Radiance is in the units of the map, called W·m⁻²·sr⁻¹ here.
 * All functions return promises; what goes wrong rejects them with a sentence that says what to do.
 */

import type { Content, MapDescription, MapHandle } from "./calls.js";
import { startEngine, type Engine, type EngineKind } from "./engine.js";
import { bytesOf } from "./source.js";
import type * as t from "./types.js";

export type * from "./types.js";

let configuration: t.Configuration = {};
const engines = new Map<EngineKind, Engine>();

/** An engine, started with its first call and anew after a failure. */
function running(kind: EngineKind): Engine {
  const found = engines.get(kind);
  if (found) return found;
  const { worker = true, [kind]: wasm } = configuration;
  const engine = startEngine({ kind, worker, wasm, onEnd: () => engines.get(kind) === engine && engines.delete(kind) });
  engines.set(kind, engine);
  return engine;
}

/**
 * Chooses how the package works, and ends what runs: maps that were loaded before are lost. To be called before all else; without
 * it, a Worker starts with the first call.
 */
export function configure(options: t.Configuration): void {
  configuration = options;
  const ended = [...engines.values()];
  engines.clear();
  for (const engine of ended) engine.end();
}

/** A map that an engine keeps. */
interface Kept {
  engine: Engine;
  id: number;
}

const free = ({ engine, id }: Kept) => void engine.call("free", [id]).catch(() => {});

/** Frees what engines have of a map that is garbage. */
const garbage = new FinalizationRegistry(free);

/** A map of an engine. */
class LoadedMap implements t.LightMap {
  readonly name: string;
  readonly width: number;
  readonly height: number;
  readonly rotation: number;
  readonly up: "y" | "z";
  readonly warnings: readonly string[];
  readonly #kept: Kept;
  readonly #description: MapDescription;
  /** The same map in the engine that renders. */
  #copy: { engine: Engine; kept: Promise<Kept> } | null = null;

  constructor(engine: Engine, { id, description }: MapHandle) {
    this.#kept = { engine, id };
    this.#description = description;
    [this.name, this.width, this.height] = [description.name, description.width, description.height];
    [this.rotation, this.up, this.warnings] = [description.rotation, description.up, description.warnings];
    garbage.register(this, this.#kept, this);
  }

  get kept(): Kept {
    return this.#kept;
  }

  pixels(): Promise<Float32Array> {
    return this.#kept.engine.call("pixels", [this.#kept.id]);
  }

  free(): void {
    garbage.unregister(this);
    free(this.#kept);
    void this.#copy?.kept.then(free, () => {});
  }

  /** The map in the engine that renders. */
  async inFull(): Promise<Kept> {
    const full = running("full");
    if (this.#kept.engine === full) return this.#kept;
    if (this.#copy?.engine !== full) this.#copy = { engine: full, kept: this.#copyTo(full) };
    return this.#copy.kept;
  }

  async #copyTo(engine: Engine): Promise<Kept> {
    const pixels = await this.pixels();
    const { id } = await engine.call("load", [{ pixels, description: this.#description }, this.name, "{}"], [pixels.buffer]);
    const copy = { engine, id };
    garbage.register(this, copy, this);
    return copy;
  }
}

function loaded(map: t.LightMap): LoadedMap {
  if (map instanceof LoadedMap) return map;
  throw new TypeError("a map is what load() returns; await it");
}

/** Options as the engine reads them. */
function json(call: string, options: object): string {
  return JSON.stringify(options, (name: string, value: unknown) => {
    if (typeof value === "number" && !Number.isFinite(value)) throw new TypeError(`${call}: option ${name}: ${value} is not a finite number`);
    return value;
  });
}

const isBuiltin = (source: object | string): source is { builtin: string } => typeof source === "object" && "builtin" in source;

/**
 * Reads a light probe: Radiance `.hdr`, OpenEXR, PFM, PNG, JPEG, or a cube in KTX2 or DDS.
 *
 * ```js
 * const map = await load("venice.hdr", { convention: "three" });
 * ```
 *
 * Rejects if the file cannot be read, is damaged or is no map, if it needs more than 1 GiB, or if an option is wrong.
 */
export async function load(source: t.Source | t.BuiltinMap, options: t.LoadOptions = {}): Promise<t.LightMap> {
  const { name: given, ...rest } = options;
  const settings = json("load", rest);
  let content: Content, name = given ?? "the map", transfer: ArrayBuffer[] = [];
  if (isBuiltin(source)) {
    content = { builtin: source.builtin };
  } else {
    const { bytes, name: own, owned } = await bytesOf(source);
    name = given ?? own ?? name;
    content = { bytes };
    if (owned) transfer = [bytes.buffer];
  }
  const engine = running("bytes" in content && isDisplayPicture(content.bytes) ? "full" : "light");
  return new LoadedMap(engine, await engine.call("load", [content, name, settings], transfer));
}

/** Whether a file is a PNG or a JPEG, which only one of the engines reads. */
const isDisplayPicture = ([a, b]: Uint8Array) => (a === 0x89 && b === 0x50) || (a === 0xff && b === 0xd8);

/** Lights as the engine reports them. */
interface LightsReport {
  lights: Omit<t.Light, "color" | "intensity">[];
  harmonics: t.Triple[] | null;
  error: t.Rig["error"];
}

function lightOf(light: LightsReport["lights"][number]): t.Light {
  const intensity = Math.max(...light.irradiance);
  const color = light.irradiance.map((c) => (intensity > 0 ? c / intensity : 0)) as t.Triple;
  return { ...light, color, intensity };
}

/**
 * Divides a map into distant lights. Lights and residual together have the light of the map.
 *
 * ```js
 * const { lights: [sun], residual } = await lights(map, { sun: true, residual: true });
 * ```
 *
 * Rejects if the map has no sun or lamp where only these are asked for, if it is black, or if an option is wrong.
 */
export async function lights(map: t.LightMap, options: t.LightsOptions = {}): Promise<t.Rig> {
  const { engine, id } = loaded(map).kept;
  const { report, residual } = await engine.call("lights", [id, json("lights", options)]);
  const { lights, harmonics, error } = JSON.parse(report) as LightsReport;
  return {
    lights: lights.map(lightOf),
    orientation: { up: map.up, rotation: map.rotation },
    residual: residual && new LoadedMap(engine, residual),
    harmonics: harmonics && new Float32Array(harmonics.flat()),
    error,
  };
}

/**
 * Fits spherical Gaussians to a map; a sun is a lobe of its own.
 *
 * Rejects if the map is black, or has fewer lit texels than lobes.
 */
export async function sg(map: t.LightMap, options: t.SgOptions = {}): Promise<t.SphericalGaussians> {
  const { engine, id } = loaded(map).kept;
  const { n = 64, ...rest } = options;
  const [unknown] = Object.keys(rest);
  if (unknown !== undefined) throw new TypeError(`sg: option ${unknown}: there is none of this name; n is the only one`);
  if (!Number.isInteger(n) || n < 0) throw new TypeError(`sg: option n: ${n} is not a number of lobes`);
  const { lobes, hasSun } = await engine.call("sg", [id, n]);
  return { n: lobes.length / 7, lobes, hasSun };
}

/**
 * Projects a map to the first nine real spherical harmonics: 27 numbers, r, g and b [W·m⁻²·sr⁻¹] of each, in the order and with the
 * signs of three.js' `SphericalHarmonics3`, which a `LightProbe` takes: Y₀₀; y, z, x; xy, yz, 3z² − 1, xz, x² − y² of the world's
 * axes. The irradiance of a surface with the normal n is Σ A_l L_i Y_i(n) with A = π, 2π/3, π/4 for l = 0, 1, 2.
 */
export async function sh(map: t.LightMap): Promise<Float32Array> {
  const { engine, id } = loaded(map).kept;
  return engine.call("sh", [id]);
}

/**
 * Prefilters a map for an engine: every texel is the integral over the whole map, so that a small sun leaves no fireflies. The files
 * are those of the program's `domelight ibl`.
 *
 * Rejects if the map is black, or if an option is wrong.
 */
export async function ibl(map: t.LightMap, options: t.IblOptions = {}): Promise<t.PrefilteredLight> {
  const { engine, id } = loaded(map).kept;
  const { report, ...files } = await engine.call("ibl", [id, json("ibl", options)]);
  const { levels, harmonics, harmonicsWindow, warnings } = JSON.parse(report);
  return { ...files, levels, harmonics: new Float32Array(harmonics.flat()), harmonicsWindow, warnings };
}

/**
 * Renders a scene (glTF, OBJ, PLY, STL, pbrt, …) under the direct light of a map, with shadows: the picture of the program's
 * `domelight render`, with the same bits.
 *
 * Rejects if the scene cannot be read or is damaged, if the camera makes no picture, or if an option is wrong.
 */
export async function render(
  scene: t.Source | t.BuiltinScene,
  map: t.LightMap | t.Source | t.BuiltinMap,
  options: t.RenderOptions = {},
): Promise<t.Picture> {
  const { name: given, files: named = {}, onProgress, ...rest } = options;
  const settings = json("render", rest);
  const files = new Map<string, Uint8Array>();
  for (const [path, source] of Object.entries(named)) files.set(path, (await bytesOf(source)).bytes);
  let name: string;
  if (isBuiltin(scene)) {
    name = scene.builtin;
  } else {
    const { bytes, name: own } = await bytesOf(scene);
    name = given ?? own ?? "scene.glb";
    files.set(name, bytes);
  }
  const isOurs = !(map instanceof LoadedMap);
  const light = isOurs ? loaded(await load(map as t.Source | t.BuiltinMap)) : map;
  try {
    const { engine, id } = await light.inFull();
    const { linear, display, report } = await engine.call("render", [id, name, files, settings], [], onProgress);
    return { ...JSON.parse(report), linear, pixels: new Uint8ClampedArray(display.buffer) };
  } finally {
    if (isOurs) light.free();
  }
}
