// The program's exposure and tone curves, on the GPU and on the CPU.

export const CURVES = ["agx", "aces", "neutral", "reinhard", "standard"] as const;
export type Curve = (typeof CURVES)[number];
export const CURVE_NAMES: Record<Curve, string> = { agx: "AgX", aces: "ACES", neutral: "Khronos neutral", reinhard: "Reinhard", standard: "standard" };

export const GLSL = `
vec3 aces(vec3 c) {
  mat3 a = mat3(0.59719, 0.07600, 0.02840, 0.35458, 0.90834, 0.13383, 0.04823, 0.01566, 0.83777);
  mat3 b = mat3(1.60475, -0.10208, -0.00327, -0.53108, 1.10813, -0.07276, -0.07367, -0.00605, 1.07602);
  vec3 v = a * min(c, vec3(1e9));
  return b * ((v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.432951) + 0.238081));
}
float agx_shaped(float light) {
  float d = 2.4 * (clamp(log2(max(light, 1e-10) / 0.18), -10.0, 6.5) / 16.5);
  float scale = d < 0.0 ? -0.5656756 : 0.7151983;
  float u = d / scale;
  return pow(max(scale * u / pow(1.0 + u * sqrt(u), 1.0 / 1.5) + pow(0.18, 1.0 / 2.4), 0.0), 2.4);
}
float agx_purity(float y) { return 1.0 - min(pow(y, 0.08), 1.0); }
vec3 agx(vec3 c) {
  mat3 a = mat3(0.54481475, 0.14041695, 0.08881042, 0.3737874, 0.75413756, 0.17887176, 0.081397855, 0.1054455, 0.7323178);
  mat3 b = mat3(1.9648874, -0.29931337, -0.16435274, -0.8559885, 1.326398, -0.23818397, -0.10889892, -0.0270846, 1.4025367);
  vec3 v = a * c;
  vec3 s = vec3(agx_shaped(v.r), agx_shaped(v.g), agx_shaped(v.b));
  float least = min(v.r, min(v.g, v.b)), range = max(v.r, max(v.g, v.b)) - least;
  float low = min(s.r, min(s.g, s.b)), formed = max(s.r, max(s.g, s.b)) - low;
  if (range > 0.0 && formed > 0.0) s = low + formed * mix((v - least) / range, (s - low) / formed, 0.4);
  s = b * s;
  float below = -min(s.r, min(s.g, s.b));
  if (below <= 0.0) return s;
  float y = max(dot(s, vec3(0.2067738, 0.6581298, 0.1350964)), 0.0), raised = y + below;
  return (s + below) * min((y + agx_purity(y) * raised) / (raised + agx_purity(raised) * raised), 1.0);
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

/** The same colors as bytes, written to `out` at `at`. */
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

const agxPurity = (y: number) => 1 - Math.min(y ** 0.08, 1);

function agxShaped(light: number): number {
  const d = (2.4 * Math.min(Math.max(Math.log2(Math.max(light, 1e-10) / 0.18), -10), 6.5)) / 16.5;
  const scale = d < 0 ? -0.5656756 : 0.7151983;
  const u = d / scale;
  return Math.max((scale * u) / (1 + u ** 1.5) ** (1 / 1.5) + 0.18 ** (1 / 2.4), 0) ** 2.4;
}

function agx(c: Color): Color {
  const v = times([0.54481475, 0.3737874, 0.081397855, 0.14041695, 0.75413756, 0.1054455, 0.08881042, 0.17887176, 0.7323178], c);
  let s = v.map(agxShaped) as Color;
  const [least, low] = [Math.min(...v), Math.min(...s)];
  const [range, formed] = [Math.max(...v) - least, Math.max(...s) - low];
  // Mix back six tenths of the hue before the curve.
  if (range > 0 && formed > 0) s = s.map((x, i) => low + 0.6 * formed * ((v[i] - least) / range) + 0.4 * (x - low)) as Color;
  s = times([1.9648874, -0.8559885, -0.10889892, -0.29931337, 1.326398, -0.0270846, -0.16435274, -0.23818397, 1.4025367], s);
  const below = -Math.min(...s);
  if (below <= 0) return s;
  const y = Math.max(0.2067738 * s[0] + 0.6581298 * s[1] + 0.1350964 * s[2], 0);
  const raised = y + below;
  const factor = Math.min((y + agxPurity(y) * raised) / (raised + agxPurity(raised) * raised), 1);
  return s.map((x) => (x + below) * factor) as Color;
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

/** An sRGB byte from linear light in [0, 1], by a sufficiently fine table. */
const ENCODED = Uint8ClampedArray.from({ length: 4097 }, (_, i) => {
  const c = i / 4096;
  return 255 * (c <= 0.0031308 ? 12.92 * c : 1.055 * c ** (1 / 2.4) - 0.055);
});

/** Writes the display bytes of linear R, G, B to `out` at `at`. */
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
