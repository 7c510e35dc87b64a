// What goes into the functions of the package and what comes out of them.

/** A vector, or a color in linear Rec. 709. */
export type Triple = [number, number, number];

/**
 * A file: its bytes, a `File` or `Blob`, or where it is. In Node, a string that is no URL is a path; in a browser, it is a URL
 * relative to the page.
 */
export type Source = ArrayBuffer | Uint8Array | Blob | URL | string;

/** A map that the package can make itself. */
export interface BuiltinMap {
  builtin: "sky" | "studio" | "cathedral" | "constant";
}

/** A scene that the package can make itself, such as `{ builtin: "spheres" }`. */
export interface BuiltinScene {
  builtin: string;
}

/** A program, for how it orients a lat-long map. */
export type Convention =
  "blender" | "mitsuba" | "pbrt" | "usd" | "gltf" | "three" | "babylon" | "unreal" | "unity" | "godot" | "bevy" | "filament" | "playcanvas" | "radiance" | "nvdiffrec";

/** The options of `load`. */
export interface LoadOptions {
  /** The name of the file, for messages. Default: that of the `File` or URL. */
  name?: string;
  /** Turns the map about the up axis, counterclockwise as seen from above [degrees]. Default: 0. */
  rotate?: number;
  /**
   * Orients the map as in this program. With `"three"`, directions are those of a scene of three.js whose background is the same
   * picture. Default: the center of the map is toward −Z, or toward +Y if z is up.
   */
  convention?: Convention;
  /** A factor on the radiance, ≥ 0. Default: 1. */
  scale?: number;
  /** A further factor on the radiance, 2^exposure [stops]. Default: 0. */
  exposure?: number;
  /** The axis that the top of the map points to. Default: `"y"`, in `render` that of the scene. */
  up?: "y" | "z";
  /** The layout, such as `"lat-long"`, `"angular"` or `"cross-vertical"`. Default: inferred from the file. */
  mapping?: string;
  /** The layer of an OpenEXR file. Default: inferred from the file. */
  layer?: string;
  /** Rejects negative, NaN and infinite texels instead of repairing them with a warning. Default: false. */
  strict?: boolean;
  /** How many columns and rows of a Radiance or OpenEXR file become one, such as 4 for a map of 16k. Default: 1. */
  reduce?: number;
  /** Rows of a built-in map, in [1, 4096]. Default: 512. */
  rows?: number;
}

/** The options of `lights`. Without `n` and `error`, light that `sun` and `lamps` leave stays on the map, the residual. */
export interface LightsOptions {
  /** The number of lights, those of `sun` and `lamps` included, at least 1. Default: 64, or only those of `sun` and `lamps`. */
  n?: number;
  /** Uses the fewest lights whose shading errors are at most this [%], instead of `n`. */
  error?: number;
  /** Extracts the sun first: the brightest compact source no wider than 14°. Default: false. */
  sun?: boolean;
  /** Extracts up to so many lamps and windows: compact bright sources no wider than 56°. Default: 0. */
  lamps?: number;
  /** How light beside sun and lamps is divided. Default: `"variance-minimization"`. */
  method?: "variance-minimization" | "variance-minimization:2009" | "median-cut";
  /** Leaves lights with a smaller share of the map's light on it, in [0, 1]. Default: 0.001 for sun and lamps, 0 for others. */
  minShare?: number;
  /** Returns what the lights leave of the map as `residual`. Default: false. */
  residual?: boolean;
  /** Measures `error` of the result, which takes longer. Default: false. */
  measure?: boolean;
}

