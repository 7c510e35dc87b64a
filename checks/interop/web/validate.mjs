// Prints the Khronos validator's counts of issues in glTF files: node validate.mjs FILE...

import { readFile } from "node:fs/promises";
import validator from "gltf-validator";

const reports = {};
for (const file of process.argv.slice(2)) {
  const { issues } = await validator.validateBytes(new Uint8Array(await readFile(file)));
  const { numErrors, numWarnings, messages } = issues;
  reports[file] = { errors: numErrors, warnings: numWarnings, codes: messages.map((m) => m.code) };
}
console.log(JSON.stringify({ version: validator.version(), reports }));
