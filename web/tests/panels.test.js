// What all panels share: links, history, files, terms and accessibility.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { violations } from "./axe.js";
import { drawn, settled } from "./lecture.js";
import { SMALL, address, close, launch, open, rendered, renderedAnew, show, slide, text } from "./page.js";

before(launch);
after(close);

test("what the page cannot do without is named", async () => {
  const script = "WebAssembly.validate = () => false;";
  const { page, done } = await open(SMALL, { script, ready: "#status.error" });
  assert.match(await text(page, "#status"), /This browser lacks WebAssembly SIMD, which domelight needs/);
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

test("terms are explained under the pointer and at the keyboard's focus", async () => {
  const { page, done } = await open(`${SMALL}&strategy=brdf:2`, { refers: true });
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
