// The page: unpacks the engine, makes the panels, and takes dropped files.

import { App } from "./app";
import { $ } from "./dom";
import { Engines } from "./engines";
import { Lecture } from "./lecture";
import { LightsPanel } from "./lights";
import { MapPanel } from "./map";
import { PicturePanel } from "./picture";
import { XrayPanel } from "./xray";

const PANELS = ["picture", "map", "xray", "lights", "lecture"];

/** What the page cannot do without; the name of what is missing. */
function missing(): string | null {
  if (typeof WebAssembly === "undefined") return "WebAssembly";
  // A function of one SIMD instruction.
  const simd = [0, 97, 115, 109, 1, 0, 0, 0, 1, 5, 1, 96, 0, 1, 123, 3, 2, 1, 0, 10, 10, 1, 8, 0, 65, 0, 253, 15, 253, 98, 11];
  if (!WebAssembly.validate(new Uint8Array(simd))) return "WebAssembly SIMD";
  if (typeof DecompressionStream === "undefined") return "DecompressionStream";
  return null;
}

async function main() {
  const lacking = missing();
  if (lacking) {
    $("status").textContent = `This browser lacks ${lacking}, which domelight needs; browsers from 2023 on have it.`;
    $("status").classList.add("error");
    return;
  }
  const app = new App(await Engines.create());
  const picture = new PicturePanel(app);
  new MapPanel(app);
  new XrayPanel(app);
  new LightsPanel(app);
  const lecture = new Lecture(app);
  wireTabs(app);
  wireDrop(app);
  app.on((what) => { if (what === "all") show(app); });
  Object.assign(window, { domelight: { app, picture, lecture } });
  show(app);
  app.load();
}

function show(app: App) {
  const panel = PANELS.includes(app.state.panel) ? app.state.panel : "picture";
  app.state.panel = panel;
  for (const name of PANELS) {
    $(name).hidden = name !== panel;
    const tab = $(`tab-${name}`);
    tab.setAttribute("aria-selected", String(name === panel));
    tab.tabIndex = name === panel ? 0 : -1;
  }
}

function wireTabs(app: App) {
  const choose = (panel: string) => {
    app.state.panel = panel;
    show(app);
    app.set({ panel }, "panel");
  };
  for (const name of PANELS) $(`tab-${name}`).addEventListener("click", () => choose(name));
  $("tabs").addEventListener("keydown", (event) => {
    const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (!step) return;
    const next = PANELS[(PANELS.indexOf(app.state.panel) + step + PANELS.length) % PANELS.length];
    choose(next);
    $(`tab-${next}`).focus();
  });
}

/** All files of a dropped folder, with their paths in it. */
async function filesOf(entry: FileSystemEntry, folder = ""): Promise<{ path: string; file: File }[]> {
  const path = folder + entry.name;
  if (entry.isFile) {
    const file = await new Promise<File>((resolve, reject) => (entry as FileSystemFileEntry).file(resolve, reject));
    return [{ path, file }];
  }
  const reader = (entry as FileSystemDirectoryEntry).createReader(), all: FileSystemEntry[] = [];
  for (;;) {
    const some = await new Promise<FileSystemEntry[]>((resolve, reject) => reader.readEntries(resolve, reject));
    if (!some.length) break;
    all.push(...some);
  }
  return (await Promise.all(all.map((inner) => filesOf(inner, `${path}/`)))).flat();
}

function wireDrop(app: App) {
  const veil = $("drop");
  let depth = 0;
  const end = () => { depth = 0; veil.hidden = true; };
  addEventListener("dragenter", (event) => {
    event.preventDefault();
    depth++;
    veil.hidden = false;
  });
  addEventListener("dragleave", () => { if (--depth <= 0) end(); });
  addEventListener("dragover", (event) => event.preventDefault());
  addEventListener("drop", async (event) => {
    event.preventDefault();
    end();
    const items = [...(event.dataTransfer?.items ?? [])].filter((item) => item.kind === "file");
    const entries = items.map((item) => item.webkitGetAsEntry?.() ?? null);
    const plain = [...(event.dataTransfer?.files ?? [])].map((file) => ({ path: file.name, file }));
    const found = entries.length && entries.every(Boolean) ? (await Promise.all(entries.map((entry) => filesOf(entry!)))).flat() : plain;
    if (found.length) await app.open(found);
  });
}

void main().catch((error: Error) => {
  $("status").textContent = error.message;
  $("status").classList.add("error");
});
