// The Map and the X-ray: what a pixel samples.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { SMALL, brightness, canvasHash, close, launch, open, rendered, show, text } from "./page.js";

/** A picture of what is not matte. */
const GLOSSY = SMALL.replace("sphere", "statue");

before(launch);
after(close);

test("the map turns, shows the sun, and what a pixel samples", async () => {
  const { page, done } = await open(SMALL);
  await rendered(page);
  await show(page, "map");
  await page.waitForSelector("html[data-map]");
  assert.match(await text(page, "#map-caption"), /sky, 128 × 64 texels, rotated by 125°; the sun is outlined/);
  const first = await canvasHash(page, "map-film");
  await page.focus("#map-viewer");
  await page.keyboard.press("Shift+ArrowLeft");
  await page.waitForFunction(() => /130°/.test(document.getElementById("map-caption").textContent));
  assert.notEqual(await canvasHash(page, "map-film"), first);
  await page.selectOption("#mapping", "angular");
  await page.waitForFunction(() => document.getElementById("map-film").width === document.getElementById("map-film").height);
  await page.selectOption("#mapping", "lat-long");
  await show(page, "picture");
  const box = await page.locator("#viewer").boundingBox();
  await page.mouse.click(box.x + 0.42 * box.width, box.y + 0.42 * box.height);
  await show(page, "map");
  await page.waitForFunction(() => Number(document.documentElement.dataset.samples) > 0);
  assert.match(await text(page, "#point-table"), /Radiance, by quadrature/);
  const marks = await canvasHash(page, "map-marks");
  await page.selectOption("#layer", "target");
  assert.notEqual(await canvasHash(page, "map-marks"), marks);
  await done();
});

test("samples and layers are drawn in every layout of the map", async () => {
  const { page, done } = await open(`${GLOSSY}&panel=map&pixel=[27,27]&strategy=mis:1:1`, { reducedMotion: "reduce" });
  const layers = await page.$$eval("#layer option", (all) => all.map((option) => option.value));
  assert.ok(["product", "sir", "rejection", "own", "target"].every((layer) => layers.includes(layer)));
  for (const mapping of await page.$$eval("#mapping option", (all) => all.map((option) => option.value))) {
    await page.selectOption("#mapping", mapping);
    await page.uncheck("#show-samples");
    await page.uncheck("#show-sun");
    await page.selectOption("#layer", "");
    const shown = (layer) => page.waitForSelector(`html[data-layer="${layer} ${mapping}"]`, { state: "attached" });
    await shown("");
    const seen = new Set([await canvasHash(page, "map-marks")]);
    // All of them in one layout, one of each kind in the others.
    const some = mapping === "lat-long" ? layers : ["", "target", "sir"];
    for (const layer of some.slice(1)) {
      await page.selectOption("#layer", layer);
      await shown(layer);
      const hash = await canvasHash(page, "map-marks");
      assert.ok(!seen.has(hash) || layer === "own", `${layer} of ${mapping} is like another`);
      seen.add(hash);
    }
    const without = await canvasHash(page, "map-marks");
    await page.check("#show-samples");
    const samples = await canvasHash(page, "map-marks");
    assert.notEqual(samples, without, `samples on ${mapping}`);
    await page.check("#show-sun");
    assert.notEqual(await canvasHash(page, "map-marks"), samples, `the sun on ${mapping}`);
    const [map, marks] = await Promise.all(["map-film", "map-marks"].map((id) => page.$eval(`#${id}`, ({ width, height }) => [width, height])));
    assert.deepEqual(marks, map);
  }
  await page.waitForFunction(() => /layer=sir/.test(location.hash) && /mapping=/.test(location.hash));
  await done();
});

