// The package in Node, with and without a Worker.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, describe, test } from "node:test";
import { pathToFileURL } from "node:url";

import { configure, ibl, lights, load, render, sg, sh } from "domelight";
import { OBJ, SCENE, glb, png } from "../../tests/models.js";
import { HEIGHT, WIDTH, angle, direction, irradiance, pfm, sun, sunny } from "./maps.js";

const folder = mkdtempSync(join(tmpdir(), "domelight-npm-"));
after(() => rmSync(folder, { recursive: true }));

const near = (a, b, tolerance = 1e-5) => {
  assert.equal(a.length, b.length);
  a.forEach((x, i) => assert.ok(Math.abs(x - b[i]) <= tolerance * Math.max(1, Math.abs(b[i])), `${x} is not ${b[i]} (number ${i})`));
};

const sum = (vectors) => vectors.reduce((s, v) => s.map((x, i) => x + v[i]), [0, 0, 0]);

/** Maps of one radiance. */
const even = (radiance) => pfm(8, 4, () => [radiance, radiance, radiance]);

for (const worker of [true, false]) describe(worker ? "in a Worker" : "in this thread", () => {
  test("a map says what it is, and has its texels", async () => {
    configure({ worker });
    const map = await load(sunny(), { name: "sunny.pfm", rotate: 30 });
    const { name, width, height, rotation, up, warnings } = map;
    assert.deepEqual({ name, width, height, rotation, up, warnings }, { name: "sunny.pfm", width: WIDTH, height: HEIGHT, rotation: 30, up: "y", warnings: [] });
    const pixels = await map.pixels();
    assert.equal(pixels.length, 4 * WIDTH * HEIGHT);
    near(pixels.slice(0, 4), [0.4, 0.6, 1, 1]);
    near(pixels.slice(-4), [0.2, 0.15, 0.1, 1]);
  });

  test("maps come from bytes, buffers, Blobs, Files, paths and URLs", async () => {
    const bytes = sunny(), path = join(folder, "sunny map.pfm");
    writeFileSync(path, bytes);
    const pixels = await (await load(bytes)).pixels();
    const sources = [bytes.slice().buffer, new Blob([bytes]), new File([bytes], "dropped.pfm"), path, pathToFileURL(path), pathToFileURL(path).href];
    const maps = await Promise.all(sources.map((source) => load(source)));
    for (const map of maps) assert.deepEqual(await map.pixels(), pixels);
    assert.deepEqual(maps.map(({ name }) => name), ["the map", "the map", "dropped.pfm", "sunny map.pfm", "sunny map.pfm", "sunny map.pfm"]);
    assert.equal(bytes.length, sunny().length, "the caller keeps the bytes");
    assert.equal((await load({ builtin: "sky" }, { rows: 64 })).height, 64);
    const { warnings } = await load(png(16, [200, 100, 50]), { name: "warm.png" });
    assert.match(warnings.join(), /^warm\.png: PNG holds nothing brighter than white/);
  });

  test("the sun and the residual have the light of the map", async () => {
    const map = await load(sunny());
    const { lights: [light, ...others], residual, harmonics, error, orientation } = await lights(map, { sun: true, residual: true, measure: true });
    assert.deepEqual(others, []);
    assert.deepEqual(orientation, { up: "y", rotation: 0 });
    assert.equal(light.kind, "sun");
    assert.equal(light.name, "sun");
    assert.ok(angle(light.direction, sun.direction) < 0.05, `${angle(light.direction, sun.direction)}°`);
    near(light.irradiance, sun.irradiance, 0.001);
    near(light.color.map((c) => c * light.intensity), light.irradiance);
    assert.equal(Math.max(...light.color), 1);
    near(sum([light.irradiance, irradiance(await residual.pixels())]), irradiance(await map.pixels()));
    near(harmonics, await sh(residual));
    assert.ok(error.diffuse > 0 && error.diffuse < 0.01, `${error.diffuse}`);
  });

  test("without sun, all light becomes lights, by every method", async () => {
    const map = await load(sunny());
    const all = irradiance(await map.pixels());
    for (const method of ["variance-minimization", "variance-minimization:2009", "median-cut"]) {
      const rig = await lights(map, { n: 7, method });
      assert.equal(rig.lights.length, 7);
      assert.equal(rig.residual, null);
      assert.equal(rig.harmonics, null);
      near(sum(rig.lights.map((light) => light.irradiance)), all);
    }
    assert.equal((await lights(map)).lights.length, 64);
    const few = await lights(map, { error: 5 });
    assert.ok(few.error.diffuse <= 0.05 && few.error.glossy <= 0.05 && few.lights.length < 64);
  });

  test("rotation and convention turn the map", async () => {
    const towardSun = async (options) => (await lights(await load(sunny(), options), { sun: true })).lights[0].direction;
    const [x, y, z] = await towardSun({});
    // Counterclockwise as seen from above.
    near(await towardSun({ rotate: 90 }), [z, y, -x]);
    // three.js has the center at +X, its right half at +Z.
    near(await towardSun({ convention: "three" }), [-z, y, x]);
    near(await towardSun({ up: "z" }), [x, -z, y]);
    const bright = await load(sunny(), { scale: 2, exposure: 1 });
    near(irradiance(await bright.pixels()), irradiance(await (await load(sunny())).pixels()).map((l) => 4 * l));
  });

  test("harmonics and Gaussians have the light of the map", async () => {
    const map = await load(sunny());
    const y0 = Math.sqrt(1 / (4 * Math.PI)), all = irradiance(await map.pixels());
    const harmonics = await sh(map);
    assert.equal(harmonics.length, 27);
    near([...harmonics.slice(0, 3)].map((c) => c / y0), all);
    const { n, lobes, hasSun } = await sg(map, { n: 9 });
    assert.deepEqual([n, lobes.length, hasSun], [9, 63, true]);
    assert.ok(angle(lobes.slice(0, 3), sun.direction) < 0.1);
    const flux = [0, 0, 0];
    for (let i = 0; i < n; i++) {
      const [, , , sharpness, ...amplitude] = lobes.slice(7 * i, 7 * i + 7);
      const integral = (2 * Math.PI / sharpness) * (1 - Math.exp(-2 * sharpness));
      amplitude.forEach((a, c) => { flux[c] += a * integral; });
    }
    near(flux, all, 1e-3);
  });

  test("prefiltered light comes as files", async () => {
    const map = await load(sunny(), { name: "sunny.pfm" });
    const { radiance, irradiance: diffuse, brdf, levels, harmonics, warnings } = await ibl(map, { size: 16, for: "three", sun: "remove" });
    for (const file of [radiance, diffuse, brdf]) assert.equal(Buffer.from(file.slice(1, 7)).toString(), "KTX 20");
    assert.deepEqual(levels.map(({ size }) => size), [16, 8, 4, 2, 1]);
    assert.deepEqual(levels.map(({ roughness }) => roughness), [0, 0.25, 0.5, 0.75, 1]);
    assert.equal(harmonics.length, 27);
    assert.deepEqual(warnings, []);
    const clamped = await ibl(map, { size: 8, sun: "clamp:10", container: "dds", texels: "half" });
    assert.equal(Buffer.from(clamped.radiance.slice(0, 4)).toString(), "DDS ");
    const square = await ibl(map, { size: 16, layout: "octahedral" });
    // The number of faces.
    assert.equal(square.radiance[36], 1);
    assert.match(clamped.warnings.join(), /^sunny\.pfm: clamped, -\d+\.\d\d % light$/);
    assert.match((await ibl(await load(even(1)), { size: 4, sun: "remove" })).warnings.join(), /there is no sun.*; nothing is removed$/);
  });

  test("a picture has the light of the map", async () => {
    const shares = [];
    const white = { width: 16, height: 16, spp: 4, material: "diffuse:1", exposure: 0, tone: "standard", onProgress: (share) => shares.push(share) };
    const picture = await render({ builtin: "sphere" }, await load(even(0.5)), { ...white, background: false });
    assert.deepEqual([picture.width, picture.height, picture.exposure, picture.linear.length, picture.pixels.length], [16, 16, 0, 1024, 1024]);
    const center = 4 * (8 * 16 + 8);
    // A white convex body in even light is as bright as the light.
    near(picture.linear.slice(center, center + 4), [0.5, 0.5, 0.5, 1], 0.02);
    assert.deepEqual([...picture.pixels.slice(0, 4)], [0, 0, 0, 0]);
    assert.ok(Math.abs(picture.pixels[center] - 188) <= 2, `${picture.pixels[center]}`);
    assert.match(picture.strategy, /^product/);
    assert.ok(picture.cameraRays >= 1024 && picture.shadowRays > 0);
    assert.equal(shares.at(-1), 1);
    const seen = await render({ builtin: "sphere" }, even(0.5), white);
    near(seen.linear.slice(0, 4), [0.5, 0.5, 0.5, 1], 1e-3);
  });

  test("scenes come from files, with a camera and other files", async () => {
    const settings = { width: 16, height: 16, spp: 1, background: false };
    const red = await render(new Uint8Array(glb()), { builtin: "studio" }, settings);
    const alpha = (picture) => [...picture.linear].filter((_, i) => i % 4 === 3).reduce((s, a) => s + a, 0);
    assert.ok(alpha(red) > 50);
    const away = await render(new Uint8Array(glb()), { builtin: "studio" }, { ...settings, camera: { origin: [0, 0.5, 4], target: [0, 0.5, 8], fov: 40 } });
    assert.equal(alpha(away), 0);
    const described = await render(Buffer.from(SCENE), { builtin: "studio" }, { ...settings, name: "scene.toml", files: { "triangle.obj": Buffer.from(OBJ) } });
    assert.ok(alpha(described) > 20);
  });

  test("what is wrong is said, and the engine goes on", async () => {
    const map = await load(sunny(), { name: "sunny.pfm" });
    const text = Buffer.from(sunny());
    const wrong = [
      [() => load(new Uint8Array()), /^the map: the file is empty/],
      [() => load(text.subarray(0, 1000), { name: "cut.pfm" }), /^cut\.pfm: .*(truncated|ends|bytes)/],
      [() => load(Buffer.from("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 64 +X 128\n\x02\x02"), { name: "cut.hdr" }), /^cut\.hdr: /],
      [() => load(Buffer.from("nothing")), /not a picture in a known format/],
      [() => load(pfm(4, 2, () => [NaN, 1, 1]), { strict: true }), /texel \(0, 0\) has R = NaN/],
      [() => load(join(folder, "missing.hdr")), /ENOENT.*missing\.hdr/],
      [() => load("http://127.0.0.1:1/map.hdr"), /^http:\/\/127\.0\.0\.1:1\/map\.hdr: /],
      [() => load(7), /a file is given as/],
      [() => load({ builtin: "moon" }), /no built-in probe "moon"/],
      [() => load(sunny(), { rotation: 3 }), /^load: option rotation: unknown field/],
      [() => load(sunny(), { rotate: NaN }), /^load: option rotate: NaN is not a finite number/],
      [() => load(sunny(), { convention: "maya" }), /^load: option convention: there is no convention "maya"; known are blender/],
      [() => load(sunny(), { mapping: "flat" }), /^load: option mapping: /],
      [() => lights(map, { n: 0 }), /^a rig has at least one light; 0 were requested/],
      [() => lights(map, { n: 1 << 20 }), /only \d+ texels of the map are not black/],
      [() => lights(map, { suns: true }), /^lights: option suns: unknown field `suns`, expected one of `n`/],
      [() => lights(map, { n: 4, error: 1 }), /^lights: only one of the options n and error/],
      [() => lights({}), /a map is what load\(\) returns/],
      [() => lights(load(sunny())), /await it/],
      [() => sg(map, { n: 2000 }), /2000 lobes were requested; there are at most 1024/],
      [() => sg(map, { k: 4 }), /^sg: option k: /],
      [() => ibl(map, { size: 0 }), /^ibl: option size: 0 is not in \[1, 4096\]/],
      [() => ibl(map, { for: "maya" }), /^ibl: option for: unknown engine "maya"; known are three/],
      [() => ibl(map, { layout: "disc" }), /^ibl: option layout: unknown layout "disc"; known are cube, octahedral/],
      [() => ibl(map, { sun: "eat" }), /^ibl: option sun: "eat" is not keep, remove or clamp:X/],
      [() => render(new Uint8Array(9), map), /^scene\.glb/],
      [() => render({ builtin: "sphere" }, map, { width: 0 }), /^render: option width: 0 is not in \[1, 8192\]/],
      [() => render({ builtin: "sphere" }, map, { spp: 0 }), /^render: option spp/],
      [() => render({ builtin: "sphere" }, map, { strategy: "luck" }), /luck/],
      [() => render({ builtin: "sphere" }, map, { tone: "sepia" }), /^render: option tone: unknown tone curve "sepia"/],
      [() => render({ builtin: "sphere" }, map, { camera: { origin: [0, 0, 0] } }), /^render: option camera: missing field `target`/],
      [() => render(Buffer.from(SCENE), map, { name: "scene.toml" }), /triangle\.obj.*it is not among the option files/],
    ];
    for (const [act, message] of wrong) await assert.rejects(act, (error) => assert.match(error.message, message) ?? true, String(act));
    assert.equal((await lights(map, { n: 3 })).lights.length, 3);
  });

  test("odd maps work", async () => {
    const one = await load(pfm(1, 1, () => [1, 2, 3]));
    near((await lights(one, { n: 1 })).lights[0].irradiance, [1, 2, 3].map((l) => 4 * Math.PI * l));
    await assert.rejects(lights(one, { n: 2 }), /only 1 texels/);
    await assert.rejects(lights(one, { sun: true }), /^Error: there is no sun/);
    const black = await load(even(0));
    await assert.rejects(lights(black), /the map is black/);
    const repaired = await load(pfm(8, 4, (x) => [x ? 1 : NaN, 1, -1]), { name: "broken.pfm" });
    assert.match(repaired.warnings.join(), /^broken\.pfm: repaired 32 negative and 4 NaN or infinite values/);
  });

  test("a map that was freed is refused", async () => {
    const map = await load(sunny());
    map.free();
    await assert.rejects(sh(map), /the map was freed; load it again/);
  });
});

