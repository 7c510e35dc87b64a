// Steps 5, 8 to 11 and 13: inversion, combination, the product, rejection, resampling and bias, in one dimension.

import { percentage, short } from "../dom";
import { plot, type Series } from "../plot";
import type { Stage } from "../stage";
import { Importance } from "./importance";
import { Table, clamp, gauss, generator, integral, light, lightAt, line, normalized, top, type Point } from "./curves";

/** The vertical line under the pointer. */
const marker = (x: number | undefined, height: number): Series =>
  ({ name: "", kind: "shade", points: x === undefined ? [] : [[x, 0], [x, height]] });

export const inversion = (stage: Stage) => {
  const n = stage.player("Samples", 1, 64, 16);
  const peak = stage.slider("Peak", 0.01, 0.2, 0.01, 0.04, (x) => `width ${x}`);
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
  const width = stage.slider("Lobe", -3, -0.3, 0.1, -1.3, (x) => `width ${Number((10 ** x).toPrecision(2))}`);
  const split = stage.slider("Light samples of 16", 1, 15, 1, 8);
  const heuristic = stage.choice("Weights", [["1", "balance"], ["2", "power"]]);
  stage.play(width, 0.1);
  // Dragging puts the lobe's flank, one standard deviation from its center, under the pointer.
  const pointed = stage.pointer(({ x }) => width.set(Math.round(10 * Math.log10(Math.max(Math.abs(x - 0.5), 1e-3))) / 10));
  stage.draw(() => {
    const lobe = normalized((x) => gauss(x, 0.5, 10 ** width()));
    const q = normalized(light), f = (x: number) => light(x) * lobe(x);
    const [m, n] = [split(), 16 - split()], beta = Number(heuristic());
    const w = (x: number) => (m * q(x)) ** beta / ((m * q(x)) ** beta + (n * lobe(x)) ** beta);
    const variance = (p: (x: number) => number, weight: (x: number) => number) => {
      const part = (x: number) => weight(x) * f(x);
      return integral((x) => (part(x) > 0 ? part(x) ** 2 / p(x) : 0), 8000) - integral(part, 8000) ** 2;
    };
    const exact = integral(f, 8000);
    const errors = { "light alone": variance(q, () => 1) / 16, "lobe alone": variance(lobe, () => 1) / 16, both: variance(q, w) / m + variance(lobe, (x) => 1 - w(x)) / n };
    const at = pointed()?.x, [mostLight, mostLobe] = [top(q), top(lobe)];
    stage.svg(plot([
      { name: "light", kind: "light", points: line(400, (x) => q(x) / mostLight) }, { name: "lobe", kind: "lobe", points: line(400, (x) => lobe(x) / mostLobe) },
      { name: "MIS weight of light samples", kind: "product", points: line(400, w), as: "area" }, marker(at, 1.05),
    ], { x: { name: "direction, drag the lobe’s flank", range: [0, 1] }, y: { name: "relative to the maximum", range: [0, 1.05] }, presented: 480 }), "Two densities and the MIS weight of one of them");
    stage.read(at === undefined ? null : `Direction ${at.toFixed(2)}: light’s density ${short(q(at))}, lobe’s ${short(lobe(at))}, weight of a light sample ${w(at).toFixed(2)}, of a lobe sample ${(1 - w(at)).toFixed(2)}. ∫ p = ${integral(q, 8000).toFixed(2)} each.`);
    const percent = (v: number) => `${short(100 * Math.sqrt(Math.max(v, 0)) / exact)} %`;
    const best = Object.entries(errors).reduce((a, b) => (b[1] < a[1] ? b : a))[0];
    stage.say(`Error of 16 samples: ${Object.entries(errors).map(([name, v]) => `${name} ${percent(v)}`).join(", ")}; least here: ${best}.`);
  });
};

