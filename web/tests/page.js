// The page in headless Chromium, from a file.

import assert from "node:assert/strict";
import { existsSync, readFileSync } from "node:fs";
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { chromium } from "playwright-core";

const root = resolve(import.meta.dirname, "../..");
const first = (places) => places.filter(Boolean).find((place) => existsSync(place));

/** The program whose pictures the page's must be. */
export const program = first([process.env.DOMELIGHT, join(root, "target/release/domelight"), join(root, "target/debug/domelight")]);
const browserPath = first([process.env.CHROMIUM, "/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"]);
export const file = join(root, "web/dist/domelight.html");
assert.ok(browserPath, "no Chromium: install it, or set CHROMIUM");
assert.ok(existsSync(file), "no web/dist/domelight.html: run web/build first");
export const address = pathToFileURL(file).href;

/** A small picture of what loads quickest, and no more samples than a test needs. */
export const SMALL = "size=64&spp=4&rows=64&scene=sphere";

const OPTIONS = { viewport: { width: 1280, height: 900 }, acceptDownloads: true };

let browser;
/** The context of all pages, unless each compiles the engine. */
let shared;

/** Starts the browser. All pages share a process, in which one stays open, so that only this one compiles the engine; `isCold`
 *  leaves that to each page. */
export async function launch({ isCold = false } = {}) {
  browser = await chromium.launch({
    executablePath: browserPath,
    args: ["--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-component-update", "--disable-sync", "--process-per-site"],
  });
  if (isCold) return;
  shared = await browser.newContext(OPTIONS);
  const kept = await shared.newPage();
  await kept.goto(`${address}?embed=step#panel=lecture`);
  await kept.waitForSelector("html[data-ready]");
}
export const close = () => browser?.close();

/** How much slower the page's main thread is made, to test what happens on a slow machine. */
const throttling = Number(process.env.THROTTLE ?? 1);

/** Never makes a reference for the picture's error, which takes time from what is tested. */
const WITHOUT_REFERENCE = `Object.defineProperty(window, "domelight", { configurable: true, set(value) {
  value.picture.reference.run = () => {};
  Object.defineProperty(window, "domelight", { value });
} });`;

/** Bytes as text: an array of numbers takes seconds on its way out of the browser. */
const BASE64 = `window.base64 = (bytes) => {
  let text = "";
  for (let i = 0; i < bytes.length; i += 0x8000) text += String.fromCharCode(...bytes.subarray(i, i + 0x8000));
  return btoa(text);
};`;

/** The bytes that a function of the page finds. */
export const bytesOf = async (page, find, argument) => Buffer.from(await page.evaluate(`(${find})(${JSON.stringify(argument)}).then(window.base64)`), "base64");

