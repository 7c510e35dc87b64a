// Step 12: four ways to sample the direct illumination of a sphere, measured with repeats.

import { h, short, withError } from "../dom";
import { FilmView, luminance } from "../film";
import { pixels } from "../pointer";
import type { Stage } from "../stage";
import { Lab, errorOf, sizeOf, sphere, type Rendered } from "./lab";

/** The four ways at the counts of the lecture, as in the program’s figure: name, counts, the strategy, and one with few samples
 *  at a time for equal time. */
const WAYS = [
  { name: "environment", counts: "100", strategy: "environment:100", few: "environment:4" },
  { name: "reflectance", counts: "75", strategy: "brdf:75", few: "brdf:4" },
  { name: "both", counts: "37 : 37", strategy: "mis:37:37", few: "mis:2:2" },
  { name: "resampling", counts: "15/800", strategy: "sir:15/800", few: "sir:1/53" },
];
/** The engine's time for each way at equal time [ms]. */
const EQUAL_TIME = 250;

/** One repeat of one way. */
interface Run extends Rendered {
  error: number;
}

/** The repeats of each way, by size, share of diffuse reflectance, comparison and name. */
const known = new Map<string, Run[]>();

/** The mean of the runs' values, and its standard error, which takes two runs. */
function mean(runs: Run[], of: (run: Run) => number): [number, number] {
  const m = runs.reduce((sum, run) => sum + of(run), 0) / runs.length;
  const squares = runs.reduce((sum, run) => sum + (of(run) - m) ** 2, 0);
  return [m, runs.length > 1 ? Math.sqrt(squares / (runs.length - 1) / runs.length) : NaN];
}

const shown = ([m, sd]: [number, number]) => (isFinite(sd) ? withError(m, sd) : short(Number(m.toPrecision(2))));

