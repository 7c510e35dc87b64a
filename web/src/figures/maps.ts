// Steps 6, 7, 14 and 15: rows and columns of the map, its samples, and its division into lights.

import { h, short } from "../dom";
import { Film } from "../film";
import { plot } from "../plot";
import type { Frame } from "../pointer";
import type { Stage } from "../stage";
import type { Point } from "./curves";

/** The size of a map in a figure. */
const WIDTH = 640, HEIGHT = 320;
/** Columns of the map that is drawn and read. */
const COLUMNS = 320;

/** The figure's map, cleared; its units are columns and rows of the whole, from 0 to 1. */
function canvas(stage: Stage, label: string): CanvasRenderingContext2D {
  let element = stage.drawing.querySelector("canvas");
  if (!element) {
    const frame: Frame = { left: 0, right: WIDTH, top: 0, bottom: HEIGHT, xs: [0, 1], ys: [1, 0] };
    element = h("canvas", { width: String(WIDTH), height: String(HEIGHT), role: "img", "data-frame": JSON.stringify(frame) });
    stage.drawing.replaceChildren(element);
  }
  element.setAttribute("aria-label", label);
  const context = element.getContext("2d")!;
  context.clearRect(0, 0, WIDTH, HEIGHT);
  return context;
}

/** The map that the figures draw and read. */
class SmallMap {
  private constructor(private rgb: Float32Array, private solidAngles: Float64Array, private total: number) {}

  static async of(stage: Stage): Promise<SmallMap> {
    const rgb = (await stage.app.engines.call("map", COLUMNS)) as Float32Array, rows = COLUMNS / 2;
    const edge = (y: number) => Math.cos(Math.PI * y / rows);
    const solidAngles = Float64Array.from({ length: rows }, (_, y) => (edge(y) - edge(y + 1)) * 2 * Math.PI / COLUMNS);
    const map = new SmallMap(rgb, solidAngles, 1);
    map.total = map.sum(() => true);
    return map;
  }

  private luminance(i: number) {
    return 0.2126 * this.rgb[3 * i] + 0.7152 * this.rgb[3 * i + 1] + 0.0722 * this.rgb[3 * i + 2];
  }

  /** The light in the texels of a set. */
  private sum(has: (i: number) => boolean): number {
    let sum = 0;
    for (let i = 0; i < COLUMNS * COLUMNS / 2; i++) if (has(i)) sum += this.luminance(i) * this.solidAngles[Math.floor(i / COLUMNS)];
    return sum;
  }

  /** The share of the light in the texels of a set. */
  share(has: (i: number) => boolean): number {
    return this.sum(has) / (this.total || 1);
  }

  /** The texel at a place. */
  texel([u, v]: Point): number {
    const at = (c: number, n: number) => Math.min(Math.floor(c * n), n - 1);
    return at(v, COLUMNS / 2) * COLUMNS + at(u, COLUMNS);
  }

  /** Light and its density at a place, in words. */
  read(place: Point): string {
    const l = this.luminance(this.texel(place));
    return `Under the pointer, L = ${short(l)}, its density is ${short(l / (this.total || 1))} per steradian`;
  }

  /** Draws the map in the background of a figure. */
  paint(context: CanvasRenderingContext2D) {
    const { rgb } = this, rows = COLUMNS / 2, scale = 2 ** Film.fromRgb(COLUMNS, rows, rgb).exposure();
    const small = h("canvas", { width: String(COLUMNS), height: String(rows) }), inner = small.getContext("2d")!;
    const image = inner.createImageData(COLUMNS, rows);
    for (let i = 0; i < COLUMNS * rows; i++) {
      for (let c = 0; c < 3; c++) {
        const x = scale * rgb[3 * i + c];
        image.data[4 * i + c] = 255 * (x / (1 + x)) ** (1 / 2.2) * 1.3;
      }
      image.data[4 * i + 3] = 255;
    }
    inner.putImageData(image, 0, 0);
    context.imageSmoothingEnabled = true;
    context.drawImage(small, 0, 0, WIDTH, HEIGHT);
  }
}

