// Makes the models and their variants, renders all, and compares; see `run`.
import { execFileSync } from "node:child_process";
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { MODELS } from "./models.mjs";

const folder = process.argv[2];
const program = process.env.DOMELIGHT;
const bin = (name) => join(import.meta.dirname, "node_modules", ".bin", name);
const quiet = { stdio: ["ignore", "ignore", "pipe"] };
const node = (...args) => execFileSync(process.execPath, args, quiet);
const pack = (...args) => (from, to) => node(bin("gltfpack"), "-i", from, "-o", to, ...args);
const transform = (command, ...args) => (from, to) => node(bin("gltf-transform"), command, from, to, ...args);
const ktx2 = (kind) => (from, to) => node(join(import.meta.dirname, "ktx2.mjs"), kind, from, to);

// How far a variant's picture may be from the original's, as mean ꟻLIP. Positions of 14 bits and normals of 8 move
// edges and highlights a little; a lost texture, normal map or transform costs many times as much.
const FINE = 0.004;
const QUANTIZED = 0.02;
const BLOCKS = 0.04;
// Lossy textures, the normal map among them, differ by what their encoder lost. So beside a wide bound the picture must be
// that of the same file with its textures decoded by another decoder, within FINE, where there is one.
const LOSSY = 0.15;

const gltfpack = [
  ["quantized", "KHR_mesh_quantization", pack(), QUANTIZED],
  ["meshopt-ext", "EXT_meshopt_compression", pack("-c", "-ce", "ext"), QUANTIZED],
  ["meshopt-khr", "KHR_meshopt_compression", pack("-c", "-ce", "khr"), QUANTIZED],
  ["meshopt-khr-high", "KHR_meshopt_compression", pack("-cc", "-ce", "khr", "-vp", "16", "-vn", "10"), QUANTIZED],
  ["meshopt-fallback", "KHR_meshopt_compression", pack("-cf", "-ce", "khr"), QUANTIZED],
  ["meshopt-float", "KHR_meshopt_compression", pack("-c", "-ce", "khr", "-vpf", "-vnf", "-vtf"), QUANTIZED],
  ["meshopt-float-ext", "EXT_meshopt_compression", pack("-c", "-ce", "ext", "-vpf", "-vnf", "-vtf"), QUANTIZED],
  ["meshopt-interleaved", "KHR_meshopt_compression", pack("-c", "-ce", "khr", "-vi"), QUANTIZED],
];
const gltfTransform = [
  ["transform-quantize", "KHR_mesh_quantization", transform("quantize"), QUANTIZED],
  ["transform-meshopt", "EXT_meshopt_compression", transform("meshopt", "--level", "medium"), QUANTIZED],
  ["transform-meshopt-high", "EXT_meshopt_compression", transform("meshopt", "--level", "high"), QUANTIZED],
  ["draco", "KHR_draco_mesh_compression", transform("draco"), QUANTIZED],
  ["draco-sequential", "KHR_draco_mesh_compression", transform("draco", "--method", "sequential"), QUANTIZED],
];
const textures = [
  ["webp", "EXT_texture_webp", transform("webp", "--lossless", "true"), FINE],
  ["webp-lossy", "EXT_texture_webp", transform("webp", "--quality", "90"), LOSSY, transform("png")],
  ["etc1s", "KHR_texture_basisu", ktx2("etc1s"), LOSSY],
  ["uastc", "KHR_texture_basisu", ktx2("uastc"), BLOCKS],
];
const VARIANTS = {
  textured: [...gltfpack, ...gltfTransform, ...textures, ["tangents", null, transform("tangents"), FINE]],
  animated: [...gltfpack, ...gltfTransform],
  instances: [
    ["gpu-instancing", "EXT_mesh_gpu_instancing", transform("instance"), FINE],
    ["gpu-instancing-packed", "EXT_mesh_gpu_instancing", pack("-mi", "-c", "-ce", "khr"), QUANTIZED],
  ],
  sparse: [["sparse", "sparse", transform("sparse"), FINE], ...gltfpack.slice(0, 3)],
  layered: [...gltfpack.slice(0, 3), ...gltfTransform.slice(2, 4), textures[0], textures[3]],
};
const RENDER = { animated: ["--animation", "0", "--at", "0.8"] };

// The JSON of a GLB file.
function document(file) {
  const bytes = readFileSync(file);
  return JSON.parse(bytes.subarray(20, 20 + bytes.readUInt32LE(12)).toString());
}

