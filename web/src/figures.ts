// The interactive figures of the lecture, one per step.

import { h, percentage, short, signed } from "./dom";
import { Film, FilmView } from "./film";
import { figureWidth, plot, slope, type Series } from "./plot";
import type { Statistics } from "./protocol";
import type { Stage } from "./stage";

type Figure = (stage: Stage) => void;
type Point = [number, number];

/** A generator of reproducible uniform numbers. */
function generator(seed: number): () => number {
  let s = seed >>> 0;
  return () => {
    s = (s + 0x6d2b79f5) | 0;
    let t = Math.imul(s ^ (s >>> 15), 1 | s);
    t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
    return ((t ^ (t >>> 14)) >>> 0) / 4294967296;
  };
}

const line = (n: number, f: (x: number) => number, [low, high]: Point = [0, 1]): Point[] =>
  Array.from({ length: n + 1 }, (_, i) => low + (high - low) * i / n).map((x) => [x, f(x)]);
const integral = (f: (x: number) => number, n = 2000) =>
  Array.from({ length: n }, (_, i) => f((i + 0.5) / n)).reduce((a, b) => a + b, 0) / n;
const gauss = (x: number, mean: number, width: number) => Math.exp(-0.5 * ((x - mean) / width) ** 2);
const normalized = (f: (x: number) => number) => {
  const total = integral(f);
  return (x: number) => f(x) / total;
};

/** A function on [0, 1] as a table that can be sampled. */
class Table {
  private cdf: Float64Array;
  constructor(f: (x: number) => number, private n = 1000) {
    this.cdf = new Float64Array(n + 1);
    for (let i = 0; i < n; i++) this.cdf[i + 1] = this.cdf[i] + f((i + 0.5) / n);
    const total = this.cdf[n] || 1;
    this.cdf = this.cdf.map((c) => c / total);
  }
  at(x: number) {
    const i = Math.min(Math.floor(x * this.n), this.n - 1);
    return this.cdf[i] + (this.cdf[i + 1] - this.cdf[i]) * (x * this.n - i);
  }
  sample(u: number) {
    let [low, high] = [0, this.n];
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (this.cdf[middle] <= u) low = middle;
      else high = middle;
    }
    const width = this.cdf[low + 1] - this.cdf[low];
    return (low + (width > 0 ? (u - this.cdf[low]) / width : 0.5)) / this.n;
  }
}

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

const estimator: Figure = (stage) => {
  const f = (x: number) => 3 * x * x;
  const density = (similar: number) => (x: number) => 1 - similar + similar * f(x);
  // Dragging moves the curve of p through the pointer. All densities meet where f is 1.
  const [resemblance, pointed] = stage.dragged("Density", 0, 1, 0.05, 0, (x) => (x === 0 ? "uniform" : `${Math.round(100 * x)} % similar`),
    ({ x, y }) => (Math.abs(f(x) - 1) < 0.1 ? null : Math.min(Math.max((y - 1) / (f(x) - 1), 0), 1)));
  const fallen = stage.player("Samples", 0, FALLEN.length - 1, 15, (i) => String(FALLEN[i]));
  let known = { similar: NaN, ...repeats(f, density(0)) };
  stage.draw(() => {
    const similar = resemblance(), p = density(similar);
    if (known.similar !== similar) known = { similar, ...repeats(f, p) };
    const { rms } = known, upTo = fallen(), n = FALLEN[upTo];
    const xs = known.xs.slice(0, n), values = xs.map((x) => f(x) / p(x)), last = xs[n - 1];
    let sum = 0;
    const means = values.map((value, j): Point => [j + 1, (sum += value) / (j + 1)]);
    const at = pointed(), x = at?.x ?? last;
    /** The height at which a sample lies, so that many do not cover each other. */
    const heap = (j: number) => -0.15 - 0.35 * (j * 0.618 % 1);
    const named = n <= 64 ? "samples" : "";
    const where = plot([
      { name: "f", kind: "first", points: line(120, f) }, { name: "p", kind: "second", points: line(120, p) },
      { name: named, kind: "third", as: "dots", points: xs.map((x, j): Point => [x, heap(j)]) },
      { name: "", kind: "shade", as: "line", points: [[x, at ? 0 : heap(n - 1)], [x, Math.max(f(x), p(x))]] },
      { name: "", kind: "first", as: "dots", points: [[x, f(x)]] }, { name: "", kind: "second", as: "dots", points: [[x, p(x)]] },
    ], { x: { name: "x, drag to bend p", range: [0, 1] }, y: { name: "f and p", range: [-0.6, 3], ticks: [0, 1, 2, 3] } });
    const edge = (side: number) => rms.slice(0, upTo + 1).map(([k, e]): Point => [k, 1 + side * e]);
    const most = Math.max(3, ...values);
    const mean = plot([
      { name: "± spread", kind: "third", as: "ribbon", points: [...edge(1), ...edge(-1).reverse()] },
      { name: "each f/p", kind: "shade", as: "dots", points: values.map((value, j): Point => [j + 1, value]) },
      { name: "running mean", kind: "third", points: n > 1 ? means : [[0.9, means[0][1]], [1.1, means[0][1]]] },
    ], { x: { name: "samples N", log: true, range: [0.9, 1024], ticks: [1, 4, 16, 64, 256, 1024], tick: String }, y: { name: "f/p", range: [0, Math.ceil(most)] } });
    const guide = rms[0][1] || 1, isExact = rms[0][1] === 0;
    const error = plot([
      { name: isExact ? "error: 0 for every N" : `RMSE of ${REPEATS} repeats`, kind: "third", points: rms },
      { name: "slope −½", kind: "shade", points: [[1, guide], [1024, guide / 32]] },
    ], { x: { name: "samples N", log: true, range: [0.9, 1024], ticks: [1, 4, 16, 64, 256, 1024], tick: String }, y: { name: "RMSE", log: true, range: [0.01, 1] }, height: 180 });
    stage.svg(where + mean + error, "The integrand, the density and its samples; the running mean of f over p; the error over the number of samples");
    const [what, estimate] = [at ? "Under the pointer" : `Sample ${n}`, means.at(-1)![1]];
    stage.say(`${what}, x = ${x.toFixed(2)}: f = ${f(x).toFixed(2)}, p = ${p(x).toFixed(2)}, f/p = ${p(x) > 0 ? (f(x) / p(x)).toFixed(2) : "0/0"}. ∫ p = ${integral(p).toFixed(2)}. `
      + (isExact ? `The mean is 1 for every N: every sample equals the integral.` : `The mean of ${n} is ${estimate.toFixed(3)} for the integral 1, ± ${short(rms[upTo][1])}, the spread of ${REPEATS} repeats; the slope of the error is ${signed(slope(rms))}.`));
  });
};

