// What axe finds in a page.

import { readFileSync } from "node:fs";
import { createRequire } from "node:module";

const axe = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");

/** Axe's findings, by rule; of some rules only, if they are named. */
export async function violations(page, ...rules) {
  await page.evaluate(axe);
  return page.evaluate(async (rules) => (await window.axe.run(document, { resultTypes: ["violations"], ...(rules.length ? { runOnly: rules } : {}) })).violations.map((v) =>
    `${v.id}: ${v.nodes.map((n) => n.target).join(" ")}`), rules);
}
