// The package in headless Chromium: in a Worker and without, and in three.js.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";

import { lights, load, sh } from "domelight";
import { close, launch, open } from "./browser.js";
import { angle, sun, sunny } from "./maps.js";

before(launch);
after(close);

const bytes = [...sunny()];

/** What `run`, a function of the page, makes of the test map's bytes. */
async function inPage(run, ...more) {
  const { page, done } = await open();
  const result = await page.evaluate(run, [bytes, ...more]);
  const workers = page.workers().length;
  await done();
  return { result, workers };
}

for (const worker of [true, false]) test(`values are those in Node, ${worker ? "in a Worker" : "without a Worker"}`, async () => {
  const { result, workers } = await inPage(async ([bytes, worker]) => {
    const { configure, lights, load, render, sh } = await import("domelight");
    configure({ worker });
    const map = await load(new File([new Uint8Array(bytes)], "sunny.pfm"));
    const rig = await lights(map, { sun: true, lamps: 2, residual: true });
    const picture = await render({ builtin: "sphere" }, map, { width: 8, height: 8, spp: 1 });
    return { name: map.name, lights: rig.lights, harmonics: [...await sh(rig.residual)], pixels: picture.pixels instanceof Uint8ClampedArray };
  }, worker);
  assert.equal(workers, worker ? 2 : 0);
  const map = await load(sunny()), rig = await lights(map, { sun: true, lamps: 2, residual: true });
  assert.deepEqual(result, { name: "sunny.pfm", lights: rig.lights, harmonics: [...await sh(rig.residual)], pixels: true });
});

test("what is wrong is said", async () => {
  const { result } = await inPage(async ([bytes]) => {
    const { lights, load } = await import("domelight");
    const message = (promise) => promise.then(() => "nothing", (error) => error.message);
    const map = await load(new Uint8Array(bytes));
    return [await message(load("/missing.hdr")), await message(load(new Blob([]))), await message(lights(map, { n: 0 })), (await lights(map, { n: 2 })).lights.length];
  });
  assert.match(result[0], /\/missing\.hdr: HTTP 404$/);
  assert.deepEqual(result.slice(1), ["the map: the file is empty", "a rig has at least one light; 0 were requested", 2]);
});

test("where no Worker is allowed, that is said, and it works without", async () => {
  const { result } = await inPage(async ([bytes]) => {
    const policy = document.createElement("meta");
    [policy.httpEquiv, policy.content] = ["Content-Security-Policy", "worker-src 'none'"];
    document.head.append(policy);
    const { configure, load } = await import("domelight");
    const refused = await load(new Uint8Array(bytes)).catch((error) => error.message);
    configure({ worker: false });
    return [refused, (await load(new Uint8Array(bytes))).width];
  });
  assert.match(result[0], /the Worker of domelight did not start.*configure\(\{ worker: false \}\) does without it/);
  assert.equal(result[1], 64);
});

test("a map of 1k becomes lights in a moment", async (t) => {
  const { result } = await inPage(async () => {
    const { lights, load } = await import("domelight");
    const map = await load({ builtin: "sky" }, { rows: 512 });
    const start = performance.now();
    const { residual } = await lights(map, { sun: true, residual: true });
    return { milliseconds: performance.now() - start, size: [residual.width, residual.height] };
  });
  t.diagnostic(`the sun of a map of 1k: ${Math.round(result.milliseconds)} ms`);
  assert.deepEqual(result.size, [1024, 512]);
});

/** Runs `draw` with a scene of three.js, and what reads its radiance from above or from the side. */
async function drawn(draw, ...more) {
  const { page, done } = await open();
  await page.evaluate(async () => {
    const THREE = await import("three");
    const renderer = new THREE.WebGLRenderer();
    renderer.shadowMap.enabled = true;
    window.THREE = THREE;
    /** The radiance that an orthographic camera sees of a square of the width 2, linear, from the bottom left. */
    window.radiance = (scene, size, from, up = new THREE.Vector3(0, 1, 0)) => {
      const camera = new THREE.OrthographicCamera(-1, 1, 1, -1, 0.1, 20);
      camera.up.copy(up);
      camera.position.copy(from);
      camera.lookAt(0, 0, 0);
      const target = new THREE.WebGLRenderTarget(size, size, { type: THREE.FloatType });
      renderer.setRenderTarget(target);
      renderer.render(scene, camera);
      const pixels = new Float32Array(4 * size * size);
      renderer.readRenderTargetPixels(target, 0, 0, size, size, pixels);
      return pixels;
    };
    window.ball = (radius, material = new THREE.MeshStandardMaterial({ roughness: 1 })) => new THREE.Mesh(new THREE.SphereGeometry(radius, 128, 64), material);
  });
  const result = await page.evaluate(draw, [bytes, ...more]);
  await done();
  return result;
}

