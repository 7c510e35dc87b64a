// The film's bits are the program's, for every strategy: the files that both write are the same, byte for byte.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { close, launch, open, program, rendered } from "./page.js";

// One for each kind of strategy, and for what differs most within a kind.
const STRATEGIES = [
  "brdf:2", "environment:2", "mis:2:1", "mis:1:1:heuristic=balance:no-compensation", "product:8", "product:3", "rejection:8",
  "rejection:rays=2:tries=16", "sir:2/32", "sir:2", "sir:2/16:from=brdf:resampling=multinomial", "median-cut:16", "variance-minimization:16",
];

before(launch);
after(close);

const STATE = "scene=material-ball&env=studio&rows=64&rotate=30&ev=0.5&material=phong%3A50%3A0.6%3A0.3&size=72&spp=5&seed=7";

/** What the program makes of the command that the page shows. */
function fromProgram(command, folder) {
  const words = command.split(" ").slice(1);
  const path = join(folder, "program.exr");
  const output = words.indexOf("-o");
  execFileSync(program, ["-q", ...words.slice(0, output), "-o", path]);
  return readFileSync(path);
}

for (const strategy of STRATEGIES) {
  test(`${strategy}: the same bytes`, async () => {
    assert.ok(program, "no domelight in target/: build it first, or set DOMELIGHT");
    const { page, done } = await open(`${STATE}&strategy=${encodeURIComponent(strategy)}`);
    const folder = mkdtempSync(join(tmpdir(), "domelight-web-"));
    try {
      await rendered(page);
      const bytes = await page.evaluate(async () => [...await window.domelight.picture.file("exr")]);
      const command = await page.textContent("#command");
      const expected = fromProgram(command, folder);
      assert.ok(expected.equals(Buffer.from(bytes)), `the files differ: ${command}`);
    } finally {
      rmSync(folder, { recursive: true });
    }
    await done();
  });
}

test("an orbited camera is the command line's", async () => {
  const { page, done } = await open(`${STATE}&strategy=mis:1:1`);
  const folder = mkdtempSync(join(tmpdir(), "domelight-web-"));
  try {
    await rendered(page);
    await page.focus("#viewer");
    for (const key of ["ArrowLeft", "ArrowUp", "+"]) await page.keyboard.press(key);
    await page.waitForTimeout(400);
    await rendered(page);
    const bytes = await page.evaluate(async () => [...await window.domelight.picture.file("exr")]);
    const command = await page.textContent("#command");
    assert.match(command, /--origin=/);
    assert.ok(fromProgram(command, folder).equals(Buffer.from(bytes)), `the files differ: ${command}`);
  } finally {
    rmSync(folder, { recursive: true });
  }
  await done();
});
