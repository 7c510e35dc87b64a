// Steps 5, 8 to 11 and 13: inversion, combination, the product, rejection, resampling and bias, in one dimension.

import { percentage, short } from "../dom";
import { plot, type Series } from "../plot";
import type { Stage } from "../stage";
import { Importance } from "./importance";
import { Table, clamp, gauss, integral, line, normalized, top, type Point } from "./curves";
import { Combination, Envelope, FixedLights, Resampling, Shadowed } from "./densities";

/** The vertical line under the pointer. */
const marker = (x: number | undefined, height: number): Series =>
  ({ name: "", kind: "shade", points: x === undefined ? [] : [[x, 0], [x, height]] });

export const inversion = (stage: Stage) => {
  const n = stage.player("Samples", 1, 64, 16);
  const peak = stage.slider("Peak’s width", 0.01, 0.2, 0.01, 0.04);
  const center = stage.slider("Peak at", 0.3, 0.9, 0.01, 0.7);
  const pointed = stage.pointer(({ x }) => center.set(x));
  stage.draw(() => {
    const p = normalized((x) => 0.25 + gauss(x, center(), peak()) * 0.2 / peak() + 0.6 * gauss(x, 0.25, 0.1));
    const table = new Table(p), most = Math.max(...line(200, p).map((q) => q[1]));
    const samples = Array.from({ length: n() }, (_, i): Point => [table.sample((i + 0.5) / n()), (i + 0.5) / n()]);
    // Under the pointer: from u to the curve, and down to x.
    const u = pointed()?.y, x = u === undefined ? 0 : table.sample(u);
    stage.svg(plot([
      { name: `density, maximum ${short(most)}`, kind: "light", points: line(200, (t) => p(t) / most), as: "area" }, { name: "P(x)", kind: "lobe", points: line(200, (t) => table.at(t)) },
      { name: "", kind: "lobe", points: samples, as: "dots" }, { name: "", kind: "estimate", points: samples.map(([t]): Point => [t, 0]), as: "dots" },
      { name: "", kind: "shade", points: u === undefined ? [] : [[0, u], [x, u], [x, 0]] },
    ], { x: { name: "x, drag to move the peak", range: [0, 1] }, y: { name: "u", range: [0, 1] }, presented: 480 }), "A cumulative distribution, and samples drawn by inverting it");
    stage.read(u === undefined ? null : `u = ${u.toFixed(3)} is inverted to x = ${x.toFixed(3)}, where the density is ${short(p(x))}. ∫ p = ${integral(p).toFixed(2)}.`);
    const inside = samples.filter(([t]) => Math.abs(t - center()) < 2 * peak()).length;
    stage.say(`${inside} of ${n()} samples are in the peak.`);
  });
};

export const combination = (stage: Stage) => {
  const width = stage.slider("Lobe’s width", -3, -0.3, 0.1, -1.3, (x) => String(Number((10 ** x).toPrecision(2))));
  const split = stage.slider("Light samples", 1, 15, 1, 8, (x) => `${x} of 16`);
  const heuristic = stage.choice("Weights", [["1", "balance"], ["2", "power"]]);
  stage.play(width, 0.1);
  // Dragging puts the lobe's flank, one standard deviation from its center, under the pointer.
  const pointed = stage.pointer(({ x }) => width.set(Math.round(10 * Math.log10(Math.max(Math.abs(x - 0.5), 1e-3))) / 10));
  stage.draw(() => {
    const both = new Combination(10 ** width(), split(), 16 - split(), Number(heuristic()));
    const { light: q, lobe, weight: w, exact, variances } = both;
    const at = pointed()?.x, [mostLight, mostLobe] = [top(q), top(lobe)];
    stage.svg(plot([
      { name: "light", kind: "light", points: line(400, (x) => q(x) / mostLight) }, { name: "lobe", kind: "lobe", points: line(400, (x) => lobe(x) / mostLobe) },
      { name: "MIS weight of light samples", kind: "product", points: line(400, w), as: "area" }, marker(at, 1.05),
    ], { x: { name: "direction, drag the lobe’s flank", range: [0, 1] }, y: { name: "relative to the maximum", range: [0, 1.05] }, presented: 480 }), "Two densities and the MIS weight of one of them");
    stage.read(at === undefined ? null : `Direction ${at.toFixed(2)}: light’s density ${short(q(at))}, lobe’s ${short(lobe(at))}, weight of a light sample ${w(at).toFixed(2)}, of a lobe sample ${(1 - w(at)).toFixed(2)}. ∫ p = ${integral(q, 8000).toFixed(2)} each.`);
    const percent = (v: number) => `${short(100 * Math.sqrt(Math.max(v, 0)) / exact)} %`;
    const best = Object.entries(variances).reduce((a, b) => (b[1] < a[1] ? b : a))[0];
    stage.say(`Error of 16 samples: ${Object.entries(variances).map(([name, v]) => `${name} ${percent(v)}`).join(", ")}; least here: ${best}.`);
  });
};

