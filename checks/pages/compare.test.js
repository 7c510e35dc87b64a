// The report of `domelight compare` in headless Chromium, from a file, at a desk and on a phone.
//
//   npm ci && npm test
//
// DOMELIGHT names the program (by default the one in target), CHROMIUM the browser.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { after, before, test } from "node:test";
import { chromium } from "playwright-core";

const first = (places) => places.filter(Boolean).find((place) => existsSync(place));
const target = resolve(import.meta.dirname, "../../target");
const program = first([process.env.DOMELIGHT, `${target}/release/domelight`, `${target}/debug/domelight`]);
const browserPath = first([process.env.CHROMIUM, "/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"]);
assert.ok(program, "no domelight in target/: build it first, or set DOMELIGHT");
assert.ok(browserPath, "no Chromium: install it, or set CHROMIUM");

let folder, browser, address, develop;

before(async () => {
  folder = mkdtempSync(join(tmpdir(), "domelight-web-"));
  const report = join(folder, "report.html");
  const run = (...words) => execFileSync(program, ["-q", ...words], { stdio: "inherit" });
  const scene = ["sphere", "--env", "sky", "--env-rows", "32", "--size", "64x48"];
  mkdirSync(join(folder, "others"));
  run("render", ...scene, "--spp", "16", "-o", join(folder, "others/cycles.1.5s.exr"));
  run("render", ...scene, "--spp", "64", "-o", join(folder, "reference.exr"));
  run("compare", ...scene, "--budget", "rays:8", "--pictures", join(folder, "others"),
    "--strategies", "brdf,mis,median-cut:8,variance-minimization:1000", "--seeds", "2",
    "--reference", join(folder, "reference.exr"), "-o", report);
  develop = (tone, exposure) => {
    const png = join(folder, `${tone}.png`);
    run("tone", join(folder, "reference.exr"), "--tone", tone, "--exposure", String(exposure), "-o", png);
    return readFileSync(png).toString("base64");
  };
  address = pathToFileURL(report).href;
  browser = await chromium.launch({
    executablePath: browserPath,
    args: ["--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking",
      "--disable-component-update", "--disable-sync"],
  });
});

after(async () => {
  await browser?.close();
  rmSync(folder, { recursive: true, force: true });
});

/** Opens the page; whatever goes wrong there, or reaches for the network, fails the test. */
async function open(options = {}) {
  const context = await browser.newContext({ viewport: { width: 1280, height: 900 }, ...options });
  const page = await context.newPage();
  await page.addInitScript(`window.bytesOf = ${bytesOf}`);
  const complaints = [];
  page.on("console", (message) => ["error", "warning"].includes(message.type()) && complaints.push(message.text()));
  page.on("pageerror", (error) => complaints.push(String(error)));
  page.on("request", (request) => /^(file|data|blob):/.test(request.url()) || complaints.push(request.url()));
  await page.goto(address);
  await page.waitForSelector("html[data-ready]");
  return { page, done: async () => { await context.close(); assert.deepEqual(complaints, []); } };
}

/** A frame of animation later, all is painted. */
const painted = (page) => page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));

/** In the page: the bytes of a canvas, by way of a copy that is made to be read. */
function bytesOf(canvas) {
  const { width, height } = canvas;
  const copy = Object.assign(document.createElement("canvas"), { width, height });
  const context = copy.getContext("2d", { willReadFrequently: true });
  context.drawImage(canvas, 0, 0);
  return context.getImageData(0, 0, width, height).data;
}

/** A hash (FNV-1a) of every picture that is seen, the pair viewer's first. */
async function canvases(page) {
  await painted(page);
  return page.$$eval(".viewer canvas", (all) => all.map((canvas) =>
    window.bytesOf(canvas).reduce((hash, byte) => Math.imul(hash ^ byte, 16777619), 2166136261)));
}

/** The mean of the pair viewer's bytes between the fractions `from` and `to` of its width. */
async function brightness(page, from = 0, to = 1) {
  await painted(page);
  return page.$eval("#pair-viewer canvas", (canvas, [from, to]) => {
    const inside = window.bytesOf(canvas).filter((_, i) => {
      const x = ((i >> 2) % canvas.width + 0.5) / canvas.width;
      return from <= x && x < to;
    });
    return inside.reduce((sum, byte) => sum + byte, 0) / inside.length;
  }, [from, to]);
}

const changed = (before, after) => before.map((bytes, i) => bytes !== after[i]);
const all = (values) => values.every(Boolean);
const text = (page, selector) => page.$eval(selector, (e) => e.textContent);

