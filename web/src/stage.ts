// The stage of a lecture figure: its controls, its drawing, and its result in words.

import type { App } from "./app";
import { h, latest, short } from "./dom";
import { player } from "./player";
import { framedIn, onPointer, placeOn, type Pointed } from "./pointer";

/** A slider's value, and how a figure sets it. */
export interface Slider {
  (): number;
  set(x: number): void;
  readonly input: HTMLInputElement;
}

/** A place in one of a figure's plots and maps, in its units. */
export type Mark = Pick<Pointed, "frame" | "x" | "y">;

/** Draws SVGs in the place of others, which keep the focus. */
export function drawInto(place: HTMLElement, markup: string) {
  const fresh = h("template");
  fresh.innerHTML = markup;
  const [before, after] = [[...place.children], [...fresh.content.children]];
  if (before.length !== after.length) return place.replaceChildren(...after);
  after.forEach((svg, i) => {
    for (const { name, value } of svg.attributes) if (name !== "aria-hidden") before[i].setAttribute(name, value);
    before[i].replaceChildren(...svg.childNodes);
  });
}

/** Controls and a drawing area, filled by a figure. */
export class Stage {
  private inputs: (HTMLInputElement | HTMLSelectElement)[] = [];
  readonly drawing = h("div");
  readonly result = h("p", { class: "result", role: "status" });
  /** The values under the pointer. */
  private readout = h("p", { class: "readout", "aria-live": "polite" }, "\u00a0");
  private overlay = h("div", { class: "overlay" });
  private controls = h("div", { class: "controls" });

  /** `values` are the controls' values in order; missing or invalid values get the figure's defaults. */
  constructor(readonly place: HTMLElement, readonly app: App, private values: string[], private answers: (text: string) => void = () => {}) {
    place.replaceChildren(this.drawing, this.readout, this.controls, this.result, this.overlay);
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
    this.drawing.classList.add("touchable");
    onPointer(this.drawing, (at) => {
      if (!at && !this.pointed) return;
      this.pointed = at;
      if (at?.dragged) drag(at);
      this.redraw();
    });
    return () => this.pointed;
  }
  private pointed: Pointed | null = null;

  /** Marks places until the figure is drawn again. */
  mark(...places: Mark[]) {
    this.marked.push(...places);
  }
  private marked: Mark[] = [];

  private showMarks() {
    const { pointed, marked, overlay } = this, all = framedIn(this.drawing), origin = overlay.offsetParent?.getBoundingClientRect();
    const places = origin ? [...(pointed?.byKeys ? [pointed] : []), ...marked].filter(({ frame }) => all[frame]) : [];
    overlay.replaceChildren(...places.map(({ frame, x, y }) => {
      const box = all[frame].getBoundingClientRect(), [u, v] = placeOn(all[frame], x, y), cross = h("span", { class: "mark" });
      Object.assign(cross.style, { left: `${box.left + u * box.width - origin!.left}px`, top: `${box.top + v * box.height - origin!.top}px` });
      return cross;
    }));
  }

  /** Plots and maps take the focus, so that keys read them. */
  private makeFocusable() {
    if (!this.drawing.matches(".touchable")) return;
    const all = framedIn(this.drawing);
    all.forEach((framed, k) => {
      const ofGroup = `${this.plots.getAttribute("aria-label") ?? "Plot"}${all.length > 1 ? `: ${k + 1} of ${all.length}` : ""}`;
      const label = (framed instanceof HTMLCanvasElement && framed.getAttribute("aria-label")) || ofGroup;
      framed.removeAttribute("aria-hidden");
      for (const [name, value] of Object.entries({ tabindex: "0", role: "application", "aria-roledescription": "plot", "aria-label": label, "aria-describedby": "keys-of-plots" })) framed.setAttribute(name, value);
    });
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
    this.marked = [];
    try {
      await this.drawNow();
    } catch (error) {
      this.app.tell((error as Error).message, true);
    }
    this.makeFocusable();
    this.showMarks();
    this.isDrawing = false;
    this.drawn();
    this.place.dataset.drawn = String(Number(this.place.dataset.drawn ?? 0) + 1);
  }, () => { delete this.place.dataset.drawing; });

  /** Draws now, and whenever a control changes. */
  draw(draw: () => void | Promise<void>) {
    this.drawNow = draw;
    this.redraw();
  }

  private plots = h("div", { role: "group" });

  /** Shows SVGs with a text alternative, below other pictures. */
  svg(markup: string, label: string, ...above: HTMLElement[]) {
    this.plots.setAttribute("aria-label", label);
    drawInto(this.plots, markup);
    this.fill(...above, this.plots);
  }

  /** Shows pictures. Those that are shown stay, with the focus. */
  fill(...pictures: HTMLElement[]) {
    const { children } = this.drawing;
    if (children.length !== pictures.length || pictures.some((picture, i) => children[i] !== picture)) this.drawing.replaceChildren(...pictures);
  }

  /** Shows the values under the pointer, if any, and says whether keys carry something. */
  read(text: string | null) {
    const carried = this.pointed?.byKeys && this.pointed.dragged ? "Picked up. " : "";
    this.readout.textContent = `${carried}${text?.replaceAll(" %", "\u00a0%") ?? ""}` || "\u00a0";
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
