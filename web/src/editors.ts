// Editors of what the program takes as text: strategies and materials.

import { fill, h } from "./dom";

interface Slider {
  name: string;
  min: number;
  max: number;
  step: number;
  value: number;
}

interface Kind {
  /** Its name in text. */
  key: string;
  label: string;
  numbers: Slider[];
  /** Options with names, beside the numbers. */
  choices?: { name: string; values: [string, string][]; value: string }[];
  text(numbers: number[], choices: string[]): string;
  /** Numbers and choices of a text of this kind; none if it is more than the editor can say. */
  parse(words: string[]): { numbers: number[]; choices: string[] } | null;
}

const whole = (name: string, value: number, max: number): Slider => ({ name, min: 1, max, step: 1, value });
const one = (key: string, label: string, name: string, value: number, max: number): Kind => ({
  key, label, numbers: [whole(name, value, max)], text: ([n]) => `${key}:${n}`,
  parse: (words) => (words.length <= 1 && (!words.length || /^\d+$/.test(words[0])) ? { numbers: [Number(words[0] ?? value)], choices: [] } : null),
});

export const STRATEGIES: Kind[] = [
  one("product", "product sampling", "Rays at most", 8, 64),
  {
    key: "mis", label: "multiple importance sampling",
    numbers: [whole("Environment", 1, 128), whole("BRDF", 1, 128)],
    choices: [
      { name: "Weights", values: [["power", "power heuristic"], ["balance", "balance heuristic"]], value: "power" },
      { name: "Table", values: [["", "compensated"], ["no-compensation", "whole map"]], value: "" },
    ],
    text: ([m, n], [heuristic, table]) => ["mis", m, n, ...(heuristic === "balance" ? ["heuristic=balance"] : []), ...(table ? [table] : [])].join(":"),
    parse: (words) => {
      const numbers = words.filter((w) => /^\d+$/.test(w)).map(Number);
      const rest = words.filter((w) => !/^\d+$/.test(w));
      const known = rest.every((w) => ["heuristic=balance", "heuristic=power", "no-compensation"].includes(w));
      if (!known || ![0, 2].includes(numbers.length)) return null;
      return {
        numbers: numbers.length ? numbers : [1, 1],
        choices: [rest.includes("heuristic=balance") ? "balance" : "power", rest.includes("no-compensation") ? "no-compensation" : ""],
      };
    },
  },
  one("environment", "environment sampling", "Samples", 1, 128),
  one("brdf", "BRDF sampling", "Samples", 1, 128),
  {
    key: "sir", label: "sampling importance resampling",
    numbers: [whole("Rays", 1, 64), whole("Candidates", 32, 1024)],
    choices: [
      { name: "From", values: [["mixture", "both"], ["environment", "environment"], ["brdf", "BRDF"]], value: "mixture" },
      { name: "Picks", values: [["sorted", "sorted"], ["systematic", "systematic"], ["multinomial", "multinomial"], ["reservoir", "reservoirs"]], value: "sorted" },
    ],
    text: ([n, m], [from, picks]) => [`sir:${n}/${Math.max(n, m)}`, ...(from === "mixture" ? [] : [`from=${from}`]), ...(picks === "sorted" ? [] : [`resampling=${picks}`])].join(":"),
    parse: (words) => {
      const match = /^(\d+)\/(\d+)$/.exec(words[0] ?? "1/32");
      if (!match) return null;
      const option = (name: string, fallback: string) => words.find((w) => w.startsWith(`${name}=`))?.split("=")[1] ?? fallback;
      return { numbers: [Number(match[1]), Number(match[2])], choices: [option("from", "mixture"), option("resampling", "sorted")] };
    },
  },
  {
    key: "rejection", label: "rejection sampling",
    numbers: [whole("Tries", 16, 256)],
    choices: [{ name: "From", values: [["tighter", "the tighter bound"], ["environment", "environment"], ["brdf", "BRDF"]], value: "tighter" }],
    text: ([n], [from]) => `rejection:${n}${from === "tighter" ? "" : `:proposal=${from}`}`,
    parse: (words) => {
      const rest = words.filter((w) => !/^\d+$/.test(w));
      if (!rest.every((w) => w.startsWith("proposal="))) return null;
      return { numbers: [Number(words.find((w) => /^\d+$/.test(w)) ?? 16)], choices: [rest[0]?.split("=")[1] ?? "tighter"] };
    },
  },
  one("median-cut", "median cut lights", "Lights", 64, 1024),
  one("variance-minimization", "variance minimization lights", "Lights", 64, 1024),
];

