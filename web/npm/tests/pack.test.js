// The packed package in new projects: in Node, and bundled for browsers. npm downloads what the projects need.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, readdirSync, readFileSync, rmSync, writeFileSync, mkdirSync, cpSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { close, launch, open } from "./browser.js";

const root = join(import.meta.dirname, "..");
const folder = mkdtempSync(join(tmpdir(), "domelight-pack-"));
before(launch);
after(async () => {
  await close();
  rmSync(folder, { recursive: true });
  rmSync(join(root, "dist/packed"), { recursive: true, force: true });
});

const npm = (cwd, ...words) => execFileSync("npm", words, { cwd, encoding: "utf8", stdio: ["ignore", "pipe", "inherit"] });
const [packed] = JSON.parse(npm(root, "pack", "--json", "--pack-destination", folder));

/** A project with the package and others. */
function project(name, ...packages) {
  const path = join(folder, name);
  mkdirSync(path);
  writeFileSync(join(path, "package.json"), JSON.stringify({ name, private: true, type: "module" }));
  npm(path, "install", "--no-audit", "--no-fund", "--silent", join(folder, packed.filename), ...packages);
  return path;
}

test("the package has what it needs, and no more", () => {
  const names = packed.files.map(({ path }) => path);
  for (const name of ["LICENSE-MIT", "LICENSE-APACHE", "README.md", "THIRD-PARTY.txt", "dist/index.d.ts", "dist/three.d.ts", "dist/light/engine_bg.wasm", "dist/full/engine_bg.wasm"]) {
    assert.ok(names.includes(name), `${name} is missing`);
  }
  assert.deepEqual(names.filter((name) => /^(src|tests|example|dist\/example)/.test(name)), []);
  const { version } = JSON.parse(readFileSync(join(root, "package.json")));
  assert.ok(readFileSync(join(root, "../../Cargo.toml"), "utf8").includes(`\nversion = "${version}"\n`), "the program has another version");
});

test("Node imports it, and its process ends", () => {
  const path = project("node");
  writeFileSync(join(path, "main.js"), `
    import { lights, load, render } from "domelight";
    const map = await load({ builtin: "sky" }, { rows: 64 });
    const { lights: [sun] } = await lights(map, { sun: true });
    const { pixels } = await render({ builtin: "sphere" }, map, { width: 8, height: 8, spp: 1 });
    console.log(sun.kind, pixels.length);
  `);
  assert.equal(execFileSync("node", ["main.js"], { cwd: path, encoding: "utf8", timeout: 60_000 }), "sun 256\n");
});

test("TypeScript knows its types", () => {
  const { devDependencies: { typescript, "@types/three": three } } = JSON.parse(readFileSync(join(root, "package.json")));
  const path = project("types", `typescript@${typescript}`, `@types/three@${three}`);
  const check = (text) => {
    writeFileSync(join(path, "main.ts"), text);
    return execFileSync("node_modules/.bin/tsc", ["--strict", "--noEmit", "--module", "nodenext", "--target", "es2022", "--lib", "es2022,dom", "main.ts"], { cwd: path, encoding: "utf8" });
  };
  const lines = ["import { lights, load } from 'domelight';", "import { addRig } from 'domelight/three';", "import { Scene } from 'three';"];
  check([...lines, "const map = await load('a.hdr', { convention: 'three' });", "await addRig(new Scene(), await lights(map, { sun: true, residual: true }));"].join("\n"));
  assert.throws(() => check([...lines, "await lights(await load('a.hdr'), { suns: true });"].join("\n")));
});

/** A page that lights a ball, and says the direction of the sun. */
const PAGE = `
  import * as THREE from "three";
  import { lights, load, render } from "domelight";
  import { addRig } from "domelight/three";
  const map = await load({ builtin: "sky" }, { rows: 64 });
  const rig = await lights(map, { sun: true, residual: true });
  const scene = new THREE.Scene();
  await addRig(scene, rig);
  const picture = await render({ builtin: "sphere" }, map, { width: 8, height: 8, spp: 1 });
  document.title = [scene.children[0].children[0].name, picture.pixels.length].join();
`;

/** Whether the page of a bundler works. */
async function works(built) {
  cpSync(built, join(root, "dist/packed"), { recursive: true });
  const { page, done } = await open("/dist/packed/index.html");
  await page.waitForFunction(() => document.title !== "");
  assert.equal(await page.title(), "sun,256");
  await done();
  rmSync(join(root, "dist/packed"), { recursive: true });
}

test("Vite bundles it", async () => {
  const path = project("vite", "vite@8", "three@0.187.0");
  writeFileSync(join(path, "index.html"), `<!doctype html><script type="module" src="/main.js"></script>`);
  writeFileSync(join(path, "main.js"), PAGE);
  execFileSync("node_modules/.bin/vite", ["build", "--base", "./", "--logLevel", "warn"], { cwd: path, stdio: "inherit" });
  assert.equal(readdirSync(join(path, "dist/assets")).filter((name) => name.endsWith(".wasm")).length, 2);
  await works(join(path, "dist"));
});

test("esbuild bundles it, with its Workers as entries", async () => {
  const path = project("esbuild", "esbuild@0.28", "three@0.187.0"), own = join(path, "node_modules/domelight/dist");
  writeFileSync(join(path, "main.js"), PAGE);
  const entries = ["main.js", join(own, "light_worker.js"), join(own, "full_worker.js")];
  execFileSync("node_modules/.bin/esbuild", [...entries, "--bundle", "--format=esm", "--outdir=built", "--entry-names=[name]", "--log-level=warning"], { cwd: path, stdio: "inherit" });
  for (const kind of ["light", "full"]) {
    mkdirSync(join(path, "built", kind));
    cpSync(join(own, kind, "engine_bg.wasm"), join(path, "built", kind, "engine_bg.wasm"));
  }
  writeFileSync(join(path, "built/index.html"), `<!doctype html><script type="module" src="main.js"></script>`);
  await works(join(path, "built"));
});
