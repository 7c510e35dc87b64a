// Exposure and tone curves as the program has them, on the GPU and without one.

export const CURVES = ["agx", "aces", "neutral", "reinhard", "srgb"] as const;
export type Curve = (typeof CURVES)[number];

export const GLSL = `
vec3 aces(vec3 c) {
  mat3 a = mat3(0.59719, 0.07600, 0.02840, 0.35458, 0.90834, 0.13383, 0.04823, 0.01566, 0.83777);
  mat3 b = mat3(1.60475, -0.10208, -0.00327, -0.53108, 1.10813, -0.07276, -0.07367, -0.00605, 1.07602);
  vec3 v = a * min(c, vec3(1e9));
  return b * ((v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.432951) + 0.238081));
}
vec3 agx(vec3 c) {
  mat3 a = mat3(0.84247906, 0.04232824, 0.042375654, 0.0784336, 0.87846864, 0.0784336, 0.079223745, 0.07916613, 0.87914297);
  mat3 b = mat3(1.196879, -0.05289685, -0.052971635, -0.09802088, 1.1519031, -0.09804345, -0.09902974, -0.09896118, 1.1510737);
  vec3 x = (clamp(log2(max(a * c, vec3(1e-10))), -12.47393, 4.026069) + 12.47393) / 16.499999;
  vec3 s = ((((((15.5 * x - 40.14) * x + 31.96) * x - 6.868) * x + 0.4298) * x + 0.1191) * x - 0.00232);
  return pow(max(b * s, vec3(0.0)), vec3(2.2));
}
vec3 neutral(vec3 c) {
  float least = min(c.r, min(c.g, c.b));
  c -= least < 0.08 ? least - 6.25 * least * least : 0.04;
  float peak = max(c.r, max(c.g, c.b));
  if (peak < 0.76) return c;
  float top = 1.0 - 0.24 * 0.24 / (peak + 0.24 - 0.76);
  return mix(c * (top / peak), vec3(top), 1.0 - 1.0 / (0.15 * (peak - top) + 1.0));
}
vec3 shown(vec3 c, int curve) {
  c = clamp(c, 0.0, 1e30);
  if (curve == 0) c = agx(c);
  if (curve == 1) c = aces(c);
  if (curve == 2) c = neutral(c);
  if (curve == 3) c /= 1.0 + dot(c, vec3(0.2126, 0.7152, 0.0722));
  c = clamp(c, 0.0, 1.0);
  return mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c));
}`;

/** Signed relative errors of luminance as colors: blue is too dark, orange too bright, on a logarithmic scale from 2⁻⁸ to 1. */
export const ERROR_GLSL = `
vec3 error_color(vec3 c, vec3 reference) {
  const vec3 luminance = vec3(0.2126, 0.7152, 0.0722);
  float y = dot(reference, luminance), d = (dot(c, luminance) - y) / sqrt(y * y + 0.01);
  float t = clamp(1.0 + log2(max(abs(d), 1e-9)) / 8.0, 0.0, 1.0);
  return mix(vec3(0.05), d < 0.0 ? vec3(0.35, 0.65, 1.0) : vec3(1.0, 0.55, 0.15), t);
}`;

/** The same as bytes, into `out` at `at`. */
export function errorColor(pixel: Float32Array, reference: Float32Array, out: Uint8ClampedArray, at: number) {
  const luminance = (c: Float32Array) => 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
  const y = luminance(reference), d = (luminance(pixel) - y) / Math.sqrt(y * y + 0.01);
  const t = Math.min(Math.max(1 + Math.log2(Math.max(Math.abs(d), 1e-9)) / 8, 0), 1);
  const full = d < 0 ? [0.35, 0.65, 1] : [1, 0.55, 0.15];
  for (let i = 0; i < 3; i++) out[at + i] = 255 * (0.05 + t * (full[i] - 0.05));
  out[at + 3] = 255;
}

type Color = [number, number, number];
const times = (m: number[], [r, g, b]: Color): Color =>
  [m[0] * r + m[1] * g + m[2] * b, m[3] * r + m[4] * g + m[5] * b, m[6] * r + m[7] * g + m[8] * b];

function aces(c: Color): Color {
  const v = times([0.59719, 0.35458, 0.04823, 0.076, 0.90834, 0.01566, 0.0284, 0.13383, 0.83777], c)
    .map((x) => Math.min(x, 1e9)).map((x) => (x * (x + 0.0245786) - 0.000090537) / (x * (0.983729 * x + 0.432951) + 0.238081)) as Color;
  return times([1.60475, -0.53108, -0.07367, -0.10208, 1.10813, -0.00605, -0.00327, -0.07276, 1.07602], v);
}

function agx(c: Color): Color {
  const inside = times([0.84247906, 0.0784336, 0.079223745, 0.04232824, 0.87846864, 0.07916613, 0.042375654, 0.0784336, 0.87914297], c);
  const shaped = inside.map((v) => {
    const x = (Math.min(Math.max(Math.log2(Math.max(v, 1e-10)), -12.47393), 4.026069) + 12.47393) / 16.499999;
    return [15.5, -40.14, 31.96, -6.868, 0.4298, 0.1191, -0.00232].reduce((sum, k) => sum * x + k, 0);
  }) as Color;
  return times([1.196879, -0.09802088, -0.09902974, -0.05289685, 1.1519031, -0.09896118, -0.052971635, -0.09804345, 1.1510737], shaped)
    .map((v) => Math.max(v, 0) ** 2.2) as Color;
}

function neutral(c: Color): Color {
  const least = Math.min(...c);
  const offset = least < 0.08 ? least - 6.25 * least * least : 0.04;
  const d = c.map((x) => x - offset) as Color;
  const peak = Math.max(...d);
  if (peak < 0.76) return d;
  const top = 1 - (0.24 * 0.24) / (peak + 0.24 - 0.76);
  const white = 1 - 1 / (0.15 * (peak - top) + 1);
  return d.map((x) => x * (top / peak) * (1 - white) + top * white) as Color;
}

/** A byte of sRGB from linear light in [0, 1]: a table is finer than the eye. */
const ENCODED = Uint8ClampedArray.from({ length: 4097 }, (_, i) => {
  const c = i / 4096;
  return 255 * (c <= 0.0031308 ? 12.92 * c : 1.055 * c ** (1 / 2.4) - 0.055);
});

/** Writes the bytes that a screen shows of linear R, G, B into `out` at `at`. */
export function develop(r: number, g: number, b: number, curve: Curve, out: Uint8ClampedArray, at: number) {
  let c: Color = [Math.max(r, 0) || 0, Math.max(g, 0) || 0, Math.max(b, 0) || 0];
  if (curve === "agx") c = agx(c);
  else if (curve === "aces") c = aces(c);
  else if (curve === "neutral") c = neutral(c);
  else if (curve === "reinhard") {
    const y = 1 + 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
    c = [c[0] / y, c[1] / y, c[2] / y];
  }
  for (let i = 0; i < 3; i++) out[at + i] = ENCODED[Math.round(4096 * Math.min(Math.max(c[i], 0), 1))];
  out[at + 3] = 255;
}