/** A polar plot of densities [1/sr] over the angle from the normal, −90° to 90°, with a direction on the left and one on
 *  the right. */
function polar(series: Series[], directions: [[number, string], [number, string]]): string {
  const width = figureWidth(), x0 = width / 2, radius = Math.min(240, x0 - 40), y0 = radius + 44, height = y0 + 28;
  const most = Math.max(...series.flatMap((s) => s.points.map((p) => p[1])), 1e-9);
  const at = (theta: number, r: number) => `${(x0 + radius * r * Math.sin(theta)).toFixed(1)},${(y0 - radius * r * Math.cos(theta)).toFixed(1)}`;
  const label = (theta: number, r: number, text: string, side: number) => {
    const [x, y] = at(theta, r).split(",");
    return `<text class="name" x="${Number(x) + 4 * side}" y="${Number(y) + 4}" text-anchor="${side < 0 ? "end" : "start"}">${text}</text>`;
  };
  const rings = [0.5, 1].map((r) => `<path class="grid" fill="none" d="M${at(-Math.PI / 2, r)}A${radius * r} ${radius * r} 0 0 1 ${at(Math.PI / 2, r)}"/><text x="${x0 + radius * r}" y="${y0 + 16}" text-anchor="middle">${short(r * most)}${r === 1 ? " per sr" : ""}</text>`);
  const curves = series.map((s) => `<path class="${s.kind} line" d="M${s.points.map(([t, r]) => at(t, r / most)).join("L")}"/>`);
  const arrows = directions.map(([theta, name], i) => `<path class="axis" d="M${x0} ${y0}L${at(theta, 1)}"/>${label(theta, 1.04, name, 2 * i - 1)}`);
  const legend = series.map((s, i) => `<path class="${s.kind} line" d="M8 ${14 + 18 * i}h16"/><text class="name" x="30" y="${18 + 18 * i}">${s.name}</text>`);
  return `<svg viewBox="0 0 ${width} ${height}" aria-hidden="true">${rings.join("")}<path class="axis" d="M20 ${y0}H${width - 20}"/>${arrows.join("")}${curves.join("")}${legend.join("")}</svg>`;
}

const lobes: Figure = (stage) => {
  const exponent = stage.slider("Exponent n", 1, 200, 1, 20);
  const angle = stage.slider("Viewer", 0, 85, 1, 40, (x) => `${x}°`);
  stage.draw(async () => {
    const { engines } = stage.app, n = 361;
    const curve = async (material: string) => {
      const values = (await engines.call("lobeSection", material, angle(), n)) as Float32Array;
      return Array.from({ length: n }, (_, i): Point => [Math.PI * ((i + 0.5) / n - 0.5), values[2 * i + 1]]);
    };
    const phong = `phong:${exponent()}:1:0`;
    const kept = ((await engines.call("lobeSamples", phong, angle(), 2000, 1)) as Float32Array).length / 3;
    const series: Series[] = [
      { name: `Phong, n = ${exponent()}`, kind: "first", points: await curve(phong) },
      { name: "cosine", kind: "second", points: await curve("diffuse:1") },
    ];
    const theta = angle() * Math.PI / 180;
    stage.svg(polar(series, [[-theta, "viewer"], [theta, "mirror"]]), "Densities in the plane of incidence");
    const peak = Math.max(...series[0].points.map((p) => p[1]));
    stage.say(`The maximum density is ${short(peak)} per steradian; ${short(100 * (1 - kept / 2000))} % of the Phong samples are below the surface.`);
  });
};

