// Steps 14 and 15: the map's division into lights, by a method and by hand.

import { h, short } from "../dom";
import { Film, FilmView } from "../film";
import { plot, type Series } from "../plot";
import type { Mark, Stage } from "../stage";
import { isBuiltinProbe } from "../state";
import type { Point } from "./curves";
import { Detail } from "./detail";
import { sizeOf } from "./lab";
import { Pictures } from "./pictures";
import { Ball, COLUMNS, HEIGHT, SmallMap, WIDTH, canvas, cosine, direction, dot, fromBall, onBall, placeOf } from "./small_map";

type Method = "median-cut" | "variance-minimization" | "variance-minimization:2009";
interface Light { uv: Point; share: number; solidAngle: number; irradiance: number[] }
interface Rig { lights: Light[]; diffuse: number; glossy: number }

const percent = (x: number) => `${short(100 * x)} %`;

const NAMES: Record<Method, string> = { "median-cut": "median cut", "variance-minimization": "variance minimization", "variance-minimization:2009": "the rule of 2009" };
/** The strategy that renders with a method's lights. */
const strategyOf = (method: Method, n: number) => (method === "variance-minimization:2009" ? `variance-minimization:${n}:rule=2009` : `${method}:${n}`);

/** The statue under the lights of some methods; fewer camera samples where there are many lights. */
function underLights(stage: Stage, methods: Method[]): Pictures {
  const { env, rows, rotate } = stage.app.state, of = { scene: "statue", material: "", ground: true, probe: env, rows, rotate, hidesEnvironment: false, size: sizeOf(stage.app) };
  const ways = methods.map((method) => ({ name: NAMES[method], strategy: (n: number) => strategyOf(method, n), samples: (n: number) => Math.max(2, Math.min(16, 512 / n)) }));
  return new Pictures(stage, of, ways, "A statue", "the whole probe");
}

/** The lights within 2° of the brightest light, and their share of the energy. */
function aroundBrightest(lights: Light[]): { count: number; share: number } {
  const brightest = direction(lights.reduce((a, b) => (b.share > a.share ? b : a)).uv);
  const near = lights.filter(({ uv }) => cosine(direction(uv), brightest) > Math.cos(Math.PI / 90));
  return { count: near.length, share: near.reduce((sum, { share }) => sum + share, 0) };
}

/** Light, and its moments on the sphere and on the map, in a part of the map. */
class Part {
  energy = 0;
  private sphere = [0, 0, 0];
  private plane = [0, 0];
  private squares = 0;

  add(light: number, [u, v]: Point) {
    const at = direction([u, v]);
    this.energy += light;
    this.sphere = this.sphere.map((c, k) => c + light * at[k]);
    // Heights and widths have the same unit.
    this.plane = [this.plane[0] + light * u, this.plane[1] + light * v / 2];
    this.squares += light * (u * u + v * v / 4);
  }

  plus(other: Part, sign = 1): Part {
    const sum = new Part();
    sum.energy = this.energy + sign * other.energy;
    sum.sphere = this.sphere.map((c, k) => c + sign * other.sphere[k]);
    sum.plane = this.plane.map((c, k) => c + sign * other.plane[k]);
    sum.squares = this.squares + sign * other.squares;
    return sum;
  }

  /** ∫ L d² dω about the centroid, with chords of the sphere, and with distances on the map. */
  get variance(): number {
    return this.energy > 0 ? Math.max(this.energy - this.sphere.reduce((sum, c) => sum + c * c, 0) / this.energy, 0) : 0;
  }
  get planar(): number {
    return this.energy > 0 ? Math.max(this.squares - this.plane.reduce((sum, c) => sum + c * c, 0) / this.energy, 0) : 0;
  }

  /** The centroid on the sphere. */
  get place(): Point {
    const [x, y, z] = this.sphere, length = Math.hypot(x, y, z) || 1;
    return placeOf([x / length, y / length, z / length]);
  }
}

/** The first cut of the map, at each of its columns. */
class FirstCut {
  readonly halves: [Part, Part][] = [];
  readonly whole: Part;

