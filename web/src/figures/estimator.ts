// Step 1: an integral, the density of its samples, and the error of their mean.

import { short, signed } from "../dom";
import { plot, slope } from "../plot";
import type { Stage } from "../stage";
import { Table, clamp, generator, integral, line, type Point } from "./curves";

/** The numbers of samples of the first figure: one by one up to 32, then ever faster. */
const FALLEN = Array.from({ length: 73 }, (_, i) => (i <= 32 ? i : Math.round(32 * 2 ** ((i - 32) / 8)))).slice(1);
const REPEATS = 200;

/** The first run's samples, and the estimates of all repeats at each of `FALLEN`: their spread about the integral, 1. */
function repeats(f: (x: number) => number, p: (x: number) => number) {
  const table = new Table(p), random = generator(1);
  const xs: number[] = [], squares = FALLEN.map(() => 0);
  for (let run = 0; run < REPEATS; run++) {
    let sum = 0;
    for (let k = 1, next = 0; next < FALLEN.length; k++) {
      const x = table.sample(random());
      sum += f(x) / p(x);
      if (run === 0) xs.push(x);
      if (k === FALLEN[next]) squares[next++] += (sum / k - 1) ** 2;
    }
  }
  // A density proportional to the integrand leaves only rounding errors.
  const rms = FALLEN.map((k, i): Point => [k, Math.sqrt(squares[i] / REPEATS)]).map(([k, e]): Point => [k, e < 1e-9 ? 0 : e]);
  return { xs, rms };
}

export const estimator = (stage: Stage) => {
  const f = (x: number) => 3 * x * x;
  const density = (similar: number) => (x: number) => 1 - similar + similar * f(x);
  const resemblance = stage.slider("Density", 0, 1, 0.05, 0, (x) => (x === 0 ? "uniform" : `${Math.round(100 * x)} % similar`));
  // Dragging moves the curve of p through the pointer. All densities meet where f is 1.
  const pointed = stage.pointer(({ frame, x, y }) => {
    if (frame === 0 && Math.abs(f(x) - 1) >= 0.1) resemblance.set(clamp((y - 1) / (f(x) - 1)));
  });
  const fallen = stage.player("Samples", 0, FALLEN.length - 1, 15, (i) => String(FALLEN[i]));
  let known = { similar: NaN, ...repeats(f, density(0)) };
  stage.draw(() => {
    const similar = resemblance(), p = density(similar);
    if (known.similar !== similar) known = { similar, ...repeats(f, p) };
    const { rms } = known, upTo = fallen(), n = FALLEN[upTo];
    const xs = known.xs.slice(0, n), values = xs.map((x) => f(x) / p(x)), last = xs[n - 1];
    let sum = 0;
    const means = values.map((value, j): Point => [j + 1, (sum += value) / (j + 1)]);
    const over = pointed(), at = over?.frame === 0 ? over : null, x = at?.x ?? last;
    /** The height at which a sample lies, so that many do not cover each other. */
    const heap = (j: number) => -0.15 - 0.35 * (j * 0.618 % 1);
    const named = n <= 64 ? "samples" : "";
    const where = plot([
      { name: "f", kind: "product", points: line(120, f) }, { name: "p", kind: "light", points: line(120, p) },
      { name: named, kind: "estimate", as: "dots", points: xs.map((x, j): Point => [x, heap(j)]) },
      { name: "", kind: "shade", as: "line", points: [[x, at ? 0 : heap(n - 1)], [x, Math.max(f(x), p(x))]] },
      { name: "", kind: "product", as: "dots", points: [[x, f(x)]] }, { name: "", kind: "light", as: "dots", points: [[x, p(x)]] },
    ], { x: { name: "x, drag to bend p", range: [0, 1] }, y: { name: "f and p", range: [-0.6, 3], ticks: [0, 1, 2, 3] } });
    const edge = (side: number) => rms.slice(0, upTo + 1).map(([k, e]): Point => [k, 1 + side * e]);
    const most = Math.max(3, ...values);
    const mean = plot([
      { name: "± spread", kind: "estimate", as: "ribbon", points: [...edge(1), ...edge(-1).reverse()] },
      { name: "each f/p", kind: "shade", as: "dots", points: values.map((value, j): Point => [j + 1, value]) },
      { name: "running mean", kind: "estimate", points: n > 1 ? means : [[0.9, means[0][1]], [1.1, means[0][1]]] },
    ], { x: { name: "samples N", log: true, range: [0.9, 1024], ticks: [1, 4, 16, 64, 256, 1024], tick: String }, y: { name: "f/p", range: [0, Math.ceil(most)] } });
    const guide = rms[0][1] || 1, isExact = rms[0][1] === 0;
    const error = plot([
      { name: isExact ? "error: 0 for every N" : `RMSE of ${REPEATS} repeats`, kind: "estimate", points: rms },
      { name: "slope −½", kind: "shade", points: [[1, guide], [1024, guide / 32]] },
    ], { x: { name: "samples N", log: true, range: [0.9, 1024], ticks: [1, 4, 16, 64, 256, 1024], tick: String }, y: { name: "RMSE", log: true, range: [0.01, 1] }, height: 180 });
    stage.svg(where + mean + error, "The integrand, the density and its samples; the running mean of f over p; the error over the number of samples");
    const upTill = over ? FALLEN.findLastIndex((k) => k <= over.x) : -1;
    const k = FALLEN[Math.min(upTill, upTo)];
    stage.read(over && over.frame > 0 && upTill >= 0 ? `N = ${k}: the mean is ${means[k - 1][1].toFixed(3)}, the RMSE of ${REPEATS} repeats ${short(rms[Math.min(upTill, upTo)][1])}.` : null);
    const [what, estimate] = [at ? "Under the pointer" : `Sample ${n}`, means.at(-1)![1]];
    stage.say(`${what}, x = ${x.toFixed(2)}: f = ${f(x).toFixed(2)}, p = ${p(x).toFixed(2)}, f/p = ${p(x) > 0 ? (f(x) / p(x)).toFixed(2) : "0/0"}. ∫ p = ${integral(p).toFixed(2)}. `
      + (isExact ? `The mean is 1 for every N: every sample equals the integral.` : `The mean of ${n} is ${estimate.toFixed(3)} for the integral 1, ± ${short(rms[upTo][1])}, the spread of ${REPEATS} repeats; the slope of the error is ${signed(slope(rms))}.`));
  });
};

