// Light for engines and shaders in the Lights panel: prefiltered cubes, tables, and the code that samples them.

import type { App } from "./app";
import { $, count, fill, h, percentage, save, words } from "./dom";
import { lightWords, quoted } from "./state";

/** The engines' own names. */
const ENGINES: Record<string, string> = { three: "three.js", filament: "Filament", babylon: "Babylon.js", godot: "Godot", bevy: "Bevy", unreal: "Unreal", playcanvas: "PlayCanvas" };
const LAYOUTS: Record<string, string> = { cube: "cube", octahedral: "octahedral square" };
/** The extension of all files in one. */
const ARCHIVE = "zip";
const LANGUAGES: Record<string, string> = { wgsl: "WGSL", glsl: "GLSL", hlsl: "HLSL", slang: "Slang", cuda: "CUDA", metal: "Metal" };

interface Targets {
  engines: string[];
  /** Formats of prefiltered light, and the only engine that reads one. */
  files: { extension: string; engine: string | null }[];
  layouts: string[];
  languages: { name: string; extension: string }[];
  /** The usual number of texels of tables. */
  texels: number;
}

/** What the engine says of prefiltered light. */
interface Prefiltered {
  levels: number;
  /** What the file changes, as a sentence. */
  loss: string | null;
  clamped: number;
}

/** A file, and what is to be said of it. */
interface Made {
  bytes: Uint8Array;
  notes?: string[];
}

const chosen = (id: string) => $<HTMLSelectElement | HTMLInputElement>(id).value;

export class EngineLight {
  private targets: Targets | null = null;

  constructor(private app: App) {
    for (const id of ["ibl", "tables"]) $(id).addEventListener("change", () => this.offer());
    app.on((what) => { if (what !== "pixel" && what !== "view") void this.show(); });
  }

  /** Fills the controls when the panel is shown for the first time. */
  private async show() {
    if (this.app.state.panel !== "lights") return;
    if (!this.targets) {
      const { engines, files, layouts, languages, texels } = (this.targets = JSON.parse(await this.app.engines.call("targets")) as Targets);
      fill($("ibl-engine"), [["", "any: roughness = level / last level"], ...engines.map((name): [string, string] => [name, ENGINES[name] ?? name])], "");
      fill($("ibl-layout"), layouts.map((name): [string, string] => [name, LAYOUTS[name] ?? name]), layouts[0]);
      fill($("ibl-file"), files.map(({ extension, engine }): [string, string] => [extension, this.fileWords(extension, engine)]), files[0].extension);
      fill($("tables-language"), languages.map(({ name }): [string, string] => [name, LANGUAGES[name] ?? name]), languages[0].name);
      fill($("tables-texels"), [1 / 32, 1 / 8, 1, 4].map((k): [string, string] => [String(k * texels), count(k * texels)]), String(texels));
    }
    this.offer();
  }

  private fileWords(extension: string, engine: string | null) {
    if (engine) return `.${extension}, for ${ENGINES[engine] ?? engine}`;
    return extension === ARCHIVE ? `.${extension}, a folder with OpenEXR pictures` : `.${extension}`;
  }

  /** The name of the files without their extensions. */
  private get stem() {
    return this.app.envName.replace(/\.\w+$/, "");
  }

  /** Shows buttons for all files, and the commands that write them. */
  private offer() {
    if (!this.targets) return;
    $("ibl-most").hidden = chosen("ibl-sun") !== "clamp";
    this.offerPrefiltered(this.targets);
    this.offerTables(this.targets);
  }