export const fourWays = (stage: Stage) => {
  const by = stage.choice("Compare", [["counts", "at the counts above"], ["time", "at equal time"]]);
  const diffuse = stage.slider("Diffuse share", 0, 0.8, 0.1, 0);
  const repeats = stage.player("Repeats", 1, 12, 3, String);
  const size = sizeOf(stage.app);
  const figures = WAYS.map(({ name, counts }) => {
    const canvas = h("canvas", { width: String(size), height: String(size), role: "img", "aria-label": `A sphere rendered by ${name}`, "data-frame": JSON.stringify(pixels(size, size)) });
    const caption = h("figcaption", {}, `${name}, ${counts}`);
    return { view: new FilmView(canvas, false), caption, figure: h("figure", {}, canvas, caption) };
  });
  stage.drawing.replaceChildren(h("div", { class: "quartet" }, ...figures.map((f) => f.figure)));
  // Dragging moves the border between each picture and the reference.
  let border = 1;
  const pointed = stage.pointer(({ x }) => { border = x / size > 0.98 ? 1 : x / size; });
  const lab = Lab.of(stage.app);
  /** Shows the repeats that there are of those that are wanted. */
  const show = (all: Run[][], truth: Rendered[], timed: boolean, wanted: number) => {
    const n = all[0].length;
    WAYS.forEach(({ name, counts }, i) => {
      const { view, caption } = figures[i], runs = all[i];
      view.set({ exposure: 0, curve: "agx" });
      view.show(0, runs.at(-1)!.film);
      view.show(1, border < 1 ? truth[0].film : null);
      view.set({ divider: border });
      caption.replaceChildren(timed ? name : `${name}, ${counts}`, h("br"), `error ${shown(mean(runs, (run) => run.error))}`, h("br"), `${shown(mean(runs, (run) => run.time / 1000))} s`);
    });
    const rays = WAYS.map(({ name }, i) => `${name} ${short(Number((mean(all[i], (run) => run.rays)[0] / 1000).toPrecision(3)))} thousand`);
    stage.say(`Errors are mean relative squared errors of the pixels, and times are the engine’s alone. Both are means of ${n === wanted ? n : `${n} of ${wanted}`} repeat${n > 1 ? "s with their standard errors" : ", too few for a standard error"}. Shadow rays: ${rays.join(", ")}.`);
    stage.answer(`${answerOf(all, timed)} Diffuse reflectance hurts reflectance sampling most, because its rays then go everywhere.`);
  };
  stage.draw(async () => {
    const share = diffuse(), timed = by() === "time", n = repeats();
    const truth = await lab.truth(sphere(stage.app, share)), keyOf = (name: string) => `${size} ${share} ${timed} ${name}`, runsOf = ({ name }: { name: string }) => known.get(keyOf(name)) ?? [];
    // A figure that was left, or shows something else by now, renders no more.
    const isStill = () => stage.place.isConnected && share === diffuse() && timed === (by() === "time");
    // All ways have as many repeats at any time, so that the figure compares like with like.
    for (let k = 1; k <= n && isStill(); k++) {
      for (const way of WAYS) {
        const runs = runsOf(way);
        if (runs.length >= k || !isStill()) continue;
        const picture = await (timed ? lab.render(sphere(stage.app, share), way.few, 4096, EQUAL_TIME) : lab.render(sphere(stage.app, share), way.strategy, 1));
        known.set(keyOf(way.name), [...runs, { ...picture, error: errorOf(picture, truth) }]);
      }
      if (isStill()) show(WAYS.map((way) => runsOf(way).slice(0, k)), truth, timed, n);
    }
    if (!isStill()) return;
    const all = WAYS.map((way) => runsOf(way).slice(0, n)), over = pointed();
    const at = over && 4 * (Math.min(Math.floor(over.y), size - 1) * size + Math.min(Math.floor(over.x), size - 1));
    if (over && at !== null) {
      stage.mark(...WAYS.flatMap((_, frame) => (frame === over.frame ? [] : [{ ...over, frame }])));
      const [seen, y] = [luminance(all[over.frame].at(-1)!.film.pixels, at), luminance(truth[0].film.pixels, at)];
      stage.read(`Under the pointer, ${WAYS[over.frame].name} has ${short(Number(seen.toPrecision(3)))}, the reference ${short(Number(y.toPrecision(3)))}${border < 1 ? "; right of the border is the reference" : "; drag to uncover the reference"}.`);
    } else stage.read(null);
  });
};

/** Which way the figure shows to be best, and whether the repeats suffice to say so. */
function answerOf(all: Run[][], timed: boolean): string {
  const errors = all.map((runs, i) => ({ name: WAYS[i].name, error: mean(runs, (run) => run.error), rays: mean(runs, (run) => run.rays)[0] }));
  const ranked = (of: (e: (typeof errors)[number]) => number) => [...errors].sort((a, b) => of(a) - of(b));
  const compare = (where: string, of: (e: (typeof errors)[number]) => number) => {
    const [best, next] = ranked(of), factor = of(next) / of(best);
    // Two standard errors of the quotient.
    const uncertainty = 2 * factor * Math.hypot(best.error[1] / best.error[0], next.error[1] / next.error[0]);
    if (!isFinite(uncertainty)) return `${where}, ${best.name} has the least error; one repeat does not show how certain that is.`;
    return factor - 1 > uncertainty ? `${where}, ${best.name} has the least error, ${short(Number(factor.toPrecision(2)))} times less than ${next.name} (± ${short(Number(uncertainty.toPrecision(1)))}).`
      : `${where}, ${best.name} and ${next.name} cannot be told apart with ${all[0].length} repeats.`;
  };
  return timed ? `${compare("At equal time", (e) => e.error[0])} The comparison at the counts shows what each ray is worth.`
    : `${compare("For each ray, that is by error times rays", (e) => e.error[0] * e.rays)} Compare at equal time, too: candidates cost time, but no rays.`;
}