  constructor(map: SmallMap) {
    const columns = Array.from({ length: COLUMNS }, (_, x) => {
      const part = new Part();
      for (let y = 0; y < COLUMNS / 2; y++) part.add(map.power(y * COLUMNS + x), [(x + 0.5) / COLUMNS, (y + 0.5) / (COLUMNS / 2)]);
      return part;
    });
    this.whole = columns.reduce((sum, part) => sum.plus(part), new Part());
    let left = new Part();
    for (const column of columns.slice(0, -1)) {
      left = left.plus(column);
      this.halves.push([left, this.whole.plus(left, -1)]);
    }
  }

  at(x: number): [Part, Part] {
    return this.halves[Math.min(Math.max(Math.round(x * COLUMNS) - 1, 0), this.halves.length - 1)];
  }

  /** A quantity of the two halves over the place of the cut, and where it is least. */
  curve(of: (a: Part, b: Part) => number): { points: Point[]; least: Point } {
    const points = this.halves.map(([a, b], k): Point => [(k + 1) / COLUMNS, of(a, b)]);
    return { points, least: points.reduce((p, q) => (q[1] < p[1] ? q : p)) };
  }
}

/** Spheres under the probe and under the lights of both methods. */
class Spheres {
  private views: [FilmView, HTMLElement][];
  readonly element: HTMLElement;

  constructor(ball: Ball, names: string[]) {
    const figures = names.map((name) => {
      const element = h("canvas", { width: String(SPHERE), height: String(SPHERE), role: "img", "aria-label": `A matte sphere under ${name}`, "data-frame": JSON.stringify({ left: 0, right: SPHERE, top: 0, bottom: SPHERE, xs: [-1, 1], ys: [-1, 1] }) });
      const caption = h("figcaption", {}, name);
      return { view: new FilmView(element, false), caption, figure: h("figure", {}, element, caption) };
    });
    this.views = figures.map(({ view, caption }) => [view, caption]);
    this.element = h("div", { class: "spheres" }, ball.element, ...figures.map(({ figure }) => figure));
  }

  show(films: Film[], captions: string[]) {
    const exposure = films[0].exposure();
    this.views.forEach(([view, caption], i) => {
      view.set({ exposure, curve: "standard" });
      view.show(0, films[i]);
      caption.textContent = captions[i];
    });
  }
}
/** Pixels along an edge of a sphere's picture, which is drawn twice as large: matte shading is smooth, and the rim is cut. */
const SPHERE = 80;

/** A place of the map after a turn of the light [degrees]. */
const turned = ([u, v]: Point, by: number): Point => [((u - by / 360) % 1 + 1) % 1, v];

/** The place on the map that is pointed at, there, on the sphere of directions, or on a matte sphere, where it faces. The
 *  matte spheres stand under the light as it is turned. */
function placeAt({ frame, x, y }: Mark, turn: number): Point | null {
  if (frame === 0) return [x, y];
  const r = Math.hypot(x, y);
  return frame === 1 ? fromBall([x, y]) : r < 1 ? turned(placeOf([x, y, Math.sqrt(1 - r * r)]), -turn) : null;
}

/** The marks of a place in all pictures but the one that is pointed at; matte spheres are seen from +z. */
function marksOf({ frame }: Mark, place: Point, turn: number): Mark[] {
  const [x, y, z] = direction(turned(place, turn)), ahead = z > 0 ? [2, 3, 4].map((frame) => ({ frame, x, y })) : [], [u, v] = onBall(place);
  return [{ frame: 0, x: place[0], y: place[1] }, { frame: 1, x: u, y: v }, ...ahead].filter((mark) => mark.frame !== frame);
}
const texelOf = ([x, y]: Point) => Math.min(Math.floor(y * HEIGHT), HEIGHT - 1) * WIDTH + Math.min(Math.floor(x * WIDTH), WIDTH - 1);

