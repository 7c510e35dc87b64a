// The numbers of the lecture's one-dimensional figures against simulations and quadrature: both find the same.

import assert from "node:assert/strict";
import { test } from "node:test";
import { build } from "esbuild";

/** A part of the page, as a module. */
async function part(name) {
  const { outputFiles } = await build({ entryPoints: [new URL(`../src/figures/${name}.ts`, import.meta.url).pathname], bundle: true, write: false, format: "esm", logLevel: "error" });
  return import(`data:text/javascript;base64,${Buffer.from(outputFiles[0].text).toString("base64")}`);
}

const { Table, generator, integral } = await part("curves");
const { Combination, Envelope, FixedLights, Resampling, Shadowed } = await part("densities");

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

test("the combination of two densities has the error that is stated", () => {
  for (const [width, m, n, beta] of [[0.05, 8, 8, 1], [0.05, 8, 8, 2], [0.005, 1, 15, 1], [0.3, 12, 4, 2]]) {
    const both = new Combination(width, m, n, beta), name = `width ${width}, ${m} + ${n} samples, power ${beta}`;
    const random = generator(3), [light, lobe] = [both.light, both.lobe].map((p) => [new Table(p, 4000), p]);
    const mean = (k, [table, p], weight) => Array.from({ length: k }, () => table.sample(random())).reduce((sum, x) => sum + weight(x) * both.f(x) / p(x), 0) / k;
    const one = () => 1, estimates = {
      "light alone": () => mean(16, light, one), "lobe alone": () => mean(16, lobe, one),
      both: () => mean(m, light, both.weight) + mean(n, lobe, (x) => 1 - both.weight(x)),
    };
    for (const [which, estimate] of Object.entries(estimates)) {
      const found = moments(20000, estimate);
      requireNear(both.exact, found.mean, found.ofMean, `${name}, ${which}, the mean`);
      requireNear(both.variances[which], found.variance, found.ofVariance, `${name}, ${which}`);
    }
  }
});

test("densities in shadow have the deviations that are stated", () => {
  for (const [center, width, edge, sun] of [[0.5, 0.08, 0.6, 0.35], [0.3, 0.2, 0.34, 0.35], [0.7, 0.03, 0.69, 0.2]]) {
    const shadowed = new Shadowed(center, width, edge, sun), { total, visible } = shadowed;
    for (const [which, density] of Object.entries(shadowed.densities)) {
      const table = new Table(density, 4000), random = generator(5), name = `lobe at ${center}, ${which}`;
      const found = moments(20000, () => shadowed.value(table.sample(random()), density) / total);
      requireNear(visible, found.mean, found.ofMean, `${name}, the mean`);
      requireNear(shadowed.deviation(which) ** 2, found.variance, found.ofVariance, name);
    }
  }
});

test("an envelope keeps the share of tries that is stated, in proportion to the target", () => {
  for (const bound of [0.4, 1, 2.5]) {
    const envelope = new Envelope(bound), n = 40000, { kept } = envelope.tries(n, 11), { acceptance } = envelope;
    requireNear(acceptance, kept.length / n, Math.sqrt(acceptance * (1 - acceptance) / n), `envelope × ${bound}`);
    const capped = (x) => Math.min(envelope.target(x), envelope.height(x)), whole = integral(capped);
    const below = integral((x) => (x < 0.45 ? capped(x) : 0)) / whole;
    requireNear(below, kept.filter(([x]) => x < 0.45).length / kept.length, Math.sqrt(below * (1 - below) / kept.length), `envelope × ${bound}, left`);
    if (bound >= 1) assert.ok(envelope.lost < 1e-9);
  }
});

test("resampled directions have the density that quadrature finds, and approach the target", () => {
  const [center, n] = [0.5, 1000], at = (i) => (i + 0.5) / n;
  const one = new Resampling(center, 1, 7), q = Array.from({ length: n }, (_, i) => one.proposal(at(i))), w = q.map((_, i) => one.weight(at(i)));
  // Of two candidates, x is kept beside y with probability w(x) / (w(x) + w(y)).
  const exact = { 1: q, 2: q.map((p, i) => 2 * p * q.reduce((sum, r, j) => sum + r * w[i] / (w[i] + w[j]), 0) / n) };
  for (const [m, density] of Object.entries(exact)) {
    const { bars, picks } = new Resampling(center, Number(m), 7), each = n / Resampling.BINS;
    bars.forEach(([, bar], i) => {
      const share = density.slice(i * each, (i + 1) * each).reduce((a, b) => a + b, 0) / n;
      requireNear(share, bar / Resampling.BINS, Math.sqrt(share * (1 - share) / picks) + 1 / picks, `M = ${m}, bin ${i}`);
    });
  }
  const distances = [0, 2, 4, 6].map((k) => new Resampling(center, 2 ** k, 7).distance);
  assert.ok(distances.every((d, k) => k === 0 || d < distances[k - 1]), `${distances}`);
  // With many candidates, only the noise of the counts is left: half the sum of absolute values of normal variables.
  const many = new Resampling(center, 1024, 7);
  const variances = many.bars.map(([x]) => { const p = many.target(x) / Resampling.BINS; return p * (1 - p) / many.picks; });
  const spread = 0.5 * Math.sqrt((1 - 2 / Math.PI) * variances.reduce((a, b) => a + b, 0));
  requireNear(many.noise, many.distance, spread, "M = 1024");
});

test("random samples in a row of lights have the binomial error, and fixed lights at most half a light", () => {
  const edge = 0.4, row = new FixedLights(edge), runs = 200;
  for (const [n, error] of row.noise([2, 16, 128], runs, 9)) {
    const variance = edge * (1 - edge) / n, fourth = 3 * variance ** 2 + variance * (1 - 6 * edge * (1 - edge)) / n ** 2;
    requireNear(variance, error ** 2, Math.sqrt((fourth - variance ** 2) / runs), `${n} samples`);
  }
  for (const n of [1, 3, 10, 64]) assert.ok(Math.abs(row.share(n) - edge) <= 0.5 / n + 1e-12);
});

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