export const product = (stage: Stage) => {
  const center = stage.slider("Mirror direction", 0.05, 0.95, 0.01, 0.5);
  const width = stage.slider("Lobe’s width", 0.02, 0.4, 0.01, 0.08);
  const hidden = stage.slider("Occluded from", 0, 1, 0.01, 0.6);
  stage.play(hidden, 0.02);
  const where = stage.choice("Show", [["line", "in one dimension"], ["sphere", "on the sphere, and in pictures"]]);
  const rays = stage.player("Rays", 0, 4, 3, (k) => String(2 ** k));
  const sun = stage.slider("Sun", 0.05, 0.95, 0.01, 0.35);
  let onSphere: Importance | null = null;
  // Dragging moves the sun or the shadow's edge where it began there, and the lobe elsewhere.
  let dragged = center, begun: object | null = null;
  const pointed = stage.pointer((at) => {
    const { x, from } = at;
    if (where() === "sphere") return onSphere?.drag(at);
    if (begun !== from) [begun, dragged] = [from, [hidden, sun].find((slider) => Math.abs(from.x - slider()) < 0.04) ?? center];
    dragged.set(x);
  });
  stage.draw(async () => {
    const isSphere = () => where() === "sphere", n = 2 ** rays();
    for (const slider of [center, width, hidden, sun]) stage.show(slider, !isSphere());
    stage.show(rays, isSphere());
    if (isSphere()) return (onSphere ??= new Importance(stage)).draw(n, pointed(), () => isSphere() && n === 2 ** rays());
    const shadowed = new Shadowed(center(), width(), hidden(), sun());
    const { light, lobe, visible, densities: { light: q, lobe: r, product: p } } = shadowed;
    const deviations = (["light", "lobe", "product"] as const).map((name): [string, number] => [name, shadowed.deviation(name)]);
    const at = pointed()?.x, [mostLight, mostProduct] = [top(light), top(p)];
    stage.svg(plot([
      { name: "light", kind: "light", points: line(400, (x) => light(x) / mostLight) }, { name: "lobe", kind: "lobe", points: line(400, lobe) },
      { name: "product", kind: "product", points: line(400, (x) => p(x) / mostProduct), as: "area" },
      { name: "occluded", kind: "visibility", points: [[hidden(), 0], [1, 0]], as: "band" }, marker(at, 1.05),
    ], { x: { name: "direction, drag the sun, the lobe or the shadow’s edge", range: [0, 1] }, y: { name: "relative to the maximum", range: [0, 1.05] }, presented: 480 }), "Light, lobe and their product");
    stage.read(at === undefined ? null : `Direction ${at.toFixed(2)}: L = ${short(light(at))}, f · cos θ = ${short(lobe(at))}, V = ${Number(shadowed.isVisible(at))}; densities: light ${short(q(at))}, lobe ${short(r(at))}, product ${short(p(at))}. ∫ p = ${integral(p, 4000).toFixed(2)}.`);
    const least = Math.min(...deviations.map(([, d]) => d)), best = deviations.filter(([, d]) => d <= least + 1e-6).map(([name]) => name);
    stage.say(`${short(100 * visible)} % of the product is unoccluded. Standard deviation of one sample, relative to the unoccluded radiance: ${deviations.map(([name, d]) => `${name} ${short(d)}`).join(", ")}; least here: ${best.length === 3 ? "all alike" : best.join(" and ")}.`);
  });
};

/** The numbers of tries: one by one up to 32, then ever faster. */
const TRIES = Array.from({ length: 70 }, (_, i) => (i < 32 ? i + 1 : Math.min(800, Math.round(32 * 2 ** ((i - 31) / 8)))));

export const rejection = (stage: Stage) => {
  const bound = stage.slider("Envelope", 0.3, 3, 0.05, 1, (x) => `${x.toFixed(2)} × tightest`);
  const fallen = stage.player("Tries", 0, TRIES.length - 1, TRIES.length - 1, (i) => String(TRIES[i]));
  let envelope = new Envelope(bound());
  const pointed = stage.pointer(({ x, y }) => bound.set(clamp(y / (envelope.tightest * envelope.proposal(x)), 0.3, 3)));
  stage.draw(() => {
    envelope = new Envelope(bound());
    const { c, target } = envelope, height = (x: number) => envelope.height(x), tries = TRIES[fallen()];
    const { kept, rejected } = envelope.tries(tries, 5);
    const at = pointed()?.x, top = Math.max(height(0.35), 10);
    stage.svg(plot([
      { name: "rejected", kind: "light", points: rejected, as: "dots" }, { name: "kept", kind: "estimate", points: kept, as: "dots" },
      { name: "envelope c · q", kind: "light", points: line(400, height) }, { name: "target", kind: "product", points: line(400, target) }, marker(at, top),
    ], { x: { name: "direction, drag the envelope up and down", range: [0, 1] }, y: { name: "density", range: [0, top] }, height: 280, presented: 480 }), "Tries under an envelope");
    stage.read(at === undefined ? null : `Direction ${at.toFixed(2)}: target ${short(target(at))}, envelope ${short(height(at))}; a try is kept with probability ${Math.min(target(at) / height(at), 1).toFixed(2)}.`);
    stage.say(`${kept.length} of ${tries} tries are kept (1/c = ${short(1 / c)})${envelope.lost > 1e-3 ? `; ${short(100 * envelope.lost)} % of the target exceeds the envelope and is lost` : ""}.`);
  });
};

