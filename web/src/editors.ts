// Editors of strategies and materials, which the program takes as text.

import { fill, h } from "./dom";

interface Slider {
  kind: "number";
  name: string;
  min: number;
  max: number;
  step: number;
  value: string;
  when?: (values: string[]) => boolean;
}

interface Choice {
  kind: "choice";
  name: string;
  values: [string, string][];
  value: string;
}

/** Linear R, G and B, or one number for all three, in [0, 1]. */
interface Color {
  kind: "color";
  name: string;
  value: string;
  when?: (values: string[]) => boolean;
}

type Field = Slider | Choice | Color;

interface Kind {
  /** The name in the text form. */
  key: string;
  label: string;
  fields: Field[];
  /** Formats the fields' values as text. */
  text(values: string[]): string;
  /** Parses the text's parts after the name into field values; null if the editor cannot express them. */
  parse(words: string[]): string[] | null;
}

const isNumber = (text: string) => text.trim() !== "" && isFinite(Number(text));
const isCount = (text: string) => /^\d+$/.test(text);
const whole = (name: string, value: number, max: number, min = 1): Slider => ({ kind: "number", name, min, max, step: 1, value: String(value) });
const choice = (name: string, values: [string, string][]): Choice => ({ kind: "choice", name, values, value: values[0][0] });
/** The value of an option `name=value` among words. */
const option = (words: string[], name: string) => words.find((word) => word.startsWith(`${name}=`))?.slice(name.length + 1);
const one = (key: string, label: string, name: string, value: number, max: number): Kind => ({
  key, label, fields: [whole(name, value, max)], text: ([n]) => `${key}:${n}`,
  parse: (words) => (words.length <= 1 && words.every(isCount) ? [words[0] ?? String(value)] : null),
});

export const STRATEGIES: Kind[] = [
  one("product", "product", "Max. rays", 8, 64),
  {
    key: "mis", label: "MIS",
    fields: [
      whole("Environment", 1, 128, 0), whole("BRDF", 1, 128, 0),
      choice("Weights", [["power", "power heuristic"], ["balance", "balance heuristic"]]),
      choice("Table", [["", "compensated"], ["no-compensation", "whole map"]]),
    ],
    text: ([m, n, heuristic, table]) =>
      ["mis", ...(m === "0" && n === "0" ? ["1", "0"] : [m, n]), ...(heuristic === "balance" ? ["heuristic=balance"] : []), ...(table ? [table] : [])].join(":"),
    parse: (words) => {
      const numbers = words.filter(isCount), rest = words.filter((word) => !isCount(word));
      const known = rest.every((word) => ["heuristic=balance", "heuristic=power", "no-compensation"].includes(word));
      if (!known || ![0, 2].includes(numbers.length)) return null;
      return [...(numbers.length ? numbers : ["1", "1"]), option(rest, "heuristic") ?? "power", rest.includes("no-compensation") ? "no-compensation" : ""];
    },
  },
  one("environment", "environment", "Rays", 1, 128),
  one("brdf", "BRDF", "Rays", 1, 128),
  {
    key: "sir", label: "resampling (SIR)",
    fields: [
      whole("Rays", 1, 64), choice("Candidates", [["given", "fixed number"], ["pilot", "chosen by a pilot"]]),
      { ...whole("Number", 32, 1024), when: (values) => values[1] === "given" },
      choice("From", [["mixture", "both"], ["environment", "environment"], ["brdf", "BRDF"]]),
      choice("Picks", [["sorted", "sorted"], ["systematic", "systematic"], ["multinomial", "multinomial"], ["reservoir", "reservoirs"]]),
    ],
    text: ([n, by, m, from, picks]) =>
      [`sir:${n}${by === "given" ? `/${Math.max(Number(n), Number(m))}` : ""}`, ...(from === "mixture" ? [] : [`from=${from}`]), ...(picks === "sorted" ? [] : [`resampling=${picks}`])].join(":"),
    parse: (words) => {
      const match = /^(\d+)(?:\/(\d+))?$/.exec(words[0] ?? "1");
      if (!match) return null;
      return [match[1], match[2] ? "given" : "pilot", match[2] ?? "32", option(words, "from") ?? "mixture", option(words, "resampling") ?? "sorted"];
    },
  },
  {
    key: "rejection", label: "rejection",
    fields: [
      choice("Stop", [["tries", "after all tries"], ["rays", "when enough are accepted"]]),
      { ...whole("Accepted", 2, 64), when: (values) => values[0] === "rays" }, whole("Tries", 16, 256),
      choice("From", [["tighter", "the tighter bound"], ["environment", "environment"], ["brdf", "BRDF"]]),
    ],
    text: ([ends, rays, tries, from]) =>
      [ends === "rays" ? `rejection:rays=${rays}:tries=${tries}` : `rejection:${tries}`, ...(from === "tighter" ? [] : [`proposal=${from}`])].join(":"),
    parse: (words) => {
      const rest = words.filter((word) => !isCount(word));
      if (!rest.every((word) => /^(rays|tries|proposal)=/.test(word))) return null;
      const rays = option(rest, "rays");
      return [rays ? "rays" : "tries", rays ?? "2", option(rest, "tries") ?? words.find(isCount) ?? "16", option(rest, "proposal") ?? "tighter"];
    },
  },
  one("median-cut", "median cut", "Lights", 64, 1024),
  {
    key: "variance-minimization", label: "variance minimization",
    fields: [whole("Lights", 64, 1024), choice("Rule", [["sphere", "on the sphere"], ["2009", "of 2009"]])],
    text: ([n, rule]) => `variance-minimization:${n}${rule === "2009" ? ":rule=2009" : ""}`,
    parse: (words) => {
      const numbers = words.filter(isCount), rest = words.filter((word) => !isCount(word));
      if (numbers.length > 1 || !rest.every((word) => /^rule=(sphere|2009)$/.test(word))) return null;
      return [numbers[0] ?? "64", option(rest, "rule") ?? "sphere"];
    },
  },
];

