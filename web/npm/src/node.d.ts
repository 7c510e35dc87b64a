// What is used of Node, where there is no DOM's counterpart.

interface NodeWorker {
  postMessage(message: unknown, transfer?: Transferable[]): void;
  on(event: "message" | "error", listener: (value: never) => void): void;
  ref(): void;
  unref(): void;
  terminate(): Promise<number>;
}

interface NodeModules {
  "node:fs/promises": { readFile(path: string | URL): Promise<Uint8Array<ArrayBuffer>> };
  "node:worker_threads": {
    parentPort: NodeWorker | null;
    Worker: new (url: URL) => NodeWorker;
  };
}

declare var process: undefined | {
  getBuiltinModule?<N extends keyof NodeModules>(name: N): NodeModules[N];
};
