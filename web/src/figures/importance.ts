// Step 9, on the sphere: the importance functions of a pixel with their samples, and pictures that follow from two of them.

import { colorBar } from "../direction";
import { color, h, short } from "../dom";
import { FilmView } from "../film";
import { pixels, type Pointed } from "../pointer";
import type { MapPicture } from "../protocol";
import type { Mark, Stage } from "../stage";
import type { Point } from "./curves";
import { Lab, errorOf, sizeOf, sphere, type Rendered } from "./lab";
import { ofAngular, onAngular, type Vector } from "./small_map";

/** Pixels along an edge of an importance function, and its drawing's. */
const TEXELS = 96, DISC = 192;
/** The layers of `importance`: light, reflectance times cosine, visibility, and densities. */
const [LIGHT, REFLECTANCE, VISIBILITY, OF_LIGHT, OF_LOBE, , OF_PRODUCT] = [0, 1, 2, 3, 4, 5, 6];
/** The candidates of each ray that samples the product by resampling. */
const CANDIDATES = 50;
/** The importance functions: name, layer, the strategy that samples it, and its color. */
const FUNCTIONS = [
  { name: "light", layer: OF_LIGHT, strategy: "environment:1", kind: "light" }, { name: "lobe", layer: OF_LOBE, strategy: "brdf:1", kind: "lobe" },
  { name: "product", layer: OF_PRODUCT, strategy: `sir:1/${CANDIDATES}`, kind: "product" },
];
/** What renders the pictures with n rays. */
const PICTURES = [{ name: "the light sampled", strategy: (n: number) => `environment:${n}` }, { name: "the product sampled", strategy: (n: number) => `sir:${n}/${CANDIDATES * n}` }];

/** The direction that is mirrored at a place in [-1, 1]² of the sphere, seen from +z; null outside. */
function mirroredAt([x, y]: Point): Vector | null {
  const z = Math.sqrt(1 - x * x - y * y);
  return z >= 0 ? [2 * z * x, 2 * z * y, 2 * z * z - 1] : null;
}

/** Where the sphere mirrors a direction: its normal there is the half vector. */
const mirroring = ([x, y, z]: Vector): Point => [x / Math.sqrt(2 + 2 * z), y / Math.sqrt(2 + 2 * z)];

/** A place in [-1, 1]² in a picture whose rows count from the top, and the reverse. */
const inPicture = ([x, y]: Point, size: number) => ({ x: size * (1 + x) / 2, y: size * (1 - y) / 2 });
const ofPicture = ({ x, y }: { x: number; y: number }, size: number): Point => [2 * x / size - 1, 1 - 2 * y / size];

const canvas = (size: number, label: string, units = size) => h("canvas", { width: String(size), height: String(size), role: "img", "aria-label": label, "data-frame": JSON.stringify({ ...pixels(units, units), right: size, bottom: size }) });
/** Whether a picture of the sphere is pointed at. */
const isPicture = ({ frame }: Pointed) => frame < PICTURES.length;
const figure = (...children: HTMLElement[]) => h("figure", {}, ...children);

export class Importance {
  private size: number;
  private lab: Lab;
  /** The picked pixel. */
  private at: [number, number];
  private pictures: { view: FilmView; canvas: HTMLCanvasElement; mark: CanvasRenderingContext2D; caption: HTMLElement }[];
  private discs: CanvasRenderingContext2D[];
  private bars = FUNCTIONS.map(() => h("div"));
  readonly element: HTMLElement;
  private known = { pixel: "", layers: null as MapPicture | null };
  private rendered = new Map<string, Rendered>();

  constructor(private stage: Stage) {
    const { app } = stage, size = (this.size = sizeOf(app));
    this.lab = Lab.of(app);
    this.at = [Math.floor(0.36 * size), Math.floor(0.36 * size)];
    this.pictures = PICTURES.map(({ name }) => {
      const picture = h("canvas", { width: String(size), height: String(size), "aria-hidden": "true" }), marks = canvas(DISC, `A sphere, ${name}; drag to pick a pixel`, size);
      return { view: new FilmView(picture, false), canvas: picture, mark: marks.getContext("2d")!, caption: h("figcaption", {}, name) };
    });
    this.discs = FUNCTIONS.map(({ name }) => canvas(DISC, `The importance function of ${name} and its samples`, TEXELS).getContext("2d")!);
    const images = this.pictures.map(({ canvas, mark, caption }) => figure(h("div", { class: "marked" }, canvas, mark.canvas as HTMLCanvasElement), caption));
    this.element = h("div", { class: "importance" }, h("div", { class: "pictures" }, ...images), h("div", { class: "discs" }, ...this.discs.map((disc, i) => figure(disc.canvas as HTMLCanvasElement, this.bars[i], h("figcaption", {}, `density of the ${FUNCTIONS[i].name} [sr⁻¹]`)))));
  }

  /** Picks the pixel under the pointer. */
  drag({ frame, x, y }: Pointed) {
    if (frame < PICTURES.length) this.at = [Math.min(Math.floor(x), this.size - 1), Math.min(Math.floor(y), this.size - 1)];
  }