const METALS: [string, string][] = ["gold", "copper", "silver", "aluminum", "chromium", "tungsten"].map((m) => [m, m]);
const unit = (name: string, value: number): Slider => ({ name, min: 0, max: 1, step: 0.01, value });
const alpha = (name: string, value: number): Slider => ({ name, min: 0.01, max: 1, step: 0.01, value });
const red = [unit("Red", 0.8), unit("Green", 0.5), unit("Blue", 0.2)];
const numbersOf = (words: string[]) => words.flatMap((w) => w.split(",")).map(Number);
const plain = (n: number) => (words: string[]) => {
  const numbers = numbersOf(words);
  return numbers.length === n && numbers.every((x) => isFinite(x)) ? { numbers, choices: [] } : null;
};
const microfacet = (key: string, label: string): Kind => ({
  key, label, numbers: [alpha("Roughness α", 0.2)],
  choices: [{ name: "Fresnel", values: [["", "none"], ["0.04", "dielectric, 4 %"], ...METALS], value: "gold" }],
  text: ([a], [f]) => `${key}:${a}${f ? `:${f}` : ""}`,
  parse: (words) => {
    const known = !words[1] || words[1] === "0.04" || METALS.some(([m]) => m === words[1]);
    return words.length <= 2 && known && isFinite(Number(words[0])) ? { numbers: [Number(words[0])], choices: [words[1] ?? ""] } : null;
  },
});

export const MATERIALS: Kind[] = [
  { key: "diffuse", label: "diffuse (Lambert)", numbers: red, text: (c) => `diffuse:${c.join(",")}`, parse: plain(3) },
  {
    key: "phong", label: "Phong", numbers: [{ name: "Exponent", min: 1, max: 500, step: 1, value: 50 }, unit("Specular", 0.6), unit("Diffuse", 0.3)],
    text: (n) => `phong:${n.join(":")}`, parse: plain(3),
  },
  {
    key: "ward", label: "Ward", numbers: [alpha("α along x", 0.3), alpha("α along y", 0.1), unit("Reflectance", 0.9)],
    text: (n) => `ward:${n.join(":")}`, parse: plain(3),
  },
  microfacet("ggx", "GGX"),
  microfacet("beckmann", "Beckmann"),
  {
    key: "gltf", label: "metallic-roughness (glTF)", numbers: [...red, unit("Metallic", 0), unit("Roughness", 0.3)],
    text: (n) => `gltf:${n.slice(0, 3).join(",")}:${n[3]}:${n[4]}`, parse: plain(5),
  },
  { key: "mix", label: "half diffuse, half GGX", numbers: [], text: () => "mix", parse: () => ({ numbers: [], choices: [] }) },
];

const kindOf = (kinds: Kind[], text: string) => kinds.find((kind) => kind.key === text.split(":")[0]);

/** Sliders and choices of one kind; `change` gets the text. */
function fields(kind: Kind, text: string, change: (text: string) => void): HTMLElement[] {
  const parsed = kind.parse(text.split(":").slice(1)) ?? { numbers: kind.numbers.map((n) => n.value), choices: kind.choices?.map((c) => c.value) ?? [] };
  const inputs: HTMLInputElement[] = [], selects: HTMLSelectElement[] = [];
  const tell = () => change(kind.text(inputs.map((i) => Number(i.value)), selects.map((s) => s.value)));
  const rows = kind.numbers.map((slider, i) => {
    const input = h("input", { type: "range", min: String(slider.min), max: String(Math.max(slider.max, parsed.numbers[i] ?? 0)), step: String(slider.step) });
    input.value = String(parsed.numbers[i] ?? slider.value);
    const output = h("output", {}, input.value);
    input.addEventListener("input", () => { output.textContent = input.value; tell(); });
    inputs.push(input);
    return h("label", {}, slider.name, input, output);
  });
  const choices = (kind.choices ?? []).map((choice, i) => {
    const select = h("select");
    fill(select, choice.values, parsed.choices[i] ?? choice.value);
    select.addEventListener("change", tell);
    selects.push(select);
    return h("label", {}, choice.name, select);
  });
  return [...rows, ...choices];
}

/** An editor of a strategy's text in `place`. */
export function strategyEditor(place: HTMLElement, text: string, change: (text: string) => void) {
  const kind = kindOf(STRATEGIES, text) ?? STRATEGIES[0];
  const select = h("select");
  fill(select, STRATEGIES.map((k) => [k.key, k.label]), kind.key);
  const numbers = h("div", { class: "controls" });
  numbers.append(...fields(kind, text, change));
  select.addEventListener("change", () => {
    const next = kindOf(STRATEGIES, select.value)!;
    const fresh = next.text(next.numbers.map((n) => n.value), next.choices?.map((c) => c.value) ?? []);
    numbers.replaceChildren(...fields(next, fresh, change));
    change(fresh);
  });
  place.replaceChildren(h("label", {}, "Strategy", select), numbers);
  place.className = "controls";
}

/** Sliders of a material's text in `place`; the model's name is in `select`. */
export function materialEditor(select: HTMLSelectElement, place: HTMLElement, text: string, change: (text: string) => void) {
  const kind = text ? kindOf(MATERIALS, text) : undefined;
  const known = !text || kind;
  fill(select, [["", "as in the scene"], ...MATERIALS.map((k): [string, string] => [k.key, k.label]), ...(known ? [] : [["text", "as the text says"] as [string, string]])], kind?.key ?? (text ? "text" : ""));
  place.className = "controls";
  place.replaceChildren(...(kind ? fields(kind, text, change) : []));
  select.onchange = () => {
    const next = kindOf(MATERIALS, select.value);
    change(next ? next.text(next.numbers.map((n) => n.value), next.choices?.map((c) => c.value) ?? []) : "");
    materialEditor(select, place, next ? next.text(next.numbers.map((n) => n.value), next.choices?.map((c) => c.value) ?? []) : "", change);
  };
}
