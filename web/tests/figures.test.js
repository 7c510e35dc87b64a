// The lecture's figures against those of `domelight figures`: where both show a number, it is the same.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { close, launch, open, program, text } from "./page.js";

const SEED = 3, ROWS = 64;
/** The tables of the program's figures, by number; their columns have names. */
const tables = {};

before(async () => {
  assert.ok(program, "no domelight in target/: build it first, or set DOMELIGHT");
  const folder = mkdtempSync(join(tmpdir(), "domelight-figures-"));
  try {
    execFileSync(program, ["figures", "-q", "--quick", "--only=1,2,6,7,9,14", "--scene=sphere", "--env=sky", `--env-rows=${ROWS}`, "--env-rotate=125", `--seed=${SEED}`, "-o", folder]);
    for (const n of [1, 2, 6, 7, 9, 14]) tables[n] = JSON.parse(readFileSync(join(folder, `figure-${n}.json`), "utf8"));
  } finally {
    rmSync(folder, { recursive: true });
  }
  await launch();
});
after(close);

/** The columns that name the rows. */
const KEYS = { 1: "lobe", 2: "quantity", 6: "lights", 7: "method", 14: "round" };

/** The value in a named row. */
const value = (n, row, column) => {
  const found = tables[n].find((cells) => cells[KEYS[n]] === row);
  assert.ok(found, `figure ${n} has no row ${row}`);
  assert.ok(column in found, `figure ${n} has no column ${column}`);
  return found[column];
};

/** The address of a step of the lecture with values of its controls. */
const link = (number, controls) => `scene=sphere&rows=${ROWS}&size=32&spp=4&panel=lecture&step=${number}&figure=${encodeURIComponent(controls)}`;

/** What the figure says once it is drawn. */
async function said(page) {
  await page.waitForSelector("#figure[data-drawn]:not([data-drawing], [data-before])");
  return (await text(page, "#figure .result")).replaceAll("\u00a0", " ");
}

/** Opens a step of the lecture with values of its controls. */
async function step(number, controls = "") {
  const { page, done } = await open(link(number, controls));
  return { page, done, result: await said(page) };
}

/** Sets other values, and returns what the figure says then. */
async function again(page, number, controls) {
  await page.evaluate((hash) => {
    document.getElementById("figure").dataset.before = "";
    location.hash = hash;
  }, link(number, controls));
  return said(page);
}

/** Fails where a number that is shown with three digits is not the rounded value. */
function requireShown(shown, value, what) {
  assert.equal(Number(shown), Number(value.toPrecision(3)), `${what}: the page shows ${shown}, the program has ${value}`);
}

const call = (page, ...words) => page.evaluate((words) => window.domelight.app.engines.call(...words), words);

test("as many directions of each lobe are lost below the horizon", async () => {
  const { page, done } = await step(2);
  for (const [name, material] of [["Phong, n = 50", "phong:50"], ["Ward, α = 0.2", "ward:0.2"], ["Ward, α = 0.15 × 0.5", "ward:0.15:0.5"], ["GGX, α = 0.3", "ggx:0.3"]]) {
    const drawn = value(1, name, "drawn");
    const kept = await page.evaluate(async ([material, n, seed]) => (await window.domelight.app.engines.call("lobeSamples", material, 0, n, seed)).length / 3, [material, drawn, SEED]);
    assert.equal(drawn - kept, value(1, name, "lost below the horizon"), name);
  }
  await done();
});

test("the map has the same rows and samples", async () => {
  const { page, done } = await step(6);
  const { rows } = JSON.parse(await call(page, "rowProbabilities", 2 * ROWS, 0, true));
  const sorted = [...rows].sort((a, b) => b - a), most = value(2, "row with the largest p(y)", "value");
  assert.equal(rows.indexOf(sorted[0]), most);
  const tenth = sorted.slice(0, Math.floor(ROWS / 10)).reduce((a, b) => a + b, 0);
  assert.equal(Math.round(1000 * tenth) / 10, value(2, "share of the energy in the brightest tenth of the rows", "value"));
  // The figure names that row, and its probability.
  const shown = /bar of row (\d+) is cut: it reaches (\S+)\.$/.exec((await text(page, "#figure .result")));
  assert.equal(Number(shown[1]), most);
  requireShown(shown[2], rows[most], "p(y)");
  const { places } = JSON.parse(await call(page, "mapSamples", 1024, SEED));
  const lower = tables[2].find(({ quantity }) => quantity.startsWith("samples below the horizon"));
  assert.equal(places.filter(([, v]) => v > 0.5).length, lower.value);
  await done();
});