const METALS: [string, string][] = ["gold", "copper", "silver", "aluminum", "chromium", "tungsten"].map((metal) => [metal, metal]);
const unit = (name: string, value: number): Slider => ({ kind: "number", name, min: 0, max: 1, step: 0.01, value: String(value) });
const alpha = (name: string, value: number): Slider => ({ kind: "number", name, min: 0.01, max: 1, step: 0.01, value: String(value) });
const color = (name: string, value: string): Color => ({ kind: "color", name, value });
/** A number with at most four digits. */
const rounded = (x: number) => String(Number(x.toFixed(4)));
/** Parses positional parts; missing parts get defaults, except for the first `least`. */
const inOrder = (least: number, usual: string[]) => (words: string[]) =>
  (words.length >= least && words.length <= usual.length ? usual.map((value, i) => words[i] ?? value) : null);
/** The text without trailing parts that equal the defaults. */
const trimmed = (words: string[], usual: string[], least: number) => {
  let n = words.length;
  while (n > least && words[n - 1] === usual[n - 1]) n--;
  return words.slice(0, n).join(":");
};

/** The parts before a last word "single", and what it says. */
const scattering = (words: string[]): [string[], string] =>
  (words.at(-1) === "single" ? [words.slice(0, -1), "single"] : [words, "multiple"]);
const SCATTERING = choice("Scattering", [["multiple", "multiple"], ["single", "single"]]);
const scattered = (text: string, times: string | undefined) => (times === "single" ? `${text}:single` : text);