/** The module for maps with the memory that it begins with and a megabyte more. */
function confined() {
  const bytes = readFileSync(new URL("../dist/light/engine_bg.wasm", import.meta.url));
  const number = (at) => {
    let value = 0, shift = 0, byte;
    do { byte = bytes[at++]; value += (byte & 127) << shift; shift += 7; } while (byte & 128);
    return [value, at];
  };
  const encoded = (value) => (value < 128 ? [value] : [(value & 127) | 128, ...encoded(value >> 7)]);
  for (let at = 8; at < bytes.length;) {
    const id = bytes[at], [length, start] = number(at + 1);
    if (id === 5) {
      // One memory, which has a first size but no largest.
      const [pages] = number(start + 2), body = [1, 1, ...encoded(pages), ...encoded(pages + 16)];
      return new Uint8Array(Buffer.concat([bytes.subarray(0, at), Buffer.from([5, body.length, ...body]), bytes.subarray(start + length)]));
    }
    at = start + length;
  }
  throw new Error("the module has no memory");
}

test("an engine that runs out of memory ends, and another begins", async () => {
  configure({ light: confined() });
  const map = await load(sunny());
  await assert.rejects(load({ builtin: "sky" }, { rows: 512 }), /^Error: the engine failed, perhaps because it needs more memory/);
  await assert.rejects(sh(map), /the map was lost when the engine failed; load it again/);
  assert.equal((await load(sunny())).width, WIDTH);
});

