// Bounds on what the page takes, several times what it takes on an idle machine; web/measure measures.

import assert from "node:assert/strict";
import { statSync } from "node:fs";
import { availableParallelism, loadavg } from "node:os";
import { fileURLToPath } from "node:url";
import { after, before, test } from "node:test";
import { address, close, launch, open } from "./page.js";

/** The whole page [bytes]. */
const SIZE = 6e6;
/** From the address to the first picture, and the main thread's longest task while it renders [ms]. */
const START = 10_000, TASK = 400;
/** Programs for each core: times grow with it. */
const busy = Math.max(1, loadavg()[0] / availableParallelism());

before(() => launch({ isCold: true }));
after(close);

test("the page is one file of 6 MB at most", () => {
  assert.ok(statSync(fileURLToPath(address)).size <= SIZE);
});

test("the first picture is seen soon, and the page answers while it renders", async () => {
  const script = "window.long = []; new PerformanceObserver((list) => window.long.push(...list.getEntries().map((entry) => entry.duration))).observe({ type: 'longtask', buffered: true });";
  const start = performance.now();
  const { page, done } = await open("", { script, refers: true });
  const seen = performance.now() - start;
  assert.ok(seen < START * busy, `${Math.round(seen)} ms to the first picture`);
  await page.evaluate(() => window.long.splice(0));
  await page.focus("#viewer");
  for (let i = 0; i < 8; i++) {
    await page.keyboard.press("ArrowLeft");
    await page.waitForTimeout(100);
  }
  await page.waitForTimeout(3000);
  const longest = Math.max(0, ...await page.evaluate(() => window.long));
  assert.ok(longest < TASK * busy, `a task of ${Math.round(longest)} ms`);
  await done();
});
