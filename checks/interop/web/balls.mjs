// Renders the balls in the engines, in headless Chromium: node balls.mjs FOLDER WIDTH HEIGHT FILES, where FILES are the names of
// files by engine, as JSON. Writes FILE.f32 beside each: RGBA, rows from the bottom.

import { writeFile } from "node:fs/promises";
import { join } from "node:path";
import { open } from "./browser.mjs";

const [, , folder, width, height, files] = process.argv;
const { page, close, versions } = await open(folder);
for (const [engine, names] of Object.entries(JSON.parse(files))) {
  const tab = await page(`balls-${engine}`);
  for (const name of names) {
    const pixels = await tab.evaluate(
      ([width, height, name]) => window.balls("/rigs/", width, height, name),
      [Number(width), Number(height), name],
    );
    await writeFile(join(folder, `${name}.f32`), Buffer.from(Float32Array.from(pixels).buffer));
  }
}
await close();
console.log(JSON.stringify(versions));
