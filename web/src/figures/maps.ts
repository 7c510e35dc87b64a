// Steps 6 and 7: rows and columns of the map, and its samples.

import { short } from "../dom";
import { plot } from "../plot";
import type { Stage } from "../stage";
import type { Point } from "./curves";
import { COLUMNS, HEIGHT, SmallMap, WIDTH, canvas, cosine, direction, dot, type Vector } from "./small_map";

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
