// The Lecture panel: sampling direct illumination step by step, each with a figure that the reader changes.

import type { App, Change } from "./app";
import { $, h, latest, short } from "./dom";
import { FIGURES } from "./figures";
import { STEPS } from "./steps";

/** Controls and a place to draw in; a figure fills them. */
export class Stage {
  private inputs: (HTMLInputElement | HTMLSelectElement)[] = [];
  readonly drawing = h("div");
  readonly result = h("p", { class: "result", role: "status" });
  private controls = h("div", { class: "controls" });

  /** `values` are those of the controls in their order; what is missing or out of range is as the figure has it. */
  constructor(readonly place: HTMLElement, readonly app: App, private values: string[]) {
    place.replaceChildren(this.drawing, this.controls, this.result);
  }

  /** A slider; `shown` says how its value is written. */
  slider(name: string, min: number, max: number, step: number, value: number, shown: (x: number) => string = short): () => number {
    const input = h("input", { type: "range", min: String(min), max: String(max), step: String(step) });
    input.value = this.begin(input, String(value));
    const output = h("output", {}, shown(Number(input.value)));
    input.addEventListener("input", () => { output.textContent = shown(Number(input.value)); this.changed(); });
    this.controls.append(h("label", {}, name, input, output));
    return () => Number(input.value);
  }

  choice(name: string, values: [string, string][]): () => string {
    const select = h("select");
    for (const [value, text] of values) select.append(new Option(text, value));
    select.value = this.begin(select, values[0][0]);
    if (select.selectedIndex < 0) select.selectedIndex = 0;
    select.addEventListener("change", () => this.changed());
    this.controls.append(h("label", {}, name, select));
    return () => select.value;
  }

  /** The value that a control begins with. */
  private begin(control: HTMLInputElement | HTMLSelectElement, usual: string): string {
    const given = this.values[this.inputs.push(control) - 1];
    return given && (control instanceof HTMLSelectElement || isFinite(Number(given))) ? given : usual;
  }

  /** Draws again, and keeps the values in the address. */
  private changed() {
    this.app.set({ figure: this.inputs.map(({ value }) => value).join(";") }, "view");
    this.redraw();
  }

  private drawNow: () => void | Promise<void> = () => {};
  readonly redraw = latest(async () => {
    try {
      await this.drawNow();
    } catch (error) {
      this.app.tell((error as Error).message, true);
    }
    this.place.dataset.drawn = String(Number(this.place.dataset.drawn ?? 0) + 1);
  });

  /** Draws now, and whenever a control changes. */
  draw(draw: () => void | Promise<void>) {
    this.drawNow = draw;
    this.redraw();
  }

  /** Shows an SVG, with what it says in words. */
  svg(markup: string, label: string) {
    const image = h("div", { role: "img", "aria-label": label });
    image.innerHTML = markup;
    this.drawing.replaceChildren(image);
  }

  say(text: string) {
    this.result.textContent = text;
  }
}

export class Lecture {
  private shown = -1;

  constructor(private app: App) {
    $("steps").replaceChildren(...STEPS.map(({ title }, i) => {
      const link = h("a", { href: `#panel=lecture&step=${i + 1}` }, title);
      link.addEventListener("click", (event) => { event.preventDefault(); this.go(i); });
      return h("li", {}, link);
    }));
    app.on((what) => this.changed(what));
    this.changed("all");
    // Paper has no answers to open.
    const paper = matchMedia("print");
    paper.addEventListener("change", () => document.querySelectorAll<HTMLDetailsElement>("#step details").forEach((details) => { details.open = paper.matches; }));
  }

  private changed(what: Change) {
    if (this.app.state.panel !== "lecture" || what === "view" || what === "pixel") return;
    const step = Math.min(Math.max(Math.round(this.app.state.step) - 1, 0), STEPS.length - 1);
    if (step !== this.shown || ["all", "scene", "light"].includes(what)) this.show(step);
  }

  private go(step: number) {
    this.app.set({ step: step + 1, figure: "" }, "panel");
    this.show(step);
    $("step").scrollIntoView({ block: "start" });
  }

  private show(i: number) {
    this.shown = i;
    const { title, text, formula, question, answer } = STEPS[i];
    $("steps").querySelectorAll("a").forEach((link, k) => {
      if (k === i) link.setAttribute("aria-current", "step");
      else link.removeAttribute("aria-current");
    });
    const place = h("div", { class: "figure", id: "figure" });
    const formulaBox = h("div", { class: "formula", tabindex: "0", role: "group", "aria-label": "Formula" });
    formulaBox.innerHTML = `<math display="block">${formula}</math>`;
    const move = (name: string, k: number) => {
      const button = h("button", { type: "button" }, name);
      button.disabled = k < 0 || k >= STEPS.length;
      button.addEventListener("click", () => this.go(k));
      return button;
    };
    $("step").replaceChildren(
      h("h2", {}, title), ...text.map((paragraph) => h("p", {}, paragraph)), formulaBox, place,
      h("div", { class: "question" }, h("p", {}, question), h("details", {}, h("summary", {}, "What the figure shows"), h("p", {}, answer))),
      h("div", { class: "steps" }, move("← Before", i - 1), move("Next →", i + 1)));
    // Without a map there is nothing to draw yet.
    if (this.app.probe) FIGURES[i](new Stage(place, this.app, this.app.state.figure.split(";")));
    document.documentElement.dataset.step = String(i + 1);
  }
}