/** A canvas of the given size, and its context. */
function canvas(stage: Stage, width: number, height: number, label: string): CanvasRenderingContext2D {
  let element = stage.drawing.querySelector("canvas");
  if (!element || element.width !== width) {
    element = h("canvas", { width: String(width), height: String(height) });
    stage.drawing.replaceChildren(element);
  }
  element.setAttribute("role", "img");
  element.setAttribute("aria-label", label);
  const context = element.getContext("2d")!;
  context.clearRect(0, 0, width, height);
  return context;
}

type Vector = [number, number, number];

/** The position of a direction in a hemisphere seen from above, with radius proportional to the polar angle. */
const fromAbove = ([x, y, z]: Vector, [x0, y0, radius]: Vector): Point => {
  const across = Math.hypot(x, y), r = across > 0 ? radius * Math.atan2(across, z) / (Math.PI / 2) / across : 0;
  return [x0 + r * x, y0 - r * y];
};

/** The center and radius of a hemisphere from above, with `above` as the space on top. */
const hemisphere = (above: number): Vector => [figureWidth() / 2, above + 172, 150];

/** Rings at 30°, 60° and 90° from the normal, with the axes x and y. */
function rings([x0, y0, radius]: Vector): string {
  const circle = (degrees: number) => {
    const r = radius * degrees / 90, at = Math.SQRT1_2 * r;
    return `<circle class="grid" fill="none" cx="${x0}" cy="${y0}" r="${r}"/><text class="halo" x="${x0 - at}" y="${y0 - at + 4}" text-anchor="middle">${degrees}°</text>`;
  };
  return `<path class="grid" d="M${x0 - radius} ${y0}h${2 * radius}M${x0} ${y0 - radius}v${2 * radius}"/>${[30, 60, 90].map(circle).join("")}
    <text x="${x0 + radius + 8}" y="${y0 + 4}">x</text><text x="${x0}" y="${y0 - radius - 6}" text-anchor="middle">y</text>`;
}

const ward: Figure = (stage) => {
  const ax = stage.slider("α along x", 0.02, 0.8, 0.01, 0.3);
  const ay = stage.slider("α along y", 0.02, 0.8, 0.01, 0.08);
  const angle = stage.slider("Viewer", 0, 80, 1, 30, (x) => `${x}°`);
  stage.draw(async () => {
    const samples = (await stage.app.engines.call("lobeSamples", `ward:${ax()}:${ay()}:1`, angle(), 3000, 1)) as Float32Array;
    const view = hemisphere(0), theta = angle() * Math.PI / 180;
    const dots: string[] = [];
    let [sx, sy, mx] = [0, 0, 0];
    const n = samples.length / 3;
    for (let i = 0; i < samples.length; i += 3) {
      const [x, y, z] = samples.subarray(i, i + 3);
      dots.push(`M${fromAbove([x, y, z], view).map((c) => c.toFixed(1)).join(" ")}h0`);
      [sx, sy, mx] = [sx + x * x, sy + y * y, mx + x];
    }
    const mark = (name: string, side: number) => {
      const [x, y] = fromAbove([side * Math.sin(theta), 0, Math.cos(theta)], view);
      return `<circle class="axis" cx="${x}" cy="${y}" r="5"/><text class="name halo" x="${x + 9 * side}" y="${y + 4}" text-anchor="${side < 0 ? "end" : "start"}">${name}</text>`;
    };
    stage.svg(`<svg viewBox="0 0 ${2 * view[0]} ${view[1] + 158}" aria-hidden="true">${rings(view)}<path class="first dots" d="${dots.join("")}"/>${mark("viewer", -1)}${mark("mirror", 1)}</svg>`,
      "Directions sampled from Ward’s lobe, seen from above");
    stage.say(`Standard deviation of the directions: ${short(Math.sqrt(sx / n - (mx / n) ** 2))} along x, ${short(Math.sqrt(sy / n))} along y. The rings are 30°, 60° and 90° from the normal.`);
  });
};

/** Half vectors at the patch centers: polar angle toward the mirror direction and azimuth [degrees]. */
const PATCHES: Point[] = [[0, 0], [18, 60], [20, -70], [40, 130], [38, -140]];
/** The angular radius of the patches [degrees]. */
const PATCH = 6;

