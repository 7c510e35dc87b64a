// Renders the balls in the engines, in headless Chromium: node balls.mjs FOLDER WIDTH HEIGHT. Writes ENGINE.f32 into the
// folder: RGBA, rows from the bottom.

import { writeFile } from "node:fs/promises";
import { join } from "node:path";
import { open } from "./browser.mjs";

const [, , folder, width, height] = process.argv;
const { page, close, versions } = await open(folder);
for (const engine of ["three", "babylon", "filament"]) {
  const tab = await page(`balls-${engine}`);
  const pixels = await tab.evaluate(
    ([width, height]) => window.balls("/rigs/", width, height),
    [Number(width), Number(height)],
  );
  await writeFile(join(folder, `${engine}.f32`), Buffer.from(Float32Array.from(pixels).buffer));
}
await close();
console.log(JSON.stringify(versions));
