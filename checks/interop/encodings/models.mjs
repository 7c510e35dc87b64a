// Small models of our own (CC0), each with what some encoder changes. A model is a GLB file made by hand, so that
// no encoder's library has a say in the originals.
import sharp from "sharp";

const ARRAYS = { 5120: Int8Array, 5121: Uint8Array, 5123: Uint16Array, 5125: Uint32Array, 5126: Float32Array };
const SIZES = { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4, MAT4: 16 };

// A document that grows, with one buffer.
class Model {
  constructor() {
    this.json = { asset: { version: "2.0" }, scene: 0, scenes: [{ nodes: [] }], nodes: [], meshes: [], accessors: [], bufferViews: [] };
    this.chunks = [];
    this.length = 0;
  }

  push(list, item) {
    this.json[list] ??= [];
    return this.json[list].push(item) - 1;
  }

  view(bytes) {
    const padded = Buffer.alloc(Math.ceil(bytes.byteLength / 4) * 4);
    Buffer.from(bytes.buffer, bytes.byteOffset, bytes.byteLength).copy(padded);
    const byteOffset = this.length;
    this.chunks.push(padded);
    this.length += padded.length;
    return this.push("bufferViews", { buffer: 0, byteOffset, byteLength: bytes.byteLength });
  }

  accessor(type, componentType, values, more = {}) {
    const n = SIZES[type];
    const columns = (f) => Array.from({ length: n }, (_, i) => values.filter((_, j) => j % n === i).reduce((a, b) => f(a, b)));
    const bounds = componentType === 5126 && n < 4 ? { min: columns(Math.min).map(Math.fround), max: columns(Math.max).map(Math.fround) } : {};
    const bufferView = this.view(new ARRAYS[componentType](values));
    return this.push("accessors", { bufferView, componentType, type, count: values.length / n, ...bounds, ...more });
  }

  async texture(size, texel, hasAlpha = false) {
    const data = Buffer.alloc(size * size * 4);
    for (let y = 0; y < size; y++) {
      for (let x = 0; x < size; x++) data.set(texel(x / size, y / size).map((c) => Math.round(255 * Math.min(Math.max(c, 0), 1))), 4 * (y * size + x));
    }
    const image = sharp(data, { raw: { width: size, height: size, channels: 4 } });
    const png = await (hasAlpha ? image : image.removeAlpha()).png().toBuffer();
    const source = this.push("images", { bufferView: this.view(png), mimeType: "image/png" });
    return { index: this.push("textures", { source }) };
  }

  mesh(attributes, indices, material, more = {}) {
    const primitive = { attributes, indices: this.accessor("SCALAR", 5123, indices), material, ...more };
    return this.push("meshes", { primitives: [primitive] });
  }

  node(node, isRoot = true) {
    const index = this.push("nodes", node);
    if (isRoot) this.json.scenes[0].nodes.push(index);
    return index;
  }

  glb() {
    this.json.buffers = [{ byteLength: this.length }];
    const json = Buffer.from(JSON.stringify(this.json));
    const text = Buffer.concat([json, Buffer.alloc((4 - (json.length % 4)) % 4, 32)]);
    const word = (...values) => Buffer.from(new Uint32Array(values).buffer);
    const total = 12 + 8 + text.length + 8 + this.length;
    return Buffer.concat([word(0x46546c67, 2, total, text.length, 0x4e4f534a), text, word(this.length, 0x004e4942), ...this.chunks]);
  }
}

// A surface over a grid of (u, v) in the unit square.
function grid(columns, rows, f) {
  const out = { positions: [], normals: [], uvs: [], indices: [] };
  for (let j = 0; j <= rows; j++) {
    for (let i = 0; i <= columns; i++) {
      const [u, v] = [i / columns, j / rows];
      const { position, normal } = f(u, v);
      out.positions.push(...position);
      out.normals.push(...normal);
      out.uvs.push(u, v);
      if (i < columns && j < rows) {
        const a = j * (columns + 1) + i;
        const b = a + columns + 1;
        out.indices.push(a, b, a + 1, a + 1, b, b + 1);
      }
    }
  }
  return out;
}