export const product = (stage: Stage) => {
  const center = stage.slider("Mirror direction", 0.05, 0.95, 0.01, 0.5);
  const width = stage.slider("Lobe", 0.02, 0.4, 0.01, 0.08, (x) => `width ${x}`);
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
    const lobe = (x: number) => gauss(x, center(), width()), light = lightAt(sun());
    const f = (x: number) => light(x) * lobe(x), total = integral(f, 4000), p = (x: number) => f(x) / total;
    const visible = Math.min(integral((x) => (x < hidden() ? p(x) : 0), 4000), 1), exact = visible * total;
    const q = normalized(light), r = normalized(lobe);
    const deviation = (d: (x: number) => number) => {
      const second = integral((x) => (x < hidden() && d(x) > 0 ? f(x) ** 2 / d(x) : 0), 4000);
      return Math.sqrt(Math.max(second - exact ** 2, 0)) / total;
    };
    const deviations: [string, number][] = [["light", deviation(q)], ["lobe", deviation(r)], ["product", Math.sqrt(visible * (visible < 1 - 1e-9 ? 1 - visible : 0))]];
    const at = pointed()?.x, [mostLight, mostProduct] = [top(light), top(p)];
    stage.svg(plot([
      { name: "light", kind: "light", points: line(400, (x) => light(x) / mostLight) }, { name: "lobe", kind: "lobe", points: line(400, lobe) },
      { name: "product", kind: "product", points: line(400, (x) => p(x) / mostProduct), as: "area" },
      { name: "occluded", kind: "visibility", points: [[hidden(), 0], [1, 0]], as: "band" }, marker(at, 1.05),
    ], { x: { name: "direction, drag the sun, the lobe or the shadow’s edge", range: [0, 1] }, y: { name: "relative to the maximum", range: [0, 1.05] }, presented: 480 }), "Light, lobe and their product");
    stage.read(at === undefined ? null : `Direction ${at.toFixed(2)}: L = ${short(light(at))}, f · cos θ = ${short(lobe(at))}, V = ${at < hidden() ? 1 : 0}; densities: light ${short(q(at))}, lobe ${short(r(at))}, product ${short(p(at))}. ∫ p = ${integral(p, 4000).toFixed(2)}.`);
    const least = Math.min(...deviations.map(([, d]) => d)), best = deviations.filter(([, d]) => d <= least + 1e-6).map(([name]) => name);
    stage.say(`${short(100 * visible)} % of the product is unoccluded. Standard deviation of one sample, relative to the unoccluded radiance: ${deviations.map(([name, d]) => `${name} ${short(d)}`).join(", ")}; least here: ${best.length === 3 ? "all alike" : best.join(" and ")}.`);
  });
};

/** The product of the light and a lobe about a center, as a density. */
const targetAt = (center: number) => normalized((x) => light(x) * gauss(x, center, 0.12));

/** The numbers of tries: one by one up to 32, then ever faster. */
const TRIES = Array.from({ length: 70 }, (_, i) => (i < 32 ? i + 1 : Math.min(800, Math.round(32 * 2 ** ((i - 31) / 8)))));

