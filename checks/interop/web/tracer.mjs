// Runs the example that path-traces by the tables of a map, in headless Chromium: node tracer.mjs FOLDER PICTURE. Prints the
// mean and the noise of its three panes.

import { open } from "./browser.mjs";

const [, , folder, picture] = process.argv;
const { page, close } = await open(folder);
const tab = await page("path-tracer", "/rigs/path-tracer.html?tables=studio&frames=64&size=96");
console.log(JSON.stringify(await tab.evaluate(() => window.panes ?? document.getElementById("status").textContent)));
await tab.screenshot({ path: picture, fullPage: true });
await close();