type Vector = [number, number, number];
const direction = ([u, v]: Point): Vector => [Math.sin(Math.PI * v) * Math.cos(2 * Math.PI * u), Math.cos(Math.PI * v), Math.sin(Math.PI * v) * Math.sin(2 * Math.PI * u)];
const cosine = (a: Vector, b: Vector) => a.reduce((sum, c, k) => sum + c * b[k], 0);

/** A dot with a dark rim. */
function dot(context: CanvasRenderingContext2D, [u, v]: Point, radius: number, style: string) {
  context.beginPath();
  context.arc(WIDTH * u, HEIGHT * v, radius, 0, 2 * Math.PI);
  context.fillStyle = style;
  context.fill();
  context.strokeStyle = "#000";
  context.lineWidth = 1;
  context.stroke();
}

/** The place of a direction. */
const placeOf = ([x, y, z]: Vector): Point => [(Math.atan2(z, x) / (2 * Math.PI) + 1) % 1, Math.acos(Math.min(Math.max(y, -1), 1)) / Math.PI];

/** The rim of a cone about a place's direction. */
function rim(context: CanvasRenderingContext2D, place: Point, angle: number) {
  const axis = direction(place), [u, v] = place, [a, b] = [Math.PI * v, 2 * Math.PI * u];
  const down: Vector = [Math.cos(a) * Math.cos(b), -Math.sin(a), Math.cos(a) * Math.sin(b)], across: Vector = [-Math.sin(b), 0, Math.cos(b)];
  const [s, c] = [Math.sin(angle), Math.cos(angle)];
  const points = Array.from({ length: 181 }, (_, k) => k * Math.PI / 90)
    .map((t) => placeOf(axis.map((of, i) => c * of + s * (Math.cos(t) * down[i] + Math.sin(t) * across[i])) as Vector));
  context.beginPath();
  points.forEach(([x, y], k) => {
    // The left and right edges of the map meet.
    const isCut = k === 0 || Math.abs(x - points[k - 1][0]) > 0.5;
    context[isCut ? "moveTo" : "lineTo"](WIDTH * x, HEIGHT * y);
  });
  for (const [width, style] of [[4, "#000"], [2, "#ffd34d"]] as const) {
    context.lineWidth = width;
    context.strokeStyle = style;
    context.stroke();
  }
}

/** Rows of the table of step 6. */
const ROWS = 64;

export const rowsAndColumns = (stage: Stage) => {
  const weighted = stage.choice("Row weights", [["solid-angle", "with sin θ"], ["alike", "equal (wrong)"]]);
  const chosen = stage.slider("Row", 0, ROWS - 1, 1, 24);
  stage.play(chosen, 1);
  // The row is dragged on the map and in the plot of the rows.
  const pointed = stage.pointer(({ frame, x, y }) => { if (frame < 2) chosen.set(Math.min(Math.floor(frame === 0 ? y * ROWS : x + 0.5), ROWS - 1)); });
  let map: SmallMap | null = null;
  stage.draw(async () => {
    const width = 2 * ROWS, y = chosen();
    map ??= await SmallMap.of(stage);
    const { rows, columns } = JSON.parse(await stage.app.engines.call("rowProbabilities", width, y, weighted() === "solid-angle")) as { rows: number[]; columns: number[] };
    const points = (values: number[]) => values.map((p, i): Point => [i, p]);
    // A row with a sun would flatten all others, so its bar is cut.
    const most = Math.max(...rows), others = [...rows].sort((a, b) => a - b)[Math.floor(0.95 * ROWS)];
    const top = most > 4 * others ? 2 * others : most;
    const cut = top < most ? `; row ${rows.indexOf(most)} reaches ${short(most)}` : "";
    const context = canvas(stage, `The map, with row ${y}`);
    map.paint(context);
    context.lineWidth = 2;
    context.strokeStyle = "#ffd34d";
    context.strokeRect(1, y / ROWS * HEIGHT, WIDTH - 2, HEIGHT / ROWS);
    stage.svg(plot([{ name: `p(y)${cut}`, kind: "lobe", points: points(rows), as: "bars" }, { name: "", kind: "light", points: [[y, rows[y]]], as: "dots" }],
      { x: { name: "row y, from the top; drag it here or on the map", range: [-1, ROWS] }, y: { name: "probability of a row", range: [0, top] }, height: 170 })
      + plot([{ name: `p(x | y = ${y})`, kind: "light", points: points(columns), as: "bars" }],
        { x: { name: "column x", range: [-1, width] }, y: { name: "probability of a column", range: [0, Math.max(...columns)] }, height: 170 }), "Probabilities of the rows, and of the columns in the chosen row", context.canvas as HTMLCanvasElement);
    const over = pointed(), column = over ? Math.min(Math.max(Math.round(over.x), 0), width - 1) : 0;
    stage.read(!over ? null : over.frame === 0 ? `${map.read([over.x, over.y])}; row ${Math.min(Math.floor(over.y * ROWS), ROWS - 1)} has probability ${short(rows[Math.min(Math.floor(over.y * ROWS), ROWS - 1)])}.`
      : over.frame === 1 ? `Row ${Math.min(column, ROWS - 1)} has probability ${short(rows[Math.min(column, ROWS - 1)])}. ∑ p(y) = ${rows.reduce((a, b) => a + b, 0).toFixed(2)}.`
        : `Column ${column} of row ${y} has probability ${short(columns[column])}. ∑ p(x | y) = ${columns.reduce((a, b) => a + b, 0).toFixed(2)}.`);
    const poles = [...rows.slice(0, 4), ...rows.slice(-4)].reduce((a, b) => a + b, 0);
    stage.say(`Row ${y} has probability ${short(rows[y])}; the four rows at each pole together have ${short(poles)}.`);
  });
};

