// The error of pictures, measured against a reference and estimated.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { brightness, canvasHash, close, launch, open, rendered, renderedAnew, text } from "./page.js";

before(launch);
after(close);

test("errors are measured at whole passes against a reference that is made by itself and kept", async () => {
  const { page, done } = await open("size=32&spp=16&rows=64&env=studio&strategy=mis:1:1", { refers: true });
  const measured = () => page.waitForSelector("figure[data-error=measured]");
  await rendered(page);
  await measured();
  await page.waitForFunction(() => { const { reference } = window.domelight.picture; return reference.isReady && !reference.running; });
  const read = () => page.evaluate(() => {
    const { jobs, reference } = window.domelight.picture, points = window.domelight.picture.measured()[0];
    return { points: points.map(({ rays, error }) => [rays, error]), rays: jobs[0].statistics.shadowRays, renders: reference.renders, variance: jobs[0].statistics.relativeVariance };
  });
  const first = await read();
  // Passes of 1, 1, 2, 4 and 8 samples.
  assert.equal(first.points.length, 5, JSON.stringify(first));
  assert.equal(first.points.at(-1)[0], first.rays);
  for (const [i, [rays, error]] of first.points.entries()) {
    if (i) assert.ok(rays > first.points[i - 1][0] && error < first.points[i - 1][1], JSON.stringify(first.points));
  }
  const last = first.points.at(-1)[1];
  assert.ok(last > 0.5 * first.variance && last < 2 * first.variance, `measured ${last}, estimated ${first.variance}`);
  const caption = await text(page, "#picture figcaption");
  assert.match(caption, /measured against a reference of \d+ independent renders .*: mis:1:1 has [\d.]+ ± [\d.]+, slope −0\.[3-9]\d ± 0\.\d+/);
  assert.equal((await page.$$("#error-plot circle.first")).length, 5);
  // The same link has the same numbers, and another strategy the same reference.
  await renderedAnew(page, () => page.evaluate(() => window.domelight.app.set({ strategy: "brdf:2" })));
  await measured();
  assert.equal((await read()).renders >= first.renders, true);
  const again = await open("size=32&spp=16&rows=64&env=studio&strategy=mis:1:1", { refers: true });
  await rendered(again.page);
  await again.page.waitForFunction(() => { const { reference } = window.domelight.picture; return reference.isReady && !reference.running; });
  await again.page.waitForTimeout(300);
  assert.equal(await text(again.page, "#picture figcaption"), caption);
  await again.done();
  await done();
});

test("a biased strategy is measured with its bias, which its variance does not show", async () => {
  // Four lights cannot stand for the many windows of a nave: the bias is fifty times the variance, which is that of the
  // camera's samples alone. Under the sky, sixteen lights have as much of the one as of the other.
  const { page, done } = await open("size=32&spp=16&rows=64&env=cathedral&strategy=median-cut:4", { refers: true });
  await rendered(page);
  await page.waitForSelector("figure[data-error=measured]");
  await page.waitForFunction(() => { const { reference } = window.domelight.picture; return reference.isReady && !reference.running; });
  const [measured, estimated] = await page.evaluate(() => {
    const { picture } = window.domelight;
    return [picture.measured()[0].at(-1).error, picture.jobs[0].statistics.relativeVariance];
  });
  assert.ok(measured > 20 * estimated, `measured ${measured}, estimated ${estimated}`);
  await done();
});

test("without a reference the error is called an estimate", async () => {
  const { page, done } = await open("size=32&spp=16&rows=64&strategy=mis:1:1&camera=null", { refers: true });
  await page.evaluate(() => { window.domelight.app.reference = () => Promise.reject(new Error("no memory")); });
  await renderedAnew(page, () => page.evaluate(() => window.domelight.app.set({ rotate: 10 })));
  await page.waitForFunction(() => /no memory/.test(document.querySelector("#picture figcaption").textContent));
  assert.match(await text(page, "#picture figcaption"), /^An estimate from the variance of the samples/);
  assert.match(await text(page, "#error-plot"), /mis:1:1, variance/);
  assert.ok(await page.$("#error-plot .dashed"));
  await done();
});

test("the plot of the error pairs each estimate with the rays that it is of", async () => {
  const { page, done } = await open("size=128&spp=64&rows=64&strategy=mis:1:1");
  await rendered(page);
  const [points, rays] = await page.evaluate(() => {
    const { histories, jobs } = window.domelight.picture;
    return [histories[0], jobs[0].statistics.shadowRays];
  });
  assert.ok(points.length >= 2, JSON.stringify(points));
  assert.equal(points.at(-1).rays, rays);
  points.forEach(({ error, samples }, i) => {
    assert.ok(error > 0 && samples >= 2, JSON.stringify(points));
    // No estimate stands at the rays of later ones.
    if (i) assert.notEqual(error, points[i - 1].error);
  });
  await done();
});

test("the error view measures the picture against a reference", async () => {
  const { page, done } = await open("size=32&spp=32&rows=64&env=studio&strategy=mis:1:1&beside=product:8&view=error", { refers: true });
  await rendered(page);
  await page.waitForFunction(() => /The reference has \d+ samples/.test(document.getElementById("error-legend").textContent));
  assert.ok(await page.isVisible("#error-bar"));
  await page.waitForFunction(() => window.domelight.picture.reference.renders >= 8 || !window.domelight.picture.reference.running);
  const sides = await page.evaluate(() => {
    const { picture } = window.domelight;
    return picture.measured().map((points, i) => [points.at(-1).error, picture.jobs[i].statistics.relativeVariance]);
  });
  for (const [measured, estimated] of sides) assert.ok(measured > 0.3 * estimated && measured < 3 * estimated, `measured ${measured}, estimated ${estimated}`);
  const errors = await canvasHash(page, "film");
  await page.selectOption("#view", "picture");
  assert.ok(await page.isHidden("#error-legend"));
  assert.notEqual(await canvasHash(page, "film"), errors);
  await done();
});

test("without WebGL2 the error view is the same", async () => {
  const seen = [];
  for (const query of ["", "?2d"]) {
    const { page, done } = await open("size=32&spp=1&rows=64&env=studio&strategy=brdf:1&view=error", { query, refers: true });
    await page.waitForFunction(() => { const { reference } = window.domelight.picture; return reference.isReady && !reference.running; });
    await page.evaluate(() => window.domelight.picture.reference.stop());
    await page.waitForTimeout(300);
    seen.push(await brightness(page, "film"));
    await done();
  }
  assert.ok(Math.abs(seen[0] - seen[1]) < 3, `${seen}`);
});