const halfVectors: Figure = (stage) => {
  const angle = stage.slider("Viewer", 0, 85, 1, 40, (x) => `${x}°`);
  stage.draw(() => {
    const radians = Math.PI / 180, o = -angle() * radians, width = figureWidth(), x0 = width / 2, r = Math.min(240, x0 - 30), y0 = r + 40;
    const at = (theta: number, length: number) => `${(x0 + length * Math.sin(theta)).toFixed(1)} ${(y0 - length * Math.cos(theta)).toFixed(1)}`;
    const directions: string[] = [], halves: string[] = [];
    for (let k = -8; k <= 8; k++) {
      const half = k * 5 * radians, direction = 2 * half - o;
      halves.push(`M${x0} ${y0}L${at(half, 0.4 * r)}`);
      if (Math.abs(direction) < Math.PI / 2) directions.push(`M${at(direction, 0.45 * r)}L${at(direction, r)}`);
    }
    const [x, y] = at(o, r + 10).split(" ");
    const plane = `<svg viewBox="0 0 ${width} ${y0 + 12}" aria-hidden="true"><path class="axis" d="M20 ${y0}H${width - 20}M${x0} ${y0}L${at(o, r)}"/>
      <path class="first line" d="${directions.join("")}"/><path class="second line" d="${halves.join("")}"/>
      <text class="name" x="${x}" y="${y}" text-anchor="end">viewer</text>
      <path class="second line" d="M8 14h16"/><text class="name" x="30" y="18">half vectors, every 5°</text><path class="first line" d="M8 32h16"/><text class="name" x="30" y="36">directions, every 10°</text></svg>`;
    const view = hemisphere(width < 480 ? 36 : 0), wo: Vector = [Math.sin(o), 0, Math.cos(o)];
    const dot = (a: Vector, b: Vector) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    const mirror = (h: Vector) => h.map((c, k) => 2 * dot(wo, h) * c - wo[k]) as Vector;
    const factors: number[] = [];
    const patches = PATCHES.flatMap(([theta, phi]) => {
      const [st, ct, sp, cp] = [Math.sin(theta * radians), Math.cos(theta * radians), Math.sin(phi * radians), Math.cos(phi * radians)];
      const middle: Vector = [st * cp, st * sp, ct], u: Vector = [ct * cp, ct * sp, -st], v: Vector = [-sp, cp, 0];
      const [s, c] = [Math.sin(PATCH * radians), Math.cos(PATCH * radians)];
      const rim = Array.from({ length: 48 }, (_, i) => {
        const [a, b] = [s * Math.cos(i * Math.PI / 24), s * Math.sin(i * Math.PI / 24)];
        return middle.map((m, j) => c * m + a * u[j] + b * v[j]) as Vector;
      });
      const path = (points: Vector[], kind: string) => `<path class="${kind} patch" d="M${points.map((p) => fromAbove(p, view).map((t) => t.toFixed(1)).join(" ")).join("L")}Z"/>`;
      const mirrored = rim.map(mirror), growth = 4 * dot(middle, wo);
      const shown = path(rim, "second");
      // Patches partly below the surface are not reflected.
      if (growth <= 0 || mirrored.some((p) => p[2] < 0)) return [shown];
      factors.push(growth);
      const [x, y] = fromAbove(mirror(middle), view);
      return [path(mirrored, "first"), shown, `<text class="name halo" x="${x.toFixed(1)}" y="${(y + 4).toFixed(1)}" text-anchor="middle">× ${growth.toFixed(1)}</text>`];
    });
    const [vx, vy] = fromAbove(wo, view);
    const above = `<svg viewBox="0 0 ${width} ${view[1] + 158}" aria-hidden="true">${rings(view)}${patches.join("")}<circle class="axis" cx="${vx}" cy="${vy}" r="5"/><text class="name halo" x="${vx}" y="${vy + 20}" text-anchor="middle">viewer</text>
      <path class="second line" d="M8 14h16"/><text class="name" x="30" y="18">patches of half vectors</text><path class="first line" d="M8 32h16"/><text class="name" x="30" y="36">reflected patches, × magnification</text></svg>`;
    stage.svg(plane + above, "Half vectors and their reflected directions, in the plane of incidence and from above");
    stage.say(`${directions.length} of 17 directions are above the surface; reflection enlarges the patches ${factors.length ? `${short(Math.min(...factors))} to ${short(Math.max(...factors))} times` : "beyond the horizon"}: 4 ωh·ωi.`);
  });
};

const inversion: Figure = (stage) => {
  const n = stage.player("Samples", 1, 64, 16);
  const peak = stage.slider("Peak", 0.01, 0.2, 0.01, 0.04, (x) => `width ${x}`);
  stage.draw(() => {
    const p = normalized((x) => 0.25 + gauss(x, 0.7, peak()) * 0.2 / peak() + 0.6 * gauss(x, 0.25, 0.1));
    const table = new Table(p), top = Math.max(...line(200, p).map((q) => q[1]));
    const samples = Array.from({ length: n() }, (_, i): Point => [table.sample((i + 0.5) / n()), (i + 0.5) / n()]);
    stage.svg(plot([
      { name: `density, maximum ${short(top)}`, kind: "second", points: line(200, (x) => p(x) / top), as: "area" }, { name: "P(x)", kind: "first", points: line(200, (x) => table.at(x)) },
      { name: "", kind: "first", points: samples, as: "dots" }, { name: "", kind: "third", points: samples.map(([x]): Point => [x, 0]), as: "dots" },
    ], { x: { name: "x", range: [0, 1] }, y: { name: "u", range: [0, 1] } }), "A cumulative distribution, and samples drawn by inverting it");
    const inside = samples.filter(([x]) => Math.abs(x - 0.7) < 2 * peak()).length;
    stage.say(`${inside} of ${n()} samples are in the peak.`);
  });
};