test("reflection enlarges the same patches as much", async () => {
  const { page, done, result } = await step(4, "40");
  const factors = tables[9].map((row) => row["4 (ωh · ωi)"]);
  const shown = await page.$$eval("#figure text.halo", (labels) => labels.map((label) => label.textContent).filter((label) => label.startsWith("×")).map((label) => Number(label.slice(1))));
  assert.deepEqual([...shown].sort(), factors.map((factor) => Number(factor.toFixed(1))).sort());
  const [, least, most] = /patches (\S+) to (\S+) times/.exec(result);
  requireShown(least, Math.min(...factors), "least");
  requireShown(most, Math.max(...factors), "most");
  await done();
});

const ERRORS = /shading error is (\S+) % matte and (\S+) % glossy; with median cut, (\S+) % and (\S+) %/;

test("lights of median cut and variance minimization have the same errors of shading", async () => {
  const { page, done } = await step(15);
  for (const [choice, method] of [["refined", "variance, refined"], ["rectangles", "variance, on the sphere"], ["2009", "variance, poster"]]) {
    for (const [k, n] of [[4, 16], [6, 64], [8, 256]]) {
      const shown = ERRORS.exec(await again(page, 15, `${k};map;${choice}`));
      for (const [i, [row, surface]] of [[method, "matte"], [method, "glossy"], ["median cut", "matte"], ["median cut", "glossy"]].entries()) {
        requireShown(shown[i + 1], value(7, row, `${n} ${surface}`), `${row}, ${n} ${surface}`);
      }
    }
  }
  await done();
});

test("median cut's regions have the same shares, sizes and errors, round by round", async () => {
  const { page, done } = await step(14);
  for (const round of [1, 2, 3, 4, 5, 6]) {
    const n = 2 ** round, of = (column) => value(14, round, column);
    const { lights, diffuse } = JSON.parse(await call(page, "lights", JSON.stringify({ method: "median-cut", refine: true, n, sun: false, lamps: 0 })));
    const range = (values) => [Math.min(...values), Math.max(...values)];
    const [shares, sizes] = [range(lights.map(({ share }) => 100 * share)), range(lights.map(({ solidAngle }) => solidAngle))];
    assert.equal(lights.length, of("regions"));
    for (const [i, which] of ["smallest", "largest"].entries()) {
      requireShown(of(`${which} share${i ? "" : " of the energy"} [%]`), shares[i], `${n} regions, ${which} share`);
      requireShown(of(`${which} solid angle [sr]`), sizes[i], `${n} regions, ${which} solid angle`);
    }
    if ([2, 4, 16, 64].includes(n)) requireShown(Number((100 * diffuse).toPrecision(3)), value(6, n, "RMS error [%], matte"), `${n} lights`);
  }
  await done();
});

test("the region under the pointer has the library's share and solid angle", async () => {
  const { page, done } = await step(14, "1");
  const { lights } = JSON.parse(await call(page, "lights", JSON.stringify({ method: "median-cut", refine: true, n: 2, sun: false, lamps: 0 })));
  const box = await page.locator("#figure canvas.map").boundingBox();
  await page.mouse.move(box.x + 0.1 * box.width, box.y + 0.5 * box.height);
  await page.waitForFunction(() => /region holds/.test(document.querySelector("#figure .readout").textContent));
  const [, share, area] = /region holds (\S+)\s% of the light in (\S+)\s% of the directions/.exec(await text(page, "#figure .readout"));
  const region = lights.find((light) => Number((100 * light.share).toPrecision(3)) === Number(share));
  assert.ok(region, `a region holds ${share} %`);
  requireShown(area, 100 * region.solidAngle / (4 * Math.PI), "solid angle");
  await done();
});
