// Plots as SVG.

import { short, superscript } from "./dom";
import type { Frame } from "./pointer";

/** The color: of one of several pictures or curves, or of a concept, which has the same color in all figures. */
export type Kind = "first" | "second" | "third" | "shade" | "light" | "lobe" | "visibility" | "product" | "estimate";

export interface Series {
  name: string;
  points: [number, number][];
  kind: Kind;
  /** Draws bars, dots, dots on a line, a dashed line or an area instead of a line; a band covers the range between two values of x; a ribbon is bounded by
   *  its points, which run along its upper edge and back along its lower edge. */
  as?: "line" | "dots" | "bars" | "area" | "band" | "ribbon" | "marked" | "dashed";
}

export interface Axes {
  x: { name: string; log?: boolean; range?: [number, number]; ticks?: number[]; tick?: (x: number) => string };
  y: { name: string; log?: boolean; range?: [number, number]; ticks?: number[] };
  height?: number;
  width?: number;
  /** The height when it is presented: together, a figure's plots of 640 across may have 480 on a screen of 16 : 9. */
  presented?: number;
}

/** The attribute by which the pointer is read, see `onPointer`. */
export const framed = (frame: Frame) => ` data-frame='${JSON.stringify(frame)}'`;

const escape = (text: string) => text.replace(/[&<>]/g, (c) => ({ "&": "&amp;", "<": "&lt;", ">": "&gt;" })[c]!);

function extent(values: number[], log = false): [number, number] {
  const usable = values.filter((v) => isFinite(v) && (!log || v > 0));
  if (!usable.length) return log ? [0.1, 1] : [0, 1];
  let [low, high] = [Math.min(...usable), Math.max(...usable)];
  if (log) {
    [low, high] = [10 ** Math.floor(Math.log10(low)), 10 ** Math.ceil(Math.log10(high))];
    return low === high ? [low, 10 * low] : [low, high];
  }
  return low === high ? [low - 0.5, high + 0.5] : [low, high];
}

function ticksOf([low, high]: [number, number], log = false): number[] {
  if (log) {
    const decades = Math.round(Math.log10(high / low));
    const every = Math.ceil(decades / 6) || 1;
    return Array.from({ length: Math.floor(decades / every) + 1 }, (_, i) => low * 10 ** (i * every));
  }
  const rough = (high - low) / 5;
  const unit = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((k) => k * unit).find((s) => s >= rough)!;
  const first = Math.ceil(low / step - 1e-9) * step;
  return Array.from({ length: Math.floor((high - first) / step + 1e-9) + 1 }, (_, i) => Number((first + i * step).toPrecision(10)));
}

/** Writes all ticks as powers of ten if any tick needs it. */
function labels(ticks: number[], log = false): string[] {
  const isLong = (t: number) => t !== 0 && (Math.abs(t) >= 1e4 || Math.abs(t) < 1e-3);
  const power = (t: number) => (t === 1 || t === 10 ? String(t) : `10${superscript(Math.round(Math.log10(t)))}`);
  return log && ticks.some(isLong) && ticks.every((t) => Math.abs(Math.log10(t) % 1) < 1e-6) ? ticks.map(power) : ticks.map(short);
}

/** The width of a plot's text. */
const widthOf = (() => {
  let context: CanvasRenderingContext2D | null = null;
  return (text: string) => {
    context ??= document.createElement("canvas").getContext("2d")!;
    context.font = `12px ${getComputedStyle(document.documentElement).fontFamily}`;
    return context.measureText(text).width;
  };
})();

/** The legend key of a series, 14 wide, ending at `x`. */
function swatch({ kind, as }: Series, x: number, y: number): string {
  if (as === "dots") return `<circle class="${kind} fill" cx="${x - 7}" cy="${y}" r="3"/>`;
  if (as === "bars" || as === "area" || as === "band" || as === "ribbon") return `<rect class="${kind} fill faint" x="${x - 14}" y="${y - 5}" width="14" height="10"/>`;
  return `<path class="${kind} line${as === "dashed" ? " dashed" : ""}" d="M${x - 14} ${y}h14"/>`;
}

/** Whether the lecture is shown to a room: figures are then large and low, to fit a screen. */
export const isPresenting = () => document.documentElement.hasAttribute("data-presenting");

/** The width of a figure; text keeps its size on a phone. */
export const figureWidth = () => isPresenting() ? 640 : Math.min(640, Math.max(320, document.documentElement.clientWidth - 32));

/** Calls `redraw` when the window's size has changed the width of figures. */
export function onFigureWidth(redraw: () => void) {
  let drawn = figureWidth(), timer = 0;
  addEventListener("resize", () => {
    clearTimeout(timer);
    timer = setTimeout(() => {
      if (figureWidth() === drawn) return;
      drawn = figureWidth();
      redraw();
    }, 100) as unknown as number;
  });
}

