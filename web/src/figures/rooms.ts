// Step 18: a room with a window, and how often each strategy finds it.

import { percentage, short } from "../dom";
import { figureWidth, framed, isPresenting, plot } from "../plot";
import type { Stage } from "../stage";
import { clamp, generator } from "./curves";
import { rowsOf, sizeOf } from "./lab";
import { Pictures } from "./pictures";
import { Plan, ROOM, WAYS, type Way } from "./plan";

const ALL = Object.keys(WAYS) as Way[];
/** The rays' share of the error that is wanted. */
const WANTED = 0.1;

/** Camera samples of each pixel of the pictures, and the rays of each. */
const SAMPLES = 8, each = (rays: number) => Math.max(1, Math.round(rays / SAMPLES));

/** The built-in scene by the strategies, with as many rays each. */
function pictured(stage: Stage): Pictures {
  const of = { scene: "room", material: "", ground: false, probe: "sky", rows: rowsOf(stage.app), rotate: 125, hidesEnvironment: false, size: sizeOf(stage.app) };
  const half = (n: number) => Math.max(1, Math.round(each(n) / 2)), strategies = [
    { name: "light", strategy: (n: number) => `environment:${each(n)}` }, { name: "lobe", strategy: (n: number) => `brdf:${each(n)}` },
    { name: "both", strategy: (n: number) => `mis:${half(n)}:${half(n)}` }, { name: "default, with the window", strategy: (n: number) => `product:${each(n)}` },
  ];
  return new Pictures(stage, of, strategies.map((way) => ({ ...way, samples: () => SAMPLES })), "A room with a window", "the reference");
}

/** The room's section with rays from a point on its floor. */
function section(plan: Plan, rays: (number | null)[], under: number | null): string {
  const width = figureWidth(), scale = Math.min((width - 20) / (ROOM.width + 1), (isPresenting() ? 200 : 270) / (ROOM.height + 0.3)), left = (width - scale * (ROOM.width + 1)) / 2 + scale * 0.8, top = 14, bottom = top + scale * ROOM.height;
  const X = (x: number) => (left + scale * x).toFixed(1), Y = (y: number) => (bottom - scale * y).toFixed(1);
  const line = (angle: number, kind: string) => {
    const [x, y] = plan.end(angle);
    return `<path class="${kind} line" opacity=".7" d="M${X(plan.x)} ${Y(0)}L${X(x)} ${Y(y)}"/>`;
  };
  const all = rays.filter((angle) => angle !== null).map((angle) => line(angle, plan.visible(angle) ? "light" : "shade"));
  const { width: w, height } = ROOM, end = scale * (height + 0.25) + top;
  const walls = `M${X(0)} ${Y(plan.low)}V${Y(0)}H${X(w)}V${Y(height)}H${X(0)}V${Y(plan.high)}`;
  const sunAt = plan.end(plan.sun), frame = framed({ left, right: left + scale * w, top, bottom, xs: [0, w], ys: [0, height] });
  const text = (x: number, y: number, of: string, anchor = "end") => `<text class="name halo" x="${X(x)}" y="${Y(y)}" text-anchor="${anchor}">${of}</text>`;
  /** Outside the room, where no rays are. */
  const nameSun = () => {
    const [x, y] = sunAt;
    if (x < 0) return text(x, y + 0.2, "sun", "middle");
    if (y >= height) return text(x + 0.14, height + 0.05, "sun", "start");
    return x > 0 ? text(x + 0.14, y - 0.05, "sun", "start") : text(x - 0.14, y - 0.05, "sun");
  };
  return `<svg viewBox="0 0 ${width} ${end.toFixed(0)}"${frame} aria-hidden="true"><rect x="${X(0)}" y="${Y(height)}" width="${scale * w}" height="${scale * height}" fill="transparent"/>${all.join("")}${under === null ? "" : line(under, "estimate")}
    <path d="${walls}" class="axis" style="stroke-width: 2.5px"/><path class="light line" style="stroke-width: 4px" d="M${X(0)} ${Y(plan.low)}V${Y(plan.high)}"/>
    <circle class="estimate fill" cx="${X(plan.x)}" cy="${Y(0)}" r="6"/><circle class="light fill" cx="${X(sunAt[0])}" cy="${Y(sunAt[1])}" r="8"/>${nameSun()}${text(-0.1, plan.low - 0.2, "window")}</svg>`;
}