/** The radius of the window that is dragged over the map. */
const WINDOW = Math.PI / 12;

export const environmentSamples = (stage: Stage) => {
  const n = stage.player("Samples", 0, 11, 7, (x) => String(2 ** x));
  let map: SmallMap | null = null, center: Point | null = null;
  const pointed = stage.pointer(({ x, y }) => { center = [x, y]; });
  stage.draw(async () => {
    const { engines, envName } = stage.app, count = 2 ** n();
    map ??= await SmallMap.of(stage);
    const { places, nInBrightest, shareOfBrightest } = JSON.parse(await engines.call("mapSamples", count, 3)) as { places: Point[]; nInBrightest: number; shareOfBrightest: number };
    const context = canvas(stage, "Environment samples");
    map.paint(context);
    const over = pointed(), middle = center ?? (over ? [over.x, over.y] as Point : null);
    const isInside = (place: Point) => !!middle && cosine(direction(place), direction(middle)) > Math.cos(WINDOW);
    for (const place of places) dot(context, place, 2.5, isInside(place) ? "#ffd34d" : "#fff");
    if (middle) rim(context, middle, WINDOW);
    const inside = places.filter(isInside).length;
    const rows = COLUMNS / 2, share = map.share((i) => isInside([(i % COLUMNS + 0.5) / COLUMNS, (Math.floor(i / COLUMNS) + 0.5) / rows]));
    stage.read(middle && over ? `${map.read([over.x, over.y])}; ${inside} of ${count} samples (${short(100 * inside / count)} %) are within 15° of ${center ? "the window’s center" : "it"}, which holds ${short(100 * share)} % of the light.` : null);
    stage.say(`${nInBrightest} of ${count} samples (${short(100 * nInBrightest / count)} %) are in the brightest hundredth of ${envName}, which holds ${short(100 * shareOfBrightest)} % of the light. Drag a window of 15° over the map: the shares of samples and light are alike everywhere.`);
  });
};

/** The lights within 2° of the brightest light, and their share of the energy. */
function aroundBrightest(lights: { uv: Point; share: number }[]): { count: number; share: number } {
  const brightest = direction(lights.reduce((a, b) => (b.share > a.share ? b : a)).uv);
  const near = lights.filter(({ uv }) => cosine(direction(uv), brightest) > Math.cos(Math.PI / 90));
  return { count: near.length, share: near.reduce((sum, { share }) => sum + share, 0) };
}