/** An SVG plot of series. */
export function plot(series: Series[], axes: Axes): string {
  const width = axes.width ?? figureWidth(), height = isPresenting() && axes.presented || (axes.height ?? 240) * (isPresenting() ? 0.75 : 1);
  const named = series.filter((s) => s.name);
  const ofLegend = named.reduce((sum, s) => sum + widthOf(s.name) + 36, 0);
  const [left, right, bottom] = [58, 14, 38];
  // Put the legend below the axis label if both do not fit side by side.
  const legendAt = left + widthOf(axes.y.name) + ofLegend > width - right ? 30 : 12, top = legendAt + 10;
  const xs = axes.x.range ?? extent(series.flatMap((s) => s.points.map((p) => p[0])), axes.x.log);
  const ys = axes.y.range ?? extent(series.flatMap((s) => s.points.map((p) => p[1])), axes.y.log);
  const share = (v: number, [low, high]: [number, number], log = false) =>
    log ? Math.log(Math.max(v, 1e-300) / low) / Math.log(high / low) : (v - low) / (high - low);
  const X = (v: number) => left + (width - left - right) * share(v, xs, axes.x.log);
  const Y = (v: number) => height - bottom - (height - top - bottom) * Math.min(Math.max(share(v, ys, axes.y.log), -0.02), 1.02);
  const at = (p: [number, number]) => `${X(p[0]).toFixed(1)},${Y(p[1]).toFixed(1)}`;
  const out: string[] = [];
  const ofY = axes.y.ticks ?? ticksOf(ys, axes.y.log), ofX = axes.x.ticks ?? ticksOf(xs, axes.x.log);
  for (const [i, label] of labels(ofY, axes.y.log).entries()) {
    const y = Y(ofY[i]);
    out.push(`<path class="grid" d="M${left} ${y}H${width - right}"/><text x="${left - 7}" y="${y + 4}" text-anchor="end">${label}</text>`);
  }
  for (const [i, label] of (axes.x.tick ? ofX.map(axes.x.tick) : labels(ofX, axes.x.log)).entries()) {
    const t = ofX[i], anchor = X(t) > width - right - 12 ? "end" : "middle";
    out.push(`<text x="${X(t)}" y="${height - bottom + 17}" text-anchor="${anchor}">${escape(label)}</text>`);
  }
  const base = Y(axes.y.log ? ys[0] : Math.max(ys[0], Math.min(0, ys[1])));
  // Lines stay visible above areas.
  const isArea = (s: Series) => s.as === "area" || s.as === "band" || s.as === "ribbon";
  for (const s of [...series.filter(isArea), ...series.filter((s) => !isArea(s))]) {
    const points = s.points.filter(([x, y]) => isFinite(x) && isFinite(y) && (!axes.y.log || y > 0) && (!axes.x.log || x > 0));
    if (!points.length) continue;
    if (s.as === "dots") out.push(...points.map((p) => `<circle class="${s.kind} fill" cx="${X(p[0]).toFixed(1)}" cy="${Y(p[1]).toFixed(1)}" r="${points.length > 200 ? 1.5 : 3}"/>`));
    else if (s.as === "bars") {
      const w = points.length > 1 ? Math.abs(X(points[1][0]) - X(points[0][0])) * 0.9 : 8;
      out.push(...points.map((p) => `<rect class="${s.kind} fill faint" x="${(X(p[0]) - w / 2).toFixed(1)}" y="${Math.min(Y(p[1]), base).toFixed(1)}" width="${w.toFixed(1)}" height="${Math.abs(Y(p[1]) - base).toFixed(1)}"/>`));
    } else if (s.as === "band") {
      const [from, to] = [X(points[0][0]), X(points[points.length - 1][0])];
      out.push(`<rect class="${s.kind} fill faint" x="${from}" y="${top}" width="${to - from}" height="${height - bottom - top}"/>`);
    } else if (s.as === "area") out.push(`<path class="${s.kind} fill faint" d="M${X(points[0][0])},${base}L${points.map(at).join("L")}L${X(points[points.length - 1][0])},${base}Z"/>`);
    else if (s.as === "ribbon") out.push(`<path class="${s.kind} fill faint" d="M${points.map(at).join("L")}Z"/>`);
    else out.push(`<path class="${s.kind} line${s.as === "dashed" ? " dashed" : ""}" d="M${points.map(at).join("L")}"/>`);
    // A line of one point would be invisible.
    if (s.as === "marked" || ((!s.as || s.as === "line" || s.as === "dashed") && points.length === 1)) out.push(...points.map((p) => `<circle class="${s.kind} fill" cx="${X(p[0]).toFixed(1)}" cy="${Y(p[1]).toFixed(1)}" r="3"/>`));
  }
  out.push(`<path class="axis" d="M${left} ${height - bottom}H${width - right}"/>`);
  out.push(`<text x="${(left + width - right) / 2}" y="${height - 4}" text-anchor="middle">${escape(axes.x.name)}</text>`);
  out.push(`<text x="${left}" y="12">${escape(axes.y.name)}</text>`);
  let legend = width - right;
  for (const s of [...named].reverse()) {
    out.push(`<text class="name" x="${legend}" y="${legendAt}" text-anchor="end">${escape(s.name)}</text>`);
    legend -= widthOf(s.name) + 6;
    out.push(swatch(s, legend, legendAt - 4));
    legend -= 30;
  }
  const frame = framed({ left, right: width - right, top, bottom: height - bottom, xs, ys, logs: [!!axes.x.log, !!axes.y.log] });
  return `<svg viewBox="0 0 ${width} ${height}"${frame} aria-hidden="true">${out.join("")}</svg>`;
}

/** The slope of log y over log x by least squares; NaN for fewer than two points. */
export function slope(points: [number, number][]): number {
  const logs = points.filter(([x, y]) => x > 0 && y > 0).map(([x, y]) => [Math.log(x), Math.log(y)]);
  const mean = (i: number) => logs.reduce((sum, p) => sum + p[i], 0) / logs.length;
  const [mx, my] = [mean(0), mean(1)];
  const dot = (f: (p: number[]) => number) => logs.reduce((sum, p) => sum + f(p), 0);
  return logs.length < 2 ? NaN : dot((p) => (p[0] - mx) * (p[1] - my)) / dot((p) => (p[0] - mx) ** 2);
}
