// The page in headless Firefox, by WebDriver BiDi: without WebGL 2, so on a plain canvas.

import assert from "node:assert/strict";
import { existsSync } from "node:fs";
import { after, before, test } from "node:test";
import puppeteer from "puppeteer-core";
import { SMALL, address } from "./page.js";

const path = [process.env.FIREFOX, "/usr/bin/firefox-esr", "/usr/bin/firefox"].filter(Boolean).find((place) => existsSync(place));
assert.ok(path || process.env.CI !== "true", "no Firefox: install it, or set FIREFOX");
const skip = path ? false : "there is no Firefox: install it, or set FIREFOX";

let browser;
before(async () => {
  if (path) browser = await puppeteer.launch({ browser: "firefox", executablePath: path, headless: true });
});
after(() => browser?.close());

/** Opens the page, whose errors fail the test. */
async function open(hash) {
  const page = await browser.newPage();
  const complaints = [];
  page.on("pageerror", (error) => complaints.push(String(error)));
  page.on("console", (message) => { if (message.type() === "error") complaints.push(message.text()); });
  await page.goto(`${address}#${hash}`);
  await page.waitForSelector("html[data-ready]", { timeout: 60_000 });
  return { page, done: async () => { await page.close(); assert.deepEqual(complaints, []); } };
}

const rendered = (page) => page.waitForFunction(() => {
  const { jobs, preview, view } = window.domelight.picture;
  return !preview && jobs.length > 0 && jobs.every((job) => job.complete) && !view.canvas.hasAttribute("data-stale");
}, { timeout: 60_000 });

test("the picture is rendered and shown", { skip }, async () => {
  const { page, done } = await open(SMALL);
  await rendered(page);
  const mean = await page.evaluate(() => {
    const canvas = document.getElementById("film");
    const copy = Object.assign(document.createElement("canvas"), { width: canvas.width, height: canvas.height });
    const context = copy.getContext("2d");
    context.drawImage(canvas, 0, 0);
    const { data } = context.getImageData(0, 0, copy.width, copy.height);
    return data.reduce((sum, byte) => sum + byte, 0) / data.length;
  });
  assert.ok(mean > 80, `mean ${mean}`);
  await done();
});

test("orbiting and every panel work", { skip }, async () => {
  const { page, done } = await open(`${SMALL}&pixel=[27,27]`);
  await rendered(page);
  await page.focus("#viewer");
  await page.keyboard.press("ArrowLeft");
  await page.waitForFunction(() => /camera=/.test(location.hash));
  await page.click("#reset-camera");
  await rendered(page);
  for (const [panel, seen] of [["map", "map"], ["lights", "rig"]]) {
    await page.click(`#tab-${panel}`);
    await page.waitForSelector(`html[data-${seen}]`, { timeout: 60_000 });
  }
  await page.click("#tab-lecture");
  await page.waitForFunction(() => Number(document.getElementById("figure")?.dataset.drawn ?? 0) >= 1, { timeout: 60_000 });
  await done();
});

/** The mean of a canvas's bytes. */
const brightness = (page, id) => page.evaluate(async (id) => {
  const canvas = document.getElementById(id);
  do await new Promise((done) => setTimeout(done, 20)); while (canvas.hasAttribute("data-stale"));
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  return data.reduce((sum, byte) => sum + byte, 0) / data.length;
}, id);

/** Sets a control as a person does. */
const choose = (page, selector, value) => page.$eval(selector, (control, value) => {
  if (control.type === "checkbox") control.checked = value;
  else control.value = String(value);
  for (const kind of ["input", "change"]) control.dispatchEvent(new Event(kind, { bubbles: true }));
}, value);

test("the controls of the picture work", { skip }, async () => {
  const { page, done } = await open(SMALL);
  await rendered(page);
  const middle = await brightness(page, "film");
  await choose(page, "#exposure", -6);
  assert.ok(await brightness(page, "film") < middle - 20);
  await page.click("#auto");
  await page.waitForFunction(() => !/exposure=/.test(location.hash));
  assert.ok(Math.abs(await brightness(page, "film") - middle) < 1);
  await choose(page, "#curve", "standard");
  assert.notEqual(await brightness(page, "film"), middle);
  const command = () => page.$eval("#command", (e) => e.textContent);
  assert.match(await command(), /--tone=standard/);
  await choose(page, "#model", "ggx");
  await page.waitForFunction(() => /--material=ggx:0\.2:gold/.test(document.getElementById("command").textContent));
  await choose(page, "#strategy-editor select", "brdf");
  await page.waitForFunction(() => /--strategy=brdf:1/.test(document.getElementById("command").textContent));
  await choose(page, "#env", "studio");
  await choose(page, "#split", true);
  await rendered(page);
  await page.waitForFunction(() => document.getElementById("tag-right").textContent === "mis:1:1" && !document.getElementById("divider").hidden);
  assert.equal(await page.$("#status.error"), null);
  await done();
});

