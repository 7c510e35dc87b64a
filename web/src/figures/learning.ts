// Step 17: the default strategy, step by step, on one pixel.

import { percentage, short } from "../dom";
import { figureWidth, plot, type Series } from "../plot";
import type { Stage } from "../stage";
import { clamp, line, top, type Point } from "./curves";
import { Pixel, STRATA, unoccluded } from "./learned";

/** What each step of the strategy adds. */
const STAGES = ["the product", "candidates", "control variate h", "learned V̂", "known part V̂ h", "rays"];

export const learning = (stage: Stage) => {
  const shown = stage.player("Shown up to", 0, STAGES.length - 1, STAGES.length - 1, (k) => STAGES[k]);
  const rays = stage.slider("Rays", 1, 8, 0.5, 3);
  const edge = stage.slider("Shadow’s edge", 0.1, 0.9, 0.005, 0.45);
  const penumbra = stage.slider("Penumbra", 0.01, 0.4, 0.01, 0.15);
  const pointed = stage.pointer(({ x }) => edge.set(clamp(x, 0.1, 0.9)));
  stage.draw(() => {
    const pixel = new Pixel(edge(), penumbra()), blind = new Pixel(edge(), penumbra(), false), upTo = shown(), most = top(unoccluded);
    const { value, candidates } = pixel.estimate(rays(), 4), at = pointed()?.x;
    const steps = (of: (k: number) => number): Point[] => pixel.strata.flatMap((_, k) => [[k / STRATA, of(k)], [(k + 1) / STRATA, of(k)]] as Point[]);
    const pieces = (f: (x: number) => number): Point[] => pixel.strata.flatMap((_, k) => [[k / STRATA + 1e-9, f(k / STRATA + 1e-9)], [(k + 1) / STRATA - 1e-9, f((k + 1) / STRATA - 1e-9)]] as Point[]);
    const traced = candidates.filter(({ isTraced }) => isTraced);
    const series: [number, Series][] = [
      [0, { name: "product", kind: "product", points: line(400, (x) => unoccluded(x) / most) }],
      [1, { name: figureWidth() < 480 ? "W" : "candidates", kind: "light", as: "dots", points: candidates.map(({ x }): Point => [x, unoccluded(x) / most]) }],
      [2, { name: "h", kind: "lobe", points: pieces((x) => pixel.control(x) / most) }],
      [3, { name: "V̂", kind: "visibility", points: steps((k) => pixel.strata[k].visibility) }],
      [3, { name: "", kind: "visibility", as: "area", points: steps((k) => pixel.strata[k].deviation) }],
      [4, { name: "V̂ h", kind: "product", as: "area", points: pieces((x) => pixel.of(x).visibility * pixel.control(x) / most) }],
      [5, { name: "rays", kind: "estimate", as: "dots", points: traced.map(({ x, isSeen }): Point => [x, isSeen ? 1.02 : -0.03]) }],
      [5, { name: "", kind: "shade", points: at === undefined ? [] : [[at, 0], [at, 1.08]] }],
    ];
    const main = plot(series.filter(([from]) => from <= upTo).map(([, s]) => s), { x: { name: "direction, drag the shadow’s edge", range: [0, 1] }, y: { name: "relative to the maximum", range: [-0.06, 1.08], ticks: [0, 0.5, 1] }, height: 260, presented: 330 });
    const chance = plot([{ name: "probability of a ray", kind: "estimate", as: "area", points: steps((k) => (upTo < 5 ? 0 : pixel.probability(pixel.strata[k].center, rays()))) }, { name: "", kind: "shade", points: at === undefined ? [] : [[at, 0], [at, 1]] }],
      { x: { name: "direction", range: [0, 1] }, y: { name: "π", range: [0, 1], ticks: [0, 1] }, height: 120, presented: 150 });
    stage.svg(main + chance, "The product of light and reflectance in strata, what is known of its visibility, and where rays go");
    const total = pixel.total, exact = pixel.shadowed, m = pixel.expected(rays()), relative = (variance: number) => percentage(Math.sqrt(variance) / exact);
    const blindRays = m, without = blind.variance(blindRays), alone = (total * exact - exact * exact) / m;
    const known = pixel.strata.reduce((sum, { light, visibility }) => sum + light * visibility, 0);
    stage.read(at === undefined ? null : (({ visibility, deviation }) => `Direction ${at.toFixed(2)}: f · cos θ · L = ${short(unoccluded(at))}, h = ${short(pixel.control(at))}, V̂ = ${visibility.toFixed(2)} ± ${deviation.toFixed(2)}; a candidate here is traced with probability ${pixel.probability(at, rays()).toFixed(2)}.`)(pixel.of(at)));
    stage.say(`${m.toFixed(1)} of ${STRATA} candidates are expected to be traced, here ${traced.length}: the estimate is ${short(value)} for ${short(exact)}; V̂ alone predicts ${short(known)}. Standard deviation: ${relative(pixel.variance(rays()))} with learned visibility, ${relative(without)} without it, ${relative(alone)} with as many independent samples of the product.`);
    const share = pixel.strata.filter(({ deviation }) => deviation > 0.05).length;
    stage.answer(`${share === 1 ? `To the one stratum of ${STRATA}` : `To the ${share} of ${STRATA} strata`} in which V̂ is uncertain, and there to the brightest candidates; elsewhere visibility is known, and a ray would find what is known already. A narrower penumbra leaves fewer uncertain strata: the same rays then have less error (now ${relative(pixel.variance(rays()))}). Outside it, only the difference of the product to h is left to chance.`);
  });
};
