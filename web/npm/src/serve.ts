// A Worker's side of the messages.

import { isFatal } from "./calls.js";
import { REPORTING, type Reply, type Request } from "./protocol.js";

/** The buffers that a message may take along: those of results belong to nobody else. */
function buffersOf(value: unknown): ArrayBuffer[] {
  if (ArrayBuffer.isView(value)) return [value.buffer as ArrayBuffer];
  return typeof value === "object" && value !== null ? Object.values(value).flatMap(buffersOf) : [];
}

/** Answers one call after the other. */
export function serve(calls: object) {
  const port = globalThis.process?.getBuiltinModule?.("node:worker_threads").parentPort;
  const post = (reply: Reply, transfer: ArrayBuffer[] = []) => (port ? port.postMessage(reply, transfer) : self.postMessage(reply, { transfer }));
  const answer = async ({ id, call, arguments: given }: Request) => {
    try {
      const progress = (share: number) => post({ id, progress: share });
      const named = calls as Record<string, (...values: unknown[]) => unknown>;
      const result = await named[call]!(...given, ...(call === REPORTING ? [progress] : []));
      post({ id, result }, buffersOf(result));
    } catch (error) {
      post({ id, error: error instanceof Error ? error.message : String(error), fatal: isFatal(error) });
    }
  };
  let last = Promise.resolve();
  const receive = (request: Request) => { last = last.then(() => answer(request)); };
  if (port) port.on("message", receive);
  else self.addEventListener("message", ({ data }: MessageEvent<Request>) => receive(data));
}
