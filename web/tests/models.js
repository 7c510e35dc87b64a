// Small models of one red triangle in front of nothing.

const POSITIONS = new Float32Array([-1, 0, 0, 1, 0, 0, 0, 1.5, 0]);

const description = (uri) => ({
  asset: { version: "2.0" }, scene: 0, scenes: [{ nodes: [0] }], nodes: [{ mesh: 0 }],
  meshes: [{ primitives: [{ attributes: { POSITION: 0 }, material: 0 }] }],
  materials: [{ doubleSided: true, pbrMetallicRoughness: { baseColorFactor: [0.8, 0.05, 0.05, 1], metallicFactor: 0, roughnessFactor: 1 } }],
  accessors: [{ bufferView: 0, componentType: 5126, count: 3, type: "VEC3", min: [-1, 0, 0], max: [1, 1.5, 0] }],
  bufferViews: [{ buffer: 0, byteLength: 36 }],
  buffers: [{ byteLength: 36, ...(uri ? { uri } : {}) }],
});

const binary = () => Buffer.from(POSITIONS.buffer);

/** One file. */
export function glb() {
  const json = Buffer.from(JSON.stringify(description()).padEnd(Math.ceil(JSON.stringify(description()).length / 4) * 4));
  const words = (...numbers) => Buffer.from(new Uint32Array(numbers).buffer);
  const chunks = Buffer.concat([words(json.length, 0x4e4f534a), json, words(36, 0x004e4942), binary()]);
  return Buffer.concat([words(0x46546c67, 2, 12 + chunks.length), chunks]);
}

/** Files of a folder, the triangle's corners in a folder of their own. */
export const gltf = () => ({ "scene.gltf": Buffer.from(JSON.stringify(description("data/corners.bin"))), "data/corners.bin": binary() });
