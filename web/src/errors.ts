// The plot of the error over shadow rays: measured against a reference, or, as long as there is none, estimated.

import { $, count, short, signed, withError } from "./dom";
import type { Job } from "./engines";
import { explain } from "./glossary";
import type { Film } from "./film";
import { GroupedMean, jackknife } from "./passes";
import { plot, slope, type Series } from "./plot";
import type { Reference } from "./reference";

/** A picture's mean relative squared error after so many shadow rays. */
export interface Point {
  rays: number;
  error: number;
  /** Whether all pixels have the same passes, so that the point belongs to the slope. */
  isWhole: boolean;
}

/** A measured error, in parts that show how certain it is. */
export interface Measured extends Point {
  parts: GroupedMean;
}

const rmse = ({ rays, error }: Point): [number, number] => [rays, Math.sqrt(error)];

export class ErrorPlot {
  /** Measurements of a job's passes, as long as the reference has the same renders. */
  private known = new WeakMap<Job, { of: string; points: Measured[] }>();

  /** Measures the passes of a picture, and the picture itself where it was stopped within a pass. */
  measure(job: Job, film: Film, reference: Reference): Measured[] {
    if (!reference.isReady) return [];
    const { whole, lattice } = job.passes, of = `${reference.name} ${reference.renders}`;
    let known = this.known.get(job);
    if (known?.of !== of) this.known.set(job, (known = { of, points: [] }));
    const point = (rays: number, values: Float32Array, isWhole: boolean): Measured => {
      const parts = reference.error(values);
      return { rays, error: parts.mean(), isWhole, parts };
    };
    for (const { rays, values } of whole.slice(known.points.length)) known.points.push(point(rays, values, true));
    const { points } = known, { shadowRays } = job.statistics;
    const isCut = job.ended && shadowRays > (points.at(-1)?.rays ?? 0);
    return isCut ? [...points, point(shadowRays, lattice.of(film), false)] : [...points];
  }

  /** Draws the measured errors, or the estimates where nothing is measured yet. */
  show(jobs: Job[], measured: Measured[][], estimates: Point[][], reference: Reference) {
    const isMeasured = measured.length > 0 && measured.every((points) => points.length > 0);
    const place = $("error-plot"), caption = place.parentElement!.querySelector("figcaption")!;
    place.parentElement!.dataset.error = isMeasured ? "measured" : "estimated";
    const names = jobs.map((job) => job.strategy || job.settings.strategy);
    const all: Point[][] = isMeasured ? measured.map((points) => points.filter(({ error }) => error > 2 * reference.noise(error))) : estimates;
    const series: Series[] = all.map((points, i) => ({
      name: isMeasured ? names[i] : `${names[i]}, variance`, kind: i ? "second" : "first", as: isMeasured ? "marked" : "dashed", points: points.map(rmse),
    }));
    if (series.every((s) => !s.points.length)) place.replaceChildren();
    else place.innerHTML = plot([...series, ...guideLine(all)], { x: { name: "shadow rays", log: true, tick: count }, y: { name: isMeasured ? "relative RMSE, measured" : "√ of the relative variance, an estimate", log: true }, height: 200 });
    const found = names.map((name, i) => `${name} ${isMeasured ? ofMeasured(all[i] as Measured[]) : ofEstimate(all[i])}`).join("; ");
    const hidden = isMeasured && measured.some((points, i) => points.length > all[i].length) ? ". Errors that the reference does not resolve are left out" : "";
    const text = isMeasured
      ? `Relative RMSE at whole passes, measured against a reference of ${reference.renders} independent renders with ${reference.samples} samples per pixel in all: ${found}${hidden}.`
      : `An estimate from the variance of the samples, which shows neither bias nor rare bright samples, until ${reference.failure ? `a reference is possible (${reference.failure})` : "the reference is rendered"}: ${found}.`;
    // A term that is being read stays.
    if (caption.textContent !== text) {
      caption.textContent = text;
      explain(caption);
    }
    place.setAttribute("aria-label", text);
  }
}

/** Describes the last error and the slope, each with its standard error. */
function ofMeasured(points: Measured[]): string {
  const last = points.at(-1);
  if (!last) return "has less error than the reference resolves";
  const [error, sd] = jackknife((without) => Math.sqrt(Math.max(last.parts.mean(without), 0)));
  const whole = points.filter(({ isWhole }) => isWhole);
  const [k, ofSlope] = jackknife((without) => slope(whole.map(({ rays, parts }) => [rays, Math.sqrt(Math.max(parts.mean(without), 0))])));
  const fall = isFinite(k) && isFinite(ofSlope) ? `slope ${withError(k, ofSlope)}` : "a slope needs two passes";
  return `has ${short(error)} ± ${short(Number(sd.toPrecision(2)))}, ${fall}`;
}

function ofEstimate(points: Point[]): string {
  const last = points.at(-1), k = slope(points.map(rmse));
  if (!last) return "has too few samples";
  return `has ${short(Math.sqrt(last.error))}, ${!isFinite(k) ? "a slope needs two passes" : `slope ${signed(k)}`}`;
}

/** The slope of independent samples, −½, from the first point of the first line that has two. */
function guideLine(all: Point[][]): Series[] {
  const points = all.map((line) => line.filter(({ rays, error }) => rays > 0 && error > 0).map(rmse)).find((line) => line.length > 1);
  if (!points) return [];
  const [[x, y], [end]] = [points[0], points.at(-1)!];
  return [{ name: "slope −½", kind: "shade", points: [[x, y], [end, y * Math.sqrt(x / end)]] }];
}
