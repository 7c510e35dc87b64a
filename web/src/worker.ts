// One engine: answers calls in order, and renders between them in time slices.

import { Engine, MapView, initSync } from "../dist/engine/engine.js";
import type { Call, FromWorker, ToWorker } from "./protocol";

const SLICE = 16;

let engine: Engine | undefined;
let memory: WebAssembly.Memory | undefined;
let rendering: Rendering | undefined;
/** A render in progress. */
interface Rendering {
  token: number;
  paused: boolean;
}
const pending: ToWorker[] = [];

const post = (message: FromWorker, transfer: Transferable[] = []) =>
  (self as unknown as Worker).postMessage(message, transfer);

// A message to this Worker itself queues behind the waiting ones.
const channel = new MessageChannel();
const soon = () => channel.port2.postMessage(0);
channel.port1.onmessage = turn;

/** Unpacks the engine's module from the page's text (compressed, in base64). */
async function unpack(packed: string) {
  const text = atob(packed.trim()), bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
  const response = new Response(stream, { headers: { "Content-Type": "application/wasm" } });
  post({ kind: "unpacked", module: await WebAssembly.compileStreaming(response) });
}

self.onmessage = ({ data }: MessageEvent<ToWorker>) => {
  if (data.kind === "unpack") {
    unpack(data.packed).catch((error) => post({ kind: "failed", token: 0, error: text(error), dead: false }));
    return;
  }
  if (data.kind === "pause") {
    if (rendering?.token === data.token) {
      const wasPaused = rendering.paused;
      rendering.paused = data.paused;
      if (wasPaused && !data.paused) soon();
    }
    return;
  }
  pending.push(data);
  soon();
};

function turn() {
  const message = pending.shift();
  if (message) answer(message);
  else if (rendering && !rendering.paused) slice();
}

function answer(message: ToWorker) {
  switch (message.kind) {
    case "boot":
      ({ memory } = initSync({ module: message.module }));
      engine = new Engine();
      post({ kind: "booted" });
      break;
    case "call":
      try {
        const result = call(message.call, message.args);
        const buffer = ArrayBuffer.isView(result) ? [result.buffer as ArrayBuffer] : [];
        post({ kind: "result", id: message.id, result, memory: memory!.buffer.byteLength }, buffer);
      } catch (error) {
        fail(message.id, error);
      }
      break;
    case "render":
      // Of several waiting renders, keep the last.
      if (pending.some((other) => other.kind === "render")) break;
      try {
        const strategy = engine!.start(message.settings);
        rendering = { token: message.token, paused: false };
        post({ kind: "started", token: message.token, strategy });
      } catch (error) {
        rendering = undefined;
        post({ kind: "failed", token: message.token, error: text(error), dead: isDead(error) });
      }
      soon();
      break;
    case "budget":
      if (rendering?.token === message.token) {
        engine!.setBudget(message.rays);
        rendering.paused = false;
      } else post({ kind: "spent", token: message.token });
      break;
    case "stop":
      rendering = undefined;
      break;
  }
  if (pending.length || rendering) soon();
}

function call(name: Call, args: unknown[]): unknown {
  const method = engine![name] as (...args: unknown[]) => unknown;
  const result = method.apply(engine, args);
  // The render in progress is of an old scene or light. After an error it continues.
  if (name === "loadScene" || name === "loadEnvironment" || name === "turnEnvironment") rendering = undefined;
  return result instanceof MapView ? plain(result) : result;
}

/** Converts the engine's picture for a message. */
function plain(view: MapView) {
  const picture = { width: view.width, height: view.height, pixels: view.pixels(), integrals: view.integrals() };
  view.free();
  return picture;
}

function slice() {
  const { token } = rendering!;
  try {
    const update = engine!.step(SLICE), windows = update.windows(), pixels = update.pixels();
    const { complete, progress, whole, milliseconds, spent } = update, statistics = JSON.parse(update.statistics());
    update.free();
    if (complete) rendering = undefined;
    else if (spent) rendering!.paused = true;
    if (complete || !spent) post({ kind: "update", token, windows, pixels, complete, progress, whole, milliseconds, statistics }, [windows.buffer as ArrayBuffer, pixels.buffer as ArrayBuffer]);
    if (spent) post({ kind: "spent", token });
    if (!complete && !spent) soon();
  } catch (error) {
    rendering = undefined;
    post({ kind: "failed", token, error: text(error), dead: isDead(error) });
  }
}

/** Errors thrown by WebAssembly leave the engine in an unknown state. */
const isDead = (error: unknown) => error instanceof WebAssembly.RuntimeError;

const text = (error: unknown) =>
  isDead(error) ? "the engine stopped, probably out of memory, and was restarted"
    : error instanceof Error ? error.message : String(error);

function fail(id: number, error: unknown) {
  post({ kind: "error", id, error: text(error), dead: isDead(error) });
}
