// Steps 6 and 7: rows and columns of the map, and its samples.

import { h, short } from "../dom";
import { figureWidth, framed } from "../plot";
import { drawInto, type Mark, type Stage } from "../stage";
import type { Point } from "./curves";
import { Ball, COLUMNS, HEIGHT, SmallMap, WIDTH, canvas, cosine, direction, dot, fromBall, onBall, placeOf, type Vector } from "./small_map";

/** The rim of a cone about a place's direction. */
function rim(context: CanvasRenderingContext2D, place: Point, angle: number) {
  const axis = direction(place), [u, v] = place, [a, b] = [Math.PI * v, 2 * Math.PI * u];
  const down: Vector = [-Math.cos(a) * Math.sin(b), -Math.sin(a), Math.cos(a) * Math.cos(b)], across: Vector = [-Math.cos(b), 0, -Math.sin(b)];
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

/** The map with its tables beside it: the rows' on the right, and the chosen row's columns below. */
class Tables {
  readonly element = h("div", { class: "tables" });
  private rowPlace = h("div");
  private columnPlace = h("div");

  private keys = h("div", { class: "keys" });

  constructor(map: HTMLCanvasElement, bar: HTMLElement) {
    this.element.append(map, this.rowPlace, this.columnPlace, this.keys, bar);
  }

  /** The probabilities of rows, those without sin θ, and those of the columns of row `y`; `top` ends the axis of rows. */
  show(rows: number[], plain: number[], columns: number[], y: number, top: number) {
    // The map has this size in a figure of this width.
    const whole = figureWidth(), width = TABLE.map * whole, height = width / 2, [across, below] = [TABLE.rows * whole, 96], name = 16;
    const length = (p: number) => Math.min(p / top, 1) * across, unit = height / ROWS;
    const bars = rows.map((p, i) => `<rect class="${i === y ? "light" : "lobe"} fill${i === y ? "" : " faint"}" x="0" y="${(i * unit).toFixed(2)}" width="${length(p).toFixed(1)}" height="${(0.9 * unit).toFixed(2)}"/>`);
    const curve = (of: (i: number) => number) => rows.map((_, i) => `${of(i).toFixed(1)},${((i + 0.5) * unit).toFixed(1)}`).join("L");
    const label = (x: number, at: number, text: string, kind = "") => `<text class="name halo ${kind}" x="${x}" y="${at}">${text}</text>`;
    drawInto(this.rowPlace, `<svg viewBox="0 0 ${across} ${height}"${framed({ left: 0, right: across, top: 0, bottom: height, xs: [0, top], ys: [ROWS, 0] })} aria-hidden="true"><path class="axis" d="M0 0V${height}"/>${bars.join("")}
      <path class="estimate line" d="M${curve((i) => across * Math.sin(Math.PI * (i + 0.5) / ROWS))}"/><path class="light line dashed" d="M${curve((i) => length(plain[i]))}"/></svg>`);
    const most = Math.max(...columns), w = width / columns.length, high = (p: number) => p / most * (below - name);
    drawInto(this.columnPlace, `<svg viewBox="0 0 ${width} ${below}"${framed({ left: 0, right: width, top: name, bottom: below, xs: [0, columns.length], ys: [0, most] })} aria-hidden="true">${columns.map((p, x) => `<rect class="light fill faint" x="${(x * w).toFixed(2)}" y="${(below - high(p)).toFixed(1)}" width="${(0.9 * w).toFixed(2)}" height="${high(p).toFixed(1)}"/>`).join("")}
      <path class="axis" d="M0 ${below}H${width}"/>${label(0, 12, `p(x | y = ${y}), up to ${short(most)}`)}</svg>`);
    const swatch = (kind: string, text: string) => `<tspan class="key ${kind}">■</tspan> ${text}`;
    const keys = [swatch("lobe", "p(y)"), swatch("estimate", "sin θ"), swatch("light", "without sin θ")];
    drawInto(this.keys, `<svg viewBox="0 0 ${across} ${below}" aria-hidden="true">${keys.map((key, i) => `<text class="name" x="0" y="${16 + 18 * i}">${key}</text>`).join("")}<text x="0" y="${16 + 18 * keys.length}">p up to ${short(top)}</text></svg>`);
  }
}
/** The widths of the map and of the table of rows, as shares of the figure's. */
const TABLE = { map: 0.72, rows: 0.265 };

export const rowsAndColumns = (stage: Stage) => {
  const weighted = stage.choice("Row weights", [["solid-angle", "with sin θ"], ["alike", "equal (wrong)"]]);
  const chosen = stage.slider("Row", 0, ROWS - 1, 1, 24);
  stage.play(chosen, 1);
  // The row is dragged on the map and in its table.
  const rowAt = (share: number) => Math.min(Math.floor(share), ROWS - 1);
  const pointed = stage.pointer(({ frame, y }) => { if (frame < 2) chosen.set(rowAt(frame === 0 ? y * ROWS : y)); });
  let map: SmallMap | null = null, tables: Tables | null = null;
  stage.draw(async () => {
    const width = 2 * ROWS, y = chosen();
    map ??= await SmallMap.of(stage);
    const ask = async (isWeighted: boolean) => JSON.parse(await stage.app.engines.call("rowProbabilities", width, y, isWeighted)) as { rows: number[]; columns: number[] };
    const [exact, plain] = [await ask(true), await ask(false)], { rows, columns } = weighted() === "solid-angle" ? exact : plain;
    // A row with a sun would flatten all others, so its bar is cut.
    const most = Math.max(...rows), others = [...rows].sort((a, b) => a - b)[Math.floor(0.95 * ROWS)];
    const top = most > 4 * others ? 2 * others : most;
    const context = canvas(stage, `The map, with row ${y}`);
    map.paint(context);
    context.lineWidth = 2;
    context.strokeStyle = "#ffd34d";
    context.strokeRect(1, y / ROWS * HEIGHT, WIDTH - 2, HEIGHT / ROWS);
    tables ??= new Tables(context.canvas as HTMLCanvasElement, map.bar);
    tables.show(rows, plain.rows, columns, y, top);
    stage.fill(tables.element);
    const over = pointed(), row = over ? rowAt(over.frame === 0 ? over.y * ROWS : over.y) : 0, column = over ? Math.min(Math.floor(over.x), width - 1) : 0;
    const ofRow = `row ${row} has sin θ = ${Math.sin(Math.PI * (row + 0.5) / ROWS).toFixed(2)} and probability ${short(rows[row])}, without sin θ ${short(plain.rows[row])}`;
    // A place of the map is a row, and a column of the chosen row.
    const [ofRows, ofColumns] = [{ frame: 1, x: Math.min(rows[row], top), y: row + 0.5 }, { frame: 2, x: over && over.frame === 0 ? over.x * width : column + 0.5, y: 0 }];
    if (over?.frame === 0) stage.mark(ofRows, ...(row === y ? [ofColumns] : []));
    if (over?.frame === 1) stage.mark({ frame: 0, x: 0.5, y: (row + 0.5) / ROWS });
    if (over?.frame === 2) stage.mark({ frame: 0, x: (column + 0.5) / width, y: (y + 0.5) / ROWS }, { ...ofRows, x: Math.min(rows[y], top), y: y + 0.5 });
    stage.read(!over ? null : over.frame === 0 ? `${map.read([over.x, over.y])}; ${ofRow}.`
      : over.frame === 1 ? `${ofRow[0].toUpperCase()}${ofRow.slice(1)}. ∑ p(y) = ${rows.reduce((a, b) => a + b, 0).toFixed(2)}.`
        : `Column ${column} of row ${y} has probability ${short(columns[column])}; the texel has p(y) · p(x | y) = ${short(rows[y] * columns[column])}. ∑ p(x | y) = ${columns.reduce((a, b) => a + b, 0).toFixed(2)}.`);
    const poles = (of: number[]) => short([...of.slice(0, 4), ...of.slice(-4)].reduce((a, b) => a + b, 0));
    const cut = top < most ? ` The bar of row ${rows.indexOf(most)} is cut: it reaches ${short(most)}.` : "";
    stage.say(`Row ${y} has probability ${short(rows[y])}. The four rows at each pole together have ${poles(exact.rows)} with sin θ and ${poles(plain.rows)} without.${cut}`);
    stage.answer(`The rows at the top and bottom: together, the four at each pole have probability ${poles(plain.rows)} instead of ${poles(exact.rows)}. Under a constant sky all rows would be equally likely, although the upper edge of the top row is a single point.`);
  });
};

/** The mark of a direction on the sphere or the map, whichever is not pointed at. */
const markBoth = ({ frame }: Mark, place: Point): Mark[] =>
  (([x, y]) => (frame === 0 ? [{ frame: 1, x, y }] : [{ frame: 0, x: place[0], y: place[1] }]))(onBall(place));

/** The radius of the window that is dragged over the map. */
const WINDOW = Math.PI / 12;

export const environmentSamples = (stage: Stage) => {
  const n = stage.player("Samples", 0, 11, 7, (x) => String(2 ** x));
  const ball = new Ball(), beside = h("div", { class: "spheres" }, ball.element);
  let map: SmallMap | null = null, center: Point | null = null;
  const placeAt = ({ frame, x, y }: Mark): Point | null => (frame === 0 ? [x, y] : fromBall([x, y]));
  const pointed = stage.pointer((at) => { center = placeAt(at) ?? center; });
  stage.draw(async () => {
    const { engines, envName } = stage.app, count = 2 ** n();
    map ??= await SmallMap.of(stage);
    const { places, nInBrightest, shareOfBrightest } = JSON.parse(await engines.call("mapSamples", count, 3)) as { places: Point[]; nInBrightest: number; shareOfBrightest: number };
    const context = canvas(stage, "Environment samples");
    map.paint(context);
    ball.paint(map);
    const at = pointed(), over = at && placeAt(at), middle = center ?? over;
    const isInside = (place: Point) => !!middle && cosine(direction(place), direction(middle)) > Math.cos(WINDOW);
    for (const place of places) {
      const style = isInside(place) ? "#ffd34d" : "#fff";
      dot(context, place, 2.5, style);
      ball.dot(place, 4, style);
    }
    if (middle) rim(context, middle, WINDOW);
    stage.fill(context.canvas as HTMLCanvasElement, map.bar, beside);
    if (at && over) stage.mark(...markBoth(at, over));
    const inside = places.filter(isInside).length;
    const rows = COLUMNS / 2, share = map.share((i) => isInside([(i % COLUMNS + 0.5) / COLUMNS, (Math.floor(i / COLUMNS) + 0.5) / rows]));
    stage.read(middle && over ? `${map.read(over)}; ${inside} of ${count} samples (${short(100 * inside / count)} %) are within 15° of ${center ? "the window’s center" : "it"}, which holds ${short(100 * share)} % of the light.` : null);
    stage.say(`${nInBrightest} of ${count} samples (${short(100 * nInBrightest / count)} %) are in the brightest hundredth of ${envName}, which holds ${short(100 * shareOfBrightest)} % of the light. Drag a window of 15° over the map: the shares of samples and light are alike everywhere.`);
  });
};