export const cuts = (method: string, other: string) => (stage: Stage) => {
  const rounds = stage.player("Lights", 0, 9, 4, (k) => String(2 ** k));
  let map: SmallMap | null = null, held: { texel: number } | null = null;
  // Dragging holds a region, to compare it while the lights play.
  const pointed = stage.pointer(({ x, y }) => { held = { texel: Math.floor(y * HEIGHT) * WIDTH + Math.floor(x * WIDTH) }; });
  let known: { key: number; rig: { lights: { uv: Point; share: number }[]; diffuse: number; glossy: number }; beside: { diffuse: number; glossy: number }; regions: Uint32Array } | null = null;
  stage.draw(async () => {
    const { engines } = stage.app, n = 2 ** rounds();
    const settings = (name: string) => JSON.stringify({ method: name, refine: true, n, sun: false, lamps: 0 });
    const ask = async (name: string) => JSON.parse(await engines.call("lights", settings(name)));
    map ??= await SmallMap.of(stage);
    if (known?.key !== n) {
      const beside = await ask(other), rig = await ask(method);
      known = { key: n, rig, beside, regions: (await engines.call("regions", settings(method), WIDTH)) as Uint32Array };
    }
    const { rig, beside, regions } = known, over = pointed();
    const context = canvas(stage, `The map in ${n} regions`);
    map.paint(context);
    // The region under the pointer, or the one that was dragged to.
    const at = over ? Math.min(Math.floor(over.y * HEIGHT), HEIGHT - 1) * WIDTH + Math.min(Math.floor(over.x * WIDTH), WIDTH - 1) : held?.texel;
    const chosen = at === undefined ? -1 : regions[at];
    context.fillStyle = "rgb(255 211 77 / 0.3)";
    if (chosen >= 0) regions.forEach((label, i) => { if (label === chosen) context.fillRect(i % WIDTH, Math.floor(i / WIDTH), 1, 1); });
    context.fillStyle = "rgb(255 255 255 / 0.8)";
    regions.forEach((label, i) => {
      const x = i % WIDTH, below = regions[i + WIDTH] ?? label;
      if (label !== below || label !== regions[i - x + (x + 1) % WIDTH]) context.fillRect(x, Math.floor(i / WIDTH), 1, 1);
    });
    for (const { uv, share } of rig.lights) dot(context, uv, 2 + 8 * Math.sqrt(share), "#ffd34d");
    const percent = (x: number) => `${short(100 * x)} %`, near = aroundBrightest(rig.lights);
    const place = (i: number) => regions[2 * Math.floor(i / COLUMNS) * WIDTH + 2 * (i % COLUMNS)];
    const area = chosen < 0 ? 0 : regions.reduce((sum, label, i) => sum + (label === chosen ? Math.sin(Math.PI * (Math.floor(i / WIDTH) + 0.5) / HEIGHT) : 0), 0) * Math.PI / (4 * HEIGHT * HEIGHT);
    stage.read(chosen < 0 ? null : `${over ? `${map.read([over.x, over.y])}; its` : "The"} region holds ${percent(map.share((i) => place(i) === chosen))} of the light in ${percent(area)} of the directions.`);
    const brightest = near.count > 1 ? `the ${near.count} lights within 2° of the brightest hold` : "the brightest holds";
    stage.say(`${n} light${n > 1 ? "s" : ""} of ${stage.app.envName}; ${brightest} ${percent(near.share)} of its energy. The shading error is ${percent(rig.diffuse)} matte and ${percent(rig.glossy)} glossy; with ${other.replace("-", " ")}, ${percent(beside.diffuse)} and ${percent(beside.glossy)}.`);
    if (method === "variance-minimization") stage.answer(answerOf(n, rig, beside, stage.app.envName));
  });
};

/** Which method has the smaller shading error, as the figure shows it. */
function answerOf(n: number, minimized: { diffuse: number; glossy: number }, cut: { diffuse: number; glossy: number }, map: string): string {
  const compare = (name: string, a: number, b: number) =>
    a === b ? `${name}, both are alike` : `${name}, ${a < b ? "variance minimization" : "median cut"} has ${short(Number((Math.max(a, b) / Math.max(Math.min(a, b), 1e-9)).toPrecision(2)))} times less`;
  return `With ${n} light${n > 1 ? "s" : ""} of ${map}: ${compare("matte", minimized.diffuse, cut.diffuse)}; ${compare("glossy", minimized.glossy, cut.glossy)}. On a map without small bright lights the difference is smaller.`;
}