/** Opens the page, from its file or from an address; whatever goes wrong there, or reaches for another place, fails the test. */
export async function open(hash = SMALL, { query = "", at = `${address}${query}#${hash}`, script, ready = "html[data-ready]", refers = false, viewport, ...media } = {}) {
  const context = shared ?? await browser.newContext(OPTIONS), page = await context.newPage();
  if (viewport) await page.setViewportSize(viewport);
  await page.emulateMedia(media);
  await page.addInitScript(BASE64);
  if (script) await page.addInitScript(script);
  if (!refers) await page.addInitScript(WITHOUT_REFERENCE);
  if (throttling > 1) await (await context.newCDPSession(page)).send("Emulation.setCPUThrottlingRate", { rate: throttling });
  page.setDefaultTimeout(60_000);
  const complaints = [];
  page.on("console", (message) => {
    // Chromium without a GPU remarks on its own driver.
    if (["error", "warning"].includes(message.type()) && !/GL Driver Message/.test(message.text())) complaints.push(message.text());
  });
  page.on("pageerror", (error) => complaints.push(String(error)));
  const isOwn = (url) => /^(file|data|blob):/.test(url) || (at.startsWith("http:") && url === at.replace(/#.*/, ""));
  page.on("request", (request) => isOwn(request.url()) || complaints.push(request.url()));
  await page.goto(at);
  await page.waitForSelector(ready);
  return { page, done: async () => { await (shared ? page : context).close(); assert.deepEqual(complaints, []); } };
}

/** Does what starts a picture, and waits for its last sample. */
export async function rendered(page, act) {
  await act?.();
  await page.waitForFunction(() => {
    const { jobs, preview } = window.domelight.picture;
    return !preview && jobs.length > 0 && jobs.every((job) => job.complete) && document.documentElement.dataset.complete === String(jobs.at(-1).token)
      || (!preview && jobs.length > 0 && jobs.every((job) => job.complete));
  });
}

/** Waits until the action has led to other jobs that are complete. */
export async function renderedAnew(page, act) {
  const before = await page.evaluate(() => Math.max(0, ...window.domelight.picture.jobs.map((job) => job.token)));
  await act();
  await page.waitForFunction((before) => {
    const { jobs, preview } = window.domelight.picture;
    return !preview && jobs.length > 0 && jobs.every((job) => job.token > before && job.complete);
  }, before);
}

/** What `of` makes, in the page, of a canvas's bytes once it is painted. */
const ofCanvas = (page, id, of) => page.evaluate(async ([id, of]) => {
  const frame = () => new Promise(requestAnimationFrame);
  const canvas = document.getElementById(id);
  do await frame(); while (canvas.hasAttribute("data-stale"));
  const copy = Object.assign(document.createElement("canvas"), { width: canvas.width, height: canvas.height });
  const context = copy.getContext("2d", { willReadFrequently: true });
  context.drawImage(canvas, 0, 0);
  const { data } = context.getImageData(0, 0, copy.width, copy.height);
  switch (of) {
    case "hash": return data.reduce((hash, byte) => Math.imul(hash ^ byte, 16777619), 2166136261);
    case "pixels": return window.base64(data.filter((_, i) => i % 4 < 3));
    case "mean": return data.reduce((sum, byte) => sum + byte, 0) / data.length;
    default: throw new Error(`nothing is known of ${of}`);
  }
}, [id, of]);

/** A hash (FNV-1a) of a canvas. */
export const canvasHash = (page, id) => ofCanvas(page, id, "hash");

/** R, G and B of a canvas's pixels, row by row. */
export const pixelsOf = async (page, id) => Buffer.from(await ofCanvas(page, id, "pixels"), "base64");

/** The mean of a canvas's bytes. */
export const brightness = (page, id) => ofCanvas(page, id, "mean");

export const text = (page, selector) => page.$eval(selector, (e) => e.textContent);

/** Moves a slider like a person who drags it. */
export const slide = (page, selector, value) => page.evaluate(([selector, value]) => {
  const input = document.querySelector(selector);
  input.value = String(value);
  input.dispatchEvent(new Event("input", { bubbles: true }));
}, [selector, value]);

/** Drops files and folders of the disk on the page, as a hand does. */
export async function drop(page, paths) {
  const cdp = await page.context().newCDPSession(page);
  const data = { items: [], files: paths, dragOperationsMask: 1 };
  for (const type of ["dragEnter", "dragOver", "drop"]) await cdp.send("Input.dispatchDragEvent", { type, x: 400, y: 400, data });
  await cdp.detach();
}

/** Megabytes in memory of the browser's processes that run pages. */
export async function memory() {
  const cdp = await browser.newBrowserCDPSession();
  const { processInfo } = await cdp.send("SystemInfo.getProcessInfo");
  await cdp.detach();
  const pages = processInfo.filter(({ type }) => type === "renderer").map(({ id }) => Number(id));
  const resident = (id) => Number(/VmRSS:\s+(\d+)/.exec(readFileSync(`/proc/${id}/status`, "utf8"))[1]) / 1024;
  return pages.reduce((sum, id) => sum + resident(id), 0);
}

export const show = (page, panel) => page.click(`#tab-${panel}`);
