// An engine as the caller's thread sees it.

import { isFatal } from "./calls.js";
import type { calls as fullCalls } from "./full.js";
import { REPORTING, type Reply } from "./protocol.js";
import type { ModuleSource } from "./types.js";

/** `light` knows maps alone, `full` scenes, too. */
export type EngineKind = "light" | "full";

type Calls = typeof fullCalls;
type CallName = keyof Calls;
type Progress = (share: number) => void;
/** The arguments of a call, without the function that `render` reports to. */
type Given<N extends CallName> = Parameters<Calls[N]> extends [...infer Head, Progress] ? Head : Parameters<Calls[N]>;
type Result<N extends CallName> = Awaited<ReturnType<Calls[N]>>;

/** Calls the functions of an engine. */
export interface Engine {
  call<N extends CallName>(name: N, given: Given<N>, transfer?: ArrayBufferLike[], progress?: Progress): Promise<Result<N>>;
  /** Ends it; what it was asked for is rejected. */
  end(): void;
}

const FATAL = "the engine failed, perhaps because it needs more memory than a module of WebAssembly can have";

/** What a Worker of a browser and one of Node have in common. */
interface Thread {
  post(message: unknown, transfer: ArrayBufferLike[]): void;
  /** Whether it keeps the process of Node alive. */
  hold(isBusy: boolean): void;
  end(): void;
}

interface Listeners {
  message(reply: Reply): void;
  failure(error: Error): void;
}

const nodeThreads = () => globalThis.process?.getBuiltinModule?.("node:worker_threads");

function nodeThread(Threads: NonNullable<ReturnType<typeof nodeThreads>>, kind: EngineKind, { message, failure }: Listeners): Thread {
  const worker = new Threads.Worker(new URL(`./${kind}_worker.js`, import.meta.url));
  worker.on("message", message as (value: never) => void);
  worker.on("error", failure as (value: never) => void);
  worker.unref();
  return {
    post: (value, transfer) => worker.postMessage(value, transfer),
    hold: (isBusy) => (isBusy ? worker.ref() : worker.unref()),
    end: () => void worker.terminate(),
  };
}

/** A Worker of a browser. Bundlers know this form, with the names as they are here. */
function browserWorker(kind: EngineKind): Worker {
  return kind === "light"
    ? new Worker(new URL("./light_worker.js", import.meta.url), { type: "module" })
    : new Worker(new URL("./full_worker.js", import.meta.url), { type: "module" });
}

const notStarted = (reason: string) =>
  new Error(`the Worker of domelight did not start${reason ? `: ${reason}` : ""}; configure({ worker: false }) does without it`);

function browserThread(kind: EngineKind, { message, failure }: Listeners): Thread {
  let worker: Worker;
  try {
    worker = browserWorker(kind);
  } catch (error) {
    // The package is from another origin than the page, or the page's policy allows no Workers.
    throw notStarted((error as Error).message);
  }
  worker.addEventListener("message", ({ data }: MessageEvent<Reply>) => message(data));
  worker.addEventListener("error", ({ message: reason }) => failure(notStarted(reason)));
  return { post: (value, transfer) => worker.postMessage(value, transfer as ArrayBuffer[]), hold: () => {}, end: () => worker.terminate() };
}

interface Pending {
  resolve(value: never): void;
  reject(error: Error): void;
  progress: Progress | undefined;
}

/** An engine in a Worker. */
class Threaded implements Engine {
  private pending = new Map<number, Pending>();
  private lastId = 0;
  private thread: Thread;
  /** Why there is no engine any more. */
  private ended: Error | null = null;

  constructor(start: (listeners: Listeners) => Thread, private onEnd: () => void) {
    this.thread = start({ message: (reply) => this.receive(reply), failure: (error) => this.stop(error) });
  }

  call<N extends CallName>(name: N, given: Given<N>, transfer: ArrayBufferLike[] = [], progress?: Progress): Promise<Result<N>> {
    if (this.ended) return Promise.reject(this.ended);
    return new Promise<Result<N>>((resolve, reject) => {
      const id = ++this.lastId;
      this.thread.post({ id, call: name, arguments: given }, transfer);
      this.pending.set(id, { resolve, reject, progress });
      this.thread.hold(true);
    });
  }

  end() {
    this.stop(new Error("the engine was ended"));
  }

  private receive(reply: Reply) {
    const pending = this.pending.get(reply.id);
    if (!pending) return;
    if ("progress" in reply) return pending.progress?.(reply.progress);
    this.pending.delete(reply.id);
    if (this.pending.size === 0) this.thread.hold(false);
    if ("result" in reply) return pending.resolve(reply.result as never);
    pending.reject(new Error(reply.fatal ? `${FATAL}: ${reply.error}` : reply.error));
    if (reply.fatal) this.stop(new Error("the map was lost when the engine failed; load it again"));
  }

  /** Ends it for a reason, with which all calls are rejected. */
  stop(error: Error) {
    if (this.ended) return;
    this.ended = error;
    this.thread.end();
    this.onEnd();
    for (const { reject } of this.pending.values()) reject(error);
    this.pending.clear();
  }
}

/** An engine in the caller's thread. */
class Direct implements Engine {
  private calls: Promise<object>;
  private ended: Error | null = null;

  constructor(kind: EngineKind, wasm: ModuleSource | undefined) {
    const loading = kind === "light" ? import("./light.js") : import("./full.js");
    this.calls = loading.then(async ({ calls }) => {
      await calls.start(wasm);
      return calls;
    });
    // Calls get the error.
    this.calls.catch(() => {});
  }

  async call<N extends CallName>(name: N, given: Given<N>, _: ArrayBufferLike[] = [], progress: Progress = () => {}): Promise<Result<N>> {
    const calls = (await this.calls) as Record<string, (...values: unknown[]) => Result<N>>;
    if (this.ended) throw this.ended;
    try {
      return calls[name]!(...given, ...(name === REPORTING ? [progress] : []));
    } catch (error) {
      if (!isFatal(error)) throw error;
      this.ended = new Error(`${FATAL}; it starts again with the program or the page: ${(error as Error).message}`);
      throw this.ended;
    }
  }

  end() {
    this.ended = new Error("the engine was ended");
  }
}

/** How an engine is started. */
interface Start {
  kind: EngineKind;
  worker: boolean;
  wasm: ModuleSource | undefined;
  /** Called when it is of no use any more. */
  onEnd(): void;
}

export function startEngine({ kind, worker, wasm, onEnd }: Start): Engine {
  const threads = nodeThreads();
  if (!worker || (!threads && typeof Worker === "undefined")) return new Direct(kind, wasm);
  const engine = new Threaded((listeners) => (threads ? nodeThread(threads, kind, listeners) : browserThread(kind, listeners)), onEnd);
  // The Worker's own address is another than the page's, and URLs cannot be sent.
  const isPlace = typeof wasm === "string" || wasm instanceof URL;
  const sent = isPlace && typeof document !== "undefined" ? new URL(wasm, document.baseURI).href : wasm instanceof URL ? wasm.href : wasm;
  engine.call("start", [sent]).catch((error: Error) => engine.stop(error));
  return engine;
}