test("a module that is none is said", async () => {
  configure({ light: new Uint8Array(4) });
  await assert.rejects(load(sunny()), /WebAssembly/);
  configure({});
  assert.equal((await load(sunny())).width, WIDTH);
});

test("values are those of the program", { skip: !process.env.DOMELIGHT && "$DOMELIGHT is not set" }, async () => {
  configure({});
  const path = join(folder, "program.pfm");
  writeFileSync(path, sunny());
  const program = (...words) => execFileSync(process.env.DOMELIGHT, words, { encoding: "utf8" });
  const map = await load(path, { rotate: 20 });
  const common = [path, "--env-rotate", "20"];
  for (const [options, words] of [[{ sun: true }, ["--sun"]], [{ n: 9, sun: true }, ["-n", "9", "--sun"]], [{ n: 12, method: "median-cut" }, ["-n", "12", "--method", "median-cut"]]]) {
    const rig = await lights(map, options), expected = JSON.parse(program("lights", ...common, ...words, "--json", "--preview", "none"));
    const single = (values) => values.map(Math.fround);
    assert.deepEqual(
      rig.lights.map(({ name, direction, irradiance, angularRadius }) => [name, single(direction), single(irradiance), Math.fround(angularRadius)]),
      expected.lights.map((light) => [light.name, single(light.direction), single(light.irradiance), Math.fround(light.angular_radius)]),
    );
    if (expected.dome) assert.deepEqual([...rig.harmonics], single(expected.dome.flat()));
  }
  const cube = join(folder, "cube.ktx2");
  program("ibl", ...common, "--for", "three", "--size", "16", "-o", cube, "-q");
  assert.ok(readFileSync(cube).equals((await ibl(map, { for: "three", size: 16 })).radiance));
  const film = join(folder, "film.pfm");
  program("render", "spheres", "--env", path, "--env-rotate", "20", "--size", "32x24", "--spp", "4", "-o", film, "-q");
  const expected = readFileSync(film), { linear } = await render({ builtin: "spheres" }, map, { width: 32, height: 24, spp: 4 });
  const texels = pfm(32, 24, (x, y) => linear.slice(4 * (32 * y + x), 4 * (32 * y + x) + 3));
  assert.ok(expected.subarray(-32 * 24 * 12).equals(Buffer.from(texels).subarray(-32 * 24 * 12)));
});
