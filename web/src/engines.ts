// The engines: one in each Worker, or those of a program.

import { whileBusy } from "./busy";
import * as native from "./native";
import { Passes } from "./passes";
import type { Arguments, Call, FromWorker, Link, Result, Statistics, ToWorker, Update } from "./protocol";
import { socketLink } from "./socket";

/** The first Worker, and the engine's module that it unpacks from the page. */
async function unpacked(script: string): Promise<[Worker, WebAssembly.Module]> {
  const worker = new Worker(script);
  const module = await new Promise<WebAssembly.Module>((resolve, reject) => {
    worker.onmessage = ({ data }: MessageEvent<FromWorker>) => {
      if (data.kind === "unpacked") resolve(data.module);
      else if (data.kind === "failed") reject(new Error(data.error));
    };
    worker.onerror = (event) => reject(new Error(event.message));
    worker.postMessage({ kind: "unpack", packed: document.getElementById("engine")!.textContent! } satisfies ToWorker);
  });
  return [worker, module];
}

/** An engine in its own Worker. */
function workerLink(worker: Worker, module: WebAssembly.Module): Link {
  const link: Link = {
    receive() {},
    post: (message, transfer) => worker.postMessage(message, transfer),
    end: () => worker.terminate(),
  };
  worker.onmessage = ({ data }: MessageEvent<FromWorker>) => link.receive(data);
  link.post({ kind: "boot", module }, []);
  return link;
}

/** Half of the computer's memory as reported by the browser, or 4 GiB if it is not reported; `?memory=` in the address
 *  sets another limit [GiB]. */
function memoryLimit(): number {
  const given = Number(new URLSearchParams(location.search).get("memory"));
  const { deviceMemory = 8 } = navigator as Navigator & { deviceMemory?: number };
  return 2 ** 30 * (given > 0 ? given : 0.5 * deviceMemory);
}

const LOST = "the connection to domelight view has ended: reload this page, or start it again";

/** An engine. */
export class Host {
  private link!: Link;
  private nextId = 0;
  private waiting = new Map<number, { resolve: (value: never) => void; reject: (error: Error) => void }>();
  onRender: (message: Extract<FromWorker, { token: number }>) => void = () => {};
  /** Called after a new engine, without scene and light, has replaced one that died. */
  onRestart: () => void = () => {};
  /** Called when files that the program opened have changed. */
  onChanged: () => void = () => {};
  /** Called when the connection to the program has ended. */
  onLost: (why: string) => void = () => {};
  private isLost = false;

  /** The engine's memory use [bytes]. */
  memory = 0;

  constructor(private connect: () => Link) {
    this.boot();
  }

  private boot() {
    this.link = this.connect();
    this.link.receive = (message) => this.receive(message);
  }

  private receive(message: FromWorker) {
    switch (message.kind) {
      case "booted":
      case "unpacked":
        return;
      case "result":
        this.memory = message.memory;
        this.waiting.get(message.id)?.resolve(message.result as never);
        this.waiting.delete(message.id);
        return;
      case "error":
        this.waiting.get(message.id)?.reject(new Error(message.error));
        this.waiting.delete(message.id);
        if (message.dead) this.restart(message.error);
        return;
      case "changed":
        this.onChanged();
        return;
      case "lost":
        this.isLost = true;
        this.end(LOST);
        this.onLost(LOST);
        return;
      default:
        this.onRender(message);
        if (message.kind === "failed" && message.dead) this.restart(message.error);
    }
  }

  private restart(why: string) {
    this.end(why);
    this.boot();
    this.onRestart();
  }

  /** Ends the engine and frees its memory. */
  end(why: string) {
    this.link.end();
    this.waiting.forEach(({ reject }) => reject(new Error(why)));
    this.waiting.clear();
    this.memory = 0;
  }

  /** Replaces the engine by a new one, without scene and light. */
  reset() {
    this.end("the engine was restarted");
    this.boot();
  }

  send(message: ToWorker, transfer: Transferable[] = []) {
    if (!this.isLost) this.link.post(message, transfer);
  }

  call<C extends Call>(call: C, ...args: Arguments<C>): Promise<Result<C>> {
    if (this.isLost) return Promise.reject(new Error(LOST));
    const id = this.nextId++;
    return whileBusy(new Promise((resolve, reject) => {
      this.waiting.set(id, { resolve, reject });
      this.send({ kind: "call", id, call, args });
    }));
  }
}

/** The settings of a render, except for its shard. */
export interface RenderSettings {
  width: number;
  height: number;
  spp: number;
  strategy: string;
  seed: number;
  hideEnvironment: boolean;
  camera: Camera | null;
}

export interface Camera {
  origin: number[];
  target: number[];
  up: number[];
  fov: number | null;
  ortho: number | null;
}

