// The page in headless Firefox, by WebDriver BiDi: without WebGL 2, so on a plain canvas.

import assert from "node:assert/strict";
import { existsSync } from "node:fs";
import { after, before, test } from "node:test";
import puppeteer from "puppeteer-core";
import { SMALL, address } from "./page.js";

const path = [process.env.FIREFOX, "/usr/bin/firefox-esr", "/usr/bin/firefox"].filter(Boolean).find((place) => existsSync(place));
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
