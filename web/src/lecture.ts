// The Lecture panel: sampling direct illumination step by step, with an interactive figure for each step.

import type { App, Change } from "./app";
import { article } from "./article";
import { $, h } from "./dom";
import { FIGURES } from "./figures";
import { printHandout } from "./handout";
import { onFigureWidth } from "./plot";
import { SITUATIONS } from "./situations";
import { Stage } from "./stage";
import { addressOf, type State } from "./state";
import { STEPS } from "./steps";

/** HTML that shows the step with its figure in another page. */
const embedding = (state: State) =>
  `<iframe src="${addressOf(state, "?embed=step").replaceAll("&", "&amp;").replaceAll('"', "%22")}" title="${STEPS[state.step - 1].title}" width="100%" height="900" style="border:0"></iframe>`;

export class Lecture {
  private shown = -1;
  private stage: Stage | null = null;
  /** The light of the figure, by the count of `App.lightRevision`. */
  private light = -1;

  constructor(private app: App) {
    $("steps").replaceChildren(...STEPS.map(({ title }, i) => {
      const link = h("a", { href: `#panel=lecture&step=${i + 1}` }, title);
      link.addEventListener("click", (event) => { event.preventDefault(); this.go(i); });
      return h("li", {}, link);
    }));
    app.on((what) => this.changed(what));
    $("present").addEventListener("click", () => this.present(true));
    $("print-all").addEventListener("click", () => void printHandout(app, $<HTMLInputElement>("with-answers").checked));
    $("copy-step").addEventListener("click", () => app.copy(addressOf(app.state), "Link copied"));
    $("copy-embed").addEventListener("click", () => app.copy(embedding(app.state), "HTML copied"));
    addEventListener("keydown", (event) => this.key(event));
    document.addEventListener("fullscreenchange", () => { if (!document.fullscreenElement) this.present(false); });
    this.changed("all");
    onFigureWidth(() => this.stage?.redraw());
    // Open all answers for printing, and close those that were closed before.
    const paper = matchMedia("print");
    let opened: HTMLDetailsElement[] = [];
    paper.addEventListener("change", () => {
      if (paper.matches) opened = [...document.querySelectorAll<HTMLDetailsElement>("#step details:not([open])")];
      for (const details of opened) details.open = paper.matches;
    });
  }

  private changed(what: Change) {
    if (this.app.state.panel !== "lecture" || what === "view" || what === "pixel") return;
    const step = Math.min(Math.max(Math.round(this.app.state.step) - 1, 0), STEPS.length - 1);
    const isNew = step !== this.shown || what === "all";
    if (isNew || (this.app.holdsLight && this.light !== this.app.lightRevision)) this.show(step);
  }

  /** Shows the lecture for a room full of people, in full screen where the browser permits it. */
  private present(on: boolean) {
    document.documentElement.toggleAttribute("data-presenting", on);
    if (on) document.documentElement.requestFullscreen?.().catch(() => {});
    else if (document.fullscreenElement) void document.exitFullscreen();
    this.stage?.redraw();
    $("step").scrollIntoView({ block: "start" });
  }

  private key(event: KeyboardEvent) {
    if (this.app.state.panel !== "lecture" || event.ctrlKey || event.altKey || event.metaKey) return;
    if ((event.target as Element).closest?.("input, select, textarea")) return;
    const presents = document.documentElement.hasAttribute("data-presenting");
    const by = { ArrowRight: 1, PageDown: 1, ArrowLeft: -1, PageUp: -1 }[event.key];
    if (event.key === "f" || event.key === "F") this.present(!presents);
    else if (presents && event.key === "Escape") this.present(false);
    else if (presents && by) {
      const step = this.shown + by;
      if (step >= 0 && step < STEPS.length) this.go(step);
    } else return;
    event.preventDefault();
  }

  private go(step: number) {
    // The step that is shown begins anew, too.
    this.shown = -1;
    this.app.set({ step: step + 1, figure: "" }, "panel");
    $("step").scrollIntoView({ block: "start" });
  }

  private show(i: number) {
    this.shown = i;
    $("steps").querySelectorAll("a").forEach((link, k) => {
      if (k === i) link.setAttribute("aria-current", "step");
      else link.removeAttribute("aria-current");
    });
    const { elements, figure, answer } = article(i);
    figure.id = "figure";
    const move = (name: string, k: number) => {
      const button = h("button", { type: "button" }, name);
      button.disabled = k < 0 || k >= STEPS.length;
      button.addEventListener("click", () => {
        this.go(k);
        // The focus stays on the button of this name, as long as there are more steps.
        const again = [...$("step").querySelectorAll<HTMLButtonElement>(".steps button")].find((other) => other.textContent === name);
        (again?.disabled ? $("step").querySelector<HTMLElement>("h2") : again)?.focus({ preventScroll: true });
      });
      return button;
    };
    const open = SITUATIONS[i].map(({ name, change }) => {
      const button = h("button", { type: "button" }, name);
      button.addEventListener("click", () => {
        this.app.leaveFor(change);
        $(change.panel!).scrollIntoView({ block: "start" });
      });
      return button;
    });
    $("step").replaceChildren(...elements, h("div", { class: "opens", role: "group", "aria-label": "This situation in other panels" }, "See it in", ...open), h("div", { class: "steps" }, move("← Previous", i - 1), move("Next →", i + 1)));
    // Figures wait for their light.
    const { app } = this;
    this.stage = app.holdsLight ? new Stage(figure, app, app.state.figure.split(";"), answer) : null;
    this.light = this.stage ? app.lightRevision : -1;
    if (this.stage) FIGURES[i](this.stage);
    document.documentElement.dataset.step = String(i + 1);
    if (!this.stage) return;
    document.documentElement.dataset.ready = "true";
    this.app.progress("");
  }
}