/** A picture that several engines render together. */
export class Job {
  /** The engine's name for the strategy, with the pilot's choices. */
  strategy = "";
  private statisticsOf = new Map<Host, Statistics>();
  /** The last with a variance. */
  private measuredOf = new Map<Host, Statistics>();
  private progressOf = new Map<Host, number>();
  paused = false;
  ended = false;
  /** Whether the engines know where to stop, and those that have stopped there. */
  budgeted = false;
  /** Whether its budget was known when it began. */
  begunWithBudget = false;
  private spent = new Set<Host>();

  /** An engine has spent its budget or all samples; returns whether that ends the job. */
  spend(host: Host): boolean {
    this.spent.add(host);
    this.ended = this.spent.size === this.hosts.length;
    return this.ended;
  }

  /** An engine's shadow rays for one sample of each of its pixels; null before it has taken one. */
  raysPerSample(host: Host): number | null {
    const s = this.statisticsOf.get(host);
    return s && (s.samples >= 1 || s.complete) ? s.shadowRays / Math.max(s.samples, 1) : null;
  }

  /** The picture at whole passes. */
  readonly passes: Passes;

  constructor(readonly token: number, readonly hosts: Host[], readonly settings: RenderSettings) {
    this.passes = new Passes(settings.width, settings.height, hosts.length);
  }

  note(host: Host, update: Update) {
    this.statisticsOf.set(host, update.statistics);
    if (update.statistics.relativeVariance !== null) this.measuredOf.set(host, update.statistics);
    this.progressOf.set(host, update.progress);
  }

  get complete() {
    return this.ended || this.isWhole;
  }

  /** Whether all samples are there, so that it did not end before. */
  get isWhole() {
    return this.hosts.every((host) => this.statisticsOf.get(host)?.complete);
  }

  get progress() {
    return this.hosts.reduce((sum, host) => sum + (this.progressOf.get(host) ?? 0), 0) / this.hosts.length;
  }

  get statistics(): Statistics {
    const all = [...this.statisticsOf.values()];
    const sum = (key: keyof Statistics) => all.reduce((sum, s) => sum + Number(s[key]), 0);
    const pixels = sum("pixels");
    return {
      cameraRays: sum("cameraRays"), shadowRays: sum("shadowRays"), shadingPoints: sum("shadingPoints"),
      nonFinite: sum("nonFinite"), pixels, samples: sum("cameraRays") / Math.max(pixels, 1),
      relativeVariance: this.measured?.error ?? null, complete: this.complete,
    };
  }

  /** The last estimate of the relative variance, and the rays and samples that it is of, which are fewer than those by now. */
  get measured() {
    const all = [...this.measuredOf.values()];
    if (all.length < this.hosts.length) return null;
    const sum = (of: (s: Statistics) => number) => all.reduce((sum, s) => sum + of(s), 0);
    return {
      error: sum((s) => s.relativeVariance!) / Math.max(sum((s) => s.pixels), 1), rays: sum((s) => s.shadowRays),
      samples: Math.min(...all.map((s) => s.samples)),
    };
  }
}

export interface JobEvents {
  update(job: Job, host: Host, update: Update): void;
  /** The job has spent its budget. */
  ended(job: Job): void;
  failed(job: Job, error: string): void;
}

/** All engines. */
export class Engines {
  private nextToken = 1;
  private jobs: Job[] = [];
  events: JobEvents = { update() {}, ended() {}, failed() {} };
  onRestart: () => void = () => {};
  onChanged: () => void = () => {};
  onLost: (why: string) => void = () => {};

  /** The number of engines that hold the scene; the others stay empty if memory is short. */
  active: number;
  /** The memory limit of all engines together [bytes]. */
  readonly memory = native.files ? Infinity : memoryLimit();

  /** `areSingle` engines have one thread each, so that several share a picture. */
  private constructor(readonly hosts: Host[], private another: () => Host, private areSingle: boolean) {
    this.active = hosts.length;
    for (const host of hosts) {
      host.onRender = (message) => this.receive(host, message);
      host.onRestart = () => this.onRestart();
      host.onLost = (why) => this.onLost(why);
    }
    hosts[0].onChanged = () => this.onChanged();
  }

  static async create(): Promise<Engines> {
    // At least two, for two strategies side by side.
    if (native.files) {
      const another = () => new Host(() => socketLink(native.socket()));
      return new Engines([another(), another()], another, false);
    }
    const script = URL.createObjectURL(new Blob([document.getElementById("worker")!.textContent!], { type: "text/javascript" }));
    const [worker, module] = await unpacked(script);
    const n = Math.max(2, Math.min(navigator.hardwareConcurrency || 2, 8));
    const free = [worker];
    const another = () => new Host(() => workerLink(free.pop() ?? new Worker(script), module));
    return new Engines(Array.from({ length: n }, another), another, true);
  }