/** A distant light. */
export interface Light {
  /** `sun`, `lamp_1`, …, `light_1`, …. */
  name: string;
  kind: "sun" | "lamp" | "region";
  /** The unit vector toward the light. */
  direction: Triple;
  /**
   * ∫ L dω [W·m⁻², in units of the map]: the irradiance of a surface that faces the light. A surface of albedo ρ and normal n has
   * the radiance ρ/π · irradiance · max(0, n · direction).
   */
  irradiance: Triple;
  /** `irradiance` divided by `intensity`, so that the largest channel is 1. */
  color: Triple;
  /** The largest channel of `irradiance`; what three.js names the intensity of a `DirectionalLight`. */
  intensity: number;
  /** The radius [rad], in [0, π], of the uniformly bright disc with the same variance. */
  angularRadius: number;
  /** The share of the map's luminance, in [0, 1]. */
  share: number;
  /** The solid angle of its part of the map [sr]. */
  solidAngle: number;
}

/** Lights, and what they leave of the map. */
export interface Rig {
  /** The sun, lamps and others, each kind in descending order of luminance. */
  lights: Light[];
  /** How the map stands: its `up` and its `rotation`. */
  orientation: { up: "y" | "z"; rotation: number };
  /** The map without the light of `lights`, if `residual` was asked for and there is any. */
  residual: LightMap | null;
  /** The harmonics of the residual, as those of `sh`; `null` if the lights have all the light. */
  harmonics: Float32Array | null;
  /** The relative errors of shading of a matte and a glossy surface, if `measure` or `error` asked for them; 0.01 is 1 %. */
  error: { diffuse: number; glossy: number } | null;
}

/** The options of `sg`. */
export interface SgOptions {
  /** The most lobes, in [1, 1024]. Default: 64. */
  n?: number;
}

/** A map as a sum of spherical Gaussians. */
export interface SphericalGaussians {
  /** The number of lobes, K. */
  n: number;
  /**
   * 7 numbers a lobe: the unit axis x, y, z, the sharpness λ, and the amplitude r, g, b [W·m⁻²·sr⁻¹]. Radiance from w is
   * Σ amplitude · exp(λ (axis · w − 1)).
   */
  lobes: Float32Array;
  /** Whether the first lobe is the sun. */
  hasSun: boolean;
}

/** An engine that prefiltered light is made for. */
export type Engine = "three" | "filament" | "babylon" | "godot" | "bevy" | "unreal" | "playcanvas";

/** The options of `ibl`. */
export interface IblOptions {
  /** How texels cover the sphere: six faces, or one square of equal areas with +Y at its center. Default: `"cube"`. */
  layout?: "cube" | "octahedral";
  /** Columns of a face in the first level, in [1, 4096]. Default: 256. */
  size?: number;
  /**
   * The engine, which decides how the map stands, the roughness of each level and the terms of the table. Default: the map is
   * looked up with the world direction, and roughness is level / (levels − 1).
   */
  for?: Engine;
  /** What is done with the sun; `clamp:X` clamps all radiance to X. Default: `"keep"`. */
  sun?: "keep" | "remove" | `clamp:${number}`;
  /** Whether a window removes the rings of the harmonics where their irradiance would be negative. Default: `true`. */
  shWindow?: boolean;
  /** The format of texels: 4 bytes up to 65408, or 8 bytes up to 65504. Default: `"rgb9e5"`. */
  texels?: "rgb9e5" | "half";
  /** The kind of file. Default: `"ktx2"`. */
  container?: "ktx2" | "dds";
}

/** Prefiltered light, as files. */
export interface PrefilteredLight {
  /** The cube of radiance, with a level for each roughness. */
  radiance: Uint8Array;
  /** The cube of irradiance over π. */
  irradiance: Uint8Array;
  /** The table of the BRDF, the second factor of the split sum. */
  brdf: Uint8Array;
  /** The columns and the perceptual roughness, in [0, 1], of each level of `radiance`. */
  levels: { size: number; roughness: number }[];
  /** The harmonics, as those of `sh`, in the frame in which the cubes are looked up. */
  harmonics: Float32Array;
  /** The weight of degrees 1 and 2 in the window that the harmonics went through, in [0, 1]; 1 without a window. */
  harmonicsWindow: number;
  /** What the files do not hold of the light, a sentence each. */
  warnings: string[];
}