const rowsAndColumns: Figure = (stage) => {
  const weighted = stage.choice("Row weights", [["solid-angle", "with sin θ"], ["alike", "equal (wrong)"]]);
  const chosen = stage.slider("Row", 0, 63, 1, 24);
  stage.draw(async () => {
    const width = 128, height = width / 2, y = chosen();
    const { rows, columns } = JSON.parse(await stage.app.engines.call("rowProbabilities", width, y, weighted() === "solid-angle")) as { rows: number[]; columns: number[] };
    const points = (values: number[]) => values.map((p, i): Point => [i, p]);
    // A row with a sun would flatten all others, so its bar is cut.
    const most = Math.max(...rows), others = [...rows].sort((a, b) => a - b)[Math.floor(0.95 * height)];
    const top = most > 4 * others ? 2 * others : most;
    const cut = top < most ? `; row ${rows.indexOf(most)} reaches ${short(most)}` : "";
    stage.svg(plot([{ name: `p(y)${cut}`, kind: "first", points: points(rows), as: "bars" }, { name: "", kind: "second", points: [[y, rows[y]]], as: "dots" }],
      { x: { name: "row y, from the top", range: [-1, height] }, y: { name: "probability of a row", range: [0, top] }, height: 170 })
      + plot([{ name: `p(x | y = ${y})`, kind: "second", points: points(columns), as: "bars" }],
        { x: { name: "column x", range: [-1, width] }, y: { name: "probability of a column", range: [0, Math.max(...columns)] }, height: 170 }), "Probabilities of the rows, and of the columns in the chosen row");
    const poles = [...rows.slice(0, 4), ...rows.slice(-4)].reduce((a, b) => a + b, 0);
    stage.say(`Row ${y} has probability ${short(rows[y])}; the four rows at each pole together have ${short(poles)}.`);
  });
};

/** Draws the small map in the background of a figure. */
function paintMap(context: CanvasRenderingContext2D, rgb: Float32Array, width: number) {
  const film = Film.fromRgb(width, width / 2, rgb), scale = 2 ** film.exposure();
  const small = h("canvas", { width: String(width), height: String(width / 2) }), inner = small.getContext("2d")!;
  const image = inner.createImageData(width, width / 2);
  for (let i = 0; i < width * width / 2; i++) {
    for (let c = 0; c < 3; c++) {
      const x = scale * rgb[3 * i + c];
      image.data[4 * i + c] = 255 * (x / (1 + x)) ** (1 / 2.2) * 1.3;
    }
    image.data[4 * i + 3] = 255;
  }
  inner.putImageData(image, 0, 0);
  context.imageSmoothingEnabled = true;
  context.drawImage(small, 0, 0, context.canvas.width, context.canvas.height);
}

const environmentSamples: Figure = (stage) => {
  const n = stage.player("Samples", 0, 11, 7, (x) => String(2 ** x));
  stage.draw(async () => {
    const { engines, envName } = stage.app, width = 320, count = 2 ** n();
    const rgb = (await engines.call("map", width)) as Float32Array;
    const { places, nInBrightest, shareOfBrightest } = JSON.parse(await engines.call("mapSamples", count, 3)) as { places: Point[]; nInBrightest: number; shareOfBrightest: number };
    const context = canvas(stage, 640, 320, "Environment samples");
    paintMap(context, rgb, width);
    for (const [u, v] of places) {
      context.beginPath();
      context.arc(640 * u, 320 * v, 2.5, 0, 2 * Math.PI);
      context.fillStyle = "#fff";
      context.fill();
      context.strokeStyle = "#000";
      context.stroke();
    }
    stage.say(`${nInBrightest} of ${count} samples (${short(100 * nInBrightest / count)} %) are in the brightest hundredth of ${envName}, which holds ${short(100 * shareOfBrightest)} % of the light.`);
  });
};

/** Light with a small bright lamp, on [0, 1]. */
const light = (x: number) => 0.15 + 4 * gauss(x, 0.35, 0.02) + 0.7 * gauss(x, 0.75, 0.15);

const combination: Figure = (stage) => {
  const width = stage.slider("Lobe", -3, -0.3, 0.1, -1.3, (x) => `width ${Number((10 ** x).toPrecision(2))}`);
  const split = stage.slider("Light samples of 16", 1, 15, 1, 8);
  const heuristic = stage.choice("Weights", [["1", "balance"], ["2", "power"]]);
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
    const error = (v: number) => `${short(100 * Math.sqrt(Math.max(v, 0)) / exact)} %`;
    const top = (g: (x: number) => number) => Math.max(...line(400, g).map((p) => p[1]));
    stage.svg(plot([
      { name: "light", kind: "second", points: line(400, (x) => q(x) / top(q)) }, { name: "lobe", kind: "first", points: line(400, (x) => lobe(x) / top(lobe)) },
      { name: "MIS weight of light samples", kind: "third", points: line(400, w), as: "area" },
    ], { x: { name: "direction", range: [0, 1] }, y: { name: "relative to the maximum", range: [0, 1.05] } }), "Two densities and the MIS weight of one of them");
    stage.say(`Error of 16 samples: light alone ${error(variance(q, () => 1) / 16)}, lobe alone ${error(variance(lobe, () => 1) / 16)}, both ${error(variance(q, w) / m + variance(lobe, (x) => 1 - w(x)) / n)}.`);
  });
};

