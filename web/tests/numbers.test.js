// The numbers of the lecture's last figures against simulations: what is computed by quadrature is what sampling finds.

import assert from "node:assert/strict";
import { test } from "node:test";
import { build } from "esbuild";

/** A part of the page, as a module. */
async function part(name) {
  const { outputFiles } = await build({ entryPoints: [new URL(`../src/figures/${name}.ts`, import.meta.url).pathname], bundle: true, write: false, format: "esm", logLevel: "error" });
  return import(`data:text/javascript;base64,${Buffer.from(outputFiles[0].text).toString("base64")}`);
}

const { generator } = await part("curves");

/** The mean and the variance of repeats, and their standard errors. */
function moments(n, draw) {
  const values = Array.from({ length: n }, (_, i) => draw(i));
  const mean = values.reduce((a, b) => a + b, 0) / n, variance = values.reduce((sum, x) => sum + (x - mean) ** 2, 0) / (n - 1);
  const fourth = values.reduce((sum, x) => sum + (x - mean) ** 4, 0) / n;
  return { mean, variance, ofMean: Math.sqrt(variance / n), ofVariance: Math.sqrt(Math.max(fourth - variance ** 2, 0) / n) };
}

/** Fails where a value is farther than four standard errors from what is found. */
function requireNear(value, found, error, what) {
  assert.ok(Math.abs(value - found) < 4 * error + 1e-9, `${what}: ${value}, but sampling finds ${found} ± ${error}`);
}

test("the error of stratified samples is what samples have", async () => {
  const { HalfPlane, Smooth, deviations } = await part("strata");
  const smooth = new Smooth();
  for (const [name, f, at] of [[0, 0.55], [35, 0.55], [80, 0.3], [90, 0.7]].map(([tilt, edge]) => {
    const plane = new HalfPlane(edge, tilt);
    return [`edge at ${edge}, tilted ${tilt}°`, plane, (x, y) => Number(plane.has(x, y))];
  }).concat([["smooth", smooth, (x, y) => smooth.at(x, y)]])) {
    const exact = f.moments(0, 0, 1)[0];
    for (const k of [1, 3, 8]) {
      const random = generator(k), { stratified, random: independent } = deviations(f, k);
      const mean = (x, y) => Array.from({ length: k * k }, (_, i) => at(x(i), y(i))).reduce((a, b) => a + b, 0) / (k * k);
      const found = moments(3000, () => mean((i) => (i % k + random()) / k, (i) => (Math.floor(i / k) + random()) / k));
      requireNear(exact, found.mean, found.ofMean, `${name}, ${k} strata per side, the mean`);
      requireNear(stratified ** 2, found.variance, found.ofVariance, `${name}, ${k} strata per side`);
      const plain = moments(3000, () => mean(() => random(), () => random()));
      requireNear(independent ** 2, plain.variance, plain.ofVariance, `${name}, ${k * k} random samples`);
    }
  }
  // An edge along an axis crosses one column of strata: 8 of 64, each with a share of 0.4.
  const { stratified } = deviations(new HalfPlane(0.55, 0), 8);
  assert.ok(Math.abs(stratified - Math.sqrt(8 * 0.4 * 0.6) / 64) < 1e-4, `${stratified}`);
});

test("the estimate with learned visibility is unbiased, and has the variance that is stated", async () => {
  const { Pixel } = await part("learned");
  for (const [edge, penumbra] of [[0.45, 0.08], [0.3, 0.3], [0.7, 0.02]]) {
    for (const learns of [true, false]) {
      for (const rays of [1, 3, 6]) {
        const pixel = new Pixel(edge, penumbra, learns), name = `edge ${edge}, penumbra ${penumbra}, ${rays} rays, ${learns ? "learned" : "not learned"}`;
        let traced = 0;
        const n = 4000, found = moments(n, (i) => {
          const { value, candidates } = pixel.estimate(rays, 1000 * i + 7);
          traced += candidates.filter(({ isTraced }) => isTraced).length;
          return value;
        });
        requireNear(pixel.shadowed, found.mean, found.ofMean, `${name}, the mean`);
        requireNear(pixel.variance(rays), found.variance, found.ofVariance, name);
        requireNear(pixel.expected(rays), traced / n, Math.sqrt(rays / n), `${name}, rays`);
        assert.ok(pixel.expected(rays) <= rays + 1e-6);
      }
    }
  }
});

test("what finds the window is what rays find, by every strategy", async () => {
  const { Plan, WAYS } = await part("plan");
  for (const [x, low, high, sun] of [[2.5, 1, 2, 0.5], [1, 0.5, 1.2, -0.9], [4, 1.5, 2.9, -1.2]]) {
    const plan = new Plan(x, low, high, sun);
    for (const way of Object.keys(WAYS)) {
      const name = `${way} at ${x} m`, density = plan.integral((t) => plan.density(way, t));
      if (way === "light") assert.ok(density < 1, "the ground's light is lost");
      else if (way === "both") assert.ok(density < 1);
      else assert.ok(Math.abs(density - 1) < 1e-4, `${name}: ∫ p = ${density}`);
      const random = generator(17), sample = plan.sampler(way), n = 20000;
      let hits = 0;
      const found = moments(n, () => {
        const t = sample(random());
        if (t === null || !plan.visible(t)) return 0;
        hits++;
        return plan.light(t) * plan.lobe(t) / plan.density(way, t) / plan.seen;
      });
      const share = plan.share(way);
      requireNear(1, found.mean, found.ofMean, `${name}, the mean`);
      requireNear(share, hits / n, Math.sqrt(share * (1 - share) / n), `${name}, the share of rays`);
      requireNear(plan.deviation(way) ** 2, found.variance, found.ofVariance, name);
    }
  }
});