  async draw(n: number, over: Pointed | null, isStill: () => boolean) {
    const { size, lab } = this, of = sphere(this.stage.app, 0), [x, y] = this.at, pixel = JSON.stringify({ x, y, width: size, height: size, camera: null });
    if (this.known.pixel !== pixel) this.known = { pixel, layers: await lab.ask(of, "importance", pixel, "angular", 2 * TEXELS) };
    const layers = this.known.layers!, samples: Float32Array[] = [];
    for (const { strategy } of FUNCTIONS) samples.push((await lab.ask(of, "samples", pixel, strategy, "angular", n, 1)) as Float32Array);
    FUNCTIONS.forEach(({ layer, kind }, i) => this.disc(i, layers, layer, samples[i], color(kind)));
    this.stage.fill(this.element);
    const wi = over && (isPicture(over) ? mirroredAt(ofPicture(over, size)) : ofAngular(ofPicture(over, TEXELS)));
    this.read(layers, wi, over);
    if (over) this.mark(over, wi);
    const truth = await lab.truth(of), errors: number[] = [];
    for (const [i, { strategy }] of PICTURES.entries()) {
      if (!isStill()) return;
      const name = strategy(n), render = this.rendered.get(name) ?? (await lab.render(of, name, 1));
      this.rendered.set(name, render);
      this.picture(i, render);
      errors.push(Math.sqrt(Math.max(errorOf(render, truth), 0)));
    }
    const integral = layers.width ? layers.integrals[OF_PRODUCT].toFixed(2) : null;
    this.stage.say(`With ${n} ray${n > 1 ? "s" : ""} for each pixel, the picture’s relative RMSE is ${short(errors[0])} where the light is sampled and ${short(errors[1])} where the product is. ${integral ? `At pixel ${x}, ${y}, ∫ p of the product is ${integral}.` : "The picked pixel shows no surface."} Drag over a picture to pick a pixel.`);
  }

  /** Marks the direction under the pointer in the other pictures: in the densities, and where the spheres mirror it. */
  private mark(over: Pointed, wi: Vector | null) {
    const onSphere = isPicture(over) ? over : wi && inPicture(mirroring(wi), this.size), onDisc = wi && inPicture(onAngular(wi), TEXELS);
    const marks: Mark[] = [];
    if (onSphere) PICTURES.forEach((_, frame) => marks.push({ frame, x: onSphere.x, y: onSphere.y }));
    if (onDisc) FUNCTIONS.forEach((_, k) => marks.push({ frame: PICTURES.length + k, ...onDisc }));
    this.stage.mark(...marks.filter(({ frame }) => frame !== over.frame));
  }

  private picture(i: number, { film }: Rendered) {
    const { view, mark } = this.pictures[i], scale = DISC / this.size, [x, y] = this.at;
    view.set({ exposure: 0, curve: "agx" });
    view.show(0, film);
    mark.clearRect(0, 0, DISC, DISC);
    for (const [width, style] of [[4, "#000"], [2, "#ffd34d"]] as const) {
      mark.lineWidth = width;
      mark.strokeStyle = style;
      mark.beginPath();
      mark.arc((x + 0.5) * scale, (y + 0.5) * scale, 6, 0, 2 * Math.PI);
      mark.stroke();
    }
  }

  /** Draws a density and its samples; brighter is larger, full at its 99th percentile, or else a lamp would hide the rest. */
  private disc(k: number, { width, pixels }: MapPicture, layer: number, samples: Float32Array, style: string) {
    const context = this.discs[k];
    context.fillStyle = "#000";
    context.fillRect(0, 0, DISC, DISC);
    if (!width) return;
    const n = width * width, density = pixels.subarray(layer * n, (layer + 1) * n), sorted = density.filter((p) => p > 0).sort();
    const most = sorted[Math.floor(0.99 * (sorted.length - 1))] || 1, small = h("canvas", { width: String(width), height: String(width) }), inner = small.getContext("2d")!;
    const image = inner.createImageData(width, width);
    colorBar(this.bars[k], `Density of the ${FUNCTIONS[k].name}`, "linear-gradient(to right, #000, rgb(200 200 200))", [[0, "0"], [1, `${short(Number(most.toPrecision(2)))} or more`]]);
    density.forEach((p, i) => image.data.fill(200 * Math.sqrt(Math.min(p / most, 1)), 4 * i, 4 * i + 3).fill(255, 4 * i + 3, 4 * i + 4));
    inner.putImageData(image, 0, 0);
    context.drawImage(small, 0, 0, DISC, DISC);
    context.fillStyle = style;
    context.strokeStyle = "#fff";
    for (let i = 0; i < samples.length; i += 4) {
      context.beginPath();
      context.arc(samples[i] * DISC, samples[i + 1] * DISC, 2.5, 0, 2 * Math.PI);
      context.fill();
      context.stroke();
    }
  }

  private read({ width, pixels }: MapPicture, wi: Vector | null, over: Pointed | null) {
    if (!over || (!wi && !isPicture(over))) return this.stage.read(null);
    if (isPicture(over)) return this.stage.read(`Column ${Math.floor(over.x)}, row ${Math.min(Math.floor(over.y), this.size - 1)}${wi ? ", which mirrors the marked direction" : ""}: drag to pick the pixel whose densities are shown.`);
    if (!width) return this.stage.read(null);
    const { x, y } = inPicture(onAngular(wi!), width), at = (c: number) => Math.min(Math.floor(c), width - 1), i = at(y) * width + at(x);
    const of = (layer: number) => short(pixels[layer * width * width + i]);
    this.stage.read(`In this direction, L = ${of(LIGHT)}, f · cos θ = ${of(REFLECTANCE)}, V = ${of(VISIBILITY)}; densities: light ${of(OF_LIGHT)}, lobe ${of(OF_LOBE)}, product ${of(OF_PRODUCT)} per steradian. The sphere mirrors it at the marks.`);
  }
}