test("the page shows every strategy, the table and the plots", async () => {
  const { page, done } = await open();
  assert.match(await text(page, "h1"), /sphere under sky/);
  const names = await page.$$eval("#grid .name", (all) => all.map((e) => e.textContent));
  assert.deepEqual(names, ["reference", "brdf", "mis", "median-cut:8", "cycles"]);
  const rows = await page.$$eval("#table tbody tr", (all) => all.map((e) => e.textContent));
  assert.equal(rows.length, 5);
  assert.match(rows[4], /^cycles.*–.*1\.5/);
  assert.match(await text(page, "#lead"), /beside 1 picture by other renderers/);
  assert.match(rows[3], /left out: one camera sample per pixel traces/);
  assert.equal(await page.$$eval(".plots figure > svg", (all) => all.length), 2);
  assert.match(await text(page, "pre"), /^domelight -q compare sphere/);
  await done();
});

test("the divider moves by mouse and keyboard", async () => {
  const { page, done } = await open();
  await page.selectOption("#left", "0");
  await page.selectOption("#right", "1");
  const divider = page.locator("#divider");
  const value = async () => Number(await divider.getAttribute("aria-valuenow"));
  await painted(page);
  assert.equal(await value(), 50);
  const half = (await canvases(page))[0];
  const handle = await divider.boundingBox(), pairViewer = await page.locator("#pair-viewer").boundingBox();
  await page.mouse.move(handle.x + handle.width / 2, handle.y + handle.height / 2);
  await page.mouse.down();
  await page.mouse.move(pairViewer.x + 0.8 * pairViewer.width, handle.y + handle.height / 2, { steps: 4 });
  await page.mouse.up();
  await painted(page);
  assert.equal(await value(), 80);
  assert.notEqual((await canvases(page))[0], half);
  await divider.focus();
  await page.keyboard.press("ArrowLeft");
  await painted(page);
  assert.equal(await value(), 78);
  await page.keyboard.press("End");
  const left = (await canvases(page))[0];
  await page.keyboard.press("Home");
  const right = (await canvases(page))[0];
  assert.notEqual(left, right);
  await page.click("#swap");
  assert.equal((await canvases(page))[0], left, "swapped, the other picture is seen");
  await done();
});

test("wheel, buttons, drag and keys move all pictures together", async () => {
  const { page, done } = await open();
  const whole = await canvases(page);
  const pairViewer = await page.locator("#pair-viewer").boundingBox();
  await page.mouse.move(pairViewer.x + 0.3 * pairViewer.width, pairViewer.y + 0.4 * pairViewer.height);
  await page.mouse.wheel(0, -600);
  const zoomed = await canvases(page);
  assert.ok(all(changed(whole, zoomed)), "the wheel zooms all");
  assert.ok(parseFloat(await text(page, "#zoom-value")) > 2);
  await page.mouse.down();
  await page.mouse.move(pairViewer.x + 0.4 * pairViewer.width, pairViewer.y + 0.5 * pairViewer.height, { steps: 3 });
  await page.mouse.up();
  const dragged = await canvases(page);
  assert.ok(all(changed(zoomed, dragged)), "dragging moves all");
  await page.focus("#pair-viewer");
  await page.keyboard.press("ArrowRight");
  assert.ok(all(changed(dragged, await canvases(page))), "keys move all");
  await page.keyboard.press("0");
  assert.deepEqual(await canvases(page), whole, "0 shows the whole again");
  await page.keyboard.press("+");
  assert.equal(await text(page, "#zoom-value"), "1.5×");
  await page.click("#zoom-out");
  await page.click("#zoom-in");
  await page.click("#zoom-fit");
  assert.deepEqual(await canvases(page), whole);
  await done();
});

test("two fingers zoom", async () => {
  const { page, done } = await open({ viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true });
  const whole = await canvases(page);
  const { x, y, width, height } = await page.locator("#pair-viewer").boundingBox();
  const touch = await page.context().newCDPSession(page);
  const fingers = (apart) => [-1, 1].map((side, id) => ({
    id, x: x + width * (0.25 + side * apart), y: y + 0.3 * height,
  }));
  await touch.send("Input.dispatchTouchEvent", { type: "touchStart", touchPoints: fingers(0.05) });
  for (const apart of [0.08, 0.12, 0.16, 0.2]) {
    await touch.send("Input.dispatchTouchEvent", { type: "touchMove", touchPoints: fingers(apart) });
  }
  await touch.send("Input.dispatchTouchEvent", { type: "touchEnd", touchPoints: [] });
  assert.ok(all(changed(whole, await canvases(page))));
  assert.ok(parseFloat(await text(page, "#zoom-value")) > 2, await text(page, "#zoom-value"));
  await done();
});