/** The vector b with which b · n is nearest to the values of normals that it faces, by least squares. */
function brightest(samples) {
  const a = Array.from({ length: 3 }, () => [0, 0, 0]), r = [0, 0, 0];
  for (const { n, value } of samples) for (let i = 0; i < 3; i++) {
    r[i] += n[i] * value;
    for (let j = 0; j < 3; j++) a[i][j] += n[i] * n[j];
  }
  const det = (m) => m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
  const solved = [0, 1, 2].map((k) => det(a.map((row, i) => row.map((x, j) => (j === k ? r[i] : x)))) / det(a));
  const length = Math.hypot(...solved);
  return { direction: solved.map((x) => x / length), length };
}

/** Normals of a unit ball in a picture of `size` pixels from +Z, away from its edge. */
function normals(size) {
  const found = [];
  for (let i = 0; i < size * size; i++) {
    const x = (2 * (i % size) + 1) / size - 1, y = (2 * Math.floor(i / size) + 1) / size - 1, zz = 1 - x * x - y * y;
    if (zz > 0.05) found.push({ i, n: [x, y, Math.sqrt(zz)] });
  }
  return found;
}

test("a white ball is brightest toward the sun, and as bright as it should be", async () => {
  for (const rotate of [0, 75, -130]) {
    const size = 128;
    const { pixels, light } = await drawn(async ([bytes, rotate, size]) => {
      const { lights, load } = await import("domelight");
      const { addRig } = await import("domelight/three");
      const scene = new THREE.Scene().add(ball(1, new THREE.MeshLambertMaterial()));
      const rig = await lights(await load(new Uint8Array(bytes), { rotate }), { sun: true });
      await addRig(scene, rig, { environment: false });
      return { pixels: [...radiance(scene, size, new THREE.Vector3(0, 0, 5))], light: rig.lights[0] };
    }, rotate, size);
    const lit = normals(size).map(({ i, n }) => ({ n, value: pixels[4 * i + 1] })).filter(({ value }) => value > 0.01 * light.irradiance[1]);
    const { direction, length } = brightest(lit);
    assert.ok(angle(direction, light.direction) < 1, `${rotate}: ${angle(direction, light.direction)}°`);
    assert.ok(Math.abs(length * Math.PI / light.irradiance[1] - 1) < 0.01, `${length * Math.PI} is not ${light.irradiance[1]}`);
    if (rotate === 0) assert.ok(angle(direction, sun.direction) < 1);
  }
});

test("the residual stands as the map and is as bright, by texture and by harmonics", async () => {
  const size = 64;
  // A map that is brightest at one side.
  const { pictures, harmonics } = await drawn(async ([, size]) => {
    const { lights, load } = await import("domelight");
    const { addRig } = await import("domelight/three");
    const map = await load({ builtin: "sky" }, { rows: 64, rotate: 50 });
    const pictures = [];
    let harmonics;
    for (const residual of [true, false]) {
      const scene = new THREE.Scene().add(ball(1));
      const rig = await lights(map, { sun: true, residual });
      await addRig(scene, { ...rig, lights: [] });
      pictures.push([...radiance(scene, size, new THREE.Vector3(0, 0, 5))]);
      harmonics = [...rig.harmonics];
    }
    return { pictures, harmonics };
  }, size);
  /** The irradiance of green light over π of a normal. */
  const expected = ([x, y, z]) => {
    const basis = [0.282095, 0.488603 * y, 0.488603 * z, 0.488603 * x, 1.092548 * x * y, 1.092548 * y * z, 0.315392 * (3 * z * z - 1), 1.092548 * x * z, 0.546274 * (x * x - y * y)];
    return basis.reduce((sum, b, i) => sum + b * harmonics[3 * i + 1] * (i === 0 ? 1 : i < 4 ? 2 / 3 : 1 / 4), 0);
  };
  for (const pixels of pictures) {
    const errors = normals(size).map(({ i, n }) => Math.abs(pixels[4 * i + 1] / expected(n) - 1));
    const mean = errors.reduce((sum, e) => sum + e, 0) / errors.length;
    assert.ok(mean < 0.05, `${100 * mean} %`);
  }
});

