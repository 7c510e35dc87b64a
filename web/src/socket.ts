// The link to a program that is the engine, with the messages of a Worker, as `domelight-cli/src/view/message.rs` has them:
// the length of the header, the header as JSON, and arrays of numbers, which the header refers to. An empty text acknowledges
// an update, so that the next is sent when the page has shown it.

import type { FromWorker, Link, ToWorker } from "./protocol";

const KINDS = { u8: Uint8Array, u32: Uint32Array, f32: Float32Array, f64: Float64Array };
type Kind = keyof typeof KINDS;

/** An array in a header: the kind of its numbers, its first byte behind the header, and how many numbers it has. */
interface Place {
  array: Kind;
  at: number;
  length: number;
}

/** Arrays begin at multiples of this [bytes]. */
const ALIGNMENT = 8;
const aligned = (n: number) => Math.ceil(n / ALIGNMENT) * ALIGNMENT;

function encode(message: ToWorker): ArrayBuffer {
  const arrays: { at: number; bytes: Uint8Array }[] = [];
  let size = 0;
  const header = new TextEncoder().encode(JSON.stringify(message, (_, value) => {
    const kind = (Object.keys(KINDS) as Kind[]).find((kind) => value instanceof KINDS[kind]);
    if (!kind) return value;
    const bytes = new Uint8Array(value.buffer, value.byteOffset, value.byteLength), at = aligned(size);
    arrays.push({ at, bytes });
    size = at + bytes.length;
    return { array: kind, at, length: value.length } satisfies Place;
  }));
  const start = aligned(4 + header.length), bytes = new Uint8Array(start + size);
  new DataView(bytes.buffer).setUint32(0, header.length, true);
  bytes.set(header, 4);
  for (const { at, bytes: array } of arrays) bytes.set(array, start + at);
  return bytes.buffer;
}

function decode(buffer: ArrayBuffer): FromWorker {
  const length = new DataView(buffer).getUint32(0, true), start = aligned(4 + length);
  const isPlace = (value: unknown): value is Place => !!value && typeof value === "object" && Object.hasOwn(KINDS, (value as Place).array);
  return JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)), (_, value) =>
    (isPlace(value) ? new KINDS[value.array](buffer, start + value.at, value.length) : value));
}

/** Connects to an engine of the program. */
export function socketLink(address: string): Link {
  const socket = new WebSocket(address), waiting: ArrayBuffer[] = [];
  socket.binaryType = "arraybuffer";
  const link: Link = {
    receive() {},
    post(message) {
      if (socket.readyState === WebSocket.CONNECTING) waiting.push(encode(message));
      else socket.send(encode(message));
    },
    end() {
      socket.onclose = null;
      socket.close();
    },
  };
  socket.onopen = () => waiting.splice(0).forEach((bytes) => socket.send(bytes));
  socket.onmessage = ({ data }: MessageEvent<ArrayBuffer>) => {
    const message = decode(data);
    try {
      link.receive(message);
    } finally {
      if (message.kind === "update") socket.send("");
    }
  };
  socket.onclose = () => link.receive({ kind: "lost" });
  return link;
}