  private offerPrefiltered({ files }: Targets) {
    const { stem, app: { state } } = this, [size, texels, sun, clamp, extension, anyLayout] = ["size", "texels", "sun", "clamp", "file", "layout"].map((name) => chosen(`ibl-${name}`));
    // A file for one engine holds a cube and the irradiance, and decides the format of its texels.
    const only = files.find((file) => file.extension === extension)?.engine, engine = only ?? chosen("ibl-engine");
    for (const id of ["ibl-engine", "ibl-texels", "ibl-layout"]) $<HTMLSelectElement>(id).disabled = Boolean(only);
    if (only) $<HTMLSelectElement>("ibl-engine").value = only;
    const layout = only ? "cube" : anyLayout, isArchive = extension === ARCHIVE;
    const settings = JSON.stringify({ engine, layout, size: Number(size), texels, file: extension, sun, clamp: Number(clamp) });
    const file = (content: string, suffix: string, meaning: string) => this.button(`${stem}${suffix}.${extension}`, meaning, () => this.prefiltered(settings, content));
    const others = only || isArchive ? [] : [file("irradiance", "_irradiance", "diffuse light"), file("brdf", "_brdf", "table of the BRDF")];
    $("ibl-files").replaceChildren(file("radiance", "", isArchive ? "everything" : "levels of roughness"), ...others);
    const command = ["domelight", "ibl", ...lightWords(state), "-o", isArchive ? `${stem}/` : `${stem}.${extension}`, ...(only || isArchive ? [] : ["--irradiance", `${stem}_irradiance.${extension}`, "--brdf", `${stem}_brdf.${extension}`]),
      ...(engine ? ["--for", engine] : []), ...(layout === "cube" ? [] : ["--layout", layout]), "--size", size, ...(sun === "keep" ? [] : ["--sun", sun === "clamp" ? `clamp:${clamp}` : sun]), ...(only || texels === "rgb9e5" ? [] : ["--texels", texels])];
    $("ibl-command").replaceChildren(...words(command.map(quoted)));
  }

  private offerTables({ languages, texels: usual }: Targets) {
    const { stem, app: { state } } = this, name = `${stem}.tables`;
    const texels = Number(chosen("tables-texels")), compensated = $<HTMLInputElement>("tables-compensated").checked;
    const settings = JSON.stringify({ texels, compensated });
    const language = languages.find(({ name }) => name === chosen("tables-language"))!;
    const file = (format: string, meaning: string) => this.button(`${name}.${format}`, meaning, async () => {
      const host = await this.app.reference();
      return { bytes: (await host.call("tablesFile", settings, format)) as Uint8Array };
    });
    const code = this.button(`${name}.${language.extension}`, "the code", async () => ({ bytes: (await this.app.engines.call("snippet", language.name)) as Uint8Array }));
    $("tables-files").replaceChildren(file("bin", "buffer"), file("ktx2", "texture"), file("exr", "picture"), code);
    const command = ["domelight", "tables", ...lightWords(state), "-o", `${name}.bin`, "-o", `${name}.ktx2`, "-o", `${name}.exr`, "--snippet", language.name,
      ...(texels === usual ? [] : ["--texels", String(texels)]), ...(compensated ? ["--mis-compensation"] : [])];
    $("tables-command").replaceChildren(...words(command.map(quoted)));
  }

  /** A file of prefiltered light. The engine for references filters it, so that the picture goes on. */
  private async prefiltered(settings: string, content: string): Promise<Made> {
    const host = await this.app.reference(), notes: string[] = [];
    if (content !== "brdf") {
      const { loss, clamped } = JSON.parse(await host.call("prefilter", settings)) as Prefiltered;
      if (clamped > 0) notes.push(`Clamping takes ${percentage(clamped)} of the light.`);
      if (loss) notes.push(`${loss.charAt(0).toUpperCase()}${loss.slice(1)}.`);
    }
    return { bytes: (await host.call("iblFile", settings, content)) as Uint8Array, notes };
  }

  private button(name: string, meaning: string, make: () => Promise<Made>): HTMLButtonElement {
    const button = h("button", { type: "button" }, name, h("small", {}, meaning)), { app } = this;
    button.addEventListener("click", async () => {
      button.disabled = true;
      app.tell(`Making ${name} …`);
      try {
        const { bytes, notes } = await make();
        save(name, bytes);
        app.tell(notes ? [`${name} is saved.`, ...notes].join(" ") : `${name} is saved`);
      } catch (error) {
        app.tell((error as Error).message, true);
      }
      button.disabled = false;
    });
    return button;
  }
}
