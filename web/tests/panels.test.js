// Each panel, driven like a person does.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { after, before, test } from "node:test";
import { SMALL, address, brightness, canvasHash, close, launch, open as openPage, rendered, renderedAnew, show, slide, text } from "./page.js";

/** The lecture under the usual light; its figures need no scene, so this one is loaded quickest, and render small pictures. */
const LECTURE = "size=32&spp=4&rows=64&scene=sphere&panel=lecture";

/** Opens the page; only tests of the error need a reference. */
const open = (hash, options) => openPage(hash, { refers: false, ...options });
const REFERS = { refers: true };
/** A picture of what is not matte. */
const GLOSSY = SMALL.replace("sphere", "statue");

before(launch);
after(close);

const axe = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");

/** Axe's findings, by rule; of some rules only, if they are named. */
async function violations(page, ...rules) {
  await page.evaluate(axe);
  return page.evaluate(async (rules) => (await window.axe.run(document, { resultTypes: ["violations"], ...(rules.length ? { runOnly: rules } : {}) })).violations.map((v) =>
    `${v.id}: ${v.nodes.map((n) => n.target).join(" ")}`), rules);
}

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

test("errors are measured at whole passes against a reference that is made by itself and kept", async () => {
  const { page, done } = await open("size=32&spp=16&rows=64&env=studio&strategy=mis:1:1", REFERS);
  const measured = () => page.waitForSelector("figure[data-error=measured]");
  await rendered(page);
  await measured();
  await page.waitForFunction(() => { const { reference } = window.domelight.picture; return reference.isReady && !reference.running; });
  const read = () => page.evaluate(() => {
    const { jobs, reference } = window.domelight.picture, points = window.domelight.picture.measured()[0];
    return { points: points.map(({ rays, error }) => [rays, error]), rays: jobs[0].statistics.shadowRays, renders: reference.renders, variance: jobs[0].statistics.relativeVariance };
  });
  const first = await read();
  // Passes of 1, 1, 2, 4 and 8 samples.
  assert.equal(first.points.length, 5, JSON.stringify(first));
  assert.equal(first.points.at(-1)[0], first.rays);
  for (const [i, [rays, error]] of first.points.entries()) {
    if (i) assert.ok(rays > first.points[i - 1][0] && error < first.points[i - 1][1], JSON.stringify(first.points));
  }
  const last = first.points.at(-1)[1];
  assert.ok(last > 0.5 * first.variance && last < 2 * first.variance, `measured ${last}, estimated ${first.variance}`);
  const caption = await text(page, "#picture figcaption");
  assert.match(caption, /measured against a reference of \d+ independent renders .*: mis:1:1 has [\d.]+ ± [\d.]+, slope −0\.[3-9]\d ± 0\.\d+/);
  assert.equal((await page.$$("#error-plot circle.first")).length, 5);
  // The same link has the same numbers, and another strategy the same reference.
  await renderedAnew(page, () => page.evaluate(() => window.domelight.app.set({ strategy: "brdf:2" })));
  await measured();
  assert.equal((await read()).renders >= first.renders, true);
  const again = await open("size=32&spp=16&rows=64&env=studio&strategy=mis:1:1", REFERS);
  await rendered(again.page);
  await again.page.waitForFunction(() => { const { reference } = window.domelight.picture; return reference.isReady && !reference.running; });
  await again.page.waitForTimeout(300);
  assert.equal(await text(again.page, "#picture figcaption"), caption);
  await again.done();
  await done();
});

test("a biased strategy is measured with its bias, which its variance does not show", async () => {
  // Four lights cannot stand for the many windows of a nave: the bias is fifty times the variance, which is that of the
  // camera's samples alone. Under the sky, sixteen lights have as much of the one as of the other.
  const { page, done } = await open("size=32&spp=16&rows=64&env=cathedral&strategy=median-cut:4", REFERS);
  await rendered(page);
  await page.waitForSelector("figure[data-error=measured]");
  await page.waitForFunction(() => { const { reference } = window.domelight.picture; return reference.isReady && !reference.running; });
  const [measured, estimated] = await page.evaluate(() => {
    const { picture } = window.domelight;
    return [picture.measured()[0].at(-1).error, picture.jobs[0].statistics.relativeVariance];
  });
  assert.ok(measured > 20 * estimated, `measured ${measured}, estimated ${estimated}`);
  await done();
});

test("without a reference the error is called an estimate", async () => {
  const { page, done } = await open("size=32&spp=16&rows=64&strategy=mis:1:1&camera=null", REFERS);
  await page.evaluate(() => { window.domelight.app.reference = () => Promise.reject(new Error("no memory")); });
  await renderedAnew(page, () => page.evaluate(() => window.domelight.app.set({ rotate: 10 })));
  await page.waitForFunction(() => /no memory/.test(document.querySelector("#picture figcaption").textContent));
  assert.match(await text(page, "#picture figcaption"), /^An estimate from the variance of the samples/);
  assert.match(await text(page, "#error-plot"), /mis:1:1, variance/);
  assert.ok(await page.$("#error-plot .dashed"));
  await done();
});

test("the plot of the error pairs each estimate with the rays that it is of", async () => {
  const { page, done } = await open("size=128&spp=64&rows=64&strategy=mis:1:1");
  await rendered(page);
  const [points, rays] = await page.evaluate(() => {
    const { histories, jobs } = window.domelight.picture;
    return [histories[0], jobs[0].statistics.shadowRays];
  });
  assert.ok(points.length >= 2, JSON.stringify(points));
  assert.equal(points.at(-1).rays, rays);
  points.forEach(({ error, samples }, i) => {
    assert.ok(error > 0 && samples >= 2, JSON.stringify(points));
    // No estimate stands at the rays of later ones.
    if (i) assert.notEqual(error, points[i - 1].error);
  });
  await done();
});

test("the error view measures the picture against a reference", async () => {
  const { page, done } = await open("size=32&spp=32&rows=64&env=studio&strategy=mis:1:1&beside=product:8&view=error", REFERS);
  await rendered(page);
  await page.waitForFunction(() => /The reference has \d+ samples/.test(document.getElementById("error-legend").textContent));
  assert.ok(await page.isVisible("#error-bar"));
  await page.waitForFunction(() => window.domelight.picture.reference.renders >= 8 || !window.domelight.picture.reference.running);
  const sides = await page.evaluate(() => {
    const { picture } = window.domelight;
    return picture.measured().map((points, i) => [points.at(-1).error, picture.jobs[i].statistics.relativeVariance]);
  });
  for (const [measured, estimated] of sides) assert.ok(measured > 0.3 * estimated && measured < 3 * estimated, `measured ${measured}, estimated ${estimated}`);
  const errors = await canvasHash(page, "film");
  await page.selectOption("#view", "picture");
  assert.ok(await page.isHidden("#error-legend"));
  assert.notEqual(await canvasHash(page, "film"), errors);
  await done();
});

test("without WebGL2 the error view is the same", async () => {
  const seen = [];
  for (const query of ["", "?2d"]) {
    const { page, done } = await open("size=32&spp=1&rows=64&env=studio&strategy=brdf:1&view=error", { query, ...REFERS });
    await page.waitForFunction(() => { const { reference } = window.domelight.picture; return reference.isReady && !reference.running; });
    await page.evaluate(() => window.domelight.picture.reference.stop());
    await page.waitForTimeout(300);
    seen.push(await brightness(page, "film"));
    await done();
  }
  assert.ok(Math.abs(seen[0] - seen[1]) < 3, `${seen}`);
});

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

