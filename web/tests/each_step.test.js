// What every step of the lecture has in common.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { violations } from "./axe.js";
import { LECTURE, drawn, figureOf, settled, showStep } from "./lecture.js";
import { close, launch, open, text } from "./page.js";

before(launch);
after(close);

test("every step of the lecture has a figure that each of its controls changes", async (t) => {
  const { page, done } = await open(LECTURE);
  assert.equal(await page.locator("#steps a").count(), 18);
  for (let step = 1; step <= 18; step++) await t.test(`step ${step}`, async () => {
    await showStep(page, step);
    assert.ok(await page.$("#step math"), "it has a formula");
    assert.ok((await text(page, "#step .question")).length > 40);
    assert.match(await text(page, "#figure .result"), /\d/, "it says a number");
    assert.doesNotMatch(await text(page, "#figure"), /NaN|undefined|Infinity/);
    const controls = await page.$$("#figure input, #figure select");
    assert.ok(controls.length > 0, "it has a control");
    let times = Number(await page.$eval("#figure", (figure) => figure.dataset.drawn)), shown = await figureOf(page);
    for (const control of controls) {
      const before = shown, value = await control.inputValue();
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
      shown = await figureOf(page);
      assert.notEqual(shown, before, `“${name}” changes the figure`);
    }
  });
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

test("each step shows its situation in other panels, and one comes back to its figure", async (t) => {
  const { page, done } = await open(LECTURE);
  const back = page.locator("#back");
  for (let step = 1; step <= 18; step++) await t.test(`step ${step}`, async () => {
    await showStep(page, step);
    const n = await page.locator("#step .opens button").count();
    assert.ok(n > 0, "it is seen somewhere else");
    for (let k = 0; k < n; k++) {
      const button = page.locator("#step .opens button").nth(k), [panel] = (await button.textContent()).toLowerCase().replace("-", "").split(":");
      const before = await touch(page, k === 0 && step !== 12 ? "step up" : "none");
      await page.evaluate(() => { for (const key of ["map", "xray", "rig"]) delete document.documentElement.dataset[key]; });
      await button.click();
      await page.waitForSelector(`#${panel}:not([hidden])`);
      // The engine has begun what is asked; pictures are tested elsewhere.
      if (panel === "picture") await page.waitForFunction(() => { const { jobs } = window.domelight.picture; return jobs.length > 0 && jobs.every((job) => job.strategy); });
      else await page.waitForSelector(`html[data-${{ map: "map", xray: "xray", lights: "rig" }[panel]}]`);
      assert.equal(await page.$("#status.error"), null, await text(page, "#status"));
      assert.doesNotMatch(await text(page, `#${panel}`), /NaN|undefined/);
      assert.equal(await back.textContent(), `← Back to step ${step}`);
      await back.click();
      await page.waitForSelector(`html[data-step='${step}']`);
      await page.waitForSelector("#lecture:not([hidden])");
      await drawn(page, 1);
      assert.equal(await touch(page), before, "it is as it was left");
      assert.equal(await page.evaluate(() => window.domelight.app.state.scene), "sphere", "and so is the picture");
      assert.ok(await back.isHidden());
    }
  });
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