/** A perspective camera, in the units of the scene. */
export interface Camera {
  origin: Triple;
  target: Triple;
  /** Default: the scene's up axis. */
  up?: Triple;
  /** The vertical field of view [degrees], in (0, 180). Default: 35. */
  fov?: number;
}

/** The options of `render`. */
export interface RenderOptions {
  /** The name of the scene's file, whose extension is its format. Default: that of the `File` or URL, or else `scene.glb`. */
  name?: string;
  /** Files that the scene refers to, by the paths that it names. */
  files?: Record<string, Source>;
  /** Columns, in [1, 8192]. Default: 512. */
  width?: number;
  /** Rows, in [1, 8192]. Default: 512. */
  height?: number;
  /** Samples of a pixel, at least 1; with the strategy `product` in the mean. Default: 32. */
  spp?: number;
  /** The strategy, as `--strategy` of the program: `product`, `mis:2:2`, `environment`, …. Default: `"product"`. */
  strategy?: string;
  /** The same seed gives the same picture. Default: 0. */
  seed?: number;
  /** Default: the first camera of the scene, or one framed to it. */
  camera?: Camera;
  /** Shows the map behind the scene; otherwise the picture has alpha. Default: true. */
  background?: boolean;
  /** Puts the scene on a large gray ground. Default: false. */
  ground?: boolean;
  /** Replaces the scene's materials, as `--material` of the program: `diffuse:0.5`, `ggx:0.3`, …. */
  material?: string;
  /** The exposure of `pixels` [stops]. Default: automatic. */
  exposure?: number;
  /** The tone curve of `pixels`. Default: `"agx"`. */
  tone?: "standard" | "reinhard" | "aces" | "agx" | "neutral";
  /** Gets the share that is done, in [0, 1], every 100 ms. */
  onProgress?: (share: number) => void;
}

/** A picture. */
export interface Picture {
  width: number;
  height: number;
  /** R, G, B [W·m⁻²·sr⁻¹], linear Rec. 709, multiplied by alpha, and alpha of each pixel, from the top left, row by row. */
  linear: Float32Array;
  /** The same for display: sRGB bytes with straight alpha, as an `ImageData` takes them. */
  pixels: Uint8ClampedArray<ArrayBuffer>;
  /** The exposure of `pixels` [stops]. */
  exposure: number;
  /** The strategy with all its numbers. */
  strategy: string;
  cameraRays: number;
  shadowRays: number;
  /** What of the scene was not used, a sentence each. */
  warnings: string[];
}

/** A map that was loaded. */
export interface LightMap {
  readonly name: string;
  readonly width: number;
  readonly height: number;
  /** The direction of the map's center from −Z, or from +Y if z is up, counterclockwise as seen from above [degrees]. */
  readonly rotation: number;
  /** The axis that the top of the map points to. */
  readonly up: "y" | "z";
  /** Differences between the map and the file's light, a sentence each. */
  readonly warnings: readonly string[];
  /**
   * The radiance [W·m⁻²·sr⁻¹] of the lat-long map, linear Rec. 709, not turned: r, g, b and 1 of each texel, from the top left,
   * row by row. The top row faces up, the center column faces −Z turned by `rotation`, and columns go to the right as seen from
   * inside.
   */
  pixels(): Promise<Float32Array>;
  /** Frees the memory of the map before it is garbage. */
  free(): void;
}

/** A module of WebAssembly, or where it is; a string is a URL, in a browser relative to the page. */
export type ModuleSource = string | URL | ArrayBuffer | Uint8Array<ArrayBuffer> | WebAssembly.Module;

/** How the package works. */
export interface Configuration {
  /** Runs in Workers, so that a page does not freeze. Default: true where there are Workers. */
  worker?: boolean;
  /** The module for maps. Default: `light/engine_bg.wasm` beside the package's code. */
  light?: ModuleSource;
  /** The module for scenes, PNG and JPEG. Default: `full/engine_bg.wasm` beside the package's code. */
  full?: ModuleSource;
}
