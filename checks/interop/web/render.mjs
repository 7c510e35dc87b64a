// Renders the sphere in headless Chromium: node render.mjs JOBS.json, each job
// { page, call, rig, view, out }; writes raw floats (RGBA, rows from the bottom) and prints versions.

import { readFile, writeFile } from "node:fs/promises";
import { open } from "./browser.mjs";

const { size, folder, jobs } = JSON.parse(await readFile(process.argv[2], "utf8"));
const { page, close, versions } = await open(folder);
for (const { page: name, call, rig, view, out } of jobs) {
  const tab = await page(name);
  const side = view === "front" ? 1 : -1;
  const pixels = await tab.evaluate(
    ([call, url, size, side]) => window[call](url, size, side),
    [call, `/rigs/${rig}`, size, side],
  );
  await writeFile(out, Buffer.from(Float32Array.from(pixels).buffer));
}
await close();
console.log(JSON.stringify(versions));