test("exposure works on the radiance, not on the screen's values", async () => {
  const { page, done } = await open();
  const middle = await brightness(page);
  const set = (ev) => page.$eval("#exposure", (slider, ev) => {
    slider.value = ev;
    slider.dispatchEvent(new Event("input"));
  }, ev);
  await set(-4);
  const dark = await brightness(page);
  await set(2);
  const bright = await brightness(page);
  assert.ok(dark < 0.8 * middle && middle < bright, `${dark} ${middle} ${bright}`);
  assert.equal(await text(page, "#exposure-value"), "+2 EV");
  // What is cut off at +10 comes back.
  await set(10);
  await brightness(page);
  await set(-4);
  assert.equal(await brightness(page), dark);
  await page.selectOption("#tone", "neutral");
  assert.notEqual(await brightness(page), dark);
  await done();
});

test("the page opens as the program shows pictures, and has its tone curves", async () => {
  const { page, done } = await open();
  assert.equal(await page.$eval("#tone", (select) => select.value), "agx");
  const exposure = await page.evaluate(() => JSON.parse(document.getElementById("data").textContent).report.exposure);
  assert.ok(Math.abs(await page.$eval("#exposure", (slider) => slider.value) - exposure) < 1e-4);
  const [least, most] = await page.$eval("#exposure", (slider) => [slider.min, slider.max].map(Number));
  assert.ok(least <= exposure - 10 && most >= exposure + 10);
  await page.selectOption("#left", "0");
  await page.selectOption("#right", "0");
  for (const tone of ["agx", "aces", "neutral", "reinhard", "standard"]) {
    await page.selectOption("#tone", tone);
    await painted(page);
    const worst = await page.$eval("#pair-viewer canvas", async (canvas, png) => {
      const image = new Image();
      image.src = `data:image/png;base64,${png}`;
      await image.decode();
      const { width, height } = canvas;
      const copy = Object.assign(document.createElement("canvas"), { width, height });
      const context = copy.getContext("2d", { willReadFrequently: true });
      context.imageSmoothingEnabled = false;
      context.drawImage(image, 0, 0, width, height);
      const [a, b] = [window.bytesOf(canvas), context.getImageData(0, 0, width, height).data];
      return a.reduce((worst, byte, i) => Math.max(worst, Math.abs(byte - b[i])), 0);
    }, develop(tone, exposure));
    // The page's radiance has mantissas of eight bits.
    assert.ok(worst <= 3, `${tone} is off by ${worst}`);
  }
  await done();
});

test("on paper there are no controls, and all fits", async () => {
  const { page, done } = await open({ viewport: { width: 720, height: 1000 }, colorScheme: "dark" });
  await page.emulateMedia({ media: "print" });
  for (const hidden of [".controls", "#keys", "#swap", "#grid .choose"]) {
    assert.ok(!await page.isVisible(hidden), hidden);
  }
  for (const seen of ["#pair-viewer", "#table", ".plots", "#settings"]) assert.ok(await page.isVisible(seen), seen);
  const [wide, seen] = await page.evaluate(() => [document.documentElement.scrollWidth, innerWidth]);
  assert.ok(wide <= seen, `${wide} px in ${seen}`);
  const paper = await page.$eval("body", (body) => getComputedStyle(body).backgroundColor);
  assert.equal(paper, "rgb(255, 255, 255)");
  await done();
});

test("error pictures have a legend, and the reference no error", async () => {
  const { page, done } = await open();
  await page.selectOption("#left", "1");
  await page.selectOption("#right", "0");
  for (const [mode, label] of [["relative", /%/], ["flip", /0 to 1/]]) {
    await page.check(`input[value=${mode}]`, { force: true });
    assert.ok(await page.isVisible("#scale"));
    assert.match(await page.getAttribute("#scale-bar", "aria-label"), label);
    assert.ok(await brightness(page, 0, 0.45) > await brightness(page, 0.55, 1));
  }
  await page.check("input[value=radiance]", { force: true });
  assert.ok(!await page.isVisible("#scale"));
  await done();
});

test("it fits a phone, light and dark, and everything has a name", async () => {
  for (const colorScheme of ["light", "dark"]) {
    const { page, done } = await open({ viewport: { width: 390, height: 844 }, colorScheme });
    const [wide, seen] = await page.evaluate(() => [document.documentElement.scrollWidth, innerWidth]);
    assert.ok(wide <= seen, `${wide} px in ${seen}`);
    const nameless = await page.$$eval("button, select, input, [role=img], [tabindex]", (all) =>
      all.filter((e) => !e.getAttribute("aria-label") && !e.getAttribute("aria-labelledby")
        && !e.getAttribute("aria-describedby") && !e.labels?.length && !e.textContent.trim()).map((e) => e.outerHTML));
    assert.deepEqual(nameless, []);
    const [paper, ink] = await page.$eval("body", (body) => {
      const style = getComputedStyle(body);
      return [style.backgroundColor, style.color].map((c) => Number(c.match(/\d+/)[0]));
    });
    assert.ok(colorScheme === "dark" ? paper < ink : ink < paper);
    await done();
  }
});
