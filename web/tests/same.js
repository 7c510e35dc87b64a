// The pictures that the page writes, beside those of the program.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { bytesOf, program } from "./page.js";

/** What the program makes of the command that the page shows: the files of the two kinds. */
function fromProgram(command, folder) {
  const words = command.split(" ").slice(1);
  const paths = ["exr", "png"].map((kind) => join(folder, `program.${kind}`));
  const output = words.indexOf("-o");
  execFileSync(program, ["-q", ...words.slice(0, output), ...paths.flatMap((path) => ["-o", path])], { cwd: folder });
  const [exr, png] = paths.map((path) => readFileSync(path));
  return { exr, png };
}

/** An OpenEXR file's attributes by name, and where its table of chunks begins. */
function header(bytes) {
  let at = 8;
  const string = () => {
    const end = bytes.indexOf(0, at);
    const text = bytes.toString("utf8", at, end);
    at = end + 1;
    return text;
  };
  const attributes = {};
  while (bytes[at] !== 0) {
    const [name, type] = [string(), string()];
    const size = bytes.readUInt32LE(at);
    attributes[name] = `${type} ${bytes.toString("hex", at + 4, at + 4 + size)}`;
    at += 4 + size;
  }
  return { attributes, table: at + 1 };
}

/** The attributes but for the job, which the program alone writes. */
function withoutJob(bytes) {
  const { "domelight.job": job, "domelight.inputs": inputs, ...attributes } = header(bytes).attributes;
  return attributes;
}

/** The pixels, compressed. */
function chunks(bytes) {
  return bytes.subarray(Number(bytes.readBigUInt64LE(header(bytes).table)));
}

/** The page's files, which must be the program's; the command that it shows. */
export async function requireTheSame(page, folder) {
  const command = await page.textContent("#command");
  const expected = fromProgram(command, folder);
  for (const kind of ["exr", "png"]) {
    const bytes = await bytesOf(page, (kind) => window.domelight.picture.file(kind), kind);
    if (kind === "exr") assert.deepEqual(withoutJob(bytes), withoutJob(expected.exr), `the attributes differ: ${command}`);
    const contents = (file) => (kind === "exr" ? chunks(file) : file);
    assert.ok(contents(expected[kind]).equals(contents(bytes)), `the ${kind} files differ: ${command}`);
  }
  return command;
}