export const rejection = (stage: Stage) => {
  const bound = stage.slider("Envelope", 0.3, 3, 0.05, 1, (x) => `${x.toFixed(2)} × the tightest`);
  const fallen = stage.player("Tries", 0, TRIES.length - 1, TRIES.length - 1, (i) => String(TRIES[i]));
  const target = targetAt(0.5), q = normalized(light), needed = Math.max(...line(2000, (x) => target(x) / q(x)).map((p) => p[1]));
  const pointed = stage.pointer(({ x, y }) => bound.set(clamp(y / (needed * q(x)), 0.3, 3)));
  stage.draw(() => {
    const c = bound() * needed, table = new Table(q), random = generator(5), tries = TRIES[fallen()];
    const kept: Point[] = [], lost: Point[] = [];
    for (let k = 0; k < tries; k++) {
      const x = table.sample(random()), y = random() * c * q(x);
      (y < target(x) ? kept : lost).push([x, y]);
    }
    const at = pointed()?.x, height = Math.max(c * q(0.35), 10);
    stage.svg(plot([
      { name: "rejected", kind: "light", points: lost, as: "dots" }, { name: "kept", kind: "estimate", points: kept, as: "dots" },
      { name: "envelope c · q", kind: "light", points: line(400, (x) => c * q(x)) }, { name: "target", kind: "product", points: line(400, target) }, marker(at, height),
    ], { x: { name: "direction, drag the envelope up and down", range: [0, 1] }, y: { name: "density", range: [0, height] }, height: 280, presented: 480 }), "Tries under an envelope");
    stage.read(at === undefined ? null : `Direction ${at.toFixed(2)}: target ${short(target(at))}, envelope ${short(c * q(at))}; a try is kept with probability ${Math.min(target(at) / (c * q(at)), 1).toFixed(2)}.`);
    const bias = integral((x) => Math.max(target(x) - c * q(x), 0));
    stage.say(`${kept.length} of ${tries} tries are kept (1 / c = ${short(1 / c)})${bias > 1e-3 ? `; ${short(100 * bias)} % of the target exceeds the envelope and is lost` : ""}.`);
  });
};

export const resampling = (stage: Stage) => {
  const m = stage.player("Candidates M", 0, 10, 2, (x) => String(2 ** x));
  const center = stage.slider("Lobe at", 0.1, 0.9, 0.01, 0.5);
  const pointed = stage.pointer(({ x }) => center.set(x));
  let known = { key: "", bars: [] as Point[], picks: 0 };
  stage.draw(() => {
    const q = normalized(light), bins = 50, target = targetAt(center()), key = `${m()} ${center()}`;
    if (known.key !== key) {
      const table = new Table(light), random = generator(7);
      const picks = Math.min(20000, Math.floor(2e6 / 2 ** m())), histogram = new Array<number>(bins).fill(0);
      for (let k = 0; k < picks; k++) {
        let chosen = 0, sum = 0;
        for (let j = 0; j < 2 ** m(); j++) {
          const x = table.sample(random()), w = target(x) / q(x);
          sum += w;
          if (random() * sum < w) chosen = x;
        }
        histogram[Math.min(Math.floor(chosen * bins), bins - 1)]++;
      }
      known = { key, picks, bars: histogram.map((count, i): Point => [(i + 0.5) / bins, count * bins / picks]) };
    }
    const { bars, picks } = known, at = pointed()?.x;
    const inBin = (x: number) => integral((u) => target(x + (u - 0.5) / bins), 20);
    const distance = 0.5 * bars.reduce((sum, [x, y]) => sum + Math.abs(y - inBin(x)) / bins, 0);
    const height = Math.max(10, Math.ceil(top(target)));
    stage.svg(plot([
      { name: "picked", kind: "estimate", points: bars, as: "bars" }, { name: "candidates", kind: "light", points: line(400, q) }, { name: "target", kind: "product", points: line(400, target) }, marker(at, height),
    ], { x: { name: "direction, drag the lobe", range: [0, 1] }, y: { name: "density", range: [0, height] }, height: 260, presented: 480 }), "A histogram of the resampled directions");
    stage.read(at === undefined ? null : `Direction ${at.toFixed(2)}: candidates’ density ${short(q(at))}, target ${short(target(at))}, picked ${short(bars[Math.min(Math.floor(at * bins), bins - 1)][1])}; a candidate here has weight ${short(target(at) / q(at))}.`);
    // The expected distance of a histogram of as many samples of the target itself.
    const noise = 0.5 * bars.reduce((sum, [x]) => { const p = inBin(x) / bins; return sum + Math.sqrt(2 * p * (1 - p) / (Math.PI * picks)); }, 0);
    stage.say(`The histogram of ${picks.toLocaleString("en-US")} picks differs from the target by ${percentage(distance)} (half the sum of absolute differences); counting noise accounts for ${percentage(noise)}.`);
  });
};

