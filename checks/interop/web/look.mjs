// The background of a scene in PlayCanvas, in headless Chromium: node look.mjs JOB.json, { folder, views, size, maps }. Writes
// MAP.f32 beside each map: RGBA, rows from the bottom, one view after another. Prints versions.

import { readFile, writeFile } from "node:fs/promises";
import { join } from "node:path";
import { open } from "./browser.mjs";

const { folder, views, size, maps } = JSON.parse(await readFile(process.argv[2], "utf8"));
const { page, close, versions } = await open(folder);
const tab = await page("playcanvas");
for (const map of maps) {
  const pixels = await tab.evaluate(([url, views, size]) => window.look(url, views, size), [`/rigs/${map}`, views, size]);
  await writeFile(join(folder, `${map}.f32`), Buffer.from(Float32Array.from(pixels).buffer));
}
await close();
console.log(JSON.stringify(versions));
