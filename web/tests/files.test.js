// Files that are dropped from the disk, what is refused, and memory.

import assert from "node:assert/strict";
import { mkdirSync, mkdtempSync, rmSync, truncateSync, writeFileSync } from "node:fs";
import { availableParallelism, tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { after, before, test } from "node:test";
import { OBJ, SCENE, glb, gltf, png } from "./models.js";
import { close, drop, launch, memory, open, rendered, renderedAnew, text } from "./page.js";

let folder;
/** A small picture of the scene that a page without a link shows. */
const SMALL = "size=64&spp=4&rows=64";

before(async () => {
  folder = mkdtempSync(join(tmpdir(), "domelight-web-"));
  await launch();
});
after(async () => {
  await close();
  rmSync(folder, { recursive: true });
});

/** Puts a file on the disk. */
function put(name, bytes) {
  const path = join(folder, name);
  mkdirSync(dirname(path), { recursive: true });
  writeFileSync(path, bytes);
  return path;
}

/** R, G and B in the middle of the picture. */
const middle = (page) => page.evaluate(() => {
  const { pixels, width, height } = window.domelight.picture.films[0], at = 4 * (Math.floor(height / 2) * width + width / 2);
  return [...pixels.slice(at, at + 3)];
});

test("a GLB is dropped", async () => {
  const { page, done } = await open(SMALL);
  await rendered(page);
  await renderedAnew(page, () => drop(page, [put("triangle.glb", glb())]));
  assert.equal(await page.inputValue("#scene"), "triangle.glb");
  const [red, green] = await middle(page);
  assert.ok(red > 3 * green, `red ${red}, green ${green}`);
  await done();
});

test("a folder with a glTF file and what it refers to is dropped", async () => {
  for (const [name, bytes] of Object.entries(gltf())) put(join("model", name), bytes);
  const { page, done } = await open(SMALL);
  await rendered(page);
  await renderedAnew(page, () => drop(page, [join(folder, "model")]));
  assert.equal(await page.inputValue("#scene"), "model/scene.gltf");
  const [red, green] = await middle(page);
  assert.ok(red > 3 * green, `red ${red}, green ${green}`);
  await done();
});

test("a damaged file is named, and the picture stays", async () => {
  const { page, done } = await open(SMALL);
  await rendered(page);
  const before = await middle(page);
  for (const [name, bytes] of [["cut.glb", glb().subarray(0, 60)], ["flipped.glb", Buffer.from(glb().map((byte, i) => (i < 4 ? 0 : byte)))], ["cut.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 64 +X 128\n"]]) {
    await drop(page, [put(name, bytes)]);
    await page.waitForFunction((name) => document.querySelector("#status.error")?.textContent.includes(name), name);
  }
  assert.deepEqual(await middle(page), before);
  assert.equal(await page.inputValue("#scene"), "statue");
  assert.equal(await page.inputValue("#env"), "sky");
  await done();
});

test("a scene stays when a probe is dropped, and its material can be changed", async () => {
  const { page, done } = await open(SMALL);
  await rendered(page);
  await renderedAnew(page, () => drop(page, [put("triangle.glb", glb())]));
  // A Radiance picture of one color.
  const hdr = Buffer.concat([Buffer.from("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n"), ...Array(8).fill(Buffer.from([128, 64, 32, 129]))]);
  await renderedAnew(page, () => drop(page, [put("orange.hdr", hdr)]));
  await renderedAnew(page, () => page.selectOption("#model", "ggx"));
  assert.equal(await page.inputValue("#scene"), "triangle.glb");
  assert.equal(await page.inputValue("#env"), "orange.hdr");
  assert.equal(await page.$("#status.error"), null);
  await done();
});

/** A Radiance picture of two colors, one above the other, in runs. */
function runs(width, height) {
  const line = (bytes) => {
    const component = (byte) => [...Array(Math.floor(width / 127)).fill([255, byte]), [128 + width % 127, byte]].flat();
    return Buffer.from([2, 2, width >> 8, width & 255, ...bytes.flatMap(component)]);
  };
  const [above, below] = [[128, 128, 200, 129], [64, 32, 16, 129]].map(line);
  return Buffer.concat([Buffer.from(`#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y ${height} +X ${width}\n`), ...Array.from({ length: height }, (_, y) => (y < height / 2 ? above : below))]);
}

test("a map of 16k is offered at half and a quarter of its size", async () => {
  const { page, done } = await open("size=32&spp=1&rows=64&scene=sphere&strategy=mis:1:1");
  await rendered(page);
  await drop(page, [put("vast.hdr", runs(16384, 8192))]);
  await page.waitForSelector("#smaller:not([hidden])");
  assert.match(await text(page, "#smaller"), /vast\.hdr has 16384 × 8192 texels/);
  assert.deepEqual(await page.$$eval("#smaller button", (all) => all.map(({ textContent }) => textContent)), ["Half: 8192 × 4096", "A quarter: 4096 × 2048"]);
  assert.equal(await page.inputValue("#env"), "sky");
  await renderedAnew(page, () => page.click("#smaller button:has-text('quarter')"));
  assert.equal(await page.inputValue("#env"), "vast.hdr");
  assert.equal(await page.isVisible("#smaller"), false);
  assert.deepEqual(await page.evaluate(() => window.domelight.app.probe.size), [4096, 2048]);
  assert.match(await text(page, "#warnings"), /its 16384x8192 texels are averaged to 4096x2048, with the same light/);
  await page.waitForFunction(() => /reduce=4/.test(location.hash));
  await done();
});

test("files beyond what memory holds are refused before they are read", async () => {
  const { page, done } = await open(SMALL);
  await rendered(page);
  const path = put("huge.glb", "");
  // A file with a hole takes no room on the disk.
  truncateSync(path, 1.5 * 2 ** 30);
  await drop(page, [path]);
  await page.waitForSelector("#status.error");
  assert.match(await text(page, "#status"), /1\.5 GiB exceed this page’s limit of 1 GiB/);
  await done();
});

test("memory is bounded while the camera orbits", async () => {
  // A film kept of each of some 200 views would be 200 MB. More by hand: an hour is 3600.
  const seconds = Number(process.env.ORBIT_SECONDS ?? 8);
  const { page, done } = await open("size=256&spp=4&rows=64&view=error", { refers: true });
  await rendered(page);
  await page.focus("#viewer");
  const orbit = async (seconds) => {
    for (const end = performance.now() + 1000 * seconds; performance.now() < end;) {
      await page.keyboard.press("ArrowLeft");
      await page.waitForTimeout(40);
    }
    await rendered(page);
  };
  await orbit(Math.min(0.5 * seconds, 60));
  const before = await memory();
  await orbit(seconds);
  const after = await memory();
  assert.ok(after < before + 100, `from ${Math.round(before)} to ${Math.round(after)} MB`);
  await done();
});

test("a link that names files waits for them", async () => {
  const { page, done } = await open(`${SMALL}&scene=robot.glb&env=yard.hdr&rotate=10&material=diffuse:0.5&spp=3`);
  await rendered(page);
  assert.match(await text(page, "#wanted"), /drop robot\.glb and yard\.hdr here.*statue under sky/);
  assert.match(await text(page, "#command"), /render robot\.glb --env yard\.hdr/);
  const before = await middle(page);
  await renderedAnew(page, () => drop(page, [put("robot.glb", glb())]));
  assert.match(await text(page, "#wanted"), /drop yard\.hdr here.*robot\.glb under sky/);
  assert.notDeepEqual(await middle(page), before);
  const hdr = Buffer.concat([Buffer.from("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n"), ...Array(8).fill(Buffer.from([128, 64, 32, 129]))]);
  await renderedAnew(page, () => drop(page, [put("yard.hdr", hdr)]));
  assert.ok(await page.isHidden("#wanted"));
  assert.equal(await page.inputValue("#rotate"), "10", "what the link says of it stays");
  assert.equal(await page.inputValue("#material"), "diffuse:0.5");
  await done();
});

test("PNG and JPEG are light probes, unless they come with a scene", async () => {
  const { page, done } = await open(SMALL);
  await rendered(page);
  await renderedAnew(page, () => drop(page, [put("room.png", png(16, [200, 40, 40]))]));
  assert.equal(await page.inputValue("#env"), "room.png");
  const [red, green] = await middle(page);
  assert.ok(red > 2 * green, `red ${red}, green ${green}`);
  const jpeg = await page.evaluate(async () => {
    const canvas = Object.assign(document.createElement("canvas"), { width: 16, height: 8 });
    const context = canvas.getContext("2d");
    context.fillStyle = "#2030c0";
    context.fillRect(0, 0, 16, 8);
    const blob = await new Promise((done) => canvas.toBlob(done, "image/jpeg"));
    return [...new Uint8Array(await blob.arrayBuffer())];
  });
  await renderedAnew(page, () => drop(page, [put("room.jpg", Buffer.from(jpeg))]));
  assert.equal(await page.inputValue("#env"), "room.jpg");
  await renderedAnew(page, () => drop(page, [put("triangle.glb", glb()), put("texture.png", png(16, [0, 0, 0]))]));
  assert.equal(await page.inputValue("#env"), "room.jpg");
  await done();
});

test("what was repaired stays on the page, until there is other light", async () => {
  const rows = Buffer.alloc(4 * 3 * 8);
  for (let i = 0; i < 24; i++) rows.writeFloatLE(i === 5 ? NaN : 1, 4 * i);
  const { page, done } = await open(SMALL);
  await rendered(page);
  await renderedAnew(page, () => drop(page, [put("nan.pfm", Buffer.concat([Buffer.from("PF\n4 2\n-1\n"), rows]))]));
  assert.match(await text(page, "#warnings"), /nan\.pfm: repaired 0 negative and 1 NaN/);
  assert.doesNotMatch(await text(page, "#warnings"), /--/, "no options of the program");
  assert.ok(await page.isVisible("#warnings"));
  await renderedAnew(page, () => page.selectOption("#env", "studio"));
  assert.equal(await page.isVisible("#warnings"), false);
  await done();
});

test("a scene file brings its camera and its light", async () => {
  const { page, done } = await open(SMALL);
  await rendered(page);
  await renderedAnew(page, () => drop(page, [put("triangle.obj", OBJ), put("scene.toml", SCENE)]));
  assert.equal(await page.inputValue("#scene"), "scene.toml");
  assert.equal(await page.inputValue("#env"), "studio");
  assert.equal(await page.inputValue("#rotate"), "40");
  assert.match(await text(page, "#command"), /--env studio .*--env-rotate=40 --env-exposure=1 --env-scale=0\.5/);
  const [red, green] = await middle(page);
  assert.ok(red > 3 * green, `red ${red}, green ${green}`);
  await done();
});

test("the cameras of a file are chosen from", async () => {
  const { page, done } = await open(SMALL);
  await rendered(page);
  assert.ok(await page.isHidden("#camera"));
  await renderedAnew(page, () => drop(page, [put("cameras.glb", glb({ cameras: true }))]));
  assert.deepEqual(await page.$$eval("#camera option", (all) => all.map((option) => option.textContent)), ["near", "far"]);
  const [near] = await middle(page);
  await renderedAnew(page, () => page.selectOption("#camera", "1"));
  assert.match(await text(page, "#command"), /--origin=0,0\.5,40 /);
  const [far] = await middle(page);
  assert.notEqual(far, near);
  await page.focus("#viewer");
  await renderedAnew(page, () => page.keyboard.press("ArrowLeft"));
  assert.equal(await page.$eval("#camera option:checked", (option) => option.textContent), "custom");
  await done();
});

test("fewer Workers hold a scene that is too large for all", async () => {
  // All Workers and that of the reference fit with a small scene, see `ENGINE_MEMORY` in app.ts.
  const n = Math.max(2, Math.min(availableParallelism(), 8));
  const { page, done } = await open(SMALL, { query: `?memory=${0.043 * (n + 1)}` });
  await rendered(page);
  const all = await page.evaluate(() => window.domelight.app.engines.hosts.length);
  await renderedAnew(page, () => drop(page, [put("large.glb", glb({ padding: 24 << 20 }))]));
  await page.waitForFunction(() => /Workers, because memory is limited/.test(document.getElementById("status").textContent));
  assert.match(await text(page, "#status"), new RegExp(`on [1-${all - 1}] of ${all} Workers`));
  const [red, green] = await middle(page);
  assert.ok(red > 3 * green, `red ${red}, green ${green}`);
  await renderedAnew(page, () => drop(page, [put("triangle.glb", glb())]));
  assert.equal(await page.evaluate(() => window.domelight.app.engines.active), all, "all work again");
  await done();
});
