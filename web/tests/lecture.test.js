// The lecture: single steps, and how it is shown.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { violations } from "./axe.js";
import { LECTURE, drawn, figureOf, settled, showStep } from "./lecture.js";
import { SMALL, address, close, launch, open, show, slide, text } from "./page.js";

before(launch);
after(close);

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
