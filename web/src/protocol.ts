// The messages between the page and its engines: Workers, or a program.

import type { Engine, MapView } from "../dist/engine/engine.js";

type Methods = { [K in keyof Engine]: Engine[K] extends (...args: never[]) => unknown ? K : never }[keyof Engine];
export type Call = Exclude<Methods, "free" | "start" | "setBudget" | "step" | typeof Symbol.dispose>;
export type Arguments<C extends Call> = Engine[C] extends (...args: infer A) => unknown ? A : never;
/** A map in a given mapping: R, G, B and alpha, or layer by layer. */
export interface MapPicture {
  width: number;
  height: number;
  pixels: Float32Array;
  /** The integral of each layer over the sphere, where the layers have integrals. */
  integrals: Float64Array;
}

type Plain<R> = R extends MapView ? MapPicture : R;
export type Result<C extends Call> = Engine[C] extends (...args: never[]) => infer R ? Plain<R> : never;

/** The progress of one Worker, or of several combined. */
export interface Statistics {
  cameraRays: number;
  shadowRays: number;
  shadingPoints: number;
  nonFinite: number;
  samples: number;
  /** Null if a Worker has not estimated it. */
  relativeVariance: number | null;
  pixels: number;
  complete: boolean;
}

export type ToWorker =
  | { kind: "unpack"; packed: string }
  | { kind: "boot"; module: WebAssembly.Module }
  | { kind: "call"; id: number; call: Call; args: unknown[] }
  | { kind: "render"; token: number; settings: string }
  | { kind: "pause"; token: number; paused: boolean }
  /** Pauses a render as near as its tiles allow to a number of shadow rays, and says so. */
  | { kind: "budget"; token: number; rays: number }
  | { kind: "stop" };

export interface Update {
  kind: "update";
  token: number;
  windows: Uint32Array;
  pixels: Float32Array;
  complete: boolean;
  progress: number;
  /** The samples of each pixel at the end of a pass; 0 within one. */
  whole: number;
  /** The time in the engine since the last update [ms]. */
  milliseconds: number;
  statistics: Statistics;
}

export type FromWorker =
  | { kind: "unpacked"; module: WebAssembly.Module }
  | { kind: "booted" }
  /** `memory` is the engine's memory use so far [bytes]. */
  | { kind: "result"; id: number; result: unknown; memory: number }
  | { kind: "error"; id: number; error: string; dead: boolean }
  | { kind: "started"; token: number; strategy: string }
  | { kind: "spent"; token: number }
  | { kind: "failed"; token: number; error: string; dead: boolean }
  /** Files that the program opened have changed. */
  | { kind: "changed" }
  /** The connection to the program has ended. */
  | { kind: "lost" }
  | Update;

/** The way to an engine. */
export interface Link {
  /** Called for each of its messages. */
  receive(message: FromWorker): void;
  post(message: ToWorker, transfer: Transferable[]): void;
  /** Ends the engine. */
  end(): void;
}
