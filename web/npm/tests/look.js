// A picture of the example beside domelight's own: node tests/look.js FILE.png, after example/build. It is docs/npm.png.

import { close, launch, open } from "./browser.js";

await launch();
const { page, done } = await open("/dist/example/index.html", { width: 1220, height: 460 });
await page.waitForSelector("html[data-ready]", { state: "attached" });
await page.click("#render");
await page.waitForSelector("html[data-rendered]", { state: "attached" });
// Shadows of the last frame.
await page.waitForTimeout(3000);
await page.screenshot({ path: process.argv[2] });
await done();
await close();