test("densities on the map integrate to one, also under a sky with a small sun", async () => {
  const { page, done } = await open("size=64&spp=1&rows=256&panel=map&pixel=[27,27]&strategy=mis:1:1", { reducedMotion: "reduce" });
  for (const mapping of ["lat-long", "angular", "octahedral"]) {
    await page.selectOption("#mapping", mapping);
    await page.waitForSelector("html[data-samples]");
    for (const [layer, least] of [["environment", 0.995], ["target", 0.995], ["mis", 0.5], ["brdf", 0.5], ["sir", 0.995]]) {
      await page.selectOption("#layer", layer);
      await page.waitForSelector(`html[data-layer="${layer} ${mapping}"]`, { state: "attached" });
      await page.waitForFunction(() => /∫ p dω/.test(document.getElementById("point-table").textContent));
      const stated = Number(/∫ p dω(.*)/.exec(await text(page, "#point-table"))?.[1]);
      assert.ok(stated >= least && stated <= 1.005, `${layer} on ${mapping}: ${stated}`);
      if (mapping !== "lat-long") continue;
      // What is drawn: the mean of each texel, over the texels' solid angles.
      const drawn = await page.evaluate(() => {
        const { values, width, height } = window.domelight.map.layer();
        const edge = (y) => Math.cos(Math.PI * y / height);
        return values.reduce((sum, p, i) => sum + p * (edge(Math.floor(i / width)) - edge(Math.floor(i / width) + 1)) * 2 * Math.PI / width, 0);
      });
      assert.ok(Math.abs(drawn - stated) < 0.01, `${layer}: ${drawn} is drawn, ${stated} is stated`);
    }
  }
  await done();
});

test("samples come one after the other", async () => {
  const script = `const { arc } = CanvasRenderingContext2D.prototype;
    window.arcs = [];
    CanvasRenderingContext2D.prototype.arc = function (...at) {
      if (this.canvas.id === "map-marks") window.arcs.push(performance.now());
      return arc.apply(this, at);
    };`;
  const { page, done } = await open(`${SMALL}&panel=map&pixel=[27,27]&strategy=mis:1:1&samples=8`, { script });
  await page.waitForSelector("html[data-samples]");
  await page.waitForSelector("#map-marks:not([data-stale])", { state: "attached" });
  const arcs = await page.evaluate(() => window.arcs);
  assert.ok(arcs.length >= 400, `${arcs.length} samples`);
  assert.ok(arcs.at(-1) - arcs[0] > 300, `all within ${arcs.at(-1) - arcs[0]} ms`);
  await done();
});

test("a direction under the pointer is read, and marked alike on the map and the hemispheres", async () => {
  const { page, done } = await open(`${GLOSSY}&pixel=[27,27]&panel=map&strategy=mis:1:1&layer=environment`, { reducedMotion: "reduce" });
  await page.waitForSelector("html[data-samples]");
  const over = async (selector, u, v) => {
    const box = await page.locator(selector).first().boundingBox();
    await page.mouse.move(box.x + u * box.width, box.y + v * box.height);
  };
  const numbers = (text) => [/L = ([\d.]+)/, /f · cos θ = ([\d.]+)/, /V = ([\d.]+)/, /environment ([\d.]+)/].map((number) => Number(number.exec(text)?.[1]));
  const places = (selector) => page.$$eval(selector, (marks) => marks.map(({ hidden, style }) => (hidden ? null : [style.left, style.top].map((share) => Math.round(parseFloat(share))))));
  await over("#map-viewer", 0.7, 0.4);
  await page.waitForFunction(() => /^In this direction, L = .*, V = .*; densities: environment .* per steradian\. The weight .* there\.$/.test(document.getElementById("map-readout").textContent));
  const read = await text(page, "#map-readout"), first = numbers(read);
  assert.deepEqual(await places("#map-viewer .mark"), [[70, 40]]);
  assert.match(await page.getAttribute("#map-bar", "aria-label"), /^The overlay, environment: 0, [\d.]+, [\d.]+ sr⁻¹ or more$/);
  // The light's density is in proportion to the light.
  await over("#map-viewer", 0.7, 0.1);
  await page.waitForFunction((before) => document.getElementById("map-readout").textContent !== before, read);
  const second = numbers(await text(page, "#map-readout"));
  assert.ok(Math.abs(first[0] / first[3] / (second[0] / second[3]) - 1) < 0.02, `${first} and ${second}`);
  // The X-ray panel marks the same direction and reads the same values.
  await show(page, "xray");
  await page.waitForFunction(() => /^In this direction, L = .* Counted rays per steradian, .*: .*, weight /.test(document.getElementById("xray-readout").textContent));
  const above = numbers(await text(page, "#xray-readout"));
  for (const i of [0, 1, 2]) assert.ok(Math.abs(above[i] - second[i]) <= 0.1 * second[i], `${above} in the X-ray panel, ${second} on the map`);
  assert.deepEqual(await places("#xray-map .mark"), [[70, 10]]);
  // All hemispheres mark what is pointed at in one, and so does the map.
  await over("#hemispheres .marked", 0.5, 0.5);
  await page.waitForFunction(() => document.querySelector("#hemispheres .mark").style.left === "50%");
  const marks = await places(".hemispheres .mark");
  assert.ok(marks.length > 4 && marks.every((place) => place?.join() === "50,50"), JSON.stringify(marks));
  const normal = await places("#xray-map .mark");
  await show(page, "map");
  await page.waitForFunction((place) => Math.round(parseFloat(document.querySelector("#map-viewer .mark").style.left)) === place, normal[0][0]);
  assert.deepEqual(await places("#map-viewer .mark"), normal);
  // So are the values of a pixel of the picture.
  await show(page, "picture");
  await rendered(page);
  await over("#viewer", 0.5078, 0.3047);
  await page.waitForFunction(() => /^Column 32, row 19: R, G, B .*; luminance /.test(document.getElementById("pixel-readout").textContent));
  const luminance = await page.evaluate(() => {
    const { pixels } = window.domelight.picture.films[0], [r, g, b] = pixels.subarray(4 * (19 * 64 + 32));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  });
  const stated = await text(page, "#pixel-readout");
  assert.ok(Math.abs(Number(/luminance ([\d.]*\d)/.exec(stated)[1]) / luminance - 1) < 0.01, `${stated} for ${luminance}`);
  // A finger scrolls the page where nothing is dragged in its direction.
  assert.deepEqual(await page.$$eval("#viewer, #map-viewer, #xray-viewer, #lights .viewer", (all) => all.map((viewer) => getComputedStyle(viewer).touchAction)), ["none", "pan-y", "auto", "auto"]);
  await done();
});