function torus(columns, rows) {
  return grid(columns, rows, (u, v) => {
    const [s, t] = [2 * Math.PI * u, 2 * Math.PI * v];
    const normal = [Math.cos(s) * Math.cos(t), Math.sin(t), Math.sin(s) * Math.cos(t)];
    const ring = [Math.cos(s), 0, Math.sin(s)];
    return { position: ring.map((c, i) => c + 0.45 * normal[i]), normal };
  });
}

function sphere(columns, rows) {
  return grid(columns, rows, (u, v) => {
    const [s, t] = [2 * Math.PI * u, Math.PI * v];
    const normal = [-Math.cos(s) * Math.sin(t), Math.cos(t), Math.sin(s) * Math.sin(t)];
    return { position: normal, normal };
  });
}

function attributes(model, surface, names = "POSITION NORMAL TEXCOORD_0") {
  const of = {
    POSITION: () => model.accessor("VEC3", 5126, surface.positions),
    NORMAL: () => model.accessor("VEC3", 5126, surface.normals),
    TEXCOORD_0: () => model.accessor("VEC2", 5126, surface.uvs),
  };
  return Object.fromEntries(names.split(" ").map((name) => [name, of[name]()]));
}

const smooth = (x) => 0.5 + 0.5 * Math.sin(2 * Math.PI * x);

// Every kind of texture, vertex colors, and a normal map without tangents.
async function textured() {
  const model = new Model();
  const surface = torus(64, 32);
  const base = await model.texture(128, (u, v) => [0.3 + 0.6 * smooth(4 * u), 0.2 + 0.6 * smooth(3 * v), 0.6 - 0.3 * smooth(4 * u + 3 * v)]);
  const metal = await model.texture(128, (u, v) => [0, 0.3 + 0.5 * smooth(6 * v), smooth(2 * u) > 0.5 ? 1 : 0]);
  const normals = await model.texture(128, (u, v) => [0.5 + 0.2 * Math.cos(24 * Math.PI * u), 0.5 + 0.2 * Math.cos(16 * Math.PI * v), 0.93]);
  const material = model.push("materials", {
    name: "paint",
    normalTexture: normals,
    pbrMetallicRoughness: { baseColorTexture: base, metallicRoughnessTexture: metal },
  });
  const colors = surface.uvs.flatMap((_, i) => (i % 2 ? [] : [255, 155 + Math.round(100 * smooth(surface.uvs[i])), 255, 255]));
  const names = attributes(model, surface);
  names.COLOR_0 = model.accessor("VEC4", 5121, colors, { normalized: true });
  model.node({ mesh: model.mesh(names, surface.indices, material), rotation: [0.3826834, 0, 0, 0.9238795] });
  return model.glb();
}

// A tube with two joints and a morph target, both animated.
function animated() {
  const model = new Model();
  const surface = grid(32, 32, (u, v) => {
    const s = 2 * Math.PI * u;
    const normal = [Math.cos(s), 0, -Math.sin(s)];
    return { position: [0.4 * normal[0], 2 * v, 0.4 * normal[2]], normal };
  });
  const material = model.push("materials", { pbrMetallicRoughness: { baseColorFactor: [0.8, 0.4, 0.2, 1], metallicFactor: 0, roughnessFactor: 0.5 }, doubleSided: true });
  const n = surface.positions.length / 3;
  const height = (i) => surface.positions[3 * i + 1] / 2;
  const each = (f) => Array.from({ length: n }, (_, i) => f(i)).flat();
  const names = attributes(model, surface, "POSITION NORMAL");
  names.JOINTS_0 = model.accessor("VEC4", 5121, each(() => [0, 1, 0, 0]));
  names.WEIGHTS_0 = model.accessor("VEC4", 5126, each((i) => [1 - height(i), height(i), 0, 0]));
  const bulge = each((i) => [0, 1, 2].map((k) => (k === 1 ? 0 : 0.8 * smooth(2 * height(i) - 0.25) * surface.positions[3 * i + k])));
  const target = { POSITION: model.accessor("VEC3", 5126, bulge) };
  const mesh = model.mesh(names, surface.indices, material, { targets: [target] });
  model.json.meshes[mesh].weights = [0];
  const upper = model.node({ translation: [0, 1, 0] }, false);
  const lower = model.node({ children: [upper] });
  const identity = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
  const raised = identity.map((v, i) => (i === 13 ? -1 : v));
  const inverseBindMatrices = model.accessor("MAT4", 5126, [...identity, ...raised]);
  const skin = model.push("skins", { joints: [lower, upper], inverseBindMatrices });
  const node = model.node({ mesh, skin });
  const input = model.accessor("SCALAR", 5126, [0, 0.5, 1]);
  const turn = (angle) => [0, 0, Math.sin(angle / 2), Math.cos(angle / 2)];
  const rotations = model.accessor("VEC4", 5126, [turn(0), turn(0.5), turn(1.2)].flat());
  const weights = model.accessor("SCALAR", 5126, [0, 0.3, 1]);
  model.push("animations", {
    name: "bend",
    samplers: [{ input, output: rotations }, { input, output: weights }],
    channels: [{ sampler: 0, target: { node: upper, path: "rotation" } }, { sampler: 1, target: { node, path: "weights" } }],
  });
  return model.glb();
}