test("the shadow of a ball falls away from the sun", async () => {
  const size = 256, height = 0.25;
  const { pixels, direction } = await drawn(async ([bytes, size, height]) => {
    const { lights, load } = await import("domelight");
    const { addRig } = await import("domelight/three");
    const above = ball(0.1), ground = new THREE.Mesh(new THREE.PlaneGeometry(4, 4).rotateX(-Math.PI / 2), new THREE.MeshStandardMaterial());
    above.position.y = height;
    above.castShadow = ground.receiveShadow = true;
    const scene = new THREE.Scene().add(above, ground);
    const rig = await lights(await load(new Uint8Array(bytes)), { sun: true });
    await addRig(scene, rig, { environment: false });
    // What casts the shadow is not to be seen itself.
    above.material.colorWrite = above.material.depthWrite = false;
    return { pixels: [...radiance(scene, size, new THREE.Vector3(0, 5, 0), new THREE.Vector3(0, 0, -1))], direction: rig.lights[0].direction };
  }, size, height);
  let [n, x, z] = [0, 0, 0];
  for (let i = 0; i < size * size; i++) if (pixels[4 * i] === 0) {
    n++;
    x += (2 * (i % size) + 1) / size - 1;
    z -= (2 * Math.floor(i / size) + 1) / size - 1;
  }
  assert.ok(n > 50, "there is no shadow");
  const [toX, toY, toZ] = direction;
  assert.ok(Math.hypot(x / n + toX / toY * height, z / n + toZ / toY * height) < 0.02, `the shadow is at ${x / n}, ${z / n}`);
});

test("a background shows the map where its light comes from", async () => {
  const { result } = await inPage(async ([bytes]) => {
    const THREE = await import("three");
    const { lights, load } = await import("domelight");
    const { addRig } = await import("domelight/three");
    const map = await load(new Uint8Array(bytes), { rotate: 33 });
    const scene = new THREE.Scene(), rig = await lights(map, { sun: true, residual: true });
    const { background } = await addRig(scene, rig, { background: map });
    const renderer = new THREE.WebGLRenderer(), target = new THREE.WebGLRenderTarget(65, 65, { type: THREE.FloatType });
    const camera = new THREE.PerspectiveCamera(12, 1, 0.1, 10);
    camera.lookAt(...rig.lights[0].direction);
    renderer.setRenderTarget(target);
    renderer.render(scene, camera);
    const pixels = new Float32Array(4 * 65 * 65);
    renderer.readRenderTargetPixels(target, 0, 0, 65, 65, pixels);
    let [sum, x, y] = [0, 0, 0];
    for (let i = 0; i < 65 * 65; i++) {
      const value = pixels[4 * i];
      [sum, x, y] = [sum + value, x + value * (i % 65 - 32), y + value * (Math.floor(i / 65) - 32)];
    }
    return { offset: [x / sum, y / sum].map((d) => d * 12 / 65), name: background.name };
  });
  assert.equal(result.name, "the map");
  assert.ok(Math.hypot(...result.offset) < 1, `the sun is ${result.offset} degrees away`);
});

test("a rig is replaced, and taken back", async () => {
  const { result } = await inPage(async ([bytes]) => {
    const THREE = await import("three");
    const { lights, load } = await import("domelight");
    const { addRig, removeRig } = await import("domelight/three");
    const scene = new THREE.Scene(), own = new THREE.Texture();
    scene.environment = own;
    scene.environmentRotation.y = 1;
    scene.background = new THREE.Color(0x112233);
    const map = await load(new Uint8Array(bytes)), rig = await lights(map, { sun: true, residual: true });
    await addRig(scene, rig, { background: map });
    const { group, environment } = await addRig(scene, rig);
    const during = { children: scene.children.length, lights: group.children.filter((child) => child.isLight).length, casts: group.children[0].castShadow, environment: scene.environment === environment, background: scene.background.getHex?.() };
    removeRig(scene);
    removeRig(scene);
    const upright = await lights(await load(new Uint8Array(bytes), { up: "z" }), { n: 1 });
    const refused = await addRig(scene, upright).catch((error) => error.message);
    return { during, after: [scene.children.length, scene.environment === own, scene.environmentRotation.y, scene.background.getHex()], refused };
  });
  assert.deepEqual(result.during, { children: 1, lights: 1, casts: true, environment: true, background: 0x112233 });
  assert.deepEqual(result.after, [0, true, 1, 0x112233]);
  assert.match(result.refused, /\+Y is up in scenes of three\.js/);
});

test("the example lights its scene, and shows domelight's picture of it", async () => {
  const { page, done } = await open("/dist/example/index.html", { width: 560, height: 160 });
  await page.waitForSelector("html[data-ready]", { state: "attached" });
  assert.match(await page.textContent("#lights"), /^sun/);
  await page.setInputFiles("#file", { name: "broken.hdr", mimeType: "application/octet-stream", buffer: Buffer.from("broken") });
  await page.waitForFunction(() => /^broken\.hdr: not a picture/.test(document.getElementById("message").textContent));
  await page.setInputFiles("#file", { name: "sunny.pfm", mimeType: "application/octet-stream", buffer: Buffer.from(sunny()) });
  await page.waitForFunction(() => document.getElementById("message").textContent === "");
  await page.click("#render");
  await page.waitForSelector("html[data-rendered]", { state: "attached" });
  assert.equal(await page.textContent("#message"), "");
  await done();
});