export const resampling = (stage: Stage) => {
  const m = stage.player("Candidates M", 0, 10, 2, (x) => String(2 ** x));
  const center = stage.slider("Lobe at", 0.1, 0.9, 0.01, 0.5);
  const pointed = stage.pointer(({ x }) => center.set(x));
  let known: { key: string; resampling: Resampling } | null = null;
  stage.draw(() => {
    const key = `${m()} ${center()}`;
    if (known?.key !== key) known = { key, resampling: new Resampling(center(), 2 ** m(), 7) };
    const { resampling } = known, { bars, target, proposal: q } = resampling, at = pointed()?.x;
    const height = Math.max(10, Math.ceil(top(target)));
    stage.svg(plot([
      { name: "picked", kind: "estimate", points: bars, as: "bars" }, { name: "candidates", kind: "light", points: line(400, q) }, { name: "target", kind: "product", points: line(400, target) }, marker(at, height),
    ], { x: { name: "direction, drag the lobe", range: [0, 1] }, y: { name: "density", range: [0, height] }, height: 260, presented: 480 }), "A histogram of the resampled directions");
    stage.read(at === undefined ? null : `Direction ${at.toFixed(2)}: candidates’ density ${short(q(at))}, target ${short(target(at))}, picked ${short(resampling.pickedAt(at))}; a candidate here has weight ${short(resampling.weight(at))}.`);
    stage.say(`The histogram of ${resampling.picks.toLocaleString("en-US")} picks differs from the target by ${percentage(resampling.distance)} (half the sum of absolute differences); counting noise accounts for ${percentage(resampling.noise)}.`);
  });
};

/** The lower end of the error axis. */
const LEAST_ERROR = 1e-5;

/** The numbers of samples or lights of the error plot, up to a prime: no shadow’s edge lies between two of so many lights. */
const COUNTS = Array.from({ length: 41 }, (_, k) => Math.round(2 * (997 / 2) ** (k / 40))).filter((c, k, all) => c !== all[k - 1]);

export const biasAndVariance = (stage: Stage) => {
  const edge = stage.slider("Shadow edge", 0.1, 0.9, 0.005, 0.4);
  const number = stage.player("Lights shown", 1, 32, 8);
  const pointed = stage.pointer(({ frame, x }) => { if (frame === 0) edge.set(clamp(x, 0.1, 0.9)); });
  let known = { edge: NaN, noisy: [] as Point[] };
  stage.draw(() => {
    const row = new FixedLights(edge());
    // An error of 0, by luck, is drawn at the lower end of the axis.
    const errorOf = (n: number) => Math.max(Math.abs(row.share(n) - edge()), LEAST_ERROR);
    const fixed = COUNTS.map((n): Point => [n, errorOf(n)]);
    if (known.edge !== edge()) known = { edge: edge(), noisy: row.noise(COUNTS, 200, 9) };
    const { noisy } = known, n = number(), lights = row.places(n).map((x): Point => [x, row.visibility(x)]);
    const over = pointed();
    const shadow = plot([
      { name: "visibility V", kind: "visibility", points: [[0, 1], [edge(), 1], [edge(), 0], [1, 0]] },
      { name: `${n} fixed lights`, kind: "light", points: lights, as: "dots" }, marker(over?.frame === 0 ? over.x : undefined, 1.1),
    ], { x: { name: "light, drag the shadow’s edge", range: [0, 1] }, y: { name: "V", range: [0, 1.1], ticks: [0, 1] }, height: 130, presented: 150 });
    const error = plot([{ name: "random samples", kind: "estimate", points: noisy }, { name: "fixed lights", kind: "light", points: fixed }, { name: "", kind: "light", as: "dots", points: n > 1 ? [[n, errorOf(n)]] : [] }],
      { x: { name: "number of samples or lights N", log: true, range: [2, 1000], ticks: [2, 10, 100, 1000] }, y: { name: "absolute error", log: true, range: [LEAST_ERROR, 1] }, presented: 320 });
    stage.svg(shadow + error, "The lights that a shadow’s edge leaves visible, and the error of random samples and fixed lights");
    const k = over?.frame === 1 ? COUNTS.findLastIndex((c) => c <= over.x * 1.01) : -1;
    stage.read(k >= 0 ? `N = ${COUNTS[k]}: random samples ${short(noisy[k][1])}, fixed lights ${short(fixed[k][1])}.` : over?.frame === 0 ? `At ${over.x.toFixed(2)}, V = ${row.visibility(over.x)}; the visible share is ${edge().toFixed(3)}.` : null);
    stage.say(`${n} fixed light${n > 1 ? "s say" : " says"} ${row.share(n).toFixed(3)} for ${edge().toFixed(3)}. At N = ${COUNTS.at(-1)} the noise is ${short(noisy.at(-1)![1])} and the bias ${short(fixed.at(-1)![1])}; at N = ${COUNTS[8]} they are ${short(noisy[8][1])} and ${short(fixed[8][1])}.`);
  });
};
