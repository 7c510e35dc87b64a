// The Picture panel: the picture, its camera, materials and strategies.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { after, before, test } from "node:test";
import { SMALL, brightness, canvasHash, close, launch, open, rendered, renderedAnew, slide, text } from "./page.js";

before(launch);
after(close);

test("the first picture is small, then it is refined", async () => {
  const { page, done } = await open("size=256&spp=2&rows=64");
  assert.equal(await page.$eval("#film", (canvas) => canvas.dataset.painter), "webgl2");
  await rendered(page);
  assert.equal(await page.$eval("#film", (canvas) => canvas.width), 256);
  assert.ok(await brightness(page, "film") > 80);
  assert.match(await text(page, "#counts"), /2(\.\d)? samples per pixel/);
  await done();
});

test("without WebGL2 the picture is the same", async () => {
  const gpu = await open(SMALL);
  await rendered(gpu.page);
  const expected = await brightness(gpu.page, "film");
  await gpu.done();
  const plain = await open(SMALL, { query: "?2d" });
  await rendered(plain.page);
  await plain.page.waitForTimeout(500);
  assert.equal(await plain.page.$eval("#film", (canvas) => canvas.dataset.painter), "2d");
  assert.ok(Math.abs(await brightness(plain.page, "film") - expected) < 0.5);
  await plain.done();
});

test("orbiting shows a small picture at once", async () => {
  const { page, done } = await open("size=256&spp=2&rows=64");
  await rendered(page);
  const whole = await canvasHash(page, "film");
  const box = await page.locator("#viewer").boundingBox();
  await page.evaluate(() => delete document.documentElement.dataset.preview);
  await page.mouse.move(box.x + 300, box.y + 300);
  await page.mouse.down();
  await page.mouse.move(box.x + 360, box.y + 280, { steps: 3 });
  await page.waitForSelector("html[data-preview]");
  await page.mouse.up();
  await page.waitForTimeout(300);
  await rendered(page);
  assert.notEqual(await canvasHash(page, "film"), whole);
  assert.match(await page.evaluate(() => location.hash), /camera=/);
  await renderedAnew(page, () => page.click("#reset-camera"));
  assert.equal(await canvasHash(page, "film"), whole, "the first view is back, to the bit");
  await done();
});

test("exposure, curve and material change the picture", async () => {
  const { page, done } = await open(SMALL);
  await rendered(page);
  const middle = await brightness(page, "film");
  await slide(page, "#exposure", -6);
  assert.ok(await brightness(page, "film") < middle - 20);
  await page.click("#auto");
  assert.ok(Math.abs(await brightness(page, "film") - middle) < 1);
  const agx = await canvasHash(page, "film");
  await page.selectOption("#curve", "neutral");
  assert.notEqual(await canvasHash(page, "film"), agx);
  await page.selectOption("#curve", "agx");
  await renderedAnew(page, () => page.selectOption("#model", "ggx"));
  assert.match(await text(page, "#command"), /--material=ggx:0\.2:gold/);
  assert.notEqual(await canvasHash(page, "film"), agx);
  await renderedAnew(page, () => slide(page, "#material-numbers input", 0.6));
  assert.match(await text(page, "#command"), /ggx:0\.6:gold/);
  await page.fill("#material", "velvet");
  await page.keyboard.press("Enter");
  await page.waitForSelector("#status.error");
  assert.match(await text(page, "#status"), /velvet/);
  await done();
});

test("two strategies at equal rays, with a divider", async () => {
  const { page, done } = await open("size=256&spp=8&rows=64&strategy=brdf:4&beside=product:8");
  await rendered(page);
  assert.ok(await page.isVisible("#divider"));
  assert.equal(await text(page, "#tag-right"), "product:8");
  const half = await canvasHash(page, "film");
  await page.focus("#divider");
  await page.keyboard.press("Home");
  const right = await canvasHash(page, "film");
  await page.keyboard.press("End");
  const left = await canvasHash(page, "film");
  assert.ok(new Set([half, left, right]).size === 3);
  const rays = await page.evaluate(() => window.domelight.picture.jobs.map((job) => job.statistics.shadowRays));
  assert.ok(Math.abs(rays[0] / rays[1] - 1) < 0.02, `rays ${rays}`);
  await done();
});

