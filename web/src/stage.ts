// The stage of a lecture figure: its controls, its drawing, and its result in words.

import type { App } from "./app";
import { h, latest, short } from "./dom";
import { player } from "./player";
import { onPointer, type Pointed } from "./pointer";

/** A slider's value, and how a figure sets it. */
export interface Slider {
  (): number;
  set(x: number): void;
  readonly input: HTMLInputElement;
}

/** Controls and a drawing area, filled by a figure. */
export class Stage {
  private inputs: (HTMLInputElement | HTMLSelectElement)[] = [];
  readonly drawing = h("div");
  readonly result = h("p", { class: "result", role: "status" });
  /** The values under the pointer. */
  private readout = h("p", { class: "readout" }, "\u00a0");
  private controls = h("div", { class: "controls" });

  /** `values` are the controls' values in order; missing or invalid values get the figure's defaults. */
  constructor(readonly place: HTMLElement, readonly app: App, private values: string[], private answers: (text: string) => void = () => {}) {
    place.replaceChildren(this.drawing, this.readout, this.controls, this.result);
  }

  /** Adds a slider; `shown` formats its value. */
  slider(name: string, min: number, max: number, step: number, value: number, shown: (x: number) => string = short): Slider {
    const input = h("input", { type: "range", min: String(min), max: String(max), step: String(step), "data-name": name });
    input.value = this.begin(input, String(value));
    const output = h("output");
    const tell = () => { output.textContent = shown(Number(input.value)); };
    tell();
    input.addEventListener("input", () => { tell(); this.changed(); });
    this.controls.append(h("label", {}, name, input, output));
    const set = (x: number) => {
      const before = input.value;
      input.value = String(x);
      if (input.value !== before) input.dispatchEvent(new Event("input", { bubbles: true }));
    };
    return Object.assign(() => Number(input.value), { set, input });
  }

  /** Adds a slider that plays from `min` to `max` in steps of one. */
  player(name: string, min: number, max: number, value: number, shown: (x: number) => string = short): Slider {
    const slider = this.slider(name, min, max, 1, value, shown);
    this.play(slider, 1);
    return slider;
  }

  /** Shows or hides a slider and its playback. */
  show({ input }: Slider, isShown: boolean) {
    const label = input.closest("label")!, next = label.nextElementSibling as HTMLElement | null;
    label.hidden = !isShown;
    if (next?.classList.contains("player")) next.hidden = !isShown;
  }

  /** Adds playback that moves a slider by `by` at each step. */
  play({ input }: Slider, by: number) {
    input.closest("label")!.after(player(input, by, () => !this.isDrawing));
  }

  /** Reads the pointer over the figure's plots and maps; `drag` is called while it drags. */
  pointer(drag: (at: Pointed) => void): () => Pointed | null {
    let pointed: Pointed | null = null;
    this.drawing.classList.add("touchable");
    onPointer(this.drawing, (at) => {
      if (!at && !pointed) return;
      pointed = at;
      if (at?.dragged) drag(at);
      this.redraw();
    });
    return () => pointed;
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

  private drawn: () => void = () => {};
  /** Resolves when the figure is drawn for the first time. */
  readonly firstDrawn = new Promise<void>((done) => { this.drawn = done; });
  private drawNow: () => void | Promise<void> = () => {};
  private isDrawing = false;
  /** Draws; while it draws, only the last of other requests waits. */
  redraw() {
    this.place.dataset.drawing = "";
    this.drawLatest();
  }
  private readonly drawLatest = latest(async () => {
    this.isDrawing = true;
    try {
      await this.drawNow();
    } catch (error) {
      this.app.tell((error as Error).message, true);
    }
    this.isDrawing = false;
    this.drawn();
    this.place.dataset.drawn = String(Number(this.place.dataset.drawn ?? 0) + 1);
  }, () => { delete this.place.dataset.drawing; });

  /** Draws now, and whenever a control changes. */
  draw(draw: () => void | Promise<void>) {
    this.drawNow = draw;
    this.redraw();
  }

  /** Shows an SVG with a text alternative, below other pictures. */
  svg(markup: string, label: string, ...above: HTMLElement[]) {
    const image = h("div", { role: "img", "aria-label": label });
    image.innerHTML = markup;
    this.drawing.replaceChildren(...above, image);
  }

  /** Shows the values under the pointer, if any. */
  read(text: string | null) {
    this.readout.textContent = text?.replaceAll(" %", "\u00a0%") || "\u00a0";
  }

  /** Answers the step's question from what the figure shows. */
  answer(text: string) {
    this.answers(text);
  }

  say(text: string) {
    // A number stays with its percent sign.
    this.result.textContent = text.replaceAll(" %", "\u00a0%");
  }
}