/** The lower end of the error axis. */
const LEAST_ERROR = 1e-5;

/** The numbers of samples or lights of the error plot. */
const COUNTS = Array.from({ length: 40 }, (_, k) => Math.round(2 ** (1 + k / 4.5))).filter((c, k, all) => c !== all[k - 1]);

export const biasAndVariance = (stage: Stage) => {
  const edge = stage.slider("Shadow edge", 0.1, 0.9, 0.005, 0.4);
  const number = stage.player("Lights shown", 1, 32, 8);
  const pointed = stage.pointer(({ frame, x }) => { if (frame === 0) edge.set(clamp(x, 0.1, 0.9)); });
  let known = { edge: NaN, noisy: [] as Point[] };
  stage.draw(() => {
    const f = (x: number) => (x < edge() ? 1 : 0);
    const ofLights = (n: number) => Array.from({ length: n }, (_, i) => f((i + 0.5) / n)).reduce((a: number, b) => a + b, 0) / n;
    // An error of 0, by luck, is drawn at the lower end of the axis.
    const fixed = COUNTS.map((n): Point => [n, Math.max(Math.abs(ofLights(n) - edge()), LEAST_ERROR)]);
    if (known.edge !== edge()) {
      const random = generator(9), runs = 200;
      known = { edge: edge(), noisy: COUNTS.map((n): Point => {
        let squares = 0;
        for (let run = 0; run < runs; run++) {
          let sum = 0;
          for (let k = 0; k < n; k++) sum += f(random());
          squares += (sum / n - edge()) ** 2;
        }
        return [n, Math.sqrt(squares / runs)];
      }) };
    }
    const { noisy } = known, n = number(), lights = Array.from({ length: n }, (_, i): Point => [(i + 0.5) / n, f((i + 0.5) / n)]);
    const over = pointed();
    const shadow = plot([
      { name: "visibility V", kind: "visibility", points: [[0, 1], [edge(), 1], [edge(), 0], [1, 0]] },
      { name: `${n} fixed lights`, kind: "light", points: lights, as: "dots" }, marker(over?.frame === 0 ? over.x : undefined, 1.1),
    ], { x: { name: "light, drag the shadow’s edge", range: [0, 1] }, y: { name: "V", range: [0, 1.1], ticks: [0, 1] }, height: 130, presented: 150 });
    const error = plot([{ name: "random samples", kind: "estimate", points: noisy }, { name: "fixed lights", kind: "light", points: fixed }, { name: "", kind: "light", as: "dots", points: n > 1 ? [[n, Math.max(Math.abs(ofLights(n) - edge()), LEAST_ERROR)]] : [] }],
      { x: { name: "number of samples or lights N", log: true, range: [2, 1000], ticks: [2, 10, 100, 1000] }, y: { name: "absolute error", log: true, range: [LEAST_ERROR, 1] }, presented: 320 });
    stage.svg(shadow + error, "The lights that a shadow’s edge leaves visible, and the error of random samples and fixed lights");
    const k = over?.frame === 1 ? COUNTS.findLastIndex((c) => c <= over.x * 1.01) : -1;
    stage.read(k >= 0 ? `N = ${COUNTS[k]}: random samples ${short(noisy[k][1])}, fixed lights ${short(fixed[k][1])}.` : over?.frame === 0 ? `At ${over.x.toFixed(2)}, V = ${f(over.x)}; the visible share is ${edge().toFixed(3)}.` : null);
    stage.say(`${n} fixed light${n > 1 ? "s say" : " says"} ${ofLights(n).toFixed(3)} for ${edge().toFixed(3)}. At N = ${COUNTS.at(-1)} the noise is ${short(noisy.at(-1)![1])} and the bias ${short(fixed.at(-1)![1])}; at N = ${COUNTS[8]} they are ${short(noisy[8][1])} and ${short(fixed[8][1])}.`);
  });
};
