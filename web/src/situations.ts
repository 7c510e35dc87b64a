// Where the page's other panels show what a step of the lecture is about.

import type { State } from "./state";

export interface Situation {
  /** What is seen there. */
  name: string;
  change: Partial<State>;
}

/** What all situations begin with. */
const PLAIN: Partial<State> = { scene: "sphere", material: "", materials: {}, ground: false, hide: false, env: "sky", rotate: 125, ev: 0, scale: 1, camera: null, exposure: null, beside: "", equal: "rays", view: "picture", mapping: "lat-long", layer: "" };
const PHONG = "phong:50:1:0", BRUSHED = "ward:0.3:0.08:0.9";

/** A pixel in the middle of the upper left of the scene, as a share of the picture's size. */
const pixel = (size: number, x = 0.42, y = 0.42): Partial<State> => ({ size, pixel: [Math.floor(x * size), Math.floor(y * size)] });
const picture = (name: string, change: Partial<State>): Situation => ({ name: `Picture: ${name}`, change: { ...PLAIN, panel: "picture", ...change } });
const map = (name: string, change: Partial<State>): Situation => ({ name: `Map: ${name}`, change: { ...PLAIN, panel: "map", ...pixel(320), ...change } });
const xray = (name: string, change: Partial<State>): Situation => ({ name: `X-ray: ${name}`, change: { ...PLAIN, panel: "xray", ...pixel(320), ...change } });
const lights = (name: string, change: Partial<State>): Situation => ({ name: `Lights: ${name}`, change: { ...PLAIN, panel: "lights", sun: false, leave: false, ...change } });

/** The situations of each step. */
export const SITUATIONS: Situation[][] = [
  [picture("the error of a picture falls", { env: "studio", strategy: "brdf:1", spp: 64, size: 320 })],
  [map("the density of a Phong lobe", { material: PHONG, strategy: "brdf:1", layer: "brdf", samples: 6 })],
  [picture("brushed metal", { material: BRUSHED, strategy: "mis:1:1", size: 320 }), map("the density of its lobe", { material: BRUSHED, strategy: "brdf:1", layer: "brdf", samples: 6 })],
  [xray("the rays of a microfacet lobe", { material: "ggx:0.3:gold", strategy: "brdf:1", compared: "brdf:1" })],
  [map("samples of the environment", { strategy: "environment:1", samples: 5 })],
  [map("the density of the environment", { strategy: "environment:1", layer: "environment", samples: 6 })],
  [map("samples of a matte point", { strategy: "environment:1", layer: "environment", samples: 7 }), picture("a matte sphere and a shiny one", { scene: "spheres", strategy: "environment:4", size: 320, spp: 8 })],
  [picture("one technique beside both", { scene: "spheres", strategy: "brdf:2", beside: "mis:1:1", size: 320, spp: 8 }), xray("three densities of a pixel", { material: "ggx:0.3:gold", strategy: "mis:1:1", compared: "brdf:1 environment:1 mis:1:1" })],
  [picture("both factors beside their product", { scene: "statue", strategy: "mis:1:1", beside: "product:8", size: 320, spp: 16 }), map("the product of a pixel", { scene: "statue", material: PHONG, strategy: "product:8", layer: "target", samples: 5 }), xray("what remains of the variance", { scene: "statue", strategy: "product:8", compared: "brdf:1 environment:1 product:8" })],
  [map("rays after rejection", { scene: "statue", material: PHONG, strategy: "rejection:16", layer: "rejection", samples: 4 })],
  [map("rays after resampling", { scene: "statue", material: PHONG, strategy: "sir:2/32", layer: "sir", samples: 5 }), xray("few candidates", { scene: "statue", strategy: "sir:2/32", compared: "product:8" })],
  [picture("two of the four ways at equal rays", { scene: "sphere-orthographic", material: PHONG, env: "cathedral", rotate: 0, hide: true, strategy: "mis:37:37", beside: "sir:15/800", spp: 1, size: 320 })],
  [picture("fixed lights beside random samples", { scene: "statue", ground: true, strategy: "median-cut:16", beside: "product:8", size: 320, spp: 8 })],
  [lights("the cuts, one by one", { method: "median-cut", refine: false, lights: 16 }), picture("64 lights", { scene: "statue", ground: true, strategy: "median-cut:64", size: 320, spp: 4 })],
  [lights("the regions, one by one", { method: "variance-minimization", refine: false, lights: 16 }), picture("64 lights of each method", { scene: "statue", ground: true, strategy: "median-cut:64", beside: "variance-minimization:64:rule=2009", size: 320, spp: 4 })],
  [picture("stratified samples fall steeper", { env: "studio", strategy: "environment:4", spp: 64, size: 320 })],
  [picture("with learned visibility, and without", { scene: "statue", ground: true, strategy: "sir:8/64", beside: "product:8", size: 320, spp: 8 }), xray("what learned visibility leaves", { scene: "statue", strategy: "product:8", compared: "product:8" })],
  [picture("a room with a window", { scene: "room", strategy: "mis:4:4", beside: "product:8", size: 320, spp: 8 })],
];
