// Pages of this folder in headless Chromium.

import { readFile } from "node:fs/promises";
import { createServer } from "node:http";
import { extname, join, normalize } from "node:path";
import { fileURLToPath } from "node:url";
import { chromium } from "playwright-core";

const here = fileURLToPath(new URL("..", import.meta.url));
const types = {
  ".html": "text/html", ".js": "text/javascript", ".mjs": "text/javascript", ".wasm": "application/wasm",
};

/** Serves this folder, and the files of `folder` under /rigs/. `page` opens a page once, by default one of web/. */
export async function open(folder) {
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
  const page = async (name, path = `/web/${name}.html`) => {
    if (!pages[name]) {
      const tab = (pages[name] = await browser.newPage());
      tab.on("console", (message) => console.error(`${name}: ${message.text()}`));
      tab.on("pageerror", (error) => console.error(`${name}: ${error}`));
      await tab.goto(`${origin}${path}`);
      await tab.waitForFunction(() => window.ready, null, { timeout: 300000 });
      versions[name] = await tab.evaluate(() => window.revision);
    }
    return pages[name];
  };
  const close = async () => {
    await browser.close();
    server.close();
  };
  return { page, close, versions };
}
