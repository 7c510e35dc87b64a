// The film's bits are the program's, for every strategy: the files that both write are the same, byte for byte.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, readdirSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { bytesOf, close, drop, launch, open, pixelsOf, program, rendered, renderedAnew, slide } from "./page.js";
import { requireTheSame } from "./same.js";

// One for each kind of strategy, and for what differs most within a kind.
const STRATEGIES = [
  "brdf:2", "environment:2", "mis:2:1", "mis:1:1:heuristic=balance:no-compensation", "product:8", "product:3", "rejection:8",
  "rejection:rays=2:tries=16", "sir:2/32", "sir:2", "sir:2/16:from=brdf:resampling=multinomial", "median-cut:16", "variance-minimization:16",
];

before(launch);
after(close);

const STATE = "scene=material-ball&env=studio&rows=64&rotate=30&ev=0.5&material=phong%3A50%3A0.6%3A0.3&size=72&spp=5&seed=7";

test("every strategy has the program's bytes", async (t) => {
  assert.ok(program, "no domelight in target/: build it first, or set DOMELIGHT");
  const [first, ...others] = STRATEGIES, { page, done } = await open(`${STATE}&strategy=${encodeURIComponent(first)}`);
  const folder = mkdtempSync(join(tmpdir(), "domelight-web-"));
  try {
    await rendered(page);
    await t.test(first, () => requireTheSame(page, folder));
    for (const strategy of others) await t.test(strategy, async () => {
      await renderedAnew(page, () => page.evaluate((strategy) => window.domelight.app.set({ strategy }), strategy));
      assert.ok((await requireTheSame(page, folder)).includes(`--strategy=${strategy}`));
    });
  } finally {
    rmSync(folder, { recursive: true });
  }
  await done();
});

test("an orbited camera is the command line's", async () => {
  const { page, done } = await open(`${STATE}&strategy=mis:1:1`);
  const folder = mkdtempSync(join(tmpdir(), "domelight-web-"));
  try {
    await rendered(page);
    await page.focus("#viewer");
    for (const key of ["ArrowLeft", "ArrowUp", "+"]) await page.keyboard.press(key);
    await page.waitForTimeout(400);
    await rendered(page);
    assert.match(await requireTheSame(page, folder), /--origin=/);
  } finally {
    rmSync(folder, { recursive: true });
  }
  await done();
});

test("exposure and curve are the command line's", async () => {
  const { page, done } = await open(`${STATE}&strategy=mis:1:1&exposure=-1.3&curve=neutral&scale=2`);
  const folder = mkdtempSync(join(tmpdir(), "domelight-web-"));
  try {
    await rendered(page);
    const command = await requireTheSame(page, folder);
    assert.match(command, /--env-scale=2 .*--exposure=-1\.3 --tone=neutral/);
  } finally {
    rmSync(folder, { recursive: true });
  }
  await done();
});