// One mesh on many nodes, turned and scaled.
function instances() {
  const model = new Model();
  const surface = torus(24, 12);
  const material = model.push("materials", { pbrMetallicRoughness: { baseColorFactor: [0.3, 0.5, 0.8, 1], metallicFactor: 0.2, roughnessFactor: 0.4 } });
  const mesh = model.mesh(attributes(model, surface, "POSITION NORMAL"), surface.indices, material);
  for (let i = 0; i < 25; i++) {
    const angle = 0.7 * i;
    const size = 0.5 + 0.02 * i;
    model.node({
      mesh,
      translation: [3 * (i % 5), 0.3 * (i % 3), 3 * Math.floor(i / 5)],
      rotation: [Math.sin(angle / 2), 0, 0, Math.cos(angle / 2)],
      scale: [size, size, size * 1.3],
    });
  }
  return model.glb();
}

// A morph target that moves few of its vertices: a sparse accessor's case.
function sparse() {
  const model = new Model();
  const surface = sphere(48, 24);
  const material = model.push("materials", { pbrMetallicRoughness: { baseColorFactor: [0.7, 0.7, 0.3, 1], metallicFactor: 0, roughnessFactor: 0.6 } });
  const moved = surface.positions.map((_, i) => (i % 3 === 1 && surface.positions[i] > 0.92 ? 0.7 : 0));
  const target = { POSITION: model.accessor("VEC3", 5126, moved) };
  const names = attributes(model, surface, "POSITION NORMAL TEXCOORD_0");
  const mesh = model.mesh(names, surface.indices, material, { targets: [target] });
  model.json.meshes[mesh].weights = [1];
  model.node({ mesh });
  return model.glb();
}

// A coat with a map, fibers, a mask and a blended opacity, each with its texture. No texel is clear: encoders may change
// the color of those that are.
async function layered() {
  const model = new Model();
  const surface = torus(64, 32);
  const stripes = await model.texture(128, (u, v) => [0.8, 0.3 + 0.5 * smooth(3 * v), 0.3, smooth(8 * u) > 0.4 ? 1 : 0.1], true);
  const veil = await model.texture(128, (u, v) => [0.2, 0.5, 0.9, 0.2 + 0.7 * smooth(4 * v)], true);
  const coat = await model.texture(128, (u) => [smooth(4 * u), 0.2, 0]);
  const extensions = {
    KHR_materials_clearcoat: { clearcoatFactor: 1, clearcoatTexture: coat, clearcoatRoughnessFactor: 0.1 },
    KHR_materials_sheen: { sheenColorFactor: [0.6, 0.6, 0.3], sheenRoughnessFactor: 0.4 },
  };
  model.json.extensionsUsed = Object.keys(extensions);
  const base = (baseColorTexture) => ({ baseColorTexture, metallicFactor: 0, roughnessFactor: 0.7 });
  const masked = model.push("materials", { alphaMode: "MASK", doubleSided: true, pbrMetallicRoughness: base(stripes), extensions });
  const blended = model.push("materials", { alphaMode: "BLEND", doubleSided: true, pbrMetallicRoughness: base(veil) });
  const names = attributes(model, surface);
  model.node({ mesh: model.mesh(names, surface.indices, masked), rotation: [0.3826834, 0, 0, 0.9238795] });
  model.node({ mesh: model.mesh(names, surface.indices, blended), scale: [0.5, 0.5, 0.5] });
  return model.glb();
}

export const MODELS = { textured, animated, instances, sparse, layered };
