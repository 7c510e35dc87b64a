// This folder over HTTP, in headless Chromium.

import assert from "node:assert/strict";
import { existsSync } from "node:fs";
import { readFile } from "node:fs/promises";
import { createServer } from "node:http";
import { extname, join, normalize } from "node:path";
import { chromium } from "playwright-core";

const root = join(import.meta.dirname, "..");
const TYPES = { ".html": "text/html", ".js": "text/javascript", ".wasm": "application/wasm" };
const browserPath = [process.env.CHROMIUM, "/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"].filter(Boolean).find((path) => existsSync(path));

/** A page that finds the package and three.js as a bundler would. */
const BLANK = `<!doctype html><meta charset="utf-8"><title>test</title><script type="importmap">${JSON.stringify({ imports: {
  domelight: "/dist/index.js",
  "domelight/three": "/dist/three.js",
  three: "/node_modules/three/build/three.module.js",
} })}</script>`;

let browser, server, address;

export async function launch() {
  assert.ok(browserPath, "no Chromium: install it, or set CHROMIUM");
  server = createServer(async (request, response) => {
    const path = normalize(new URL(request.url, "http://localhost").pathname);
    try {
      const content = path === "/" ? BLANK : await readFile(join(root, path));
      response.writeHead(200, { "content-type": path === "/" ? TYPES[".html"] : TYPES[extname(path)] ?? "application/octet-stream" }).end(content);
    } catch {
      response.writeHead(404).end();
    }
  });
  await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
  address = `http://127.0.0.1:${server.address().port}`;
  browser = await chromium.launch({
    executablePath: browserPath,
    args: ["--headless", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-background-networking"],
  });
}

export async function close() {
  await browser?.close();
  server?.close();
}

/** Opens a page; whatever goes wrong there fails the test. */
export async function open(path = "/", viewport = { width: 1280, height: 720 }) {
  const page = await browser.newPage({ viewport });
  page.setDefaultTimeout(120_000);
  const complaints = [];
  page.on("console", (message) => {
    // Chromium without a GPU remarks on its own driver, and looks for an icon; some tests ask for what there is not.
    if (message.type() === "error" && !/GL Driver Message|Failed to load resource|Content Security Policy/.test(message.text())) complaints.push(message.text());
  });
  page.on("pageerror", (error) => complaints.push(String(error)));
  await page.goto(address + path);
  return { page, done: async () => { await page.close(); assert.deepEqual(complaints, []); } };
}
