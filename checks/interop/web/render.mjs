// Renders the sphere in headless Chromium: node render.mjs JOBS.json, each job
// { page, call, rig, view, out }; writes raw floats (RGBA, rows from the bottom) and prints versions.

import { readFile, writeFile } from "node:fs/promises";
import { createServer } from "node:http";
import { extname, join, normalize } from "node:path";
import { fileURLToPath } from "node:url";
import { chromium } from "playwright-core";

const here = fileURLToPath(new URL("..", import.meta.url));
const types = { ".html": "text/html", ".js": "text/javascript", ".mjs": "text/javascript" };
const { size, folder, jobs } = JSON.parse(await readFile(process.argv[2], "utf8"));

// Serves this folder, and the rigs under /rigs/.
const server = createServer(async (request, response) => {
  const path = normalize(decodeURIComponent(new URL(request.url, "http://x").pathname));
  const file = path.startsWith("/rigs/") ? join(folder, path.slice(6)) : join(here, path);
  try {
    const data = await readFile(file);
    response.writeHead(200, { "content-type": types[extname(file)] ?? "application/octet-stream" });
    response.end(data);
  } catch {
    response.writeHead(404).end();
  }
});
await new Promise((listening) => server.listen(0, "127.0.0.1", listening));
const origin = `http://127.0.0.1:${server.address().port}`;

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: [
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
  ],
});
const versions = { chromium: browser.version() };
const pages = {};
for (const { page: name, call, rig, view, out } of jobs) {
  if (!pages[name]) {
    const page = (pages[name] = await browser.newPage());
    page.on("console", (message) => console.error(`${name}: ${message.text()}`));
    page.on("pageerror", (error) => console.error(`${name}: ${error}`));
    await page.goto(`${origin}/web/${name}.html`);
    await page.waitForFunction(() => window.ready, null, { timeout: 120000 });
    versions[name] = await page.evaluate(() => window.revision);
  }
  const side = view === "front" ? 1 : -1;
  const pixels = await pages[name].evaluate(
    ([call, url, size, side]) => window[call](url, size, side),
    [call, `/rigs/${rig}`, size, side],
  );
  await writeFile(out, Buffer.from(Float32Array.from(pixels).buffer));
}
await browser.close();
server.close();
console.log(JSON.stringify(versions));