test("the X-ray of a pixel names causes whose shares are drawn", async () => {
  const { page, done } = await open(`${SMALL}&pixel=[27,27]&panel=xray&strategy=mis:1:1`);
  await page.waitForSelector("html[data-xray]");
  assert.ok((await text(page, "#xray-advice")).length > 20);
  assert.equal((await page.$$("#xray-table tbody tr")).length, 4);
  assert.ok((await page.$$("#causes .bar")).length >= 4);
  assert.equal((await page.$$("#hemispheres canvas")).length, 4);
  const densities = (await page.$$("#densities canvas")).length;
  await page.evaluate(() => delete document.documentElement.dataset.xray);
  await page.check("#compared label:nth-child(5) input");
  await page.waitForSelector("html[data-xray]");
  assert.equal((await page.$$("#densities canvas")).length, densities + 1);
  // The picture to pick in comes as it is rendered.
  await rendered(page);
  await page.waitForTimeout(600);
  assert.ok(await brightness(page, "xray-film") > 80);
  await done();
});

test("a pixel is picked in the X-ray panel, by keys and by a click", async () => {
  const { page, done } = await open(`${SMALL}&panel=xray&strategy=mis:1:1`);
  await rendered(page);
  assert.ok(await page.isVisible("#xray-hint"));
  await page.focus("#xray-viewer");
  assert.match(await text(page, "#xray-place"), /Column 32, row 32/);
  for (const key of ["ArrowLeft", "ArrowLeft", "ArrowUp", "Shift+ArrowRight", "ArrowDown"]) await page.keyboard.press(key);
  assert.match(await text(page, "#xray-place"), /Column 31, row 32/);
  const cross = await canvasHash(page, "xray-marks");
  await page.keyboard.press("Enter");
  await page.waitForSelector("html[data-xray]");
  assert.match(await text(page, "#xray-summary"), /Pixel 31, 32 of 64 × 64/);
  assert.notEqual(await canvasHash(page, "xray-marks"), cross);
  await page.evaluate(() => delete document.documentElement.dataset.xray);
  const box = await page.locator("#xray-viewer").boundingBox();
  await page.mouse.click(box.x + 0.42 * box.width, box.y + 0.42 * box.height);
  await page.waitForSelector("html[data-xray]");
  assert.match(await text(page, "#xray-summary"), /Pixel 2[67], 2[67] of 64 × 64/);
  await page.check("#compared label:nth-child(5) input");
  await page.waitForFunction(() => /pixel=/.test(location.hash) && /compared=.*sir/.test(location.hash));
  await done();
});