test("one material of a model is chosen in the picture and changed alone", async () => {
  const { page, done } = await open("scene=statue&size=64&spp=2&rows=64&strategy=mis:1:1");
  await rendered(page);
  const film = () => page.evaluate(() => [...window.domelight.picture.films[0].pixels]);
  const chosen = () => page.$eval("#one-material", (select) => select.selectedOptions[0].textContent);
  const pick = async (x, y, name) => {
    const { width, height } = await page.locator("#viewer").boundingBox();
    await page.click("#viewer", { position: { x: x * width, y: y * height } });
    await page.waitForFunction((name) => document.getElementById("status").textContent.endsWith(`its material is ${name}`), name);
  };
  assert.deepEqual(await page.$$eval("#one-material option", (all) => all.map(({ textContent }) => textContent)), ["all of the subject", "marble", "stone", "floor"]);
  const before = await film();
  await pick(0.1, 0.9, "floor");
  assert.equal(await chosen(), "floor");
  await pick(0.5, 0.4, "marble");
  assert.equal(await chosen(), "marble");
  assert.match(await page.getAttribute("#material", "placeholder"), /^gltf:0\.76,0\.71,0\.64:0:0\.42 in the file$/);
  // The controls of its own model start with its own values.
  await renderedAnew(page, () => page.selectOption("#model", "gltf"));
  assert.equal(await page.inputValue("#material"), "gltf:0.76,0.71,0.64:0:0.42");
  await renderedAnew(page, () => page.selectOption("#model", "diffuse"));
  assert.equal(await chosen(), "marble, changed");
  assert.equal(await page.isVisible("#command-lacks"), true);
  const after = await film(), at = (pixels, x, y) => pixels.slice(4 * (y * 64 + x), 4 * (y * 64 + x) + 3);
  assert.notDeepEqual(at(after, 32, 26), at(before, 32, 26));
  assert.deepEqual(at(after, 6, 58), at(before, 6, 58), "the floor stays");
  // A link carries it.
  await page.waitForFunction(() => /materials=/.test(location.hash));
  const { page: other, done: alsoDone } = await open((await page.url()).split("#")[1]);
  await rendered(other);
  assert.deepEqual(await other.evaluate(() => [...window.domelight.picture.films[0].pixels]), after);
  await alsoDone();
  // With another material for the rest, it stays.
  await page.selectOption("#one-material", "");
  await renderedAnew(page, () => page.selectOption("#model", "ggx"));
  assert.deepEqual(at(await film(), 32, 26), at(after, 32, 26));
  await renderedAnew(page, () => page.selectOption("#model", ""));
  await page.selectOption("#one-material", { label: "marble, changed" });
  await renderedAnew(page, () => page.click("#as-in-file"));
  assert.deepEqual(await film(), before);
  assert.equal(await page.isVisible("#as-in-file"), false);
  await done();
});

test("every material has controls for all that its text says", async () => {
  const { page, done } = await open(`${SMALL}&size=24&spp=1&strategy=brdf:1`);
  await rendered(page);
  const models = await page.$$eval("#model option", (all) => all.map((option) => option.value).filter(Boolean));
  assert.deepEqual(models, ["diffuse", "phong", "ward", "ggx", "beckmann", "gltf", "mix"]);
  for (const model of models) {
    await page.selectOption("#model", model);
    const n = (await page.$$("#material-numbers :is(input, select)")).length;
    for (let i = 0; i < n; i++) {
      const control = (await page.$$("#material-numbers :is(input, select)"))[i];
      if (!await control.isVisible()) continue;
      const before = await page.inputValue("#material");
      await control.evaluate((control) => {
        if (control.type === "color") control.value = "#4080c0";
        else if (control.type === "range") control.value = String(Number(control.min) + 0.6 * (Number(control.max) - Number(control.min)));
        else control.selectedIndex = (control.selectedIndex + 1) % control.options.length;
        control.dispatchEvent(new Event("input", { bubbles: true }));
        control.dispatchEvent(new Event("change", { bubbles: true }));
      });
      const after = await page.inputValue("#material");
      assert.notEqual(after, before, `${model}, control ${i}`);
      await page.waitForFunction((material) => document.getElementById("command").textContent.includes(material.split(":")[1] ?? material), after);
      await rendered(page);
      assert.equal(await page.$("#status.error"), null, `${after}: ${await text(page, "#status")}`);
    }
  }
  // What the text says is on the controls.
  await renderedAnew(page, () => page.fill("#material", "ggx:0.2,0.1:0.9,0.5,0.1:correlated").then(() => page.keyboard.press("Enter")));
  assert.deepEqual(await page.$$eval("#material-numbers :is(input, select)", (all) => all.map(({ value }) => value)), ["0.2", "0.5", "color", "#f3bc59", "correlated", "multiple"]);
  await renderedAnew(page, () => page.fill("#material", "ggx:0.2:gold:single").then(() => page.keyboard.press("Enter")));
  assert.equal(await page.$$eval("#material-numbers select", (all) => all.at(-1).value), "single");
  await done();
});

