// What the page takes: CPU time against the program's, time to the first picture and to that of a new view, and long
// tasks of the main thread. Prints a table, to be read on an idle machine; web/measure runs it.

import { spawnSync } from "node:child_process";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { close, launch, open, program, rendered } from "./page.js";

const SIZE = "320", SPP = "32";
const line = (name, value) => console.log(`${name.padEnd(60)}${value}`);
const median = (numbers) => numbers.sort((a, b) => a - b)[numbers.length >> 1];

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

for (const strategy of ["mis:1:1", "product:8"]) {
  const times = [0, 1, 2].map(() => {
    // Without what loading and writing take.
    const native = ofProgram(strategy, SPP) - ofProgram("brdf:1", "1");
    const engine = new URL("engine_time.js", import.meta.url).pathname;
    const wasm = Number(spawnSync(process.execPath, [engine, strategy, SIZE, SPP], { encoding: "utf8" }).stdout);
    return [native, wasm];
  });
  const [native, wasm] = [0, 1].map((i) => median(times.map((pair) => pair[i])));
  line(`CPU time of ${strategy}, ${SIZE} × ${SIZE}, ${SPP} samples`, `program ${native.toFixed(2)} s, page ${wasm.toFixed(2)} s: ${(wasm / native).toFixed(2)} times`);
}

await launch();
const start = performance.now();
const { page, done } = await open("");
line("statue at 640 × 640, first picture seen after", `${Math.round(performance.now() - start)} ms`);
await page.evaluate(() => {
  window.long = [];
  new PerformanceObserver((list) => window.long.push(...list.getEntries().map((entry) => Math.round(entry.duration)))).observe({ type: "longtask", buffered: true });
});
const tasks = () => page.evaluate(() => window.long.splice(0));
await rendered(page);
const told = (list) => (list.length ? `${list.join(", ")} ms` : "none");
line("tasks of the main thread over 50 ms, from the start on", told(await tasks()));
await page.focus("#viewer");
const previews = [];
for (let i = 0; i < 24; i++) {
  await page.evaluate(() => delete document.documentElement.dataset.preview);
  await page.keyboard.press("ArrowLeft");
  await page.waitForSelector("html[data-preview]");
  previews.push(Number(await page.evaluate(() => document.documentElement.dataset.preview)));
  await page.waitForTimeout(i % 2 ? 1000 : 60);
}
const sorted = [...previews].sort((a, b) => a - b);
line("first picture of a new view", `median ${median(previews)} ms, ${sorted[0]} to ${sorted.at(-1)} ms`);
line("tasks of the main thread over 50 ms, orbiting", told(await tasks()));
await done();
await close();
