// Pictures of every panel at three widths in both themes, to be looked at: node tests/look.js FOLDER [PANEL …]; web/look
// runs it.

import { mkdirSync } from "node:fs";
import { join } from "node:path";
import { close, launch, open, rendered } from "./page.js";

const [, , folder, ...only] = process.argv;
const WIDTHS = [390, 820, 1440];
const STATE = "size=320&spp=8&pixel=[135,140]";
/** Panels and their states; of the lecture, each step. */
const VIEWS = [
  ["picture", ""], ["picture-split", "panel=picture&strategy=brdf:4&beside=mis:1:1&material=ggx:0.2,0.1:0.9,0.6,0.3:correlated"], ["picture-error", "panel=picture&view=error&strategy=mis:1:1"],
  ["map", "panel=map&layer=target&strategy=mis:1:1"], ["map-angular", "panel=map&mapping=angular&layer=product&samples=6"], ["xray", "panel=xray"],
  ["lights", "panel=lights"], ["lights-steps", "panel=lights&refine=false&lights=12"], ["link", "scene=robot.glb&env=yard.hdr"],
  ...Array.from({ length: 18 }, (_, i) => [`lecture-${String(i + 1).padStart(2, "0")}`, `panel=lecture&step=${i + 1}`]),
  ["embed", "panel=lecture&step=9", "?embed=step"],
];

/** What a panel without a picture shows when it is drawn. */
const DRAWN = { map: "html[data-map]", lights: "html[data-rig]", lecture: "#figure[data-drawn]:not([data-drawing])" };

const STEPS = Array.from({ length: 18 }, (_, i) => i + 1);
const wanted = (name) => !only.length || only.some((panel) => name.startsWith(panel));

mkdirSync(folder, { recursive: true });
await launch();
for (const [name, hash, query] of VIEWS.filter(([name]) => wanted(name))) {
  for (const width of WIDTHS) {
    for (const colorScheme of ["light", "dark"]) {
      const { page, done } = await open(`${STATE}&${hash}`, { query, viewport: { width, height: 900 }, colorScheme, reducedMotion: "reduce", refers: true });
      const [, panel = "picture"] = /panel=(\w+)/.exec(hash) ?? [];
      await (panel in DRAWN ? page.waitForSelector(DRAWN[panel]) : rendered(page));
      await page.waitForTimeout(1500);
      await page.screenshot({ path: join(folder, `${name}-${width}-${colorScheme}.png`), fullPage: true });
      await done();
    }
  }
}
// The lecture as a room sees it.
for (const step of STEPS.filter((step) => wanted(`present-${String(step).padStart(2, "0")}`))) {
  const { page, done } = await open(`${STATE}&panel=lecture&step=${step}`, { viewport: { width: 1920, height: 1080 }, reducedMotion: "reduce", refers: true });
  await page.waitForSelector("#figure[data-drawn]");
  await page.keyboard.press("f");
  await page.waitForTimeout(1500);
  await page.screenshot({ path: join(folder, `present-${String(step).padStart(2, "0")}.png`) });
  await done();
}
await close();