const microfacet = (key: string, label: string, more: (typeof SCATTERING)[] = []): Kind => ({
  key, label,
  fields: [
    alpha("Roughness α", 0.2), { kind: "number", name: "αy : αx", min: 0.1, max: 1, step: 0.05, value: "1" },
    { ...choice("Fresnel", [["one", "none"], ["0.04", "dielectric, 4 %"], ["color", "of a color"], ...METALS]), value: "gold" },
    { ...color("Reflectance", "0.9,0.6,0.3"), when: (values) => values[2] === "color" },
    choice("Masking", [["separable", "separable"], ["correlated", "height-correlated"]]),
    ...more,
  ],
  text: ([a, ratio, fresnel, reflectance, masking, times]) => {
    const across = rounded(Math.max(Number(a) * Number(ratio), 0.0001));
    const alphas = Number(ratio) === 1 ? a : `${a},${across}`;
    return scattered(trimmed([key, alphas, fresnel === "color" ? reflectance : fresnel, masking], ["", "", "one", "separable"], 2), times);
  },
  parse: (all) => {
    const [words, times] = more.length > 0 ? scattering(all) : [all, "multiple"];
    const [a, b] = (words[0] ?? "").split(",");
    if (words.length < 1 || words.length > 3 || !isNumber(a)) return null;
    const ratio = b === undefined ? "1" : rounded(Number(b) / Number(a));
    const fresnel = words[1] ?? "one", named = ["one", "0.04", "aluminium", ...METALS.map(([metal]) => metal)].includes(fresnel);
    return [a, ratio, fresnel === "aluminium" ? "aluminum" : named ? fresnel : "color", named ? "0.9,0.6,0.3" : fresnel, words[2] ?? "separable", ...more.map(() => times)];
  },
});

const GLTF = ["0.8,0.5,0.2", "0", "0.3", "1", "1", "0"], WARD = ["0.3", "0.1", "1", "bounded"];

export const MATERIALS: Kind[] = [
  { key: "diffuse", label: "diffuse (Lambert)", fields: [color("Albedo", "0.8,0.5,0.2")], text: ([c]) => `diffuse:${c}`, parse: inOrder(1, ["0.8"]) },
  {
    key: "phong", label: "Phong",
    fields: [{ kind: "number", name: "Exponent", min: 1, max: 500, step: 1, value: "50" }, color("Specular", "0.6"), color("Diffuse", "0.3")],
    text: (values) => trimmed(["phong", ...values], ["", "", "1", "0"], 2), parse: inOrder(1, ["50", "1", "0"]),
  },
  {
    key: "ward", label: "Ward",
    fields: [
      alpha("α along x", 0.3), alpha("α along y", 0.1), color("Reflectance", "0.9"),
      choice("Form", [["bounded", "bounded, 2010"], ["1992", "Ward’s, 1992"], ["duer", "Dür’s, 2006"]]),
    ],
    text: (values) => trimmed(["ward", ...values], ["", ...WARD], 3),
    parse: (words) => inOrder(1, [WARD[0], words[0], WARD[2], WARD[3]])(words),
  },
  microfacet("ggx", "GGX", [SCATTERING]),
  microfacet("beckmann", "Beckmann"),
  {
    key: "gltf", label: "glTF metallic-roughness",
    fields: [color("Base color", GLTF[0]), unit("Metallic", 0), unit("Roughness", 0.3), unit("Specular", 1), color("Its color", "1"), unit("Anisotropy", 0), SCATTERING],
    text: (values) => scattered(trimmed(["gltf", ...values.slice(0, 6)], ["", ...GLTF], 4), values[6]),
    parse: (all) => {
      const [words, times] = scattering(all);
      const values = inOrder(3, GLTF)(words);
      return values && [...values, times];
    },
  },
  { key: "mix", label: "half diffuse, half GGX", fields: [], text: () => "mix", parse: () => [] },
];

const kindOf = (kinds: Kind[], text: string) => kinds.find((kind) => kind.key === text.split(":")[0]);
const usual = (kind: Kind) => kind.text(kind.fields.map(({ value }) => value));

