// Small models of one red triangle in front of nothing, and pictures.

import { crc32, deflateSync } from "node:zlib";

const POSITIONS = new Float32Array([-1, 0, 0, 1, 0, 0, 0, 1.5, 0]);

/** Two cameras: one sees the triangle from in front, the other nothing but light. */
const CAMERAS = {
  nodes: [{ mesh: 0 }, { camera: 0, translation: [0, 0.5, 4] }, { camera: 1, translation: [0, 0.5, 40] }],
  scenes: [{ nodes: [0, 1, 2] }],
  cameras: ["near", "far"].map((name) => ({ name, type: "perspective", perspective: { yfov: 0.7, znear: 0.1 } })),
};

const description = (uri) => ({
  asset: { version: "2.0" }, scene: 0, scenes: [{ nodes: [0] }], nodes: [{ mesh: 0 }],
  meshes: [{ primitives: [{ attributes: { POSITION: 0 }, material: 0 }] }],
  materials: [{ doubleSided: true, pbrMetallicRoughness: { baseColorFactor: [0.8, 0.05, 0.05, 1], metallicFactor: 0, roughnessFactor: 1 } }],
  accessors: [{ bufferView: 0, componentType: 5126, count: 3, type: "VEC3", min: [-1, 0, 0], max: [1, 1.5, 0] }],
  bufferViews: [{ buffer: 0, byteLength: 36 }],
  buffers: [{ byteLength: 36, ...(uri ? { uri } : {}) }],
});

const binary = () => Buffer.from(POSITIONS.buffer);

/** One file, with cameras and so many bytes that nothing uses. */
export function glb({ cameras = false, padding = 0 } = {}) {
  const described = { ...description(), ...(cameras ? CAMERAS : {}) };
  described.buffers[0].byteLength += padding;
  const text = JSON.stringify(described), json = Buffer.from(text.padEnd(Math.ceil(text.length / 4) * 4));
  const words = (...numbers) => Buffer.from(new Uint32Array(numbers).buffer);
  const chunks = Buffer.concat([words(json.length, 0x4e4f534a), json, words(36 + padding, 0x004e4942), binary(), Buffer.alloc(padding)]);
  return Buffer.concat([words(0x46546c67, 2, 12 + chunks.length), chunks]);
}

/** Files of a folder, the triangle's corners in a folder of their own. */
export const gltf = () => ({ "scene.gltf": Buffer.from(JSON.stringify(description("data/corners.bin"))), "data/corners.bin": binary() });

/** A scene file with its own camera and light, which names the triangle of `triangle.obj`. */
export const SCENE = `
[camera]
origin = [0.0, 0.5, 4.0]
target = [0.0, 0.5, 0.0]
[environment]
builtin = "studio"
rotate = 40.0
exposure = 1.0
scale = 0.5
[[objects]]
file = "triangle.obj"
material = "diffuse:0.8,0.1,0.1"
`;
export const OBJ = "v -1 0 0\nv 1 0 0\nv 0 1.5 0\nf 1 2 3\n";

/** A PNG of one color, `width` by half as many pixels. */
export function png(width, color) {
  const height = width / 2, row = Buffer.from([0, ...Array(width).fill(color).flat()]);
  const chunk = (name, data) => {
    const body = Buffer.concat([Buffer.from(name), data]), out = Buffer.alloc(body.length + 8);
    out.writeUInt32BE(data.length);
    body.copy(out, 4);
    out.writeUInt32BE(crc32(body), body.length + 4);
    return out;
  };
  const header = Buffer.alloc(13);
  header.writeUInt32BE(width);
  header.writeUInt32BE(height, 4);
  header.set([8, 2, 0, 0, 0], 8);
  const data = deflateSync(Buffer.concat(Array(height).fill(row)));
  return Buffer.concat([Buffer.from([137, 80, 78, 71, 13, 10, 26, 10]), chunk("IHDR", header), chunk("IDAT", data), chunk("IEND", Buffer.alloc(0))]);
}