test("the command, the link and both pictures are taken away", async () => {
  const { page, done } = await open(`${SMALL}&strategy=brdf:2`);
  await rendered(page);
  await page.evaluate(() => {
    window.copied = [];
    navigator.clipboard.writeText = async (text) => { window.copied.push(text); };
  });
  await page.click("#copy-command");
  await page.waitForFunction(() => document.getElementById("status").textContent === "Command copied");
  await slide(page, "#exposure", -2);
  await page.selectOption("#curve", "aces");
  await page.click("#copy-command");
  await page.click("#copy-link");
  await page.waitForFunction(() => document.getElementById("status").textContent === "Link copied");
  const [plain, developed, link] = await page.evaluate(() => window.copied);
  assert.match(plain, /^domelight render sphere --env sky --env-rows=64 .*--strategy=brdf:2 --spp=4 --passes=doubling -o domelight\.exr -o domelight\.png$/);
  assert.match(developed, /--exposure=-2 --tone=aces -o/);
  assert.match(link, /^file:.*#.*exposure=-2&curve=aces/);
  for (const [kind, magic] of [["exr", [0x76, 0x2f, 0x31, 0x01]], ["png", [0x89, 0x50, 0x4e, 0x47]]]) {
    const [download] = await Promise.all([page.waitForEvent("download"), page.click(`#save-${kind}`)]);
    assert.equal(download.suggestedFilename(), `domelight.${kind}`);
    assert.deepEqual([...readFileSync(await download.path()).subarray(0, 4)], magic);
    await page.waitForTimeout(250);
  }
  await done();
});

test("the picture stays in sight while its controls are used", async () => {
  const { page, done } = await open(SMALL);
  await rendered(page);
  for (const [width, height] of [[1280, 800], [1366, 768], [390, 844]]) {
    await page.setViewportSize({ width, height });
    for (const control of ["#scene", "#spp", "#seed", "#copy-command"]) {
      await page.focus(control);
      await page.locator(control).scrollIntoViewIfNeeded();
      const seen = await page.evaluate((control) => {
        const viewer = document.getElementById("viewer").getBoundingClientRect(), own = document.querySelector(control).getBoundingClientRect();
        const shown = Math.min(viewer.bottom, innerHeight) - Math.max(viewer.top, 0);
        const covered = document.elementFromPoint(own.left + own.width / 2, own.top + own.height / 2);
        return { share: shown / viewer.height, onTop: !!covered?.closest(control) };
      }, control);
      assert.ok(seen.share > 0.9, `${control} at ${width} × ${height}: ${Math.round(100 * seen.share)} % of the picture is seen`);
      assert.ok(seen.onTop, `${control} at ${width} × ${height} is not covered`);
    }
  }
  await done();
});

test("zooming ends far outside and close to the scene", async () => {
  const { page, done } = await open(SMALL);
  await rendered(page);
  const box = await page.locator("#viewer").boundingBox();
  await page.mouse.move(box.x + 50, box.y + 50);
  for (const [by, last] of [[100, 1e3], [-100, 1e-3]]) {
    await page.evaluate((by) => {
      for (let i = 0; i < 80; i++) document.getElementById("viewer").dispatchEvent(new WheelEvent("wheel", { deltaY: by, cancelable: true }));
    }, by);
    await rendered(page);
    const distance = await page.evaluate(() => {
      const { state: { camera: { origin, target } }, scene } = window.domelight.app;
      return Math.hypot(...origin.map((c, i) => c - target[i])) / scene.radius;
    });
    assert.ok(Math.abs(distance / last - 1) < 0.05, `${distance} radii`);
  }
  await done();
});

test("the default picture begins with its own exposure, without waiting for it", async () => {
  const script = `document.addEventListener("painted", ({ target }) => {
    if (target.id === "film") window.begun ??= window.domelight?.picture.view?.look.exposure;
  }, true);`;
  const { page, done } = await open("", { script });
  await page.waitForFunction(() => window.begun !== undefined && window.domelight.picture.automatic.view);
  const [begun, automatic] = await page.evaluate(() => [window.begun, window.domelight.picture.automatic.exposure]);
  assert.equal(begun, Number(automatic.toFixed(2)));
  await done();
});