export const roomWithWindow = (stage: Stage) => {
  const rays = stage.player("Rays", 1, 64, 32);
  const way = stage.choice("Rays by", ALL.map((name) => [name, WAYS[name]]));
  const place = stage.slider("Point", 0.3, ROOM.width - 0.3, 0.05, 2.5, (x) => `at ${x} m`);
  const low = stage.slider("Sill", 0.3, 2.4, 0.05, 1, (x) => `${x} m`);
  const size = stage.slider("Window", 0.1, 2, 0.05, 1, (x) => `${x} m`);
  const sun = stage.slider("Sun", -89, 89, 1, 30, (x) => `${Math.abs(x)}° ${x < 0 ? "left" : "right"}`);
  const show = stage.choice("Show", [["section", "a section of a room"], ["scene", "the scene room, rendered"]]);
  let pictures: Pictures | null = null;
  const ends = () => [low(), Math.min(low() + size(), ROOM.height - 0.05)];
  // Dragging moves the sun or the window's nearer edge where it began there, and the point elsewhere.
  let begun: { from: object | null; isSun: boolean } = { from: null, isSun: false };
  const pointed = stage.pointer((at) => {
    const { frame, x, y, from } = at;
    if (show() === "scene") return pictures?.drag(at);
    if (frame !== 0) return;
    const [a, b] = ends();
    const { x: px } = new Plan(place(), a, b, 0), [sx, sy] = new Plan(px, a, b, sun() * Math.PI / 180).end(sun() * Math.PI / 180);
    const isSun = begun.from === from ? begun.isSun : Math.hypot(from.x - clamp(sx, 0, ROOM.width), from.y - sy) < 0.4;
    begun = { from, isSun };
    if (isSun) sun.set(clamp(Math.round(Math.atan2(x - px, Math.max(y, 0.05)) * 180 / Math.PI), -89, 89));
    else if (from.x > 0.4) place.set(clamp(x, 0.3, ROOM.width - 0.3));
    else if (Math.abs(from.y - a) < Math.abs(from.y - b)) low.set(clamp(y, 0.3, 2.4));
    else size.set(clamp(y - a, 0.1, 2));
  });
  stage.draw(async () => {
    const isScene = show() === "scene", n = rays();
    for (const slider of [place, low, size, sun]) stage.show(slider, !isScene);
    if (isScene) {
      const errors = await (pictures ??= pictured(stage)).draw(n, pointed(), () => show() === "scene" && n === rays());
      if (errors) stage.say(`With at most ${SAMPLES * each(n)} rays for each pixel, the relative RMSE is ${percentage(errors[0])} by the light, ${percentage(errors[1])} by the lobe, ${percentage(errors[2])} by both, and ${percentage(errors[3])} by the default strategy, which knows the window.`);
      return;
    }
    const [a, b] = ends(), plan = new Plan(place(), a, b, sun() * Math.PI / 180), random = generator(3), sample = plan.sampler(way() as Way);
    const drawn = Array.from({ length: rays() }, () => sample(random())), over = pointed(), under = over?.frame === 0 ? Math.atan2(over.x - plan.x, Math.max(over.y, 1e-3)) : null;
    const found = ALL.map((name) => ({ name, deviation: plan.deviation(name), share: plan.share(name) }));
    const needed = (deviation: number) => Math.max(1, Number(((deviation / WANTED) ** 2).toPrecision(3)));
    const bars = plot([{ name: "", kind: "estimate", as: "bars", points: found.map(({ deviation }, i) => [i, deviation]) }],
      { x: { name: "", range: [-0.6, ALL.length - 0.4], ticks: ALL.map((_, i) => i), tick: (i) => (figureWidth() < 480 && i === 4 ? "window" : WAYS[ALL[i]]) }, y: { name: "relative standard deviation of one ray", range: [0, Math.max(1, ...found.map(({ deviation }) => deviation)) * 1.05] }, height: 170, presented: 220 });
    stage.svg(section(plan, drawn, under) + bars, "A room with a window: rays from a point on its floor, and the deviation of each strategy");
    const hits = drawn.filter((angle) => angle !== null && plan.visible(angle)).length;
    if (under !== null) stage.read(`${Math.round(Math.abs(under) * 180 / Math.PI)}° from the normal, V = ${plan.visible(under)}, L = ${short(plan.light(under))}, f · cos θ = ${short(plan.lobe(under))}; densities: ${ALL.map((name) => `${WAYS[name]} ${short(plan.density(name, under))}`).join(", ")}.`);
    else {
      const bar = over && found[clamp(Math.round(over.x), 0, ALL.length - 1)];
      stage.read(bar ? `${WAYS[bar.name]}: ${percentage(bar.share)} of the rays leave through the window; relative standard deviation ${short(bar.deviation)}; ${needed(bar.deviation)} rays for an error of 10 %.` : null);
    }
    const own = found.find(({ name }) => name === way())!;
    stage.say(`${hits} of ${drawn.length} rays by ${WAYS[own.name]} leave through the window; ${percentage(own.share)} are expected. Rays for an error of 10 %: ${found.map(({ name, deviation }) => `${WAYS[name]} ${needed(deviation)}`).join(", ")}.`);
    const [least, most] = [found.slice(0, 4).reduce((a, b) => (b.deviation < a.deviation ? b : a)), found.slice(0, 4).reduce((a, b) => (b.deviation > a.deviation ? b : a))], window = found[4];
    stage.answer(`The first four do not know where the window is: here ${WAYS[least.name]} finds it best, with ${percentage(least.share)} of its rays, and ${WAYS[most.name]} worst for its error, with ${percentage(most.share)}. The fewer rays leave through the window, the more are needed: ${needed(least.deviation)} with the best of them, ${needed(window.deviation)} with points on the window. If the sun stands beside the window, sampling the light sends nearly all rays to the wall.`);
  });
};
