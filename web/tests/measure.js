// What the page takes: its size, time to the first picture and to that of a new view, by its own engine and by the program's,
// long tasks of the main thread by the clock and by CPU time, time between frames, and CPU time against the program's. Prints
// a table, to be read on an idle machine; on a busy one the least of several runs and CPU times still say something.
// web/measure runs it, in five minutes.

import { spawn, spawnSync } from "node:child_process";
import { once } from "node:events";
import { mkdtempSync, rmSync, statSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { createInterface } from "node:readline";
import { fileURLToPath } from "node:url";
import { address, close, file, launch, open, program, rendered } from "./page.js";

const SIZE = "320", SPP = "32";
const line = (name, value) => console.log(`${name.padEnd(60)}${value}`);
const median = (numbers) => numbers.sort((a, b) => a - b)[numbers.length >> 1];
/** Runs of CPU times, of which the least counts, and times that the page is opened. */
const RUNS = [0, 1, 2], OPENED = 7;

line("size", `${(statSync(fileURLToPath(address)).size / 1e6).toFixed(2)} MB`);

/** CPU seconds of the program on one thread. */
function ofProgram(strategy, spp) {
  const folder = mkdtempSync(join(tmpdir(), "domelight-web-"));
  const words = ["render", "-q", "statue", "--env=sky", "--env-rows=256", "--env-rotate=125", `--size=${SIZE}x${SIZE}`, `--spp=${spp}`,
    `--strategy=${strategy}`, "--passes=doubling", "--threads=1", "-o", join(folder, "a.exr")];
  const { stderr, status } = spawnSync("bash", ["-c", 'TIMEFORMAT="%U %S"; time "$@"', "bash", program, ...words], { encoding: "utf8" });
  rmSync(folder, { recursive: true });
  if (status !== 0) throw new Error(stderr);
  return stderr.trim().split(" ").reduce((sum, seconds) => sum + Number(seconds), 0);
}

await launch({ isCold: true });

/** Notes when the page shows its preview, and its first tiles of the whole picture, since its navigation began [ms]. */
const NOTES = `window.seen = [];
  document.addEventListener("painted", ({ target }) => {
    const { films } = window.domelight?.picture.view ?? {};
    if (target.id === "film" && films?.[0] && window.seen.at(-1)?.[0] !== films[0].width) window.seen.push([films[0].width, performance.now()]);
  }, true);`;
const times = [];
for (let i = 0; i < OPENED; i++) {
  const { page, done } = await open("", { script: NOTES, refers: true });
  await page.waitForFunction(() => window.seen.length > 1);
  times.push(await page.evaluate(() => window.seen.map(([, at]) => at)));
  await done();
}
/** Median, least and greatest of times [ms]. */
const spread = (all) => `median ${Math.round(median(all))} ms, ${Math.round(Math.min(...all))} to ${Math.round(Math.max(...all))} ms`;
line("statue, first picture, 128 × 128, seen after", spread(times.map((seen) => seen[0])));
line("the same, first tiles of 640 × 640 seen after", spread(times.map((seen) => seen[1])));

/** CPU times over 50 ms of tasks of the page's main thread in a trace [ms]. */
function longInTrace(trace) {
  const { traceEvents } = JSON.parse(trace);
  const names = traceEvents.filter(({ name, args }) => name === "thread_name" && args.name === "CrRendererMain");
  const isMain = ({ pid, tid }) => names.some((main) => main.pid === pid && main.tid === tid);
  const tasks = traceEvents.filter((event) => event.name === "RunTask" && event.tdur > 50_000 && isMain(event));
  return tasks.map(({ tdur }) => Math.round(tdur / 1000));
}
const { page, done } = await open("", { refers: true });
const browser = page.context().browser();
const trace = { start: () => browser.startTracing(page, { categories: ["toplevel", "devtools.timeline", "disabled-by-default-devtools.timeline"] }), stop: async () => longInTrace(String(await browser.stopTracing())) };
await page.goto("about:blank");
await trace.start();
await page.goto(`${address}#`);
await page.waitForSelector("html[data-ready]");
await page.evaluate(() => {
  window.long = [];
  new PerformanceObserver((list) => window.long.push(...list.getEntries().map((entry) => Math.round(entry.duration)))).observe({ type: "longtask", buffered: true });
});
const tasks = () => page.evaluate(() => window.long.splice(0));
await rendered(page);
const told = (list) => (list.length ? `${list.join(", ")} ms` : "none");
const both = async () => `${told(await tasks())}; by CPU time ${told(await trace.stop())}`;
line("tasks of the main thread over 50 ms, from the start on", await both());
await trace.start();
/** The times from the keys that turn the view to the first tiles of it [ms]. */
async function newViews(page, n) {
  const times = [];
  await page.focus("#viewer");
  for (let i = 0; i < n; i++) {
    const before = await page.evaluate(() => window.domelight.picture.times.asked);
    await page.keyboard.press("ArrowLeft");
    const time = await page.waitForFunction((before) => {
      const { asked, shown } = window.domelight.picture.times;
      return asked > before && shown > asked && shown - asked;
    }, before);
    times.push(await time.jsonValue());
    await page.waitForTimeout(i % 2 ? 700 : 60);
  }
  return times;
}
line("first tiles of a new view", spread(await newViews(page, 24)));
line("tasks of the main thread over 50 ms, orbiting", await both());

// A drag around the scene, as fast as the page draws frames.
await page.evaluate(() => {
  window.intervals = [];
  let last = performance.now();
  const next = (now) => { window.intervals.push(now - last); last = now; requestAnimationFrame(next); };
  requestAnimationFrame(next);
});
const box = await page.locator("#viewer").boundingBox();
const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
await page.mouse.move(x, y);
await page.mouse.down();
for (let i = 0; i < 180; i++) {
  await page.mouse.move(x + 100 * Math.sin(i / 20), y);
  await page.waitForTimeout(16);
}
await page.mouse.up();
const frames = (await page.evaluate(() => window.intervals)).slice(1).sort((a, b) => a - b);
const quantile = (q) => frames[Math.floor(q * (frames.length - 1))].toFixed(1);
line("time between frames, dragging", `median ${quantile(0.5)} ms, 95 % under ${quantile(0.95)} ms, of ${frames.length}`);
await done();

/** The program as the page's engine: times from its start to its address and to the first picture, and of new views in a
 *  browser as it is and in one that is slowed down [ms]. */
const started = [], shown = [], views = [], slow = [];
const SLOWNESS = 4;
for (let i = 0; i < OPENED; i++) {
  const start = Date.now();
  const child = spawn(program, ["view", "--no-open", "-q", `--page=${file}`], { stdio: ["ignore", "pipe", "inherit"] });
  const [at] = await once(createInterface(child.stdout), "line");
  started.push(Date.now() - start);
  const { page, done } = await open("", { at, script: NOTES });
  await page.waitForFunction(() => window.seen.length > 0);
  shown.push(await page.evaluate(() => performance.timeOrigin + window.seen[0][1]) - start);
  if (i < 3) {
    await page.waitForSelector("html[data-ready]");
    views.push(...await newViews(page, 8));
    const devtools = await page.context().newCDPSession(page);
    await devtools.send("Emulation.setCPUThrottlingRate", { rate: SLOWNESS });
    slow.push(...await newViews(page, 8));
  }
  await done();
  child.kill("SIGKILL");
}
line("domelight view, address printed after", spread(started));
line("the same, first picture seen after", spread(shown));
line("the same, first tiles of a new view", spread(views));
line(`the same, ${SLOWNESS} times slower page`, spread(slow));
await close();

for (const strategy of ["mis:1:1", "product:8"]) {
  const times = RUNS.map(() => {
    // Without what loading and writing take.
    const native = ofProgram(strategy, SPP) - ofProgram("brdf:1", "1");
    const engine = new URL("engine_time.js", import.meta.url).pathname;
    const wasm = Number(spawnSync(process.execPath, [engine, strategy, SIZE, SPP], { encoding: "utf8" }).stdout);
    return [native, wasm];
  });
  const [native, wasm] = [0, 1].map((i) => Math.min(...times.map((pair) => pair[i])));
  line(`CPU time of ${strategy}, ${SIZE} × ${SIZE}, ${SPP} samples`, `program ${native.toFixed(2)} s, page ${wasm.toFixed(2)} s: ${(wasm / native).toFixed(2)} times`);
}
