// Puts page, Worker and engine into one file: node build.mjs ENGINE.wasm
import { build, transform } from "esbuild";
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { deflateRawSync } from "node:zlib";

const [, , wasm] = process.argv, isPlain = !!process.env.PLAIN;
const bundle = async (entry) => {
  const { outputFiles } = await build({
    entryPoints: [entry], bundle: true, minify: !isPlain, write: false, format: "iife", target: "es2022",
    // The engine's script would look for its module beside itself; the page hands it over instead.
    define: { "import.meta.url": "''" }, logLevel: "error",
  });
  return outputFiles[0].text;
};
const text = (name) => readFileSync(new URL(name, import.meta.url), "utf8");
const attribute = (value) => value.replaceAll("&", "&amp;").replaceAll('"', "&quot;").replaceAll("<", "&lt;");
const inScript = (code) => code.replaceAll("</script", "<\\/script").replaceAll("<!--", "<\\!--");
const packed = deflateRawSync(readFileSync(wasm), { level: 9 }).toString("base64");
const parts = {
  STYLE: (await transform(text("src/style.css"), { loader: "css", minify: !isPlain })).code.replace("@FONT@", readFileSync(new URL("fonts/stix-two-math.woff2", import.meta.url)).toString("base64")),
  MAIN: inScript(await bundle("src/main.ts")),
  WORKER: inScript(await bundle("src/worker.ts")),
  ENGINE: packed,
  // Where the page and its source code will be: BASE=https://… SOURCE=https://… web/build
  BASE: attribute(process.env.BASE ?? ""),
  SOURCE: attribute(process.env.SOURCE ?? ""),
  VERSION: /^version = "(.*)"/m.exec(text("../Cargo.toml"))[1],
};
// Indentation says nothing.
const page = text("src/index.html").replace(/\n +/g, "\n").replace(/@(STYLE|MAIN|WORKER|ENGINE|BASE|SOURCE|VERSION)@/g, (_, name) => parts[name]);
mkdirSync(new URL("dist", import.meta.url), { recursive: true });
writeFileSync(new URL("dist/domelight.html", import.meta.url), page);
const kilobytes = (n) => `${Math.round(n / 1000)} kB`;
console.log(`web/dist/domelight.html: ${kilobytes(page.length)}, of which the engine ${kilobytes(packed.length)}`);