test("light for engines and shaders has the program's bytes", async () => {
  const folder = mkdtempSync(join(tmpdir(), "domelight-web-"));
  const { page, done } = await open("panel=lights&scene=sphere&env=studio&rows=32&rotate=30&ev=0.5&size=32&spp=1&lights=8&sun=true");
  await page.waitForSelector("#ibl-files button");
  await page.waitForSelector("html[data-rig]");
  /** Compares the files of buttons with those that the command writes. */
  const compare = async (buttons, command, ...more) => {
    const words = (await page.$eval(command, (pre) => pre.textContent)).split(" ").slice(1);
    execFileSync(program, ["-q", ...words, ...more], { cwd: folder });
    for (const button of await page.$$(buttons)) {
      const [download] = await Promise.all([page.waitForEvent("download"), button.click()]);
      const name = download.suggestedFilename(), expected = readFileSync(join(folder, name));
      assert.ok(readFileSync(await download.path()).equals(expected), name);
    }
  };
  /** Compares the files of the archive with those of the folder that the command writes. */
  const compareArchive = async () => {
    const words = (await page.$eval("#ibl-command", (pre) => pre.textContent)).split(" ").slice(1);
    assert.match(words.join(" "), /-o studio\/ .*--layout octahedral/);
    execFileSync(program, ["-q", ...words], { cwd: folder });
    const [download] = await Promise.all([page.waitForEvent("download"), page.click("#ibl-files button")]);
    assert.equal(download.suggestedFilename(), "studio.zip");
    execFileSync("python3", ["-m", "zipfile", "-e", await download.path(), join(folder, "archive")]);
    const [found, names] = ["archive", "studio"].map((name) => readdirSync(join(folder, name)).sort());
    assert.deepEqual(found, names);
    assert.ok(names.includes("radiance_06.exr") && names.includes("irradiance.exr"));
    for (const name of names) assert.ok(readFileSync(join(folder, "archive", name)).equals(readFileSync(join(folder, "studio", name))), name);
  };
  try {
    await page.selectOption("#ibl-size", "64");
    await compare("#ibl-files button", "#ibl-command");
    await page.selectOption("#ibl-engine", "filament");
    await page.selectOption("#ibl-sun", "clamp");
    await page.fill("#ibl-clamp", "20");
    await page.press("#ibl-clamp", "Tab");
    await page.selectOption("#ibl-texels", "half");
    await page.selectOption("#ibl-file", "dds");
    assert.match(await page.$eval("#ibl-command", (pre) => pre.textContent), /--for filament --size 64 --sun clamp:20 --texels half$/);
    await compare("#ibl-files button", "#ibl-command");
    for (const file of ["ktx", "env"]) {
      await page.selectOption("#ibl-file", file);
      await compare("#ibl-files button", "#ibl-command");
    }
    await page.selectOption("#ibl-file", "zip");
    await page.selectOption("#ibl-layout", "octahedral");
    await compareArchive();
    const cube = join(folder, "studio.dds");
    await page.selectOption("#tables-language", "glsl");
    await page.selectOption("#tables-texels", { index: 0 });
    await page.check("#tables-compensated");
    await compare("#tables-files button", "#tables-command");
    await compare(["json", "tscn", "usda"].map((kind) => `#formats button:has-text('rig.${kind}')`).join(), "#rig-command", "-o", "rig.tscn", "-o", "rig.usda");
    // The cube is a probe, too.
    await drop(page, [cube]);
    await page.waitForFunction(() => window.domelight.app.envName === "studio.dds" && window.domelight.app.probe.size.join() === "202,101");
  } finally {
    rmSync(folder, { recursive: true });
  }
  await done();
});

for (const query of ["", "?2d"]) {
  test(`what is seen is the picture's PNG, by every curve${query && ", without WebGL2"}`, async () => {
    // Bright metal and its highlights, and a background.
    const { page, done } = await open("scene=spheres&env=sky&rows=64&rotate=30&size=96&spp=4&strategy=mis:1:1", { query });
    await rendered(page);
    for (const curve of ["agx", "aces", "neutral", "reinhard", "standard"]) {
      await page.selectOption("#curve", curve);
      for (const exposure of [-5, -1, 2, 7]) {
        await slide(page, "#exposure", exposure);
        const seen = await pixelsOf(page, "film");
        const expected = await bytesOf(page, async () => {
          const bytes = await window.domelight.picture.file("png");
          const bitmap = await createImageBitmap(new Blob([bytes], { type: "image/png" }), { colorSpaceConversion: "none", premultiplyAlpha: "none" });
          const canvas = Object.assign(document.createElement("canvas"), { width: bitmap.width, height: bitmap.height });
          const context = canvas.getContext("2d", { willReadFrequently: true });
          context.drawImage(bitmap, 0, 0);
          return context.getImageData(0, 0, canvas.width, canvas.height).data.filter((_, i) => i % 4 < 3);
        });
        assert.equal(seen.length, expected.length);
        const most = seen.reduce((most, byte, i) => Math.max(most, Math.abs(byte - expected[i])), 0);
        assert.ok(most <= 2, `${curve} at ${exposure} EV differs by ${most}`);
      }
    }
    await done();
  });
}