test("lights: the region under the pointer names its light", async () => {
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

test("lights: regions, files of every format, and what is left", async () => {
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
  test(`lights: ${method} step by step`, async () => {
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

/** What the lecture's figure shows. */
const figureOf = (page) => page.$eval("#figure", (figure) => {
  const canvases = [...figure.querySelectorAll("canvas")].map((canvas) => {
    const copy = Object.assign(document.createElement("canvas"), { width: canvas.width, height: canvas.height });
    const context = copy.getContext("2d", { willReadFrequently: true });
    context.drawImage(canvas, 0, 0);
    return context.getImageData(0, 0, copy.width, copy.height).data.reduce((hash, byte) => Math.imul(hash ^ byte, 16777619), 7);
  });
  return JSON.stringify([[...figure.querySelectorAll("svg")].map((svg) => svg.innerHTML), canvases, figure.querySelector(".result").textContent]);
});

/** Shows a step of the lecture, and waits for its figure. One repeat of the four ways at their counts takes least. */
async function showStep(page, step) {
  await page.evaluate((hash) => { location.hash = hash; }, `${LECTURE}&step=${step}${step === 12 ? "&figure=counts;0;1" : ""}`);
  await page.waitForSelector(`html[data-step='${step}']`);
  await drawn(page, 1);
  await settled(page);
}

/** What somebody does to the figure at one moment, and the values of its controls after it. */
const touch = (page, act = "none") => page.evaluate((act) => {
  const controls = [...document.querySelectorAll("#figure :is(input, select)")];
  if (act === "step up") {
    const slider = controls.find(({ type }) => type === "range");
    slider.stepUp();
    slider.dispatchEvent(new Event("input", { bubbles: true }));
  }
  return controls.map(({ value }) => value).join(";");
}, act);

/** Waits until the lecture's figure shows what its controls say. */
const settled = (page) => page.waitForSelector("#figure:not([data-drawing])");

/** Waits until the lecture's figure was drawn so often. */
const drawn = (page, n) => page.waitForFunction((n) => Number(document.getElementById("figure")?.dataset.drawn ?? 0) >= n, n);

test("every step of the lecture has a figure that each of its controls changes", async () => {
  const { page, done } = await open(`${LECTURE}`);
  const steps = await page.$$eval("#steps a", (all) => all.length);
  assert.equal(steps, 18);
  for (let step = 1; step <= steps; step++) {
    await showStep(page, step);
    assert.ok(await page.$("#step math"), `step ${step} has a formula`);
    assert.ok((await text(page, "#step .question")).length > 40);
    assert.match(await text(page, "#figure .result"), /\d/, `step ${step} says a number`);
    assert.doesNotMatch(await text(page, "#figure"), /NaN|undefined|Infinity/, `step ${step}`);
    const controls = await page.$$("#figure input, #figure select");
    assert.ok(controls.length > 0, `step ${step} has a control`);
    let times = Number(await page.$eval("#figure", (figure) => figure.dataset.drawn));
    for (const control of controls) {
      await settled(page);
      const before = await figureOf(page), value = await control.inputValue();
      const name = await control.evaluate((control) => control.closest("label").textContent);
      if (await control.evaluate((control) => control.localName) === "select") {
        const other = await control.$$eval("option", (all) => all.map((option) => option.value).find((_, i) => i === 1));
        await control.selectOption(other);
      } else {
        await control.focus();
        await page.keyboard.press("ArrowRight");
        if (await control.inputValue() === value) await page.keyboard.press("ArrowLeft");
      }
      await drawn(page, ++times);
      await settled(page);
      assert.notEqual(await figureOf(page), before, `“${name}” changes the figure of step ${step}`);
    }
  }
  await done();
});

test("the first step of the lecture plays, pauses, steps, is dragged and read", async () => {
  const { page, done } = await open(`${LECTURE}&step=1&figure=0;0`);
  await drawn(page, 1);
  const result = () => text(page, "#figure .result");
  const samples = () => page.locator("#figure label", { hasText: "Samples" }).locator("output").textContent().then(Number);
  const button = (name) => page.locator(`#figure .player button:text-is("${name}")`);
  assert.equal(await samples(), 1);
  await button("Play").click();
  await page.waitForFunction(() => /^Sample [4-9],/.test(document.querySelector("#figure .result").textContent));
  await button("Pause").click();
  const paused = await samples();
  await page.waitForTimeout(400);
  assert.equal(await samples(), paused, "a paused figure stands still");
  await button("Step forward").click();
  assert.equal(await samples(), paused + 1);
  await button("Step back").click();
  await button("Step back").click();
  assert.equal(await samples(), paused - 1);
  const circles = (kind) => page.$$eval("#figure svg:nth-of-type(1)", ([svg], kind) => svg.querySelectorAll(`circle.${kind}[r]`).length, kind);
  assert.equal(await circles("estimate"), paused - 1 + 1, "each sample is a dot, and the legend has one");
  // Over x = 0.9, f is 2.43; the pointer drags p through it.
  const svg = page.locator("#figure svg").first();
  await svg.scrollIntoViewIfNeeded();
  const place = await svg.evaluate((svg) => {
    const { left, right, top, bottom, xs, ys } = JSON.parse(svg.dataset.frame), box = svg.getBoundingClientRect();
    const scale = box.width / svg.viewBox.baseVal.width;
    const at = (x, y) => [box.left + scale * (left + (right - left) * (x - xs[0]) / (xs[1] - xs[0])), box.top + scale * (bottom - (bottom - top) * (y - ys[0]) / (ys[1] - ys[0]))];
    return { low: at(0.9, 1), high: at(0.9, 2.9) };
  });
  await page.mouse.move(...place.low);
  await page.waitForFunction(() => /^Under the pointer, x = 0.90: f = 2.4\d, p = 1.00, f\/p = 2.4\d. ∫ p = 1.00/.test(document.querySelector("#figure .result").textContent));
  await page.mouse.down();
  await page.mouse.move(...place.high, { steps: 4 });
  await page.mouse.up();
  await page.waitForFunction(() => /every sample equals the integral/.test(document.querySelector("#figure .result").textContent));
  assert.match(await text(page, "#figure"), /100 % similar/);
  await page.waitForFunction(() => /figure=1%3B/.test(location.hash));
  // Without the pointer, the numbers are of the last sample.
  await page.mouse.move(2, 2);
  await page.waitForFunction(() => /^Sample /.test(document.querySelector("#figure .result").textContent));
  assert.doesNotMatch(await result(), /NaN|Infinity/);
  await done();
});

test("step 6 draws the map beside its tables, which sin θ changes at the poles", async () => {
  const { page, done } = await open(`${LECTURE}&step=6`);
  await drawn(page, 1);
  const frames = await page.$$eval("#figure .tables [data-frame]", (all) => all.map((framed) => { const { left, right, top, bottom } = framed.getBoundingClientRect(); return { left, right, top, bottom }; }));
  assert.equal(frames.length, 3);
  const [map, rows, columns] = frames, near = (a, b) => assert.ok(Math.abs(a - b) < 2, `${a} ${b}`);
  // Rows stand beside those of the map, and columns below theirs.
  near(map.top, rows.top);
  near(map.bottom, rows.bottom);
  near(map.left, columns.left);
  near(map.right, columns.right);
  assert.ok(rows.left >= map.right && columns.top >= map.bottom);
  const [exact, plain] = /have ([\d.]+) with sin θ and ([\d.]+) without/.exec(await text(page, "#figure .result")).slice(1).map(Number);
  assert.ok(plain > 3 * exact, `${plain} ${exact}`);
  assert.match(await text(page, "#step details p"), new RegExp(`have probability ${plain} instead of ${exact}`));
  await page.mouse.move((rows.left + rows.right) / 2, (rows.top + rows.bottom) / 2);
  await page.waitForFunction(() => /^Row 3[12] has sin θ = 1\.00 .*∑ p\(y\) = 1\.00/.test(document.querySelector("#figure .readout").textContent));
  await done();
});

test("step 9 shows the densities of a picked pixel on the sphere, and pictures that sample light and product", async () => {
  const { page, done } = await open(`${LECTURE}&step=9&figure=0.5;0.08;0.6;sphere;3`);
  await drawn(page, 1);
  const result = () => text(page, "#figure .result");
  const [light, product] = /RMSE is ([\d.]+) where the light is sampled and ([\d.]+) where the product is/.exec(await result()).slice(1).map(Number);
  assert.ok(product < 0.5 * light, await result());
  assert.match(await result(), /At pixel 11, 11, ∫ p of the product is 1\.00/);
  const boxes = async (selector) => Promise.all((await page.$$(selector)).map((canvas) => canvas.boundingBox()));
  await page.locator("#figure .importance").scrollIntoViewIfNeeded();
  const [picture] = await boxes("#figure .pictures canvas"), before = await figureOf(page);
  await page.mouse.move(picture.x + 0.5 * picture.width, picture.y + 0.5 * picture.height);
  await page.mouse.down();
  await page.mouse.move(picture.x + 0.52 * picture.width, picture.y + 0.42 * picture.height, { steps: 2 });
  await page.mouse.up();
  await page.waitForFunction(() => /At pixel 16, 13,/.test(document.querySelector("#figure .result").textContent));
  await settled(page);
  assert.notEqual(await figureOf(page), before, "another pixel has other densities");
  const [disc] = await boxes("#figure .discs canvas");
  await page.mouse.move(disc.x + 0.3 * disc.width, disc.y + 0.3 * disc.height);
  await page.waitForFunction(() => /^In this direction, L = [\d.]+, f · cos θ = .*, V = 1; densities: light .* per steradian/.test(document.querySelector("#figure .readout").textContent));
  await settled(page);
  // The direction is marked in the other densities, and on the spheres where their normal is half-way between it and the camera.
  const marks = () => page.$$eval("#figure .overlay .mark", (all) => all.map((mark) => { const { left, top, width, height } = mark.getBoundingClientRect(); return [left + width / 2, top + height / 2]; }));
  const found = await marks(), discs = await boxes("#figure .discs canvas");
  assert.equal(found.length, 4);
  const near = ([x, y], box, u, v) => assert.ok(Math.hypot(x - box.x - u * box.width, y - box.y - v * box.height) < 2, `a mark at ${(x - box.x) / box.width}, ${(y - box.y) / box.height}, not ${u}, ${v}`);
  // At 0.3, 0.3 of an angular map: 0.4 √2 π from −z, up to the left.
  const angle = 0.4 * Math.SQRT2 * Math.PI, side = Math.sin(angle) * Math.SQRT1_2, scale = Math.sqrt(2 - 2 * Math.cos(angle));
  const onSphere = [0.5 - 0.5 * side / scale, 0.5 - 0.5 * side / scale], [shown] = await boxes("#figure .pictures .marked");
  near(found[0], shown, ...onSphere);
  near(found[2], discs[1], 0.3, 0.3);
  await page.mouse.move(...found[0]);
  await settled(page);
  assert.match(await text(page, "#figure .readout"), /mirrors the marked direction/);
  const back = await marks();
  assert.equal(back.length, 4);
  near(back[1], discs[0], 0.3, 0.3);
  await done();
});

test("steps 14 and 15 show pictures under the lights, whose error falls with their number", async () => {
  const { page, done } = await open(`${LECTURE}&step=14&figure=1;pictures`);
  await drawn(page, 1);
  const error = async () => Number(/lights is ([\d.]+)/.exec(await text(page, "#figure .result"))[1]);
  const few = await error();
  await slide(page, "#figure input", 6);
  await page.waitForFunction(() => /with 64 lights/.test(document.querySelector("#figure .result").textContent));
  assert.ok(await error() < few, `${await error()} % with 64 lights, ${few} % with 2`);
  await page.evaluate((hash) => { location.hash = hash; }, `${LECTURE}&step=15&figure=3;pictures`);
  await page.waitForSelector("html[data-step='15']");
  await drawn(page, 1);
  assert.equal(await page.locator("#figure .quartet canvas").count(), 4);
  // The rule that the step explains is rendered, too.
  const errors = /is ([\d.]+)\s% by median cut, ([\d.]+)\s% by the rule of 2009, ([\d.]+)\s% by variance minimization/.exec(await text(page, "#figure .result")).slice(1).map(Number);
  assert.equal(new Set(errors).size, 3, `${errors}`);
  await done();
});

test("step 18 renders the scene room, in which only the default strategy knows the window", async () => {
  const { page, done } = await open(`${LECTURE.replace("size=32", "size=64")}&step=18&figure=64;light;2.5;1;1;30;scene`);
  await drawn(page, 1);
  const errors = /RMSE is ([\d.]+)\s% by the light, ([\d.]+)\s% by the lobe, ([\d.]+)\s% by both, and ([\d.]+)\s% by the default/.exec(await text(page, "#figure .result")).slice(1).map(Number);
  assert.ok(errors.slice(0, 3).every((error) => error > 1.5 * errors[3]), `${errors}`);
  assert.equal(await page.locator("#figure .quartet canvas").count(), 5);
  const { x, y, width, height } = await page.locator("#figure .quartet canvas").first().boundingBox();
  await page.mouse.move(x + 0.9 * width, y + 0.5 * height);
  await page.waitForFunction(() => /^Under the pointer, light gives .*, the reference [\d.]+/.test(document.querySelector("#figure .readout").textContent));
  const before = await figureOf(page);
  await page.mouse.down();
  await page.mouse.move(x + 0.3 * width, y + 0.5 * height, { steps: 2 });
  await page.mouse.up();
  await settled(page);
  assert.notEqual(await figureOf(page), before, "the reference is uncovered");
  await done();
});

/** Steps and the place in their first plot or map, as shares of it, where something can be dragged, and to where. */
const DRAGS = { 1: [[0.9, 0.5], [0.9, 0.2]], 2: [[0.4, 0.4], [0.25, 0.6]], 3: [[0.45, 0.5], [0.35, 0.5]], 4: [[0.4, 0.4], [0.25, 0.6]], 5: [[0.6, 0.5], [0.4, 0.5]],
  6: [[0.5, 0.3], [0.5, 0.7]], 7: [[0.3, 0.3], [0.6, 0.5]], 8: [[0.6, 0.5], [0.8, 0.5]], 9: [[0.6, 0.5], [0.75, 0.5]], 10: [[0.5, 0.7], [0.5, 0.4]], 11: [[0.5, 0.5], [0.7, 0.5]], 12: [[0.9, 0.5], [0.4, 0.4]],
  13: [[0.4, 0.5], [0.6, 0.5]], 14: [[0.03, 0.3], [0.97, 0.6]], 15: [[0.16, 0.3], [0.66, 0.8]], 16: [[0.5, 0.5], [0.6, 0.3]], 17: [[0.5, 0.5], [0.7, 0.5]], 18: [[0.5, 0.7], [0.65, 0.7]] };

test("the figure of every step plays, pauses, is dragged and read", async (t) => {
  const { page, done } = await open(LECTURE);
  for (let step = 1; step <= 18; step++) await t.test(`step ${step}`, async () => {
    await showStep(page, step);
    // From its last step, a figure would start over.
    await page.$eval("#figure .player", (player) => {
      const input = player.previousElementSibling.querySelector("input");
      input.value = input.min;
      input.dispatchEvent(new Event("input", { bubbles: true }));
    });
    await settled(page);
    const before = await figureOf(page);
    // A busy machine may draw so slowly that playback ends before another click.
    const wasPlaying = await page.evaluate(async () => {
      const figure = document.getElementById("figure"), toggle = figure.querySelector(".player button:nth-child(2)");
      const times = () => Number(figure.dataset.drawn), n = times();
      toggle.click();
      const isPlaying = toggle.textContent === "Pause";
      while (times() < n + 2) await new Promise((done) => setTimeout(done, 5));
      if (toggle.textContent === "Pause") toggle.click();
      return isPlaying;
    });
    assert.ok(wasPlaying);
    const position = () => page.$eval("#figure .player", (player) => player.previousElementSibling.querySelector("input").value);
    const paused = await position();
    // Longer than a step of playback takes.
    await page.waitForTimeout(200);
    assert.equal(await position(), paused, "a paused figure stands still");
    assert.notEqual(await figureOf(page), before, "it plays");
    const framed = page.locator("#figure [data-frame]").first();
    await framed.scrollIntoViewIfNeeded();
    const box = await framed.boundingBox(), at = ([x, y]) => [box.x + x * box.width, box.y + y * box.height];
    const [from, to] = DRAGS[step];
    const read = () => page.$eval("#figure", (figure) => (figure.querySelector(".readout").textContent.trim() || figure.querySelector(".result").textContent));
    await page.mouse.move(...at(from));
    await page.waitForFunction((step) => /\d/.test(document.querySelector("#figure .readout").textContent) || (step === 1 && /^Under the pointer/.test(document.querySelector("#figure .result").textContent)), step);
    const readAt = await read();
    assert.doesNotMatch(readAt, /NaN|undefined|Infinity/);
    const values = () => page.$$eval("#figure input", (all) => all.map(({ value }) => value).join(" "));
    const [set, shown] = [await values(), await figureOf(page)];
    await page.mouse.down();
    await page.mouse.move(...at(to), { steps: 3 });
    await page.mouse.up();
    await settled(page);
    assert.notEqual(await figureOf(page), shown, "dragging changes the figure");
    if (![7, 12, 14, 15].includes(step)) assert.notEqual(await values(), set, "dragging moves a slider");
    assert.notEqual(await read(), readAt, "other places have other values");
  });
  await done();
});

test("plots and maps of every step are read by keys", async (t) => {
  const { page, done } = await open(LECTURE);
  for (let step = 1; step <= 18; step++) await t.test(`step ${step}`, async () => {
    await showStep(page, step);
    const said = () => page.evaluate(() => [".readout", ".result"].map((part) => document.querySelector(`#figure ${part}`).textContent).join(" "));
    const frames = page.locator("#figure [data-frame]"), n = await frames.count();
    assert.equal(await page.$eval("#figure .readout", (readout) => readout.getAttribute("aria-live")), "polite");
    for (let k = 0; k < n; k++) {
      const before = await said();
      await frames.nth(k).focus();
      for (const key of ["ArrowRight", "ArrowRight", "Shift+ArrowUp"]) await page.keyboard.press(key);
      await settled(page);
      assert.ok(await frames.nth(k).evaluate((framed) => framed === document.activeElement), "the focus stays while the figure is drawn");
      assert.ok((await frames.nth(k).getAttribute("aria-label")).length > 3);
      assert.notEqual(await said(), before, `plot ${k + 1} of ${n} is read`);
      assert.doesNotMatch(await said(), /NaN|undefined|Infinity/);
      const at = await page.evaluate(() => {
        const mark = document.querySelector("#figure .overlay .mark").getBoundingClientRect(), box = document.activeElement.getBoundingClientRect();
        return [(mark.left + mark.width / 2 - box.left) / box.width, (mark.top + mark.height / 2 - box.top) / box.height];
      });
      assert.ok(at.every((share) => share > 0 && share < 1), `${at}`);
      await page.keyboard.press("Escape");
      await settled(page);
      assert.equal(await page.locator("#figure .overlay .mark").count(), 0);
    }
  });
  // Enter drags to the mark, and the arrow keys then carry what is there until it is put down.
  await showStep(page, 9);
  const center = () => page.evaluate(() => Number(document.querySelector("#figure input").value));
  const before = await center();
  await page.locator("#figure [data-frame]").first().focus();
  for (let k = 0; k < 5; k++) await page.keyboard.press("ArrowLeft");
  await page.keyboard.press("Enter");
  await settled(page);
  assert.ok(Math.abs(await center() - before + 0.1) < 0.015, `${before} has become ${await center()}`);
  assert.match(await text(page, "#figure .readout"), /^Picked up\. Direction 0\.40/);
  await page.keyboard.press("ArrowRight");
  await page.keyboard.press("Enter");
  await page.keyboard.press("ArrowRight");
  await settled(page);
  assert.ok(Math.abs(await center() - 0.42) < 0.015, `it stays where it was put down, at ${await center()}`);
  assert.match(await text(page, "#figure .readout"), /^Direction 0\.44/);
  // So the keys also reach what is dragged from a place of its own: the sun, at 0.35.
  for (let k = 0; k < 4; k++) await page.keyboard.press("ArrowLeft");
  await page.keyboard.press("Enter");
  for (let k = 0; k < 3; k++) await page.keyboard.press("ArrowLeft");
  await page.keyboard.press("Escape");
  await page.keyboard.press("ArrowLeft");
  await settled(page);
  const sun = await page.$eval('#figure input[data-name="Sun"]', (input) => Number(input.value));
  assert.ok(Math.abs(sun - 0.3) < 0.015, `the sun is at ${sun}`);
  assert.ok(Math.abs(await center() - 0.42) < 0.015, "the lobe stays");
  await done();
});

test("a direction is marked in all pictures of a figure", async () => {
  const { page, done } = await open(LECTURE);
  const marks = () => page.$$eval("#figure .overlay .mark", (all) => all.map((mark) => { const { left, top, width, height } = mark.getBoundingClientRect(); return [left + width / 2, top + height / 2]; }));
  const over = async (k, u, v) => {
    const framed = page.locator("#figure [data-frame]").nth(k);
    await framed.scrollIntoViewIfNeeded();
    const box = await framed.boundingBox();
    await page.mouse.move(box.x + u * box.width, box.y + v * box.height);
    await settled(page);
    return [box.x + u * box.width, box.y + v * box.height];
  };
  for (const [step, n] of [[2, 1], [3, 1], [4, 2], [6, 1], [7, 1], [12, 3], [14, 1], [15, 1]]) {
    await showStep(page, step);
    await over(0, 0.55, 0.35);
    assert.ok((await marks()).length >= n, `step ${step} has ${(await marks()).length} marks`);
  }
  // From the map to the sphere and back.
  for (const step of [7, 15]) {
    await showStep(page, step);
    await page.locator("#figure [data-frame]").nth(1).scrollIntoViewIfNeeded();
    const [x, y] = await over(0, 0.45, 0.35), [[u, v]] = await marks();
    await page.mouse.move(u, v);
    await settled(page);
    const [[backX, backY]] = await marks();
    assert.ok(Math.hypot(backX - x, backY - y) < 6, `step ${step}: ${[x, y]} comes back as ${[backX, backY]}`);
  }
  await done();
});

test("color bars say the luminances of maps and hemispheres", async () => {
  const { page, done } = await open(`${LECTURE}&env=constant`);
  for (const step of [6, 7, 14, 15]) {
    await showStep(page, step);
    const bar = page.locator('#figure [aria-label^="Luminance of the map: L = 0, "]');
    assert.ok(await bar.isVisible(), `step ${step}`);
    if (step !== 6) continue;
    const white = Number(/([\d.]+) or more$/.exec(await bar.getAttribute("aria-label"))[1]);
    const canvas = page.locator("#figure canvas").first();
    await canvas.hover({ position: { x: 20, y: 8 } });
    await page.waitForFunction(() => /^Under the pointer, L = /.test(document.querySelector("#figure .readout").textContent));
    const light = Number(/L = ([\d.]+)/.exec(await text(page, "#figure .readout"))[1]);
    const byte = await canvas.evaluate((canvas) => canvas.getContext("2d").getImageData(40, 16, 1, 1).data[1]);
    // x/(1 + x) to the power 1/2.2, 1.3 times as bright.
    const of = (share) => ((t) => t / (1 - t))((share / 1.3) ** 2.2);
    assert.ok(Math.abs(of(byte / 255) / of(1) / (light / white) - 1) < 0.08, `the byte ${byte} is ${light}, and white is ${white}`);
  }
  await page.evaluate((hash) => { location.hash = hash; }, `${SMALL}&pixel=[27,27]&panel=xray&strategy=mis:1:1`);
  await page.waitForFunction(() => document.querySelectorAll("#hemispheres .colorbar").length === 4);
  const labels = await page.$$eval("#hemispheres .colorbar", (all) => all.map((bar) => bar.getAttribute("aria-label")));
  assert.match(labels[0], /^Luminance of light L: [\d.]+, [\d.]+, [\d.]+$/);
  assert.match(labels[2], /^visibility V: 0, 1$/);
  // Keys move the mark over all of them, and the map.
  await page.focus("#hemispheres .marked");
  for (let k = 0; k < 4; k++) await page.keyboard.press("ArrowRight");
  await page.waitForFunction(() => /^In this direction, L = /.test(document.getElementById("xray-readout").textContent) && document.querySelector("#hemispheres .mark").style.left === "58%");
  await page.focus("#xray-map .marked");
  const read = await text(page, "#xray-readout");
  for (let k = 0; k < 8; k++) await page.keyboard.press("ArrowUp");
  await page.waitForFunction((read) => document.getElementById("xray-readout").textContent !== read, read);
  await show(page, "map");
  await page.waitForSelector("html[data-map]");
  await page.focus("#map-viewer");
  for (const key of ["ArrowLeft", "ArrowDown"]) await page.keyboard.press(key);
  await page.waitForFunction(() => /^In this direction, L = /.test(document.getElementById("map-readout").textContent));
  await done();
});

for (const step of [14, 15]) {
  test(`the first cut of step ${step} is dragged, and compared with where the methods cut`, async () => {
    const { page, done } = await open(`${LECTURE}&step=${step}&figure=${step === 14 ? "4;map;hand;0.6" : "4;map;refined;hand;0.6"}`);
    await drawn(page, 1);
    const frame = page.locator("#figure canvas"), said = () => text(page, "#figure .result");
    await frame.scrollIntoViewIfNeeded();
    const box = await frame.boundingBox(), x = (share) => box.x + share * box.width, y = box.y + box.height / 2;
    const left = async () => Number(/, ([\d.]+)\s%/.exec(await said())[1]);
    const before = await left();
    await page.mouse.move(x(0.6), y);
    await page.mouse.down();
    await page.mouse.move(x(0.8), y, { steps: 3 });
    await settled(page);
    assert.ok(await left() > before, "more light is left of a cut farther right");
    // Where median cut cuts, both halves have the same energy.
    const median = Number(/median cut cuts at (\d\.\d+)/i.exec(await said())[1]);
    await page.mouse.move(x(median), y, { steps: 3 });
    await page.mouse.up();
    await settled(page);
    if (step === 15) {
      const numbers = /sphere is ([\d.]+)\s% .* map ([\d.]+)\s%\. They are least at ([\d.]+) and ([\d.]+)/.exec(await said()).slice(1).map(Number);
      for (const k of [0, 1]) {
        await page.mouse.move(x(numbers[2 + k]), y);
        await page.mouse.down();
        await page.mouse.up();
        await settled(page);
        const there = /sphere is ([\d.]+)\s% .* map ([\d.]+)\s%/.exec(await said()).slice(1).map(Number);
        assert.ok(there[k] <= numbers[k] + 0.5, `the least of rule ${k} is ${there[k]} %`);
      }
    }
    await page.waitForFunction(() => /figure=4%3Bmap%3B.*hand%3B/.test(location.hash));
    await done();
  });
}

test("step 15 divides the map by the rule of 2009, too", async () => {
  const { page, done } = await open(LECTURE);
  await showStep(page, 15);
  await settled(page);
  const before = await figureOf(page);
  await page.selectOption("#figure select >> nth=1", "2009");
  await settled(page);
  assert.notEqual(await figureOf(page), before);
  const errors = await page.evaluate(async () => {
    const rig = (method) => window.domelight.app.engines.call("lights", JSON.stringify({ method, refine: false, n: 16, sun: false, lamps: 0 }));
    return [await rig("variance-minimization:2009"), await rig("median-cut")].map((json) => JSON.parse(json).diffuse);
  });
  const stated = /shading error is ([\d.]+)\s% matte .* with median cut, ([\d.]+)\s%/.exec(await text(page, "#figure .result"));
  errors.forEach((error, i) => assert.ok(Math.abs(Number(stated[i + 1]) / (100 * error) - 1) < 0.01, `${stated[i + 1]} % for ${error}`));
  assert.match(await text(page, "#figure .spheres"), /the rule of 2009: error/);
  await done();
});

test("step 15 shows the brightest light from near, where median cut has most of its lights", async () => {
  const { page, done } = await open(`${LECTURE}&step=15&figure=6;detail`);
  await drawn(page, 1);
  assert.equal(await page.locator("#figure .quartet canvas").count(), 3);
  const counts = /has (\d+) by median cut, (\d+) by the rule of 2009, (\d+) by variance minimization/.exec(await text(page, "#figure .result")).slice(1).map(Number);
  assert.ok(counts[0] > counts[1] && counts[1] > 0 && counts[2] > 0, `${counts}`);
  await page.locator("#figure [data-frame]").nth(1).hover();
  await page.waitForFunction(() => /^Under the pointer, L = .* per steradian\.$/.test(document.querySelector("#figure .readout").textContent));
  assert.equal(await page.locator("#figure .overlay .mark").count(), 2);
  await done();
});

test("step 3 loses half of the lobe without quadrants", async () => {
  const { page, done } = await open(`${LECTURE}&step=3`);
  await drawn(page, 1);
  const ahead = async () => Number(/([\d.]+)\s% of their half vectors/.exec(await text(page, "#figure .result"))[1]);
  assert.ok(Math.abs(await ahead() - 50) < 4, `${await ahead()} %`);
  await page.selectOption("#figure select", "arctan");
  await page.waitForFunction(() => /100\s% of their half vectors/.test(document.querySelector("#figure .result").textContent));
  // The density of half vectors integrates to one over their hemisphere: at θh = 0 it is 1 / (π αx αy).
  await page.locator("#figure [data-frame]").nth(1).focus();
  for (let k = 0; k < 25; k++) await page.keyboard.press("ArrowLeft");
  await settled(page);
  const peak = Number(/p\(ωh\) = ([\d.]+) along x/.exec(await text(page, "#figure .readout"))[1]);
  assert.ok(Math.abs(peak * Math.PI * 0.3 * 0.08 - 1) < 0.01, `${peak}`);
  await done();
});

test("the answer of step 12 is what its figure shows, with the repeats' standard errors", async () => {
  const { page, done } = await open(`${LECTURE}&step=12&figure=counts;0;2`);
  await drawn(page, 1);
  const captions = await page.$$eval("#figure figcaption", (all) => all.map((caption) => caption.textContent));
  for (const caption of captions) assert.match(caption, /error [\d.·⁻⁰-⁹10]+ ± .* s$/);
  const answer = () => text(page, "#step details p");
  assert.match(await answer(), /^For each ray, that is by error times rays, (\w+ has the least error|\w+ and \w+ cannot be told apart)/);
  const n = await page.$eval("#figure", (figure) => Number(figure.dataset.drawn));
  await page.selectOption("#figure select", "time");
  await drawn(page, n + 1);
  assert.match(await answer(), /^At equal time, /);
  await done();
});

test("step 9 names the density with the least variance, which is not the product where most of it is occluded", async () => {
  const { page, done } = await open(`${LECTURE}&step=9`);
  await drawn(page, 1);
  const seen = new Set();
  for (const edge of [1, 0.6, 0.45, 0.38, 0.34]) {
    const n = await page.$eval("#figure", (figure) => Number(figure.dataset.drawn));
    await page.$$eval("#figure input", (all, edge) => { all[2].value = String(edge); all[2].dispatchEvent(new Event("input", { bubbles: true })); }, edge);
    await drawn(page, n + 1);
    const result = await text(page, "#figure .result");
    const numbers = Object.fromEntries(["light", "lobe", "product"].map((name) => [name, Number(new RegExp(`${name} ([\\d.]+)`).exec(result)[1])]));
    const least = /least here: ([\w ]+)/.exec(result)[1];
    assert.ok(least === "all alike" || least.split(" and ").every((name) => numbers[name] <= Math.min(...Object.values(numbers)) + 1e-3), result);
    seen.add(least);
  }
  assert.ok([...seen].some((least) => !least.includes("product") && least !== "all alike"), [...seen].join("; "));
  await done();
});

test("integral signs stand at their size", async () => {
  const { page, done } = await open(`${LECTURE}&step=1`);
  await page.evaluate(() => document.fonts.ready);
  const tallest = await page.$$eval("#step math mo", (all) => Math.max(...all.filter(({ textContent }) => textContent === "∫").map((sign) => sign.getBoundingClientRect().height / parseFloat(getComputedStyle(sign).fontSize))));
  assert.ok(tallest > 2, `an integral sign is ${tallest} em high`);
  await done();
});

test("a teacher presents: F, PageDown, arrow keys, and labels of 24 px", async () => {
  const { page, done } = await open(`${LECTURE}&step=1`, { viewport: { width: 1920, height: 1080 } });
  await drawn(page, 1);
  await page.keyboard.press("f");
  await page.waitForSelector("html[data-presenting]");
  assert.ok(await page.isHidden("#tabs"));
  assert.ok(await page.isHidden("#steps"));
  const label = () => page.$eval("#figure svg text", (text) => parseFloat(getComputedStyle(text).fontSize) * text.getScreenCTM().a);
  assert.ok(await label() >= 24, `${await label()} px`);
  for (const [key, step] of [["PageDown", 2], ["ArrowRight", 3], ["ArrowLeft", 2], ["PageUp", 1], ["ArrowLeft", 1]]) {
    await page.keyboard.press(key);
    await page.waitForSelector(`html[data-step='${step}']`);
    await page.waitForSelector("#figure svg text");
    assert.ok(await label() >= 24, `step ${step}: ${await label()} px`);
  }
  // Question and figure of every step are on the screen.
  for (let step = 2; step <= 18; step++) {
    await page.keyboard.press("PageDown");
    await page.waitForSelector(`html[data-step='${step}']`);
    await drawn(page, 1);
    const end = await page.evaluate(() => Math.max(...[...document.querySelectorAll("#step .question, #figure > div")].map((part) => part.getBoundingClientRect().bottom)));
    assert.ok(end <= 1080, `step ${step} ends at ${end} px`);
  }
  assert.deepEqual(await violations(page), []);
  await page.keyboard.press("f");
  await page.waitForSelector("html:not([data-presenting])");
  assert.ok(await page.isVisible("#tabs"));
  await done();
});

test("a teacher's way: a link to step 9, F, the sun is dragged, the densities are read, to the picture and back, and the handout", async () => {
  const { page, done } = await open(`${LECTURE}&step=9`, { viewport: { width: 1920, height: 1080 }, script: "window.print = () => { window.printed = true; };" });
  await drawn(page, 1);
  await page.keyboard.press("f");
  await page.waitForSelector("html[data-presenting]");
  await settled(page);
  const place = (x, y) => page.$eval("#figure [data-frame]", (framed, [x, y]) => {
    const { left, right, top, bottom, xs, ys } = JSON.parse(framed.dataset.frame), box = framed.getBoundingClientRect(), scale = box.width / framed.viewBox.baseVal.width;
    return [box.left + scale * (left + (right - left) * (x - xs[0]) / (xs[1] - xs[0])), box.top + scale * (bottom - (bottom - top) * (y - ys[0]) / (ys[1] - ys[0]))];
  }, [x, y]);
  const values = () => page.$$eval("#figure input", (all) => all.map(({ value }) => Number(value)));
  const before = await figureOf(page), [mirror, , edge] = await values();
  await page.mouse.move(...await place(0.35, 0.8));
  await page.mouse.down();
  await page.mouse.move(...await place(0.45, 0.8), { steps: 4 });
  await page.mouse.up();
  await settled(page);
  const moved = await values();
  assert.ok(Math.abs(moved.at(-1) - 0.45) < 0.015, `the sun is at ${moved.at(-1)}`);
  assert.deepEqual([moved[0], moved[2]], [mirror, edge], "nothing else moves");
  assert.notEqual(await figureOf(page), before);
  // At the sun, the light's density is largest, and the densities are what quadrature finds.
  const read = () => page.$eval("#figure .readout", (e) => e.textContent);
  const densities = (text) => ["light", "lobe", "product"].map((name) => Number(new RegExp(`${name} ([\\d.]*\\d)`).exec(text.split("densities:")[1])[1]));
  await page.mouse.move(...await place(0.45, 0.5));
  await page.waitForFunction(() => /^Direction 0\.45: .* densities: .* ∫ p = 1\.00\.$/.test(document.querySelector("#figure .readout").textContent));
  const gauss = (x, mean, width) => Math.exp(-0.5 * ((x - mean) / width) ** 2), n = 20000;
  const [light, lobe] = [(x) => 0.15 + 4 * gauss(x, 0.45, 0.02) + 0.7 * gauss(x, 0.75, 0.15), (x) => gauss(x, 0.5, 0.08)];
  const at = Number(/L = ([\d.]+)/.exec(await read())[1]), there = densities(await read());
  assert.ok(Math.abs(at / light(0.45) - 1) < 0.02, `L = ${at}`);
  for (const [i, f] of [light, lobe, (x) => light(x) * lobe(x)].entries()) {
    const total = Array.from({ length: n }, (_, k) => f((k + 0.5) / n)).reduce((a, b) => a + b, 0) / n;
    assert.ok(Math.abs(there[i] * total / f(0.45) - 1) < 0.02, `density ${i} is ${there[i]}, not ${f(0.45) / total}`);
  }
  await page.keyboard.press("f");
  await page.waitForSelector("html:not([data-presenting])");
  await page.locator("#step .opens button", { hasText: "Picture" }).click();
  await page.waitForSelector("#picture:not([hidden])");
  await page.waitForFunction(() => window.domelight.picture.jobs.length === 2 && window.domelight.picture.jobs.every((job) => job.strategy));
  await page.click("#back");
  await page.waitForSelector("html[data-step='9'] #lecture:not([hidden])");
  await drawn(page, 1);
  assert.deepEqual(await values(), moved, "the figure is as it was left");
  await page.click("#print-all");
  await page.waitForFunction(() => window.printed, null, { timeout: 120_000 });
  assert.equal(await page.locator("#handout article").count(), 18);
  assert.match(await text(page, "#handout article:nth-child(9) .result"), /product is unoccluded/);
  assert.ok((await page.pdf()).length > 100_000);
  await done();
});

/** What a student does to a step's figure, by the labels of its controls, and what it then says: numbers that `holds`
 *  compares, from one picture of the figure to the next. */
const QUESTIONS = [
  { step: 1, set: [{ Density: 0 }, { Density: 1 }], says: [/slope of the error is −0\.(4[5-9]|5[0-5])/, /every sample equals the integral/] },
  { step: 2, set: [{ "Exponent n": 1 }, { "Exponent n": 200 }], reads: /density is ([\d.]+) .* ([\d.]+)\s% of the Phong/, holds: ([a, lostA], [b, lostB]) => b > 50 * a && lostB < lostA },
  { step: 3, set: [{ "α along x": 0.1 }, { "α along x": 0.6 }], reads: /: ([\d.]+) along x, ([\d.]+) along y/, holds: ([x, y], [wide, same]) => wide > 3 * x && Math.abs(same - y) < 0.3 * y },
  { step: 4, set: [{ Viewer: 10 }, { Viewer: 70 }], reads: /patches ([\d.]+) to/, holds: ([high], [low]) => low < 0.5 * high },
  { step: 5, set: [{ "Peak’s width": 0.02 }], reads: /^(\d+) of (\d+)/, holds: ([inside, all]) => inside > all / 3 },
  { step: 6, set: [{ "Row weights": "alike" }], reads: /have ([\d.]+) with sin θ and ([\d.]+) without/, holds: ([exact, plain]) => plain > 3 * exact },
  { step: 7, set: [{ Samples: 11 }], reads: /\(([\d.]+)\s%\) .* holds ([\d.]+)\s%/, holds: ([samples, light]) => Math.abs(samples - light) < 4 },
  { step: 8, set: [{ "Lobe’s width": -3 }, { "Lobe’s width": -0.3 }], says: [/least here: lobe alone/, /least here: light alone/] },
  { step: 9, set: [{ "Occluded from": 1, "Mirror direction": 0.15 }], reads: /light ([\d.]+), lobe ([\d.]+), product ([\d.]+)/, holds: ([light, lobe, product]) => light > 1 && lobe > 1 && product === 0 },
  { step: 10, set: [{ Envelope: 1 }, { Envelope: 2 }], reads: /^(\d+) of/, holds: ([tight], [loose]) => Math.abs(loose / tight - 0.5) < 0.1 },
  { step: 10, set: [{ Envelope: 0.5 }], says: [/exceeds the envelope and is lost/] },
  { step: 11, set: [{ "Candidates M": 0 }, { "Candidates M": 5 }], reads: /by ([\d.]+)\s% .* for ([\d.]+)\s%/, holds: ([few, noise], [many, same]) => few > 10 * noise && many < 1.5 * same },
  { step: 12, set: [{ Repeats: 2 }], answers: /^For each ray, that is by error times rays, (resampling has the least error|\w+ and \w+ cannot be told apart)/ },
  { step: 13, set: [{ "Shadow edge": 0.375 }, { "Shadow edge": 0.43 }], reads: /at N = 11 they are ([\d.]+) and ([\d.]*\d)/, holds: ([noise, bias], [same, other]) => Math.abs(same / noise - 1) < 0.1 && Math.abs(other / bias - 1) > 0.2 },
  { step: 14, set: [{ Lights: 6 }], reads: /holds? ([\d.]+)\s% of its energy/, holds: ([share]) => share > 50 },
  { step: 15, set: [{ Lights: 5 }], answers: /^With 32 lights of sky: matte, variance minimization has [\d.]+ times less/ },
  { step: 16, set: [{ "Strata per side": 8 }, { "Strata per side": 32 }], reads: /(\d+) of (\d+) strata/, holds: ([a, n], [b, m]) => b / m < 0.35 * a / n, answers: /the slope here is −0\.7[2-8]/ },
  { step: 16, set: [{ Integrand: "smooth" }], answers: /the slope here is −(1\.0|0\.9[5-9])/ },
  { step: 17, set: [{ Penumbra: 0.3 }, { Penumbra: 0.02 }], reads: /deviation: ([\d.]+)\s% with learned visibility, ([\d.]+)/, holds: ([wide], [narrow, without]) => narrow < 0.5 * wide && narrow < 0.2 * without, answers: /^To the one stratum/ },
  { step: 18, set: [{ Window: 1 }, { Window: 0.2 }], reads: /lobe (\d+), both \d+, product \d+, points on the window (\d+)/, holds: ([large, a], [small, b]) => small > 3 * large && a + b < 20, answers: /with the best of them, \d+ with points on the window/ },
];

test("a student's way: each question is answered by touching the figure", async (t) => {
  const { page, done } = await open(LECTURE);
  let shown;
  for (const { step, set, says, reads, holds, answers } of QUESTIONS) await t.test(`step ${step}: ${JSON.stringify(set.at(-1))}`, async () => {
    if (shown !== step) await showStep(page, step);
    shown = step;
    const found = [];
    for (const [i, values] of set.entries()) {
      for (const [name, value] of Object.entries(values)) await page.$$eval("#figure label", (labels, [name, value]) => {
        const control = labels.find((label) => label.firstChild.textContent === name).querySelector("input, select");
        control.value = String(value);
        for (const kind of ["input", "change"]) control.dispatchEvent(new Event(kind, { bubbles: true }));
      }, [name, value]);
      await settled(page);
      const said = await text(page, "#figure .result");
      if (says) assert.match(said, says[i]);
      if (reads) {
        assert.match(said, reads);
        found.push(reads.exec(said).slice(1).map(Number));
      }
    }
    if (holds) assert.ok(holds(...found), JSON.stringify(found));
    // Two questions of one step share its answer, which may be open.
    if (!await page.isVisible("#step details p")) await page.click("#step summary");
    await page.waitForSelector("#step details p");
    if (answers) assert.match(await text(page, "#step details p"), answers);
  });
  await done();
});

test("a link shows the lecture's figure as it was left", async () => {
  const { page, done } = await open(`${LECTURE}&step=8&figure=-0.5;3;2`);
  await drawn(page, 1);
  const values = () => page.$$eval("#figure input, #figure select", (all) => all.map((control) => control.value));
  assert.deepEqual(await values(), ["-0.5", "3", "2"]);
  await slide(page, "#figure input", -1);
  await page.waitForFunction(() => /figure=-1%3B3%3B2/.test(location.hash));
  await page.click("#steps li:nth-child(9) a");
  await page.waitForFunction(() => /step=9/.test(location.hash) && !/figure/.test(location.hash));
  await page.goto("about:blank");
  await page.goto(`${address}#${LECTURE}&step=8&figure=x;;9`);
  await drawn(page, 1);
  assert.deepEqual(await values(), ["-1.3", "8", "1"], "what is none is as the figure has it");
  await page.goto("about:blank");
  await page.goto(`${address}#${LECTURE}&step=6&figure=alike;3`);
  await drawn(page, 1);
  assert.deepEqual(await values(), ["alike", "3"]);
  await done();
});

test("the lecture is read by keys, and its figures follow the window", async () => {
  const { page, done } = await open(`${LECTURE}&step=16`);
  await page.waitForSelector("#figure svg");
  const [next, previous] = ["Next →", "← Previous"].map((name) => page.locator(`#step .steps button:has-text("${name}")`));
  await next.focus();
  await page.keyboard.press("Enter");
  await page.waitForSelector("html[data-step='17']");
  await page.keyboard.press("Enter");
  await page.waitForSelector("html[data-step='18']");
  assert.equal(await page.evaluate(() => document.activeElement.tagName), "H2", "there is no next step");
  for (const step of [17, 16]) {
    await previous.focus();
    await page.keyboard.press("Enter");
    await page.waitForSelector(`html[data-step='${step}']`);
  }
  await page.waitForSelector("#figure svg[viewBox^='0 0 640']");
  await page.setViewportSize({ width: 400, height: 800 });
  await page.waitForSelector("#figure svg[viewBox^='0 0 368']");
  await done();
});

test("on paper the answers are open and the page is light", async () => {
  const { page, done } = await open(`${LECTURE}&step=2`, { colorScheme: "dark" });
  await drawn(page, 1);
  const paper = () => page.evaluate(() => getComputedStyle(document.documentElement).backgroundColor);
  const dark = await paper();
  assert.ok(await page.isHidden("#step details p"));
  await page.emulateMedia({ media: "print", colorScheme: "dark" });
  await page.waitForFunction(() => document.querySelector("#step details").open);
  assert.ok(await page.isVisible("#step details p"));
  assert.notEqual(await paper(), dark);
  for (const hidden of ["#tabs", "#figure .controls", "#steps", "#status"]) assert.ok(await page.isHidden(hidden), hidden);
  assert.ok((await page.pdf()).length > 10_000);
  await page.emulateMedia({ media: "screen", colorScheme: "dark" });
  await page.waitForFunction(() => !document.querySelector("#step details").open);
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

test("sliders say their values as they are written", async () => {
  const { page, done } = await open(`${LECTURE}&step=2`);
  await drawn(page, 1);
  await slide(page, "#figure input", 50);
  const said = await page.$$eval("#figure input", (all) => all.map((input) => [input.getAttribute("aria-valuetext"), input.closest("label").querySelector("output").textContent]));
  for (const [spoken, written] of said) assert.equal(spoken, written);
  await show(page, "picture");
  await page.waitForFunction(() => /EV/.test(document.getElementById("exposure").getAttribute("aria-valuetext")));
  await done();
});

test("all steps are printed, with and without answers", async () => {
  const { page, done } = await open(`${LECTURE}`, { script: "window.print = () => { window.printed = true; };" });
  for (const answers of [true, false]) {
    await page.setChecked("#with-answers", answers);
    await page.click("#print-all");
    await page.waitForFunction(() => window.printed);
    const steps = await page.$$eval("#handout article", (all) => all.map((article) => [!!article.querySelector(".figure :is(svg, canvas)"), article.querySelector(".result").textContent, !!article.querySelector("details"), article.querySelector(".address").textContent]));
    assert.equal(steps.length, 18);
    for (const [i, [figure, result, answer, address]] of steps.entries()) {
      assert.ok(figure && /\d/.test(result), `step ${i + 1} has its figure`);
      assert.equal(answer, answers);
      assert.match(address, i ? new RegExp(`step=${i + 1}$`) : /panel=lecture/);
    }
    const pdf = await page.pdf();
    assert.ok(pdf.length > 50_000);
    assert.equal(pdf.toString("latin1").match(/\/Type\s*\/Page\b/g).length, 18, "each step has a page");
    await page.evaluate(() => { window.printed = false; dispatchEvent(new Event("afterprint")); });
    assert.equal(await page.locator("#handout article").count(), 0);
  }
  await done();
});

test("what the page cannot do without is named", async () => {
  const script = "WebAssembly.validate = () => false;";
  const { page, done } = await open(SMALL, { script, ready: "#status.error" });
  assert.match(await text(page, "#status"), /This browser lacks WebAssembly SIMD, which domelight needs/);
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

/** Drops files on the page. */
const drop = (page, files) => page.evaluate((files) => {
  const data = new DataTransfer();
  for (const [name, bytes] of files) data.items.add(new File([typeof bytes === "string" ? bytes : new Uint8Array(bytes)], name));
  document.body.dispatchEvent(new DragEvent("drop", { dataTransfer: data, bubbles: true, cancelable: true }));
}, files);

const OBJ = "mtllib red.mtl\nv -1 0 0\nv 1 0 0\nv 0 1.5 0\nusemtl red\nf 1 2 3\n";

test("dropped files are shown, and their errors named", async () => {
  const { page, done } = await open(SMALL);
  await rendered(page);
  await renderedAnew(page, () => drop(page, [["red.mtl", "newmtl red\nKd 0.8 0.1 0.1\n"], ["triangle.obj", OBJ]]));
  assert.equal(await page.inputValue("#scene"), "triangle.obj");
  const red = await page.evaluate(() => {
    const { films } = window.domelight.picture;
    const { pixels, width, height } = films[0], at = 4 * (Math.floor(height / 2) * width + width / 2);
    return [...pixels.slice(at, at + 3)];
  });
  assert.ok(red[0] > 3 * red[1], `red: ${red}`);
  // A Radiance picture of one color.
  const hdr = ["#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n", ...Array(8).fill(String.fromCharCode(128, 64, 32, 129))].join("");
  await renderedAnew(page, () => drop(page, [["blue.hdr", [...hdr].map((c) => c.charCodeAt(0))]]));
  assert.equal(await page.inputValue("#env"), "blue.hdr");
  await drop(page, [["broken.obj", "v 0 0 0\nf 1 2 3\n"]]);
  await page.waitForSelector("#status.error");
  assert.match(await text(page, "#status"), /broken\.obj, line 2: index 2 refers to no vertex/);
  await drop(page, [["notes.txt", "hello"]]);
  await page.waitForFunction(() => /notes\.txt is neither/.test(document.getElementById("status").textContent));
  await done();
});

test("a visitor without a link is offered the lecture and a model, and reads version and license", async () => {
  const { page, done } = await open("");
  assert.ok(await page.isVisible("#intro"));
  assert.match(await text(page, "footer"), /^domelight \d+\.\d+\.\d+\. License: MIT or Apache-2\.0/);
  assert.ok(await page.isHidden("#source"), "no address of the source code was built in");
  await page.click("#start-lecture");
  await page.waitForSelector("html[data-step='1'] #lecture:not([hidden])");
  assert.ok(await page.isHidden("#intro"));
  await show(page, "picture");
  const [chooser] = await Promise.all([page.waitForEvent("filechooser"), page.click("#drop-model")]);
  await chooser.setFiles({ name: "triangle.obj", mimeType: "text/plain", buffer: Buffer.from("v -1 0 0\nv 1 0 0\nv 0 1.5 0\nf 1 2 3\n") });
  await page.waitForFunction(() => document.getElementById("scene").value === "triangle.obj");
  assert.ok(await page.isHidden("#intro"));
  await done();
});

test("the hash keeps the state", async () => {
  const { page, done } = await open(`${SMALL}&env=cathedral&rotate=0&strategy=brdf:2&panel=lights&lights=16&method=median-cut`);
  await page.waitForSelector("html[data-rig='median-cut:16']");
  await show(page, "picture");
  assert.equal(await page.inputValue("#scene"), "sphere");
  await page.click("#tab-lights");
  await page.check("#leave");
  await page.selectOption("#gloss", "20");
  await page.waitForFunction(() => /leave=true/.test(location.hash) && /gloss=20/.test(location.hash));
  await show(page, "picture");
  await page.waitForTimeout(300);
  const hash = await page.evaluate(() => location.hash);
  assert.match(hash, /scene=sphere/);
  assert.doesNotMatch(hash, /panel/);
  await page.goto("about:blank");
  await page.goto(`${address}${hash}`);
  await page.waitForSelector("html[data-ready]");
  assert.equal(await page.inputValue("#env"), "cathedral");
  await show(page, "lights");
  await page.waitForSelector("html[data-rig]");
  assert.ok(await page.isChecked("#leave"));
  assert.equal(await page.inputValue("#gloss"), "20");
  await done();
});

test("a hash of nonsense is the default picture", async () => {
  const { page, done } = await open("size=-5&spp=99999999&camera={}&pixel=[1]&panel=__proto__&step=99&rows=x&size=64&spp=1");
  await rendered(page);
  assert.equal(await page.inputValue("#scene"), "statue");
  await done();
});

test("a wrong link shows the defaults and says what is wrong", async () => {
  const { page, done } = await open(`${SMALL}&curve=nope&what=1&pixel=[1]&strategy=velvet:3`);
  await rendered(page);
  assert.ok(await page.isHidden("#intro"), "a link says what to see");
  await page.waitForFunction(() => /curve=nope, what=1, pixel=\[1\], strategy=velvet:3\./.test(document.getElementById("wrong").textContent));
  assert.equal(await page.evaluate(() => window.domelight.app.state.strategy), "product:8");
  await page.evaluate(() => { location.hash = "size=64&spp=1&rows=64&panel=nowhere&step=99"; });
  await page.waitForFunction(() => /panel=nowhere, step=99/.test(document.getElementById("wrong").textContent));
  await renderedAnew(page, () => page.selectOption("#scene", "sphere"));
  assert.ok(await page.isHidden("#wrong"), "a change takes the message away");
  await done();
});

test("another page shows a step alone", async () => {
  const { page, done } = await open("panel=lecture&step=9&figure=0.4", { query: "?embed=step" });
  await drawn(page, 1);
  assert.match(await text(page, "#step h2"), /product/);
  assert.equal(await page.$eval("#figure input", ({ value }) => value), "0.4");
  for (const hidden of ["#tabs", "#steps", "#picture", "#step .steps"]) assert.ok(await page.isHidden(hidden), hidden);
  assert.equal(await page.evaluate(() => window.domelight.picture.jobs.length), 0, "no picture is rendered");
  await done();
  const whole = await open(`${LECTURE}&step=9`);
  await drawn(whole.page, 1);
  await whole.page.evaluate(() => {
    document.querySelector("meta[name=base]").content = "https://example.org/domelight.html";
    window.copied = [];
    navigator.clipboard.writeText = async (text) => { window.copied.push(text); };
  });
  await whole.page.click("#copy-step");
  await whole.page.click("#copy-embed");
  const [link, html] = await whole.page.evaluate(() => window.copied);
  assert.match(link, /^https:\/\/example\.org\/domelight\.html#.*panel=lecture.*step=9$/);
  assert.match(html, /^<iframe src="https:\/\/example\.org\/domelight\.html\?embed=step#[^"]*step=9" title="The product is the target"/);
  await whole.done();
});

test("changes are undone and redone, by buttons and by keys", async () => {
  const { page, done } = await open(`${SMALL}`);
  await rendered(page);
  const [undo, redo] = ["Undo", "Redo"].map((name) => page.locator(`#history button:text-is("${name}")`));
  assert.ok(await undo.isDisabled() && await redo.isDisabled());
  await renderedAnew(page, () => page.selectOption("#env", "studio"));
  // A slider that is dragged is one change.
  for (const turn of [10, 20, 30, 40]) await slide(page, "#rotate", turn);
  await rendered(page);
  await undo.click();
  await page.waitForFunction(() => window.domelight.app.state.rotate === 125 && window.domelight.app.state.env === "studio");
  assert.equal(await page.inputValue("#rotate"), "125");
  await page.keyboard.press("Control+z");
  await page.waitForFunction(() => window.domelight.app.state.env === "sky");
  assert.equal(await page.inputValue("#env"), "sky");
  assert.ok(await undo.isDisabled());
  await page.keyboard.press("Control+Shift+z");
  await page.keyboard.press("Control+y");
  await page.waitForFunction(() => window.domelight.app.state.rotate === 40 && window.domelight.app.state.env === "studio");
  await rendered(page);
  assert.match(await text(page, "#command"), /--env studio .*--env-rotate=40/);
  assert.ok(await redo.isDisabled());
  // In a text field, the keys undo text.
  await page.fill("#material", "diffuse:0.5");
  await page.keyboard.press("Control+z");
  assert.equal(await page.evaluate(() => window.domelight.app.state.rotate), 40);
  // In the lecture, a figure's sliders are changes, too.
  await show(page, "lecture");
  await drawn(page, 1);
  const first = "#figure input";
  await slide(page, first, 0.5);
  await undo.click();
  await page.waitForFunction((first) => document.querySelector(first).value === "0", first);
  await done();
});

test("each step shows its situation in other panels, and one comes back to its figure", async () => {
  const { page, done } = await open(LECTURE);
  const back = page.locator("#back");
  for (let step = 1; step <= await page.$$eval("#steps li", (all) => all.length); step++) {
    await showStep(page, step);
    const n = await page.locator("#step .opens button").count();
    assert.ok(n > 0, `step ${step} is seen somewhere else`);
    for (let k = 0; k < n; k++) {
      const button = page.locator("#step .opens button").nth(k), [panel] = (await button.textContent()).toLowerCase().replace("-", "").split(":");
      const before = await touch(page, k === 0 && step !== 12 ? "step up" : "none");
      await page.evaluate(() => { for (const key of ["map", "xray", "rig"]) delete document.documentElement.dataset[key]; });
      await button.click();
      await page.waitForSelector(`#${panel}:not([hidden])`);
      // The engine has begun what is asked; pictures are tested elsewhere.
      if (panel === "picture") await page.waitForFunction(() => { const { jobs } = window.domelight.picture; return jobs.length > 0 && jobs.every((job) => job.strategy); });
      else await page.waitForSelector(`html[data-${{ map: "map", xray: "xray", lights: "rig" }[panel]}]`);
      assert.equal(await page.$("#status.error"), null, `step ${step}: ${await text(page, "#status")}`);
      assert.doesNotMatch(await text(page, `#${panel}`), /NaN|undefined/);
      assert.equal(await back.textContent(), `← Back to step ${step}`);
      await back.click();
      await page.waitForSelector(`html[data-step='${step}']`);
      await page.waitForSelector("#lecture:not([hidden])");
      await drawn(page, 1);
      assert.equal(await touch(page), before, `step ${step} is as it was left`);
      assert.equal(await page.evaluate(() => window.domelight.app.state.scene), "sphere", "and so is the picture");
      assert.ok(await back.isHidden());
    }
  }
  await done();
});

test("what is changed after “See it in” is in the address, too", async () => {
  const { page, done } = await open(`${LECTURE}&step=1`);
  await drawn(page, 1);
  await page.locator("#step .opens button").first().click();
  await page.waitForSelector("#picture:not([hidden])");
  await slide(page, "#exposure", -2);
  await page.waitForFunction(() => /exposure=-2/.test(location.hash));
  await page.click("#back");
  await page.waitForSelector("#lecture:not([hidden])");
  await drawn(page, 1);
  await slide(page, "#figure input", 0.5);
  await page.waitForFunction(() => /figure=0\.5/.test(location.hash));
  await done();
});

test("a figure is drawn once for a link, under its light", async () => {
  const { page, done } = await open(`${LECTURE}&step=7`);
  await drawn(page, 1);
  await page.evaluate(() => {
    window.figures = new Set();
    new MutationObserver(() => window.figures.add(document.getElementById("figure"))).observe(document.getElementById("step"), { childList: true, subtree: true, attributes: true });
  });
  const link = `${LECTURE.replace("scene=sphere", "scene=statue")}&env=cathedral&step=7`;
  await page.evaluate((hash) => { location.hash = hash; }, link);
  await page.waitForFunction(() => window.domelight.app.scene?.triangles > 10_000 && !document.querySelector("#figure[data-drawing]") && document.querySelector("#figure[data-drawn]"));
  assert.match(await text(page, "#figure .result"), /of cathedral, which holds/);
  // The text stands while the light is loaded, and the figure is then drawn in its place.
  assert.ok(await page.evaluate(() => window.figures.size) <= 2);
  // Light that is changed elsewhere is the figure's when one comes back.
  await show(page, "picture");
  await page.selectOption("#env", "studio");
  await page.waitForFunction(() => window.domelight.app.holdsLight);
  await show(page, "lecture");
  await page.waitForFunction(() => /of studio, which holds/.test(document.querySelector("#figure .result").textContent));
  await done();
});

test("terms are explained under the pointer and at the keyboard's focus", async () => {
  const { page, done } = await open(`${SMALL}&strategy=brdf:2`, REFERS);
  await rendered(page);
  const meaning = page.locator("#meaning");
  await page.waitForFunction(() => /brdf:2/.test(document.querySelector("#picture figcaption .term:last-of-type, #picture figcaption").textContent));
  // The caption is written anew while the reference grows, which takes the word from under the pointer.
  do {
    await page.mouse.move(2, 2);
    await page.locator("#picture figcaption .term", { hasText: "brdf:2" }).hover();
    await page.waitForTimeout(50);
  } while (await meaning.isHidden());
  assert.match(await meaning.textContent(), /in proportion to the BRDF/);
  // The pointer may move onto the meaning, but not away.
  await meaning.hover();
  await page.waitForTimeout(300);
  assert.ok(await meaning.isVisible());
  await page.mouse.move(2, 2);
  await meaning.waitFor({ state: "hidden" });
  await show(page, "lecture");
  await drawn(page, 1);
  const term = page.locator("#step .text .term", { hasText: "Monte Carlo" });
  await term.focus();
  assert.match(await meaning.textContent(), /average of random samples/);
  assert.match(await term.getAttribute("aria-label"), /^Monte Carlo: Estimating/);
  const [own, at] = [await meaning.boundingBox(), await term.boundingBox()];
  assert.ok(own.y >= at.y + at.height || own.y + own.height <= at.y, "it does not cover its term");
  await page.keyboard.press("Escape");
  assert.ok(await meaning.isHidden());
  await page.keyboard.press("Tab");
  assert.ok(await meaning.isVisible(), "the next term");
  await done();
});

test("words that a link cannot have are the defaults", async () => {
  const words = "mapping=nope&layer=nope&method=nope&curve=nope&view=nope&equal=nope&seed=-1&lamps=-1&pixel=[27,27]"
    + `&camera=${encodeURIComponent('{"origin":[0,0,9],"target":[0,0,0],"up":[0,1,0],"fov":null,"ortho":null}')}`;
  for (const panel of ["picture", "map", "lights"]) {
    const { page, done } = await open(`${SMALL}&${words}&panel=${panel}`);
    if (panel === "picture") await rendered(page);
    assert.equal(await page.inputValue("#curve"), "agx");
    assert.equal(await page.inputValue("#seed"), "0");
    if (panel === "map") assert.equal(await page.inputValue("#mapping"), "lat-long");
    if (panel === "lights") await page.waitForSelector("html[data-rig='variance-minimization:64']");
    await done();
  }
});

test("a material that is none is told and changes nothing", async () => {
  const linked = await open(`${SMALL}&material=ggx:bad`);
  await rendered(linked.page);
  assert.match(await text(linked.page, "#status"), /«bad»/, "also when the picture is done");
  await linked.done();
  const { page, done } = await open(SMALL);
  await rendered(page);
  await page.fill("#material", "ggx:bad");
  await page.press("#material", "Enter");
  await page.waitForSelector("#status.error");
  await renderedAnew(page, () => page.evaluate(() => window.domelight.app.set({ spp: 2 })));
  assert.equal(await page.inputValue("#material"), "ggx:bad", "to be corrected");
  assert.doesNotMatch(await text(page, "#command"), /bad/);
  await page.waitForFunction(() => !/bad/.test(location.hash));
  await done();
});

test("the browser's Back leads to the last panel", async () => {
  const { page, done } = await open(SMALL);
  await show(page, "lights");
  await show(page, "lecture");
  await page.click("#steps li:nth-child(3) a");
  for (const [panel, step] of [["lecture", "1"], ["lights", "1"], ["picture", "1"]]) {
    await page.goBack();
    await page.waitForFunction((panel) => window.domelight.app.state.panel === panel, panel);
    assert.equal(await page.isVisible(`#${panel}`), true);
    if (panel === "lecture") await page.waitForSelector(`html[data-step='${step}']`);
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

test("every panel fits 390, 820 and 1440 pixels and has no violations of accessibility, light and dark", async () => {
  const { page, done } = await open(`${SMALL}&pixel=[27,27]`);
  await rendered(page);
  const seen = { map: "[data-map][data-samples]", xray: "[data-xray]", lights: "[data-rig]", lecture: "[data-step]" };
  for (const panel of ["picture", "map", "xray", "lights", "lecture"]) {
    await show(page, panel);
    if (seen[panel]) await page.waitForSelector(`html${seen[panel]}`);
    if (panel === "lecture") await drawn(page, 1);
    for (const width of [390, 820, 1440]) {
      await page.setViewportSize({ width, height: 844 });
      // Figures follow the window a tenth of a second later.
      await page.waitForTimeout(150);
      if (panel === "lecture") await settled(page);
      const [wide, seen] = await page.evaluate(() => [document.documentElement.scrollWidth, innerWidth]);
      assert.ok(wide <= seen, `${panel}: ${wide} px in ${seen}`);
      // Colors do not depend on the width.
      for (const colorScheme of { 390: ["light"], 820: ["dark"], 1440: ["light", "dark"] }[width]) {
        await page.emulateMedia({ colorScheme });
        assert.deepEqual(await violations(page), [], `${panel}, ${colorScheme}, ${width} pixels`);
      }
    }
  }
  await done();
});

test("every step with its answer has no violations of accessibility, light and dark", async () => {
  const { page, done } = await open(LECTURE), found = [];
  for (let step = 1; step <= 18; step++) {
    await showStep(page, step);
    await page.evaluate(() => document.querySelectorAll("#step details").forEach((details) => { details.open = true; }));
    // Themes differ in their colors alone.
    for (const [colorScheme, ...rules] of [["light"], ["dark", "color-contrast"]]) {
      await page.emulateMedia({ colorScheme });
      found.push(...(await violations(page, ...rules)).map((violation) => `step ${step}, ${colorScheme}: ${violation}`));
    }
  }
  assert.deepEqual(found, []);
  await done();
});

test("the default picture begins with its own exposure, without waiting for it", async () => {
  const { page, done } = await open("", { ready: "html[data-preview]" });
  const begun = await page.evaluate(() => window.domelight.picture.view.look.exposure);
  await page.waitForFunction(() => window.domelight.picture.automatic.view);
  assert.equal(begun, Number((await page.evaluate(() => window.domelight.picture.automatic.exposure)).toFixed(2)));
  await done();
});
