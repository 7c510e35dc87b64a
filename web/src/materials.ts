// The Material controls: of all of the subject, or of one material of the scene.

import type { App } from "./app";
import { $, fill } from "./dom";
import { materialEditor } from "./editors";

/** A name for each material; of several with the same name, the later ones are numbered. */
function named(all: { index: number; name: string }[]): Map<number, string> {
  const seen = new Map<string, number>();
  return new Map(all.map(({ index, name }) => {
    const nth = (seen.get(name) ?? 0) + 1;
    seen.set(name, nth);
    return [index, !name ? `material ${index}` : nth > 1 ? `${name} ${nth}` : name];
  }));
}

export class MaterialControls {
  /** The index of the chosen material; null for all of the subject. */
  private chosen: number | null = null;
  private timer = 0;

  constructor(private app: App) {
    const text = $<HTMLInputElement>("material"), of = $<HTMLSelectElement>("one-material");
    text.addEventListener("change", () => {
      this.set(text.value.trim());
      this.fill();
    });
    of.addEventListener("change", () => {
      this.chosen = of.value ? Number(of.value) : null;
      this.fill();
    });
    $("as-in-file").addEventListener("click", () => {
      this.set("");
      this.fill();
    });
  }

  private get all() {
    return this.app.missing.scene ? [] : this.app.scene?.materials ?? [];
  }

  private get text(): string {
    const { material, materials } = this.app.state;
    return this.chosen === null ? material : materials[this.chosen] ?? "";
  }

  private set(text: string, chosen = this.chosen) {
    const { app } = this;
    if (chosen === null) {
      if (text !== app.state.material) app.set({ material: text });
      return;
    }
    const { [chosen]: before, ...others } = app.state.materials;
    if (text === (before ?? "")) return;
    app.set({ materials: text ? { ...others, [chosen]: text } : others });
    this.offer();
  }

  /** What the choice was last made from. */
  private offered = "";

  /** Offers the materials of another scene. Those of the same one leave the controls alone, which may be in use. */
  refresh() {
    if (JSON.stringify(this.all) === this.offered) this.offer();
    else this.fill();
  }

  /** Shows the chosen material of the state. */
  fill() {
    const own = this.offer(), { text } = this, input = $<HTMLInputElement>("material"), { chosen } = this;
    input.value = text;
    input.placeholder = !own ? "as in the scene" : own.text ? `${own.text} in the file` : "as in the file";
    materialEditor($("model"), $("material-numbers"), text, own ? "as in the file" : "as in the scene", own?.text ?? "", (material) => {
      input.value = material;
      clearTimeout(this.timer);
      this.timer = setTimeout(() => this.set(material, chosen), 60) as unknown as number;
    });
  }

  /** Lists the materials, and returns the chosen one. */
  private offer() {
    const { all, app: { state: { materials } } } = this;
    this.offered = JSON.stringify(all);
    const own = all.find(({ index }) => index === this.chosen);
    if (!own) this.chosen = null;
    const names = [...named(all)].map(([index, name]): [string, string] => [String(index), name + (materials[index] ? ", changed" : "")]);
    $("materials").hidden = !names.length;
    fill($("one-material"), [["", "all of the subject"], ...names], this.chosen === null ? "" : String(this.chosen));
    $("as-in-file").hidden = !own || !this.text;
    const hint = $("material-hint");
    hint.hidden = !names.length;
    hint.textContent = !own ? "Click the picture to choose the material under the pointer."
      : this.text ? "Replaces color, gloss, their textures and layers such as a coat; outline, relief and glow stay." : "A change concerns this material alone.";
    $("command-lacks").hidden = !Object.keys(materials).length;
    return own;
  }

  /** Chooses the material at the picked pixel, and returns its name; empty if none of the file's is there. */
  async choose(): Promise<string> {
    const pixel = this.app.pixel();
    if (!pixel || this.all.length < 2) return "";
    const index = await this.app.engines.call("materialAt", pixel);
    const found = this.all.find((one) => one.index === index);
    if (!found || pixel !== this.app.pixel()) return "";
    this.chosen = found.index;
    this.fill();
    return named(this.all).get(found.index)!;
  }
}
