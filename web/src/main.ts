// The page: unpacks the engine, creates the panels, and accepts dropped files.

import { App } from "./app";
import { Direction } from "./direction";
import { $ } from "./dom";
import { EngineLight } from "./engine_light";
import { Engines } from "./engines";
import { explain, showMeanings } from "./glossary";
import { Lecture } from "./lecture";
import { LightsPanel } from "./lights";
import { MapPanel } from "./map";
import * as native from "./native";
import { PicturePanel } from "./picture";
import { speakValues } from "./spoken";
import { PANELS } from "./state";
import { XrayPanel } from "./xray";

/** The name of a browser feature that the page needs but lacks, or null. */
function missing(): string | null {
  if (native.files) return null;
  if (typeof WebAssembly === "undefined") return "WebAssembly";
  // A function with one SIMD instruction.
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
  // In another page, no other panels appear even for a moment.
  if (new URLSearchParams(location.search).get("embed") === "step") document.documentElement.dataset.embed = "step";
  const app = new App(await Engines.create());
  const picture = new PicturePanel(app);
  const direction = new Direction(app), map = new MapPanel(app, direction);
  new XrayPanel(app, direction);
  new LightsPanel(app);
  new EngineLight(app);
  const lecture = new Lecture(app);
  wireTabs(app);
  wireIntro(app);
  wireHistory(app);
  wireDrop(app);
  speakValues();
  showMeanings();
  // The terms of labels and hints; other texts are explained where they are written.
  document.querySelectorAll<HTMLElement>("fieldset > :is(legend, label), .hint, #xray-table caption, #xray-table thead").forEach(explain);
  app.on((what) => { if (what === "all") show(app); });
  Object.assign(window, { domelight: { app, picture, map, lecture } });
  show(app);
  app.load();
}

function show(app: App) {
  const { panel } = app.state;
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

/** What a visitor without a link sees first; a model that is dropped, or another panel, takes its place. */
function wireIntro(app: App) {
  const isFresh = location.hash.length < 2, intro = $("intro");
  const show = () => { intro.hidden = !isFresh || app.state.panel !== "picture" || app.files.scenes.length > 0; };
  $("start-lecture").addEventListener("click", () => $("tab-lecture").click());
  $("drop-model").addEventListener("click", () => $("files").click());
  app.on(show);
  show();
  $("source").hidden = !$("source").querySelector("a")!.getAttribute("href");
}

/** Buttons and keys that undo and redo, and the way back to the lecture. */
function wireHistory(app: App) {
  const [undo, redo, back] = ["undo", "redo", "back"].map((id) => $<HTMLButtonElement>(id));
  const show = () => {
    undo.disabled = !app.history.canUndo;
    redo.disabled = !app.history.canRedo;
    back.hidden = !app.left || app.state.panel === "lecture";
    if (app.left) back.textContent = `← Back to step ${app.left.step}`;
  };
  undo.addEventListener("click", () => app.undo());
  redo.addEventListener("click", () => app.redo());
  back.addEventListener("click", () => {
    app.comeBack();
    $("step").querySelector<HTMLElement>("h2")?.focus();
  });
  addEventListener("keydown", (event) => {
    const key = event.key.toLowerCase(), target = event.target as HTMLElement;
    // Text fields undo their own text.
    if (!(event.ctrlKey || event.metaKey) || event.altKey || target.matches("textarea, input:not([type=range]):not([type=checkbox])")) return;
    if (key === "z" && !event.shiftKey) app.undo();
    else if (key === "y" || (key === "z" && event.shiftKey)) app.redo();
    else return;
    event.preventDefault();
  });
  app.on(() => {
    if (app.state.panel === "lecture") app.left = null;
    show();
  });
  show();
}

interface Dropped {
  path: string;
  file: File;
}

/** All files in a folder, with their relative paths. */
async function filesOf(handle: FileSystemHandle, folder = ""): Promise<Dropped[]> {
  const path = folder + handle.name;
  if (handle.kind === "file") return [{ path, file: await (handle as FileSystemFileHandle).getFile() }];
  const inside: Promise<Dropped[]>[] = [];
  for await (const inner of (handle as FileSystemDirectoryHandle).values()) inside.push(filesOf(inner, `${path}/`));
  return (await Promise.all(inside)).flat();
}

/** The same for browsers without file handles. */
async function filesOfEntry(entry: FileSystemEntry, folder = ""): Promise<Dropped[]> {
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
  return (await Promise.all(all.map((inner) => filesOfEntry(inner, `${path}/`)))).flat();
}

/** The dropped files. Handles come first, because Chromium's entries are empty for a page from the disk. */
function dropped(transfer: DataTransfer): Promise<Dropped[]> {
  type Item = DataTransferItem & { getAsFileSystemHandle?: () => Promise<FileSystemHandle | null> };
  const items = [...transfer.items].filter((item) => item.kind === "file") as Item[];
  // Request everything at once: the data is gone after the event.
  return Promise.all(items.map((item) => {
    const file = item.getAsFile(), entry = item.webkitGetAsEntry?.();
    const handle = item.getAsFileSystemHandle?.().catch(() => null);
    return (async () => {
      const found = await handle;
      if (found) return filesOf(found);
      if (entry?.isDirectory) return filesOfEntry(entry);
      return file ? [{ path: file.name, file }] : [];
    })();
  })).then((lists) => lists.flat());
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
    if (!event.dataTransfer) return;
    try {
      const found = await dropped(event.dataTransfer);
      if (found.length) await app.open(found);
      else if (event.dataTransfer.types.includes("Files")) app.tell("the dropped folder has no files", true);
    } catch (error) {
      app.tell(`the dropped files cannot be read: ${(error as Error).message}`, true);
    }
  });
}

void main().catch((error: Error) => {
  $("status").textContent = error.message;
  $("status").classList.add("error");
});
