// Step 16: why stratified samples converge faster than independent ones.

import { percentage, short, signed } from "../dom";
import { figureWidth, framed, isPresenting, plot, slope } from "../plot";
import type { Stage } from "../stage";
import { clamp, generator, type Point } from "./curves";
import { HalfPlane, Smooth, deviations, variances, type Integrand } from "./strata";

/** The strata per side in the plot of the error; slopes are of the later ones, where an edge crosses many strata. */
const SIDES = [1, 2, 3, 4, 6, 8, 11, 16, 23, 32];
const LATER = 8;

/** The square of samples: the integrand, the strata that contribute to the error, and a sample in each. */
function square(f: HalfPlane | Smooth, k: number): string {
  const width = figureWidth(), edge = isPresenting() ? 190 : Math.min(280, width - 40), [left, top] = [(width - edge) / 2, 6];
  const X = (x: number) => (left + edge * x).toFixed(1), Y = (y: number) => (top + edge * (1 - y)).toFixed(1);
  const box = (i: number, k: number) => `x="${X(i % k / k)}" y="${Y((Math.floor(i / k) + 1) / k)}" width="${(edge / k).toFixed(2)}" height="${(edge / k).toFixed(2)}"`;
  const fine = 32, shading = f instanceof HalfPlane ? `<path class="light fill faint" d="M${f.polygon.map(([x, y]) => `${X(x)},${Y(y)}`).join("L")}Z"/>`
    : Array.from({ length: fine * fine }, (_, i) => `<rect class="light fill" ${box(i, fine)} fill-opacity="${(0.3 * f.moments(i % fine / fine, Math.floor(i / fine) / fine, 1 / fine)[0]).toFixed(3)}"/>`).join("");
  const all = variances(f, k), most = Math.max(...all, 1e-12);
  const uncertain = all.map((v, i) => (v > 1e-9 ? `<rect class="estimate fill" ${box(i, k)} fill-opacity="${(0.45 * Math.sqrt(v / most)).toFixed(3)}"/>` : ""));
  const lines = Array.from({ length: k + 1 }, (_, i) => `M${X(i / k)} ${Y(0)}V${Y(1)}M${X(0)} ${Y(i / k)}H${X(1)}`);
  const random = generator(11), dots = Array.from({ length: k * k }, (_, i) => {
    const [x, y] = [(i % k + random()) / k, (Math.floor(i / k) + random()) / k];
    const isLit = f instanceof Smooth || f.has(x, y);
    return `<circle class="${isLit ? "light" : "visibility"} fill" cx="${X(x)}" cy="${Y(y)}" r="${k > 16 ? 1.5 : 2.5}"/>`;
  });
  const frame = framed({ left, right: left + edge, top, bottom: top + edge, xs: [0, 1], ys: [0, 1] });
  return `<svg viewBox="0 0 ${width} ${edge + 12}"${frame} aria-hidden="true">${shading}${uncertain.join("")}<path class="grid" fill="none" d="${lines.join("")}"/>${dots.join("")}</svg>`;
}

export const stratification = (stage: Stage) => {
  const sides = stage.player("Strata per side", 1, 32, 8);
  const edge = stage.slider("Edge", 0.1, 0.9, 0.01, 0.55);
  const tilt = stage.slider("Tilt", 0, 90, 1, 35, (x) => `${x}°`);
  const which = stage.choice("Integrand", [["edge", "a shadow’s edge"], ["smooth", "smooth light"]]);
  const pointed = stage.pointer(({ frame, x, y }) => {
    const { a, b } = new HalfPlane(edge(), tilt());
    if (frame === 0) edge.set(clamp((a * x + b * y) / (a + b), 0.1, 0.9));
  });
  stage.draw(() => {
    const isEdge = which() === "edge", f = isEdge ? new HalfPlane(edge(), tilt()) : new Smooth(), k = sides(), n = k * k;
    for (const slider of [edge, tilt]) stage.show(slider, isEdge);
    const all = SIDES.map((k) => ({ n: k * k, ...deviations(f as Integrand, k) })), now = deviations(f, k);
    const curve = (of: "stratified" | "random"): Point[] => all.map((at) => [at.n, at[of]]);
    const steep = slope(curve("stratified").filter(([n]) => n >= LATER * LATER));
    const error = plot([
      { name: "random: slope −½", kind: "shade", points: curve("random") }, { name: `stratified: slope ${signed(steep)}`, kind: "estimate", as: "marked", points: curve("stratified") },
      { name: "", kind: "light", as: "dots", points: [[n, now.stratified]] },
    ], { x: { name: "samples N", log: true, range: [1, 1024], ticks: [1, 4, 16, 64, 256, 1024], tick: String }, y: { name: "standard deviation", log: true }, height: 220, presented: 280 });
    stage.svg(square(f, k) + error, "Strata with a sample in each, those that contribute to the error, and the error over the number of samples");
    const cells = variances(f, k), active = cells.filter((v) => v > 1e-9).length, over = pointed();
    if (over?.frame === 0) {
      const i = Math.min(Math.floor(over.y * k), k - 1) * k + Math.min(Math.floor(over.x * k), k - 1), [mean] = f.moments(i % k / k, Math.floor(i / k) / k, 1 / k);
      stage.read(`This stratum has the mean ${mean.toFixed(3)} and the variance ${short(cells[i])}: ${percentage(cells[i] / (cells.reduce((a, b) => a + b, 0) || 1))} of all.`);
    } else {
      const at = over && all.findLast((at) => at.n <= over.x * 1.01);
      stage.read(at ? `N = ${at.n}: stratified ${short(at.stratified)}, random ${short(at.random)}.` : null);
    }
    stage.say(`N = ${n}: the standard deviation is ${short(now.stratified)} with a sample in each stratum and ${short(now.random)} at random${now.stratified > 0 ? `, ${short(now.random / now.stratified)} times more` : ""}. ${active} of ${n} strata contribute.`);
    stage.answer(isEdge
      ? `Those that the edge crosses: here ${active} of ${n}, ${percentage(active / n)}. With k strata per side it crosses about k of the k² strata, so their share falls as 1/√N, and the error with the power −¾ instead of −½; the slope here is ${signed(steep)}. An edge along the strata crosses them in one row only, each with the same share.`
      : `All of them, but each less and less: within a stratum, smooth light varies in proportion to its width. The variance of each falls as 1/N, and the error with the power −1; the slope here is ${signed(steep)}.`);
  });
};