  /** The engine that answers calls. */
  call<C extends Call>(call: C, ...args: Arguments<C>): Promise<Result<C>> {
    return this.hosts[0].call(call, ...args);
  }

  /** The engines that hold the scene. */
  get working(): Host[] {
    return this.hosts.slice(0, this.active);
  }

  /** Makes a call to all working engines, and returns the first engine's answer. */
  async all<C extends Call>(call: C, ...args: Arguments<C>): Promise<Result<C>> {
    return (await Promise.all(this.working.map((host) => host.call(call, ...args))))[0];
  }

  /** A message if not all engines work; empty otherwise. */
  get shortage(): string {
    return this.active < this.hosts.length ? ` on ${this.active} of ${this.hosts.length} Workers, because memory is limited` : "";
  }

  /** Sets the number of working engines, and returns the added ones. The others lose their data. */
  use(n: number): Host[] {
    const { active } = this;
    if (n < active) {
      this.stop();
      this.hosts.slice(n).forEach((host) => host.memory && host.reset());
      this.beside?.end("the picture needs its memory");
      this.beside = null;
    }
    this.active = n;
    return this.hosts.slice(active, n);
  }

  /** Renders pictures side by side, each on its share of the engines. */
  render(pictures: RenderSettings[]): Job[] {
    this.jobs = pictures.map((settings, i) => {
      const all = this.areSingle ? this.working : this.working.slice(0, pictures.length);
      const hosts = all.filter((_, k) => k % pictures.length === i);
      const job = new Job(this.nextToken++, hosts, settings);
      hosts.forEach((host, k) =>
        host.send({ kind: "render", token: job.token, settings: JSON.stringify({ ...settings, shard: [k, hosts.length] }) }));
      return job;
    });
    return this.jobs;
  }

  private aside: Host | null = null;
  private beside: Host | null = null;

  /** An extra engine for references of the picture. */
  reference(): Host {
    if (!this.beside) {
      const host = (this.beside = this.another());
      host.onRestart = () => {
        host.end("the engine was restarted");
        if (this.beside === host) this.beside = null;
      };
    }
    return this.beside;
  }

  /** An extra engine for the scenes of figures. */
  extra(): Host {
    return (this.aside ??= this.another());
  }

  /** Restarts one of the pictures with other settings. */
  again(job: Job, change: Partial<RenderSettings>): Job {
    const next = new Job(this.nextToken++, job.hosts, { ...job.settings, ...change });
    this.jobs = this.jobs.map((other) => (other === job ? next : other));
    next.hosts.forEach((host, k) =>
      host.send({ kind: "render", token: next.token, settings: JSON.stringify({ ...next.settings, shard: [k, next.hosts.length] }) }));
    return next;
  }

  /** Stops one of the pictures at a number of shadow rays, as soon as it is known how the engines share them, from this
   *  render or one before; returns whether it is. */
  endAt(job: Job, rays: number, known = job): boolean {
    if (job.budgeted) return true;
    const shares = job.hosts.map((host) => known.raysPerSample(host));
    if (!shares.every((share) => share !== null)) return false;
    job.budgeted = true;
    const all = Math.max(shares.reduce((sum, share) => sum + share, 0), 1e-9);
    job.hosts.forEach((host, i) => host.send({ kind: "budget", token: job.token, rays: rays * shares[i] / all }));
    return true;
  }

  /** Stops one of the pictures in its current state. */
  end(job: Job) {
    job.ended = true;
    job.hosts.forEach((host) => host.send({ kind: "pause", token: job.token, paused: true }));
  }

  stop() {
    this.jobs = [];
    this.hosts.forEach((host) => host.send({ kind: "stop" }));
  }

  pause(job: Job, paused: boolean) {
    if (job.paused === paused) return;
    job.paused = paused;
    job.hosts.forEach((host) => host.send({ kind: "pause", token: job.token, paused }));
  }

  private receive(host: Host, message: Extract<FromWorker, { token: number }>) {
    const job = this.jobs.find((job) => job.token === message.token);
    if (!job) return;
    if (message.kind === "started") job.strategy = message.strategy;
    if (message.kind === "failed") this.events.failed(job, message.error);
    if (message.kind === "spent" && job.spend(host)) this.events.ended(job);
    if (message.kind === "update") {
      job.note(host, message);
      this.events.update(job, host, message);
    }
  }

  /** Collects a job's whole picture in one engine, to write it as a file. */
  async gather(job: Job) {
    for (const host of job.hosts) {
      const part = await host.call("part");
      await this.call("addPart", part as Uint8Array);
    }
  }
}