/** A method's lights of the map, shown with those of the other method. */
export const cuts = (method: Method, other: Method) => (stage: Stage) => {
  const isMinimized = method === "variance-minimization";
  const rounds = stage.player("Lights", 0, 9, 4, (k) => String(2 ** k));
  const shown = stage.choice("Show", [["map", "regions on the map"], ["lights", "the lights alone"], ...(isMinimized ? [["detail", "the brightest light from near"] as [string, string]] : []), ...(isBuiltinProbe(stage.app.state.env) ? [["pictures", "pictures under the lights"] as [string, string]] : [])]);
  const refined = isMinimized ? stage.choice("Regions", [["refined", "joined and moved"], ["rectangles", "rectangles"], ["2009", "rectangles, by the rule of 2009"]]) : () => "refined";
  /** The method with its rule. */
  const own = (): Method => (refined() === "2009" ? "variance-minimization:2009" : method);
  const by = stage.choice("Cut", [["method", `by ${NAMES[method]}`], ["hand", "once, by hand"]]);
  const hand = stage.slider("Cut at", 0.05, 0.95, 0.005, 0.6);
  const ball = new Ball();
  const spheres = new Spheres(ball, isMinimized ? ["the probe", "variance minimization", "median cut"] : []);
  let map: SmallMap | null = null, held: { texel: number } | null = null, first: FirstCut | null = null;
  // Dragging moves the cut, or holds a region, to compare it while the lights play.
  let pictures: Pictures | null = null;
  const pointed = stage.pointer((at) => {
    if (by() !== "hand" && shown() === "detail") return;
    if (by() !== "hand" && shown() === "pictures") pictures?.drag(at);
    else if (by() === "hand") hand.set(Math.min(Math.max(at.x, 0.05), 0.95));
    else {
      const place = placeAt(at, stage.app.state.rotate);
      if (place) held = { texel: texelOf(place) };
    }
  });
  let known: { key: string; rig: Rig; beside: Rig; regions: Uint32Array; films: Film[] } | null = null;
  const settingsOf = (name: Method, n: number, refine: boolean) => JSON.stringify({ method: name, refine, n, sun: false, lamps: 0 });
  /** The methods that are compared: what the step explains, and what became of it. */
  const compared: Method[] = isMinimized ? [other, "variance-minimization:2009", method] : [method];
  let detail: Detail | null = null, counted = { n: 0, counts: [] as number[] };
  const drawDetail = async (map: SmallMap, n: number) => {
    detail ??= new Detail(stage, map);
    if (counted.n !== n) {
      const divisions = [];
      for (const name of compared) {
        const settings = settingsOf(name, n, name === method);
        divisions.push({ name: NAMES[name], settings, lights: (JSON.parse(await stage.app.engines.call("lights", settings)) as Rig).lights });
      }
      counted = { n, counts: await detail.draw(divisions) };
    }
    stage.fill(detail.element);
    const { counts } = counted, over = pointed();
    if (over) stage.mark(...compared.map((_, frame) => ({ ...over, frame })).filter(({ frame }) => frame !== over.frame));
    stage.read(over && `${map.read(detail.place(over))}.`);
    stage.say(`Of ${n} light${n > 1 ? "s" : ""}, this part of the map has ${compared.map((name, i) => `${counts[i]} by ${NAMES[name]}`).join(", ")}. The light is shown at an eighth, because it is so bright.`);
  };
  const divide = async (n: number) => {
    const { engines } = stage.app, key = `${n} ${refined()}`;
    if (known?.key === key) return known;
    const settings = (name: Method) => settingsOf(name, n, refined() === "refined");
    const ask = async (name: Method): Promise<[Rig, Film[]]> => {
      const rig = JSON.parse(await engines.call("lights", settings(name))) as Rig;
      const both = isMinimized ? (await engines.call("spheres", settings(name), SPHERE, 0)) as Float32Array : new Float32Array(), size = both.length / 2;
      return [rig, size ? [0, 1].map((k) => Film.fromRgb(SPHERE, SPHERE, both.subarray(k * size, (k + 1) * size))) : []];
    };
    const rule = own(), [beside, besideFilms] = await ask(other), [rig, films] = await ask(rule);
    const regions = (await engines.call("regions", settings(rule), WIDTH)) as Uint32Array;
    return (known = { key, rig, beside, regions, films: [...films, ...besideFilms.slice(1)] });
  };
  const drawHand = (map: SmallMap) => {
    first ??= new FirstCut(map);
    const { whole } = first, x = hand(), halves = first.at(x), context = canvas(stage, "The map, cut once by hand");
    map.paint(context);
    context.fillStyle = "rgb(255 211 77 / 0.25)";
    context.fillRect(0, 0, x * WIDTH, HEIGHT);
    context.fillStyle = "#fff";
    context.fillRect(x * WIDTH - 1, 0, 2, HEIGHT);
    for (const half of halves) dot(context, half.place, 2 + 8 * Math.sqrt(half.energy / whole.energy), "#ffd34d");
    const energy = first.curve((a, b) => Math.abs(a.energy - b.energy)), median = energy.least[0];
    const sum = first.curve((a, b) => (a.variance + b.variance) / whole.variance), worse = first.curve((a, b) => Math.max(a.planar, b.planar) / whole.planar);
    const vertical = (at: number): Point[] => [[at, 0], [at, 1.05]];
    const series: Series[] = isMinimized ? [
      { name: "sum, on the sphere", kind: "first", points: sum.points }, { name: "larger, on the map (2009)", kind: "second", points: worse.points },
      { name: "", kind: "first", as: "dots", points: [sum.least] }, { name: "", kind: "second", as: "dots", points: [worse.least] },
      { name: "median cut", kind: "third", as: "dashed", points: vertical(median) },
    ] : [
      { name: "energy left of the cut", kind: "light", points: first.halves.map(([a], k): Point => [(k + 1) / COLUMNS, a.energy / whole.energy]) },
      { name: "median cut", kind: "third", as: "dashed", points: vertical(median) }, { name: "", kind: "light", as: "dots", points: [[median, 0.5]] },
    ];
    stage.svg(plot([...series, { name: "", kind: "shade", points: vertical(x) }], {
      x: { name: "place of the cut; drag it here or on the map", range: [0, 1] }, y: { name: isMinimized ? "variance, relative to the uncut map" : "share", range: [0, 1.05] }, height: 190,
    }), "What a cut leaves on each side, over its place", context.canvas as HTMLCanvasElement, map.bar);
    const over = pointed();
    if (over) stage.mark({ frame: 1 - over.frame, x: over.x, y: over.frame === 0 ? 0 : 0.5 });
    stage.read(over ? `A cut at ${over.x.toFixed(2)} leaves ${percent(first.at(over.x)[0].energy / whole.energy)} of the light on its left.` : null);
    const [a, b] = halves, shares = `At ${x.toFixed(2)}, ${percent(a.energy / whole.energy)} of the light is left of the cut and ${percent(b.energy / whole.energy)} right of it`;
    const at = (p: Point) => `${p[0].toFixed(2)}`;
    stage.say(isMinimized
      ? `${shares}; the sum of the variances on the sphere is ${percent((a.variance + b.variance) / whole.variance)} of the uncut map’s, the larger one on the map ${percent(Math.max(a.planar, b.planar) / whole.planar)}. They are least at ${at(sum.least)} and ${at(worse.least)}; median cut cuts at ${median.toFixed(2)}.`
      : `${shares}. Median cut cuts at ${median.toFixed(2)}.`);
  };
  stage.draw(async () => {
    const isByHand = by() === "hand", n = 2 ** rounds();
    stage.show(hand, isByHand);
    map ??= await SmallMap.of(stage);
    if (isByHand) return drawHand(map);
    if (shown() === "detail") return drawDetail(map, n);
    if (shown() === "pictures") {
      const errors = await (pictures ??= underLights(stage, compared)).draw(n, pointed(), () => shown() === "pictures" && n === 2 ** rounds() && by() !== "hand");
      if (errors) stage.say(`The picture’s relative RMSE with ${n} light${n > 1 ? "s" : ""} is ${errors.map((error, i) => `${percent(error)} by ${NAMES[compared[i]]}`).join(", ")}. Each light casts a hard shadow of its own, so few lights show as steps; at edges, the noise of the camera’s samples counts, too.`);
      return;
    }
    const { rig, beside, regions, films } = await divide(n), at = pointed(), over = at && placeAt(at, stage.app.state.rotate);
    const isAlone = shown() === "lights", context = canvas(stage, isAlone ? `${n} lights` : `The map in ${n} regions`);
    const chosen = over ? regions[texelOf(over)] : held ? regions[held.texel] : -1;
    ball.paint(isAlone ? null : map);
    if (isAlone) {
      context.fillStyle = "#000";
      context.fillRect(0, 0, WIDTH, HEIGHT);
    } else {
      map.paint(context);
      drawRegions(context, regions, chosen);
    }
    for (const { uv, share, irradiance } of rig.lights) {
      const radius = 2 + 8 * Math.sqrt(share), style = isAlone ? colorOf(irradiance) : "#ffd34d";
      dot(context, uv, radius, style);
      ball.dot(uv, radius, style);
    }
    if (isMinimized) spheres.show(films, ["the whole probe", `${NAMES[own()]}: error ${percent(rig.diffuse)}`, `${NAMES[other]}: error ${percent(beside.diffuse)}`]);
    stage.fill(context.canvas as HTMLCanvasElement, map.bar, spheres.element);
    if (at && over) stage.mark(...marksOf(at, over, stage.app.state.rotate));
    const near = aroundBrightest(rig.lights);
    const region = rig.lights[chosen];
    stage.read(region ? `${over ? `${map.read(over)}; its` : "The"} region holds ${percent(region.share)} of the light in ${percent(region.solidAngle / (4 * Math.PI))} of the directions.` : null);
    const brightest = near.count > 1 ? `the ${near.count} lights within 2° of the brightest hold` : "the brightest holds";
    stage.say(`${n} light${n > 1 ? "s" : ""} of ${stage.app.envName}; ${brightest} ${percent(near.share)} of its energy. The shading error is ${percent(rig.diffuse)} matte and ${percent(rig.glossy)} glossy; with ${NAMES[other]}, ${percent(beside.diffuse)} and ${percent(beside.glossy)}.`);
    if (isMinimized) stage.answer(answerOf(n, rig, beside, stage.app.envName, NAMES[own()]));
  });
};