const product: Figure = (stage) => {
  const center = stage.slider("Mirror direction", 0.05, 0.95, 0.01, 0.5);
  const width = stage.slider("Lobe", 0.02, 0.4, 0.01, 0.08, (x) => `width ${x}`);
  const hidden = stage.slider("Occluded from", 0, 1, 0.01, 0.6);
  stage.draw(() => {
    const lobe = (x: number) => gauss(x, center(), width());
    const f = (x: number) => light(x) * lobe(x), total = integral(f, 4000), p = (x: number) => f(x) / total;
    const visible = Math.min(integral((x) => (x < hidden() ? p(x) : 0), 4000), 1), exact = visible * total;
    const q = normalized(light), r = normalized(lobe);
    const relative = (d: (x: number) => number) => {
      const second = integral((x) => (x < hidden() && d(x) > 0 ? f(x) ** 2 / d(x) : 0), 4000);
      return short(Math.sqrt(Math.max(second - exact ** 2, 0)) / total);
    };
    const top = (g: (x: number) => number) => Math.max(...line(400, g).map((s) => s[1]));
    stage.svg(plot([
      { name: "light", kind: "second", points: line(400, (x) => light(x) / top(light)) }, { name: "lobe", kind: "first", points: line(400, lobe) },
      { name: "product", kind: "third", points: line(400, (x) => p(x) / top(p)), as: "area" },
      { name: "occluded", kind: "shade", points: [[hidden(), 0], [1, 0]], as: "band" },
    ], { x: { name: "direction", range: [0, 1] }, y: { name: "relative to the maximum", range: [0, 1.05] } }), "Light, lobe and their product");
    stage.say(`${short(100 * visible)} % of the product is unoccluded. Standard deviation of one sample, relative to the unoccluded radiance: light ${relative(q)}, lobe ${relative(r)}, product ${short(Math.sqrt(visible * (visible < 1 - 1e-9 ? 1 - visible : 0)))}.`);
  });
};

const target = normalized((x) => light(x) * gauss(x, 0.5, 0.12));

const rejection: Figure = (stage) => {
  const bound = stage.slider("Envelope", 0.3, 3, 0.05, 1, (x) => `${x.toFixed(2)} × the tightest`);
  stage.draw(() => {
    const q = normalized(light), needed = Math.max(...line(2000, (x) => target(x) / q(x)).map((p) => p[1]));
    const c = bound() * needed, table = new Table(q), random = generator(5);
    const kept: Point[] = [], lost: Point[] = [];
    for (let k = 0; k < 800; k++) {
      const x = table.sample(random()), y = random() * c * q(x);
      (y < target(x) ? kept : lost).push([x, y]);
    }
    stage.svg(plot([
      { name: "rejected", kind: "second", points: lost, as: "dots" }, { name: "kept", kind: "first", points: kept, as: "dots" },
      { name: "envelope c · q", kind: "second", points: line(400, (x) => c * q(x)) }, { name: "target", kind: "first", points: line(400, target) },
    ], { x: { name: "direction", range: [0, 1] }, y: { name: "density", range: [0, Math.max(c * q(0.35), 10)] }, height: 280 }), "Tries under an envelope");
    const bias = integral((x) => Math.max(target(x) - c * q(x), 0));
    stage.say(`${kept.length} of 800 tries are kept (1 / c = ${short(1 / c)})${bias > 1e-3 ? `; ${short(100 * bias)} % of the target exceeds the envelope and is lost` : ""}.`);
  });
};

const resampling: Figure = (stage) => {
  const m = stage.player("Candidates M", 0, 10, 2, (x) => String(2 ** x));
  stage.draw(() => {
    const table = new Table(light), q = normalized(light), random = generator(7);
    const bins = 50, picks = Math.min(20000, Math.floor(2e6 / 2 ** m())), histogram = new Array<number>(bins).fill(0);
    for (let k = 0; k < picks; k++) {
      let chosen = 0, sum = 0;
      for (let j = 0; j < 2 ** m(); j++) {
        const x = table.sample(random()), w = target(x) / q(x);
        sum += w;
        if (random() * sum < w) chosen = x;
      }
      histogram[Math.min(Math.floor(chosen * bins), bins - 1)]++;
    }
    const bars = histogram.map((count, i): Point => [(i + 0.5) / bins, count * bins / picks]);
    const distance = 0.5 * bars.reduce((sum, [x, y]) => sum + Math.abs(y - integral((u) => target(x + (u - 0.5) / bins), 20)) / bins, 0);
    stage.svg(plot([
      { name: "picked", kind: "third", points: bars, as: "bars" }, { name: "candidates", kind: "second", points: line(400, q) }, { name: "target", kind: "first", points: line(400, target) },
    ], { x: { name: "direction", range: [0, 1] }, y: { name: "density", range: [0, 10] }, height: 260 }), "A histogram of the resampled directions");
    // The expected distance of a histogram of as many samples of the target itself.
    const noise = 0.5 * bars.reduce((sum, [x]) => { const p = integral((u) => target(x + (u - 0.5) / bins), 20) / bins; return sum + Math.sqrt(2 * p * (1 - p) / (Math.PI * picks)); }, 0);
    stage.say(`The histogram of ${picks.toLocaleString("en-US")} picks differs from the target by ${percentage(distance)} (half the sum of absolute differences); counting noise accounts for ${percentage(noise)}.`);
  });
};

