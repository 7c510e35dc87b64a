// The page of `domelight view`, with the program as its engine.

import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { once } from "node:events";
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { createInterface } from "node:readline";
import { after, before, test } from "node:test";
import { close, file, launch, open, program, rendered, renderedAnew, show, slide, text } from "./page.js";
import { requireTheSame } from "./same.js";

before(() => launch({ isCold: true }));
after(close);

/** Runs `domelight view` in a folder of its own, and opens its page. */
async function viewed(words, act, files = {}) {
  assert.ok(program, "no domelight in target/: build it first, or set DOMELIGHT");
  const folder = mkdtempSync(join(tmpdir(), "domelight-view-"));
  for (const [name, contents] of Object.entries(files)) writeFileSync(join(folder, name), contents);
  const child = spawn(program, ["view", "--no-open", "-q", `--page=${file}`, ...words], { cwd: folder, stdio: ["ignore", "pipe", "inherit"] });
  try {
    const [address] = await once(createInterface(child.stdout), "line");
    const { page, done } = await open("", { at: address, refers: true });
    await act(page, folder, child);
    await done();
  } finally {
    child.kill("SIGKILL");
    rmSync(folder, { recursive: true });
  }
}

const WORDS = ["--env=studio", "--env-rows=64", "--env-rotate=30", "--size=64x64", "--spp=4", "--strategy=mis:1:1", "--seed=7"];

test("pictures have the program's bytes, and panels show what it knows", () => viewed(["material-ball", ...WORDS, "--material=ggx:0.2"], async (page, folder) => {
  await rendered(page);
  assert.match(await requireTheSame(page, folder), /^domelight render material-ball --env studio --env-rows=64 --env-rotate=30 --material=ggx:0.2 /);
  // A new view.
  await page.focus("#viewer");
  await renderedAnew(page, () => page.keyboard.press("ArrowLeft"));
  assert.match(await requireTheSame(page, folder), /--origin=/);
  // Two strategies share nothing but the scene.
  await renderedAnew(page, () => page.evaluate(() => window.domelight.app.set({ beside: "brdf:2", equal: "time" })));
  assert.equal(await page.evaluate(() => window.domelight.picture.jobs.length), 2);
  await renderedAnew(page, () => page.evaluate(() => window.domelight.app.set({ beside: "" })));
  // The engine answers the other panels.
  await show(page, "xray");
  await page.evaluate(() => window.domelight.app.set({ pixel: [32, 32] }, "pixel"));
  await page.waitForFunction(() => document.querySelectorAll("#xray-table tbody tr").length >= 4);
  await show(page, "map");
  await slide(page, "#map-rotate", 60);
  await show(page, "lights");
  await page.waitForSelector("html[data-rig]");
  await show(page, "picture");
}));

test("files are opened by the program, and loaded again when they change", () => viewed(["a.obj", "--env-rows=64", ...WORDS.slice(3), "--watch"], async (page, folder, child) => {
  await rendered(page);
  const triangles = () => page.evaluate(() => window.domelight.app.scene.triangles);
  assert.equal(await triangles(), 1);
  assert.deepEqual(await page.evaluate(() => [window.domelight.app.state.env, window.domelight.app.state.rotate, window.domelight.app.state.rows]), ["sky", 0, 64]);
  await requireTheSame(page, folder);
  await renderedAnew(page, () => writeFileSync(join(folder, "a.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\n"));
  assert.equal(await triangles(), 2);
  // A file that is damaged is said to be, until it is not.
  writeFileSync(join(folder, "a.obj"), "f 1 2 3\n");
  await page.waitForSelector("#status.error");
  assert.match(await text(page, "#status"), /^a\.obj/);
  await renderedAnew(page, () => writeFileSync(join(folder, "a.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"));
  assert.equal(await triangles(), 1);
  assert.match(await text(page, "#status"), /^Done/);
  // The end of the program is said.
  child.kill("SIGINT");
  await page.waitForSelector("#status.error");
  assert.match(await text(page, "#status"), /start it again/);
}, { "a.obj": "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n" }));
