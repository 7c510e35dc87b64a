// Prints what the reader of three.js finds in a KTX2 file: node ktx2.mjs FILE. Bytes of levels as base64.

import { readFile } from "node:fs/promises";
import { read } from "three/examples/jsm/libs/ktx-parse.module.js";

const { faceCount, vkFormat, levels } = read(new Uint8Array(await readFile(process.argv[2])));
const base64 = ({ levelData }) => Buffer.from(levelData).toString("base64");
console.log(JSON.stringify({ faces: faceCount, format: vkFormat, levels: levels.map(base64) }));