/** The four ways: name, counts, the strategy at these counts, and one with few samples at a time for equal time. */
const WAYS = [
  { name: "environment", counts: "100", strategy: "environment:100", few: "environment:4" },
  { name: "reflectance", counts: "75", strategy: "brdf:75", few: "brdf:4" },
  { name: "both", counts: "50 : 38", strategy: "mis:50:38", few: "mis:2:2" },
  { name: "resampling", counts: "15/800", strategy: "sir:15/800", few: "sir:1/53" },
];
/** The settings of the reference picture. */
const TRUTH = { strategy: "product:16", spp: 32 };
/** The time of each way at equal time [ms]. */
const EQUAL_TIME = 500;

type Rendered = { film: Film; statistics: Statistics };

/** The mean relative squared error of a picture's pixels, without the reference's own variance. */
function relativeError({ film }: Rendered, truth: Rendered): number {
  const luminance = (pixels: Float32Array, i: number) => 0.2126 * pixels[i] + 0.7152 * pixels[i + 1] + 0.0722 * pixels[i + 2];
  let sum = 0;
  for (let i = 0; i < film.pixels.length; i += 4) {
    const y = luminance(truth.film.pixels, i);
    sum += (luminance(film.pixels, i) - y) ** 2 / (y * y + 0.01);
  }
  return Math.max((sum - (truth.statistics.relativeVariance ?? 0)) / (film.pixels.length / 4), 0);
}

const fourWays: Figure = (stage) => {
  const by = stage.choice("Compare", [["counts", "at the counts above"], ["time", "in half a second each"]]);
  const diffuse = stage.slider("Diffuse share", 0, 0.8, 0.1, 0);
  const size = 96, figures = WAYS.map(({ name, counts }) => {
    const element = h("canvas", { width: String(size), height: String(size), role: "img", "aria-label": `A sphere rendered by ${name}` });
    const caption = h("figcaption", {}, `${name}, ${counts}`);
    return { view: new FilmView(element, false), caption, figure: h("figure", {}, element, caption) };
  });
  stage.drawing.replaceChildren(h("div", { class: "quartet" }, ...figures.map((f) => f.figure)));
  const host = stage.app.engines.extra(), truths = new Map<number, Rendered>();
  let token = 0;
  /** Renders a picture, stopped after `milliseconds` if it is timed. */
  const render = (strategy: string, spp: number, milliseconds = 0) => new Promise<Rendered>((resolve, reject) => {
    const film = new Film(size, size), mine = ++token;
    const end = milliseconds ? performance.now() + milliseconds : Infinity;
    host.onRender = (message) => {
      if (message.token !== mine) return;
      if (message.kind === "failed") reject(new Error(message.error));
      if (message.kind !== "update") return;
      film.put(message.windows, message.pixels);
      // Every pixel has at least one sample.
      if (message.complete || (performance.now() >= end && message.statistics.samples >= 1)) resolve({ film, statistics: message.statistics });
    };
    host.send({ kind: "render", token: mine, settings: JSON.stringify({ width: size, height: size, spp, strategy, seed: mine, hideEnvironment: true, camera: null, shard: [0, 1] }) });
  });
  stage.draw(async () => {
    const share = diffuse(), timed = by() === "time";
    await host.call("loadScene", JSON.stringify({ scene: "sphere-orthographic", material: `phong:50:1:${share}`, ground: false }));
    await host.call("loadEnvironment", JSON.stringify({ probe: "cathedral", rows: 128, rotate: 0, scale: 1, exposure: 0 }));
    const truth = truths.get(share) ?? await render(TRUTH.strategy, TRUTH.spp);
    truths.set(share, truth);
    const found: string[] = [];
    for (const [k, { name, counts, strategy, few }] of WAYS.entries()) {
      const started = performance.now();
      const picture = await (timed ? render(few, 4096, EQUAL_TIME) : render(strategy, 1));
      host.send({ kind: "stop" });
      const { view, caption } = figures[k];
      view.set({ exposure: 0, curve: "agx" });
      view.show(0, picture.film);
      const seconds = (performance.now() - started) / 1000;
      caption.replaceChildren(timed ? name : `${name}, ${counts}`, h("br"), `error ${short(Number(relativeError(picture, truth).toPrecision(2)))}, ${seconds.toFixed(2)} s`);
      found.push(`${name} ${short(picture.statistics.shadowRays / 1000)} thousand`);
    }
    stage.say(`Errors are mean relative squared errors of the pixels. Shadow rays: ${found.join(", ")}.`);
  });
};

