// What an engine does, where it runs: in a Worker or in the caller's own thread.

import type { LightMap as EngineMap } from "./light/engine.js";
import type { ModuleSource } from "./types.js";

/** What both modules of the engine have. */
export interface EngineModule {
  default(options: { module_or_path: ModuleSource }): Promise<unknown>;
  LightMap: {
    fromBytes(bytes: Uint8Array, name: string, options: string): EngineMap;
    builtin(name: string, options: string): EngineMap;
    fromPixels(pixels: Float32Array, description: string): EngineMap;
  };
}

/** What a map is. */
export interface MapDescription {
  name: string;
  width: number;
  height: number;
  rotation: number;
  up: "y" | "z";
  upIsGiven: boolean;
  warnings: string[];
}

/** A map that an engine keeps. */
export interface MapHandle {
  id: number;
  description: MapDescription;
}

/** Where a map comes from: a file, the package itself, or another engine. */
export type Content = { bytes: Uint8Array } | { builtin: string } | { pixels: Float32Array; description: MapDescription };

/** Reads the results of an object of the engine, then frees it. */
export function using<T extends { free(): void }, R>(object: T, read: (object: T) => R): R {
  try {
    return read(object);
  } finally {
    object.free();
  }
}

/** The module, as the engine's own code takes it. In Node it is read from the disk, because `fetch` knows no files. */
async function moduleOf(source: ModuleSource): Promise<ModuleSource> {
  if ((typeof source === "string" || source instanceof URL) && String(source).startsWith("file:")) {
    const fs = globalThis.process?.getBuiltinModule?.("node:fs/promises");
    if (fs) return fs.readFile(new URL(source));
  }
  return source;
}

/** The maps of an engine by their numbers. */
export class Maps {
  private maps = new Map<number, EngineMap>();
  private lastId = 0;

  keep(map: EngineMap): MapHandle {
    this.maps.set(++this.lastId, map);
    return { id: this.lastId, description: JSON.parse(map.description()) };
  }

  get(id: number): EngineMap {
    const map = this.maps.get(id);
    if (!map) throw new Error("the map was freed; load it again");
    return map;
  }

  free(id: number) {
    this.maps.get(id)?.free();
    this.maps.delete(id);
  }
}

/** The calls of an engine whose module is at `place`; all arguments and results can be sent to another thread. */
export function callsOf(engine: EngineModule, place: URL) {
  const maps = new Maps();
  const mapFrom = (content: Content, name: string, options: string) => {
    if ("builtin" in content) return engine.LightMap.builtin(content.builtin, options);
    if ("bytes" in content) return engine.LightMap.fromBytes(content.bytes, name, options);
    return engine.LightMap.fromPixels(content.pixels, JSON.stringify(content.description));
  };
  return {
    maps,

    async start(source?: ModuleSource) {
      await engine.default({ module_or_path: await moduleOf(source ?? place) });
    },

    load: (content: Content, name: string, options: string): MapHandle => maps.keep(mapFrom(content, name, options)),

    free: (id: number) => maps.free(id),

    pixels: (id: number) => maps.get(id).pixels(),

    lights(id: number, options: string) {
      return using(maps.get(id).lights(options), (lights) => {
        const left = lights.takeResidual();
        return { report: lights.report(), residual: left ? maps.keep(left) : null };
      });
    },

    sg: (id: number, n: number) => using(maps.get(id).gaussians(n), (fitted) => ({ lobes: fitted.rows(), hasSun: fitted.hasSun })),

    sh: (id: number) => maps.get(id).harmonics(),

    ibl(id: number, options: string) {
      return using(maps.get(id).ibl(options), (files) => ({
        radiance: files.takeRadiance(),
        irradiance: files.takeIrradiance(),
        brdf: files.takeBrdf(),
        report: files.report(),
      }));
    },
  };
}

/** A failure after which the engine is of no use: WebAssembly ended in the middle of a call. */
export const isFatal = (error: unknown) => error instanceof WebAssembly.RuntimeError;
