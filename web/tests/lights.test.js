// The Lights panel: rigs and their files.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { after, before, test } from "node:test";
import { settled } from "./lecture.js";
import { SMALL, canvasHash, close, launch, open, show, slide, text } from "./page.js";

before(launch);
after(close);

test("the region under the pointer names its light", async () => {
  const { page, done } = await open(`${SMALL}&panel=lights&lights=8&method=median-cut`);
  await page.waitForSelector("html[data-rig]");
  const lights = await page.evaluate(async () => {
    const settings = { method: "median-cut", refine: true, n: 8, sun: false, lamps: 0 };
    return JSON.parse(await window.domelight.app.engines.call("lights", JSON.stringify(settings))).lights;
  });
  for (const { uv: [u, v], name, share } of lights) {
    const box = await page.locator("#lights .viewer").boundingBox();
    await page.mouse.move(box.x + u * box.width, box.y + v * box.height);
    await page.waitForFunction((name) => document.getElementById("rig-readout").textContent.includes(`${name}, has `), name.replace("_", " "));
    const stated = /^In this direction, L = .*, has ([\d.]+) % of all light, spread like a disc of radius [\d.]+°\.$/.exec(await text(page, "#rig-readout"));
    assert.ok(Math.abs(Number(stated[1]) - 100 * share) < 0.1, `${stated[0]} for ${share}`);
    const left = await page.$eval("#lights .mark", (mark) => parseFloat(mark.style.left));
    assert.ok(Math.abs(left - 100 * u) < 0.1);
  }
  await done();
});

test("regions, files of every format, and what is left", async () => {
  const { page, done } = await open(SMALL);
  await show(page, "lights");
  await page.waitForSelector("html[data-rig='variance-minimization:64']");
  const many = await canvasHash(page, "rig-marks");
  await slide(page, "#n-lights", 7);
  await page.waitForSelector("html[data-rig='variance-minimization:8']");
  assert.notEqual(await canvasHash(page, "rig-marks"), many);
  await page.selectOption("#method", "median-cut");
  await page.waitForSelector("html[data-rig='median-cut:8']");
  await page.check("#leave");
  await page.waitForSelector("html[data-rig='median-cut:1']");
  assert.match(await text(page, "#rig-caption"), /the rest of the light stays on the map/);
  const buttons = "#formats button, #dome-files button";
  const names = await page.$$eval(buttons, (all) => all.map((button) => button.firstChild.textContent));
  assert.ok(names.includes("rig.usda") && names.includes("dome.exr"), names.join(" "));
  assert.match(await text(page, "#formats button:has-text('rig.py')"), /Blender/);
  for (const [i, name] of names.entries()) {
    const [download] = await Promise.all([page.waitForEvent("download"), page.locator(buttons).nth(i).click()]);
    assert.equal(download.suggestedFilename(), name);
    assert.ok(readFileSync(await download.path()).length > 100, name);
    // A browser takes many downloads at once for an attack.
    await page.waitForTimeout(250);
  }
  await done();
});

for (const method of ["median-cut", "variance-minimization"]) {
  test(`${method} step by step`, async () => {
    const { page, done } = await open(`${SMALL}&panel=lights&lights=1&refine=false&method=${method}`);
    await page.waitForSelector(`html[data-rig='${method}:1']`);
    for (const n of [2, 3, 4]) {
      await page.click("#more-lights");
      await page.waitForSelector(`html[data-rig='${method}:${n}'][data-divided='1']`);
      assert.match(await text(page, "#rig-step"), /This step divided the region along the orange line/);
    }
    await page.click("#fewer-lights");
    await page.waitForSelector(`html[data-rig='${method}:3'][data-divided='0']`);
    await page.click("#play-lights");
    assert.equal(await page.getAttribute("#play-lights", "aria-pressed"), "true");
    await page.waitForSelector(`html[data-rig='${method}:6']`);
    await page.click("#play-lights");
    const n = await page.inputValue("#n-lights");
    // Longer than a step of playback takes.
    await page.waitForTimeout(800);
    assert.equal(await page.inputValue("#n-lights"), n, "it stays where it was stopped");
    await done();
  });
}

test("a rig is exported as it is shown, whatever other panels ask of the engine meanwhile", async () => {
  const { page, done } = await open(`${SMALL}&panel=lights`);
  await page.waitForSelector("html[data-rig='variance-minimization:64']");
  for (const step of [15, 0]) {
    // The map extracts its sun, or a step of the lecture its own lights, while the panel draws its rig again.
    await page.evaluate(() => delete document.documentElement.dataset.rig);
    if (step) {
      await show(page, "lecture");
      await page.click(`#steps li:nth-child(${step}) a`);
    } else await show(page, "map");
    await show(page, "lights");
    await page.waitForSelector("html[data-rig='variance-minimization:64']");
    const [download] = await Promise.all([page.waitForEvent("download"), page.click("#formats button:has-text('rig.csv')")]);
    const rows = readFileSync(await download.path(), "utf8").trim().split("\n").filter((row) => /^light_/.test(row.split(",")[0].replaceAll('"', "")));
    assert.equal(rows.length, 64, rows[0]);
  }
  await done();
});

test("where there are no lights, the panel says why and offers nothing", async () => {
  const { page, done } = await open(`${SMALL}&panel=lights`);
  await page.waitForSelector("html[data-rig='variance-minimization:64']");
  await page.evaluate(() => window.domelight.app.set({ env: "constant", sun: true, leave: true }));
  await page.waitForSelector("html[data-rig='none']");
  assert.match(await text(page, "#rig-caption"), /^There are no lights: /);
  assert.equal(await page.locator("#formats button").count(), 0);
  await page.evaluate(() => window.domelight.app.set({ env: "sky", sun: false, leave: false }));
  await page.waitForSelector("html[data-rig='variance-minimization:64']");
  assert.ok(await page.locator("#formats button").count() > 5);
  await done();
});

test("a sign says that the page works, until it is done", async () => {
  const { page, done } = await open(`${SMALL}&panel=lights`);
  await page.waitForSelector("#ibl-files button");
  await page.waitForSelector("#busy", { state: "hidden" });
  await page.selectOption("#ibl-size", "64");
  await page.click("#ibl-files button");
  await page.waitForSelector("#busy", { state: "visible" });
  await page.waitForFunction(() => /is saved/.test(document.getElementById("status").textContent));
  await page.waitForSelector("#busy", { state: "hidden" });
  // While a figure renders, too.
  await page.evaluate((hash) => { location.hash = hash; }, `${SMALL}&panel=lecture&step=9&figure=0.5;0.08;0.6;sphere;3`);
  await page.waitForSelector("#busy", { state: "visible" });
  await settled(page);
  await page.waitForSelector("#busy", { state: "hidden" });
  await done();
});