/** The lower end of the error axis. */
const LEAST_ERROR = 1e-5;

const biasAndVariance: Figure = (stage) => {
  const edge = stage.slider("Shadow edge", 0.1, 0.9, 0.005, 0.4);
  stage.draw(() => {
    const f = (x: number) => (x < edge() ? 1 : 0), random = generator(9);
    const counts = Array.from({ length: 40 }, (_, k) => Math.round(2 ** (1 + k / 4.5))).filter((c, k, all) => c !== all[k - 1]);
    // An error of 0, by luck, is drawn at the lower end of the axis.
    const fixed = counts.map((n): Point => [n, Math.max(Math.abs(Array.from({ length: n }, (_, i) => f((i + 0.5) / n)).reduce((a: number, b) => a + b, 0) / n - edge()), LEAST_ERROR)]);
    const runs = 200;
    const noisy = counts.map((n): Point => {
      let squares = 0;
      for (let run = 0; run < runs; run++) {
        let sum = 0;
        for (let k = 0; k < n; k++) sum += f(random());
        squares += (sum / n - edge()) ** 2;
      }
      return [n, Math.sqrt(squares / runs)];
    });
    stage.svg(plot([{ name: "random samples", kind: "first", points: noisy }, { name: "fixed lights", kind: "second", points: fixed }],
      { x: { name: "number of samples or lights N", log: true, range: [2, 1000], ticks: [2, 10, 100, 1000] }, y: { name: "absolute error", log: true, range: [LEAST_ERROR, 1] } }), "Error of random samples and fixed lights");
    stage.say(`At N = ${counts.at(-1)} the noise is ${short(noisy.at(-1)![1])} and the bias ${short(fixed.at(-1)![1])}; at N = ${counts[8]} they are ${short(noisy[8][1])} and ${short(fixed[8][1])}.`);
  });
};

/** The lights within 2° of the brightest light, and their share of the energy. */
function aroundBrightest(lights: { uv: Point; share: number }[]): { count: number; share: number } {
  const direction = ([u, v]: Point): Vector => [Math.sin(Math.PI * v) * Math.cos(2 * Math.PI * u), Math.cos(Math.PI * v), Math.sin(Math.PI * v) * Math.sin(2 * Math.PI * u)];
  const brightest = direction(lights.reduce((a, b) => (b.share > a.share ? b : a)).uv);
  const near = lights.filter(({ uv }) => direction(uv).reduce((sum, c, k) => sum + c * brightest[k], 0) > Math.cos(Math.PI / 90));
  return { count: near.length, share: near.reduce((sum, { share }) => sum + share, 0) };
}

const cuts = (method: string, other: string): Figure => (stage) => {
  const rounds = stage.slider("Lights", 0, 9, 1, 4, (k) => String(2 ** k));
  stage.draw(async () => {
    const { engines } = stage.app, n = 2 ** rounds(), width = 640;
    const settings = (name: string) => JSON.stringify({ method: name, refine: true, n, sun: false, lamps: 0 });
    const ask = async (name: string) => JSON.parse(await engines.call("lights", settings(name)));
    const beside = await ask(other), rig = await ask(method);
    const regions = (await engines.call("regions", settings(method), width)) as Uint32Array;
    const rgb = (await engines.call("map", width / 2)) as Float32Array;
    const context = canvas(stage, width, width / 2, `The map in ${n} regions`);
    paintMap(context, rgb, width / 2);
    context.fillStyle = "rgb(255 255 255 / 0.8)";
    regions.forEach((label, i) => {
      const x = i % width, below = regions[i + width] ?? label;
      if (label !== below || label !== regions[i - x + (x + 1) % width]) context.fillRect(x, Math.floor(i / width), 1, 1);
    });
    for (const { uv, share } of rig.lights as { uv: Point; share: number }[]) {
      context.beginPath();
      context.arc(640 * uv[0], 320 * uv[1], 2 + 8 * Math.sqrt(share), 0, 2 * Math.PI);
      context.fillStyle = "#ffd34d";
      context.fill();
      context.strokeStyle = "#000";
      context.stroke();
    }
    const percent = (x: number) => `${short(100 * x)} %`, near = aroundBrightest(rig.lights);
    const sun = near.count > 1 ? `the ${near.count} lights within 2° of the brightest hold` : "the brightest holds";
    stage.say(`${n} light${n > 1 ? "s" : ""} of ${stage.app.envName}; ${sun} ${percent(near.share)} of its energy. The shading error is ${percent(rig.diffuse)} matte and ${percent(rig.glossy)} glossy; with ${other.replace("-", " ")}, ${percent(beside.diffuse)} and ${percent(beside.glossy)}.`);
  });
};

export const FIGURES: Figure[] = [
  estimator, lobes, ward, halfVectors, inversion, rowsAndColumns, environmentSamples, combination, product, rejection, resampling,
  fourWays, biasAndVariance, cuts("median-cut", "variance-minimization"), cuts("variance-minimization", "median-cut"),
];
