// The bytes of what callers name.

import type { Source } from "./types.js";

/** The bytes of a source. */
export interface Bytes {
  bytes: Uint8Array<ArrayBuffer>;
  /** The name of the file, if it has one. */
  name: string | undefined;
  /** Whether nobody else has the bytes. */
  owned: boolean;
}

const lastPart = (path: string) => decodeURIComponent(path.slice(path.lastIndexOf("/") + 1));

/** Reads a file of Node. */
async function fromDisk(path: string | URL): Promise<Uint8Array<ArrayBuffer>> {
  const fs = globalThis.process?.getBuiltinModule?.("node:fs/promises");
  if (!fs) throw new Error(`${path}: files are read by a page from where the user drops or picks them, or over HTTP`);
  const read = await fs.readFile(path);
  // Small files share a buffer with others.
  return new Uint8Array(read);
}

async function fromNetwork(url: URL): Promise<Uint8Array<ArrayBuffer>> {
  let response;
  try {
    response = await fetch(url);
  } catch (error) {
    throw new Error(`${url}: ${error instanceof Error ? error.message : error}`, { cause: error });
  }
  if (!response.ok) throw new Error(`${url}: HTTP ${response.status}`);
  return new Uint8Array(await response.arrayBuffer());
}

/** The URL that a text is, in a browser relative to the page; null for a path. */
function urlOf(text: string): URL | null {
  if (typeof document !== "undefined") return new URL(text, document.baseURI);
  // A letter before a colon is a drive.
  return /^[a-z][a-z\d+.-]+:/i.test(text) ? new URL(text) : null;
}

/** Reads a source. */
export async function bytesOf(source: Source): Promise<Bytes> {
  if (source instanceof ArrayBuffer) return { bytes: new Uint8Array(source), name: undefined, owned: false };
  if (source instanceof Uint8Array) return { bytes: source as Uint8Array<ArrayBuffer>, name: undefined, owned: false };
  if (source instanceof Blob) {
    const name = "name" in source && typeof source.name === "string" ? source.name : undefined;
    return { bytes: new Uint8Array(await source.arrayBuffer()), name, owned: true };
  }
  if (typeof source === "string" || source instanceof URL) {
    const url = typeof source === "string" ? urlOf(source) : source;
    if (!url) return { bytes: await fromDisk(source), name: lastPart(String(source)), owned: true };
    const bytes = await (url.protocol === "file:" ? fromDisk(url) : fromNetwork(url));
    return { bytes, name: lastPart(url.pathname), owned: true };
  }
  throw new TypeError("a file is given as ArrayBuffer, Uint8Array, Blob, File, URL or string");
}
