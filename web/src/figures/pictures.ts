// Pictures of one scene by several ways, beside the reference, with their errors.

import { h, percentage, short } from "../dom";
import { FilmView, luminance, type Film } from "../film";
import { pixels, type Pointed } from "../pointer";
import type { Stage } from "../stage";
import { Lab, errorOf, type Situation } from "./lab";

/** A way to render with a number of lights or rays. */
export interface Way {
  name: string;
  strategy(n: number): string;
  /** Camera samples of each pixel. */
  samples(n: number): number;
}

export class Pictures {
  private figures: { view: FilmView; caption: HTMLElement; name: string }[];
  private element: HTMLElement;
  private known = new Map<string, { film: Film; error: number }>();
  /** Where the reference begins in the other pictures, as a share of the width. */
  private border = 1;

  /** `subject` names what is seen, and `reference` the picture that is exact. */
  constructor(private stage: Stage, private of: Situation, private ways: Way[], subject: string, private reference: string) {
    const size = String(of.size), figures = [...ways.map(({ name }) => name), reference].map((name) => {
      const element = h("canvas", { width: size, height: size, role: "img", "aria-label": `${subject}, ${name}`, "data-frame": JSON.stringify(pixels(of.size, of.size)) });
      const caption = h("figcaption", {}, name);
      return { view: new FilmView(element, false), caption, name, figure: h("figure", {}, element, caption) };
    });
    this.figures = figures;
    this.element = h("div", { class: "quartet" }, ...figures.map(({ figure }) => figure));
  }

  /** Moves the border to the reference. */
  drag({ x }: Pointed) {
    const share = x / this.of.size;
    this.border = share > 0.98 ? 1 : share;
  }

  /** Renders what is missing and shows all; returns the relative RMSE of each way, or null if `isStill` fails meanwhile. */
  async draw(n: number, over: Pointed | null, isStill: () => boolean): Promise<number[] | null> {
    const truth = await Lab.of(this.stage.app).truth(this.of), found: { film: Film; error: number }[] = [];
    for (const way of this.ways) {
      if (!isStill()) return null;
      found.push(await this.render(way, n));
    }
    if (!isStill()) return null;
    this.show([...found.map(({ film }) => film), truth[0].film], found.map(({ error }) => error));
    this.read(over, [...found.map(({ film }) => film), truth[0].film]);
    return found.map(({ error }) => error);
  }

  private async render(way: Way, n: number) {
    const lab = Lab.of(this.stage.app), [strategy, samples] = [way.strategy(n), way.samples(n)], key = `${strategy} ${samples}`, known = this.known.get(key);
    if (known) return known;
    const picture = await lab.render(this.of, strategy, samples);
    const result = { film: picture.film, error: Math.sqrt(Math.max(errorOf(picture, await lab.truth(this.of)), 0)) };
    this.known.set(key, result);
    return result;
  }

  private show(films: Film[], errors: number[]) {
    const reference = films.at(-1)!, exposure = reference.exposure();
    this.figures.forEach(({ view, caption, name }, i) => {
      view.set({ exposure, curve: "agx" });
      view.show(0, films[i]);
      view.show(1, this.border < 1 && i < errors.length ? reference : null);
      view.set({ divider: this.border });
      caption.textContent = i < errors.length ? `${name}: error ${percentage(errors[i])}` : name;
    });
    this.stage.fill(this.element);
  }

  private read(over: Pointed | null, films: Film[]) {
    if (over) this.stage.mark(...this.figures.flatMap((_, frame) => (frame === over.frame ? [] : [{ ...over, frame }])));
    const { size } = this.of, at = over && 4 * (Math.min(Math.floor(over.y), size - 1) * size + Math.min(Math.floor(over.x), size - 1));
    this.stage.read(over && at !== null && films[over.frame] ? `Under the pointer, ${this.figures[over.frame].name} gives ${short(luminance(films[over.frame].pixels, at))}, ${this.reference} ${short(luminance(films.at(-1)!.pixels, at))}; drag to uncover it.` : null);
  }
}
