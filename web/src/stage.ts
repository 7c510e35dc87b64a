// The stage of a lecture figure: its controls, its drawing, and its result in words.

import type { App } from "./app";
import { h, latest, short } from "./dom";
import { player } from "./player";
import { onPointer, type Pointed } from "./pointer";

/** Controls and a drawing area, filled by a figure. */
export class Stage {
  private inputs: (HTMLInputElement | HTMLSelectElement)[] = [];
  readonly drawing = h("div");
  readonly result = h("p", { class: "result", role: "status" });
  private controls = h("div", { class: "controls" });

  /** `values` are the controls' values in order; missing or invalid values get the figure's defaults. */
  constructor(readonly place: HTMLElement, readonly app: App, private values: string[]) {
    place.replaceChildren(this.drawing, this.controls, this.result);
  }

  /** Adds a slider; `shown` formats its value. */
  slider(name: string, min: number, max: number, step: number, value: number, shown: (x: number) => string = short): () => number {
    const input = this.range(name, min, max, step, value, shown);
    return () => Number(input.value);
  }

  /** Adds a slider that plays from `min` to `max` in steps of one. */
  player(name: string, min: number, max: number, value: number, shown: (x: number) => string = short): () => number {
    const input = this.range(name, min, max, 1, value, shown);
    this.controls.append(player(input));
    return () => Number(input.value);
  }

  /** Adds a slider that dragging in the first plot moves as well: to `value` of the place, which is null to leave it. The
   *  result is the place under the pointer. */
  dragged(name: string, min: number, max: number, step: number, value: number, shown: (x: number) => string, valueAt: (at: Pointed) => number | null): [() => number, () => Pointed | null] {
    const input = this.range(name, min, max, step, value, shown);
    let pointed: Pointed | null = null;
    this.drawing.classList.add("touchable");
    onPointer(this.drawing, (at) => {
      if (!at && !pointed) return;
      pointed = at;
      const moved = at?.dragged ? valueAt(at) : null;
      if (moved === null) return this.redraw();
      input.value = String(moved);
      input.dispatchEvent(new Event("input", { bubbles: true }));
    });
    return [() => Number(input.value), () => pointed];
  }

  private range(name: string, min: number, max: number, step: number, value: number, shown: (x: number) => string): HTMLInputElement {
    const input = h("input", { type: "range", min: String(min), max: String(max), step: String(step) });
    input.value = this.begin(input, String(value));
    const output = h("output", {}, shown(Number(input.value)));
    input.addEventListener("input", () => { output.textContent = shown(Number(input.value)); this.changed(); });
    this.controls.append(h("label", {}, name, input, output));
    return input;
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

  /** The initial value of a control. */
  private begin(control: HTMLInputElement | HTMLSelectElement, usual: string): string {
    const given = this.values[this.inputs.push(control) - 1];
    return given && (control instanceof HTMLSelectElement || isFinite(Number(given))) ? given : usual;
  }

  /** Redraws, and stores the values in the address. */
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

  /** Shows an SVG with a text alternative. */
  svg(markup: string, label: string) {
    const image = h("div", { role: "img", "aria-label": label });
    image.innerHTML = markup;
    this.drawing.replaceChildren(image);
  }

  say(text: string) {
    // A number stays with its percent sign.
    this.result.textContent = text.replaceAll(" %", "\u00a0%");
  }
}