function has(file, extension) {
  const json = document(file);
  if (extension === "sparse") return json.accessors.some((a) => a.sparse);
  return extension === null || (json.extensionsUsed ?? []).includes(extension);
}

// How the file's views are compressed, by mode and filter.
const seen = new Set();
function note(file) {
  for (const view of document(file).bufferViews ?? []) {
    for (const { mode, filter } of Object.values(view.extensions ?? {})) seen.add(filter ? `${mode} ${filter}` : mode);
  }
}
const FILTERS = ["TRIANGLES", ...["OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR"].map((f) => `ATTRIBUTES ${f}`)];

// The original's frame, for all of its variants: encoders may change bounds by a hair.
const VIEWS = {
  textured: ["--origin", "0,2.2,4.4", "--target", "0,0,0"],
  animated: ["--origin", "-0.6,2,6", "--target", "-0.3,1,0"],
  instances: ["--origin", "6,12,22", "--target", "6,0,6"],
  sparse: ["--origin", "1,2.5,4.5", "--target", "0,0.2,0"],
  layered: ["--origin", "0,2.2,4.4", "--target", "0,0,0"],
};

function render(model, file, picture, ...more) {
  const settings = ["--strategy", "mis", "--env", "studio", "--env-rows", "256", "--size", "256x256", "--spp", "64", "--fov", "35"];
  execFileSync(program, ["render", file, ...settings, ...VIEWS[model], ...(RENDER[model] ?? []), ...more, "-q", "-o", picture, "-o", picture.replace(".exr", ".png")], quiet);
}

const failures = [];
const compare = (a, b) => JSON.parse(execFileSync(program, ["diff", a, b, "--json"], { encoding: "utf8" })).flip;
for (const [model, make] of Object.entries(MODELS)) {
  const original = join(folder, `${model}.glb`);
  writeFileSync(original, await make());
  const reference = join(folder, `${model}.exr`);
  render(model, original, reference);
  for (const [name, extension, encode, tolerance, decode] of VARIANTS[model]) {
    const file = join(folder, `${model}-${name}.glb`);
    const picture = file.replace(".glb", ".exr");
    let result;
    try {
      encode(original, file);
      if (!has(file, extension)) throw new Error(`the file lacks ${extension}`);
      note(file);
      render(model, file, picture);
      const flip = compare(picture, reference);
      result = `${flip.toFixed(4)} of ${tolerance}`;
      if (!(flip <= tolerance)) throw new Error(`FLIP ${result}`);
      if (decode) {
        const decoded = file.replace(".glb", "-decoded.glb");
        decode(file, decoded);
        render(model, decoded, decoded.replace(".glb", ".exr"));
        const own = compare(picture, decoded.replace(".glb", ".exr"));
        result += `, ${own.toFixed(4)} of ${FINE} from its own decoder`;
        if (!(own <= FINE)) throw new Error(`FLIP ${result}`);
      }
    } catch (error) {
      const text = (error.stderr?.length ? error.stderr.toString() : error.message).trim();
      failures.push(`${model}-${name}: ${text.split("\n").slice(-3).join(" ")}`);
      result = "FAILED";
    }
    console.log(`${model} ${name}: ${result}`);
  }
}

for (const kind of FILTERS.filter((f) => !seen.has(f))) failures.push(`no file has views of ${kind}`);

// What is not read is named, and refused if that is asked for.
const avif = join(folder, "textured-avif.glb");
transform("avif")(join(folder, "textured.glb"), avif);
try {
  render("textured", avif, join(folder, "avif.exr"), "--strict");
  failures.push("textured-avif: it is not refused");
} catch (error) {
  if (!/AVIF.*gltf-transform/.test(error.stderr.toString())) failures.push(`textured-avif: ${error.stderr}`);
}

// The measure has teeth: a texture less is seen.
const bare = join(folder, "bare.glb");
const bytes = Buffer.from(readFileSync(join(folder, "textured.glb")));
writeFileSync(bare, Buffer.from(bytes.toString("latin1").replace('"normalTexture"', '"normalTextuer"'), "latin1"));
render("textured", bare, join(folder, "bare.exr"));
const lost = compare(join(folder, "bare.exr"), join(folder, "textured.exr"));
console.log(`without its normal map: ${lost.toFixed(4)}`);
if (lost < LOSSY) failures.push(`the measure is blunt: a lost normal map is only ${lost}`);

if (failures.length) {
  console.error(failures.map((f) => `FAILED ${f}`).join("\n"));
  process.exit(1);
}