/** Converts linear numbers to `#rrggbb`, and back. */
function toHex(linear: string): string {
  const numbers = linear.split(",").map(Number), channels = numbers.length === 3 ? numbers : [numbers[0], numbers[0], numbers[0]];
  const encoded = (c: number) => 255 * Math.min(Math.max(c <= 0.0031308 ? 12.92 * c : 1.055 * c ** (1 / 2.4) - 0.055, 0), 1);
  return `#${channels.map((c) => Math.round(encoded(c) || 0).toString(16).padStart(2, "0")).join("")}`;
}
function fromHex(hex: string): string {
  const channels = [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16) / 255);
  const linear = channels.map((c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4)).map((c) => String(Number(c.toFixed(3))));
  return linear[0] === linear[1] && linear[1] === linear[2] ? linear[0] : linear.join(",");
}

/** The controls of one kind; `change` receives the text. */
function controls(kind: Kind, text: string, change: (text: string) => void): HTMLElement[] {
  const values = kind.parse(text.split(":").slice(1));
  if (!values) return [h("p", { class: "hint" }, "The controls cannot express this text.")];
  const rows: HTMLElement[] = [];
  const showRows = () => kind.fields.forEach((field, i) => { rows[i].hidden = field.kind !== "choice" && !!field.when && !field.when(values); });
  const tell = (i: number, value: string) => {
    values[i] = value;
    showRows();
    change(kind.text(values));
  };
  kind.fields.forEach((field, i) => rows.push(row(field, values[i], (value) => tell(i, value))));
  showRows();
  return rows;
}

function row(field: Field, value: string, change: (value: string) => void): HTMLElement {
  if (field.kind === "choice") {
    const select = h("select");
    fill(select, field.values.some(([key]) => key === value) ? field.values : [...field.values, value], value);
    select.addEventListener("change", () => change(select.value));
    return h("label", {}, field.name, select);
  }
  if (field.kind === "color") {
    const input = h("input", { type: "color" }), output = h("output", {}, value);
    input.value = toHex(value);
    input.addEventListener("input", () => {
      output.textContent = fromHex(input.value);
      change(fromHex(input.value));
    });
    return h("label", { class: "color" }, field.name, input, output);
  }
  const input = h("input", { type: "range", min: String(Math.min(field.min, Number(value))), max: String(Math.max(field.max, Number(value))), step: String(field.step) });
  input.value = value;
  const output = h("output", {}, value);
  input.addEventListener("input", () => {
    output.textContent = input.value;
    change(input.value);
  });
  return h("label", {}, field.name, input, output);
}

/** Puts an editor of a strategy's text into `place`. */
export function strategyEditor(place: HTMLElement, text: string, change: (text: string) => void) {
  const kind = kindOf(STRATEGIES, text) ?? STRATEGIES[0];
  const select = h("select");
  fill(select, STRATEGIES.map((k) => [k.key, k.label]), kind.key);
  const numbers = h("div", { class: "controls" });
  numbers.append(...controls(kind, text, change));
  select.addEventListener("change", () => {
    const next = kindOf(STRATEGIES, select.value)!;
    numbers.replaceChildren(...controls(next, usual(next), change));
    change(usual(next));
  });
  place.replaceChildren(h("label", {}, "Strategy", select), numbers);
  place.className = "controls";
}

/** Puts controls of a material's text into `place`; `select` holds the model's name. An empty text leaves what the scene
 *  brings, which is called `own` and, if its text `start` is not empty, is where the controls of its model start. */
export function materialEditor(select: HTMLSelectElement, place: HTMLElement, text: string, own: string, start: string, change: (text: string) => void) {
  const kind = text ? kindOf(MATERIALS, text) : undefined;
  const known = !text || kind;
  fill(select, [["", own], ...MATERIALS.map((k): [string, string] => [k.key, k.label]), ...(known ? [] : [["text", "as text"] as [string, string]])], kind?.key ?? (text ? "text" : ""));
  place.className = "controls";
  place.replaceChildren(...(kind ? controls(kind, text, change) : []));
  select.onchange = () => {
    const next = kindOf(MATERIALS, select.value), fresh = !next ? "" : kindOf([next], start) ? start : usual(next);
    change(fresh);
    materialEditor(select, place, fresh, own, start, change);
  };
}
