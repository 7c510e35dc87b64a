// Small helpers for elements.

export const $ = <E extends HTMLElement>(id: string) => document.getElementById(id) as E;

type Child = Node | string;
export function h<K extends keyof HTMLElementTagNameMap>(tag: K, attributes: Record<string, string> = {}, ...children: Child[]): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

/** Fills a select with values, optionally with display names. */
export function fill(select: HTMLSelectElement, values: readonly (string | [string, string])[], chosen: string) {
  select.replaceChildren(...values.map((value) => {
    const [key, name] = typeof value === "string" ? [value, value] : value;
    return new Option(name, key, false, key === chosen);
  }));
  select.value = chosen;
}

export function save(name: string, bytes: Uint8Array) {
  const url = URL.createObjectURL(new Blob([bytes as Uint8Array<ArrayBuffer>]));
  h("a", { href: url, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}

export const degrees = (x: number) => `${Math.round(x)}°`;
export const stops = (x: number) => `${x > 0 ? "+" : x < 0 ? "−" : ""}${Math.abs(x).toFixed(1)} EV`;
/** An exponent in superscript digits. */
export const superscript = (n: number) => [...String(n)].map((c) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[Number(c)] ?? "⁻").join("");
/** The words of a command, without line breaks at hyphens. */
export const words = (all: string[]): (HTMLElement | string)[] =>
  all.flatMap((word, i) => [...(i ? [" "] : []), h("span", { class: "word" }, word)]);
/** A number with three significant digits. */
export function short(x: number): string {
  if (x === 0) return "0";
  const size = Math.abs(x);
  if (size >= 1e4 || size < 1e-3) {
    const exponent = Math.floor(Math.log10(size));
    const lead = Number((x / 10 ** exponent).toPrecision(2));
    return `${lead === 1 ? "" : `${lead}·`}10${superscript(exponent)}`;
  }
  return String(Number(x.toPrecision(3))).replace("-", "−");
}
export const count = (n: number) => {
  const [unit, name] = n >= 1e9 ? [1e9, " G"] : n >= 1e6 ? [1e6, " M"] : n >= 1e4 ? [1e3, " k"] : [1, ""];
  return `${Number((n / (unit as number)).toPrecision(3))}${name}`;
};
/** A percentage with its meaningful digits. */
export const percentage = (share: number) => (share !== 0 && Math.abs(share) < 5e-4 ? "< 0.1 %" : `${signed(100 * share, 1)} %`);
/** A value and its standard error, which has one digit; both end at the same decimal place. */
export function withError(x: number, error: number): string {
  const digits = error > 0 ? Math.max(-Math.floor(Math.log10(error)), 0) : 7;
  if (digits > 6) return `${short(x)} ± ${short(Number(error.toPrecision(1)))}`;
  return `${signed(x, digits)} ± ${error.toFixed(digits)}`;
}
/** A signed number with a true minus sign. */
export const signed = (x: number, digits = 2) => x.toFixed(digits).replace("-", "−");

/** Runs at most one task at a time; afterwards runs only the last of the tasks requested meanwhile, and calls `done` when
 *  there are no more. */
export function latest<A extends unknown[]>(task: (...args: A) => Promise<void>, done = () => {}): (...args: A) => void {
  let running = false;
  let next: A | null = null;
  const run = async (args: A) => {
    running = true;
    try { await task(...args); } finally {
      running = false;
      if (next) {
        const again = next;
        next = null;
        void run(again);
      } else done();
    }
  };
  return (...args) => {
    if (running) next = args;
    else void run(args);
  };
}

/** The theme's colors. */
export const color = (name: string) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
