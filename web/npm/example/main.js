// Drop an HDRI: its sun and lamps become lights with shadows, and what they leave the environment.

import * as THREE from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { GLTFExporter } from "three/addons/exporters/GLTFExporter.js";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { lights, load, render } from "domelight";
import { addRig } from "domelight/three";

const $ = (id) => document.getElementById(id);
/** Most lamps beside the sun. */
const LAMPS = 4;

const renderer = new THREE.WebGLRenderer({ canvas: $("view"), antialias: true });
renderer.shadowMap.enabled = true;
renderer.shadowMap.type = THREE.PCFShadowMap;
renderer.toneMapping = THREE.AgXToneMapping;
const scene = new THREE.Scene();
const camera = new THREE.PerspectiveCamera(35, 1, 0.1, 100);
camera.position.set(3.2, 2.4, 5.2);
const controls = new OrbitControls(camera, renderer.domElement);
controls.target.set(0, 0.7, 0);

/** What stands on the ground. */
const model = new THREE.Group();
const ground = new THREE.Mesh(new THREE.CircleGeometry(3.5, 96).rotateX(-Math.PI / 2), new THREE.MeshStandardMaterial({ color: 0x9a9a94, roughness: 1 }));
scene.add(model, ground);

function statue() {
  const mesh = (geometry, settings, x, y, z) => {
    const made = new THREE.Mesh(geometry, new THREE.MeshStandardMaterial(settings));
    made.position.set(x, y, z);
    return made;
  };
  return [
    mesh(new THREE.TorusKnotGeometry(0.55, 0.18, 192, 32), { color: 0xc8502f, roughness: 0.45 }, 0, 0.93, 0),
    mesh(new THREE.SphereGeometry(0.4, 64, 48), { color: 0xffffff, roughness: 1 }, 1.45, 0.4, 0.5),
    mesh(new THREE.SphereGeometry(0.4, 64, 48), { color: 0xd8d8d8, roughness: 0.15, metalness: 1 }, -1.45, 0.4, 0.6),
  ];
}

function show(...objects) {
  model.clear();
  model.add(...objects);
  scene.traverse((object) => { if (object.isMesh) object.castShadow = object.receiveShadow = true; });
}

let map = null, hdri = { builtin: "sky" }, exposure = 0;

const radians = (angle) => `${(angle * 180 / Math.PI).toFixed(1)}°`;
function list(rig) {
  $("lights").replaceChildren(...rig.lights.map(({ name, color, intensity, angularRadius, share }) => {
    const row = document.createElement("tr");
    const css = `rgb(${color.map((c) => Math.round(255 * c ** (1 / 2.2))).join()})`;
    row.innerHTML = `<td><i style="background:${css}"></i>${name}<td>${intensity.toPrecision(3)}<td>${radians(angularRadius)}<td>${(100 * share).toFixed(1)} %`;
    return row;
  }));
}

/** An exposure [stops] under which a gray card that faces up is middle gray. */
function exposureOf(rig) {
  const [r, g, b] = [0, 1, 2].map((c) => rig.lights.reduce((sum, { direction, irradiance }) => sum + Math.max(0, direction[1]) * irradiance[c], 0));
  // Y00 and Y1-1 of the residual, times their shares of irradiance.
  const dome = (c) => (rig.harmonics ? 0.886227 * rig.harmonics[c] + 1.023328 * rig.harmonics[3 + c] : 0);
  const luminance = 0.2126 * (r + dome(0)) + 0.7152 * (g + dome(1)) + 0.0722 * (b + dome(2));
  return Math.log2(Math.PI / Math.max(luminance, 1e-9));
}

/** Lights of the map; one without a sun and lamps lights as a whole. */
async function rigOf(map) {
  const whole = () => ({ lights: [], orientation: { up: map.up, rotation: map.rotation }, residual: map, harmonics: null, error: null });
  if (!$("sun").checked) return whole();
  for (const options of [{ sun: true, lamps: LAMPS }, { lamps: LAMPS }]) {
    try {
      return await lights(map, { ...options, residual: true });
    } catch (error) {
      if (!/^there is no (sun|lamp)/.test(error.message)) throw error;
    }
  }
  return whole();
}

async function relight() {
  const rotate = Number($("rotate").value);
  $("degrees").value = `${rotate}°`;
  const before = map;
  map = await load(hdri, { rotate });
  before?.free();
  const rig = await rigOf(map);
  await addRig(scene, rig, { background: map, bounds: new THREE.Box3().setFromObject(model).expandByScalar(0.8) });
  if (rig.residual !== map) rig.residual?.free();
  list(rig);
  if (rig.lights.length) exposure = exposureOf(rig);
  renderer.toneMappingExposure = 2 ** exposure;
}

/** One after the other; what goes wrong is shown. */
let last = Promise.resolve();
function attempt(act) {
  last = last.then(act).then(() => { $("message").textContent = ""; }, (error) => { $("message").textContent = error.message; });
  return last;
}

async function open(file) {
  if (/\.glb$/i.test(file.name)) {
    const { scene: loaded } = await new GLTFLoader().parseAsync(await file.arrayBuffer(), "");
    const box = new THREE.Box3().setFromObject(loaded), size = box.getSize(new THREE.Vector3()), center = box.getCenter(new THREE.Vector3());
    const scale = 2 / Math.max(size.x, size.y, size.z);
    loaded.scale.multiplyScalar(scale);
    loaded.position.set(-center.x, -box.min.y, -center.z).multiplyScalar(scale);
    show(loaded);
  } else {
    hdri = file;
  }
  await relight();
}

/** The same view by domelight, beside that of three.js. */
async function compare() {
  const canvas = $("rendered");
  canvas.parentElement.hidden = false;
  resize();
  const exported = new THREE.Group();
  exported.add(model.clone(), ground.clone());
  const glb = await new GLTFExporter().parseAsync(exported, { binary: true });
  const { width, height } = renderer.domElement;
  const picture = await render(glb, map, {
    width, height, spp: 32, exposure, tone: "agx",
    camera: { origin: camera.position.toArray(), target: controls.target.toArray(), fov: camera.fov },
    onProgress: (share) => { $("render").textContent = `${Math.round(100 * share)} %`; },
  });
  [canvas.width, canvas.height] = [width, height];
  canvas.getContext("2d").putImageData(new ImageData(picture.pixels, width, height), 0, 0);
  $("render").textContent = "Render with domelight";
}

function resize() {
  const { clientWidth: width, clientHeight: height } = renderer.domElement.parentElement;
  renderer.setSize(width, height, false);
  camera.aspect = width / height;
  camera.updateProjectionMatrix();
}

addEventListener("resize", resize);
addEventListener("dragover", (event) => { event.preventDefault(); document.body.classList.add("over"); });
addEventListener("dragleave", () => document.body.classList.remove("over"));
addEventListener("drop", (event) => {
  event.preventDefault();
  document.body.classList.remove("over");
  const [file] = event.dataTransfer.files;
  if (file) attempt(() => open(file));
});
$("file").addEventListener("change", ({ target: { files: [file] } }) => file && attempt(() => open(file)));
for (const id of ["rotate", "sun"]) $(id).addEventListener("change", () => attempt(relight));
$("render").addEventListener("click", () => attempt(compare).then(() => { document.documentElement.dataset.rendered = ""; }));

show(...statue());
resize();
renderer.setAnimationLoop(() => {
  controls.update();
  renderer.render(scene, camera);
});
await attempt(relight);
document.documentElement.dataset.ready = "";