/** Draws the borders of regions, and one of them in yellow. */
function drawRegions(context: CanvasRenderingContext2D, regions: Uint32Array, chosen: number) {
  context.fillStyle = "rgb(255 211 77 / 0.3)";
  if (chosen >= 0) regions.forEach((label, i) => { if (label === chosen) context.fillRect(i % WIDTH, Math.floor(i / WIDTH), 1, 1); });
  context.fillStyle = "rgb(255 255 255 / 0.8)";
  regions.forEach((label, i) => {
    const x = i % WIDTH, below = regions[i + WIDTH] ?? label;
    if (label !== below || label !== regions[i - x + (x + 1) % WIDTH]) context.fillRect(x, Math.floor(i / WIDTH), 1, 1);
  });
}

/** The color of a light, as bright as can be shown. */
function colorOf(irradiance: number[]): string {
  const most = Math.max(...irradiance, 1e-9);
  return `rgb(${irradiance.map((c) => Math.round(255 * Math.max(c / most, 0) ** (1 / 2.2))).join(" ")})`;
}

/** Which method has the smaller shading error, as the figure shows it. */
function answerOf(n: number, minimized: Rig, cut: Rig, map: string, minimizing: string): string {
  const compare = (name: string, a: number, b: number) =>
    a === b ? `${name}, both are alike` : `${name}, ${a < b ? minimizing : "median cut"} has ${short(Number((Math.max(a, b) / Math.max(Math.min(a, b), 1e-9)).toPrecision(2)))} times less error`;
  return `With ${n} light${n > 1 ? "s" : ""} of ${map}: ${compare("matte", minimized.diffuse, cut.diffuse)}; ${compare("glossy", minimized.glossy, cut.glossy)}. On a map without small bright lights the difference is smaller.`;
}