test("the X-ray works", { skip }, async () => {
  const { page, done } = await open(`${SMALL}&panel=xray&strategy=mis:1:1`);
  await rendered(page);
  await page.focus("#xray-viewer");
  for (const key of ["ArrowLeft", "ArrowUp", "Enter"]) await page.keyboard.press(key);
  await page.waitForSelector("html[data-xray]", { timeout: 60_000 });
  assert.match(await page.$eval("#xray-summary", (e) => e.textContent), /Pixel 31, 31 of 64 × 64/);
  assert.ok((await page.$$("#causes .bar")).length >= 4);
  assert.ok(await brightness(page, "xray-film") > 40);
  // A direction that is pointed at on one hemisphere is marked on all, and read.
  const hemisphere = await page.$("#hemispheres .marked");
  await hemisphere.evaluate((element) => element.scrollIntoView({ block: "center" }));
  const { x, y, width, height } = await hemisphere.boundingBox();
  await page.mouse.move(x + 0.5 * width, y + 0.5 * height);
  await page.waitForFunction(() => /^In this direction, L = /.test(document.getElementById("xray-readout").textContent)
    && [...document.querySelectorAll(".hemispheres .mark")].every(({ hidden }) => !hidden), { timeout: 60_000 });
  await done();
});

/** Waits until the lecture's figure shows what its controls say. */
const settled = (page) => page.waitForFunction(() => {
  const figure = document.getElementById("figure");
  return Number(figure?.dataset.drawn ?? 0) >= 1 && !figure.hasAttribute("data-drawing");
}, { timeout: 60_000 });

/** Steps of the lecture, whether dragging moves one of their controls, and the drag in shares of the first plot or map. */
const DRAGS = [
  [1, true, [0.9, 0.5], [0.9, 0.2]], [2, true, [0.4, 0.4], [0.25, 0.6]], [3, true, [0.45, 0.5], [0.35, 0.5]], [6, true, [0.5, 0.3], [0.5, 0.7]], [7, false, [0.3, 0.3], [0.6, 0.5]],
  [9, true, [0.6, 0.5], [0.75, 0.5]], [11, true, [0.5, 0.5], [0.7, 0.5]], [14, false, [0.03, 0.3], [0.97, 0.6]], [15, false, [0.16, 0.3], [0.66, 0.8]],
];

test("the main figures of the lecture play, pause, are dragged and read", { skip }, async (t) => {
  const { page, done } = await open("size=64&spp=4&rows=64&scene=sphere&panel=lecture");
  await settled(page);
  const integral = await page.$$eval("#step math mo", (all) => {
    const sign = all.find(({ textContent }) => textContent === "∫");
    return sign.getBoundingClientRect().height / parseFloat(getComputedStyle(sign).fontSize);
  });
  assert.ok(integral > 2, `an integral sign is ${integral} em high`);
  for (const [step, moves, from, to] of DRAGS) await t.test(`step ${step}`, async () => {
    await page.click(`#steps li:nth-child(${step}) a`);
    await page.waitForSelector(`html[data-step='${step}']`);
    await settled(page);
    const values = () => page.$$eval("#figure input, #figure select", (all) => all.map(({ value }) => value));
    const player = () => page.$eval("#figure .player", (player) => player.previousElementSibling.querySelector("input").value);
    await page.$eval("#figure .player", (player) => {
      const input = player.previousElementSibling.querySelector("input");
      input.value = input.min;
      input.dispatchEvent(new Event("input", { bubbles: true }));
    });
    const first = await player(), [, toggle] = await page.$$("#figure .player button");
    await toggle.evaluate((button) => button.scrollIntoView({ block: "center" }));
    await toggle.click();
    await page.waitForFunction((first) => document.querySelector("#figure .player").previousElementSibling.querySelector("input").value !== first, {}, first);
    if (await toggle.evaluate((button) => button.textContent) === "Pause") await toggle.click();
    const paused = await player();
    await new Promise((done) => setTimeout(done, 200));
    assert.equal(await player(), paused, "a paused figure stands still");
    await settled(page);
    // The pointer reads values, and drags.
    const box = await page.$eval("#figure [data-frame]", (framed) => {
      framed.scrollIntoView({ block: "center" });
      const { left, top, width, height } = framed.getBoundingClientRect();
      return { left, top, width, height };
    });
    const at = ([x, y]) => [box.left + x * box.width, box.top + y * box.height];
    const read = () => page.$eval("#figure", (figure) => figure.querySelector(".readout").textContent + figure.querySelector(".result").textContent);
    const unread = await read(), before = await values();
    await page.mouse.move(...at(from));
    await page.waitForFunction((unread) => {
      const figure = document.getElementById("figure");
      return figure.querySelector(".readout").textContent + figure.querySelector(".result").textContent !== unread;
    }, {}, unread);
    const readAt = await read();
    assert.doesNotMatch(readAt, /NaN|undefined|Infinity/);
    await page.mouse.down();
    await page.mouse.move(...at(to), { steps: 3 });
    await page.mouse.up();
    await settled(page);
    assert.notEqual(await read(), readAt, "other places have other values");
    const after = await values();
    if (moves) assert.notDeepEqual(after, before, "dragging moves a control");
    // Keys read, too, at a mark in a plot or map that keeps the focus.
    const unmarked = await read();
    await page.$eval("#figure [data-frame]", (framed) => framed.focus());
    for (const key of ["ArrowRight", "ArrowUp"]) await page.keyboard.press(key);
    await settled(page);
    assert.notEqual(await read(), unmarked);
    assert.ok(await page.evaluate(() => document.activeElement.matches("[data-frame]") && !!document.querySelector("#figure .overlay .mark")));
  });
  await done();
});
