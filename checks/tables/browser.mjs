// Runs a snippet in headless Chromium: node browser.mjs wgsl|glsl FOLDER reads u.bin and each NAME.tables, the columns of a
// texture and its numbers, and writes NAME.samples: direction, density, radiance, and the density of a look-up in that direction.

import { readFile, readdir, writeFile } from "node:fs/promises";
import { createRequire } from "node:module";
import { join } from "node:path";

const { chromium } = createRequire(new URL("../interop/package.json", import.meta.url))("playwright-core");
const [language, folder] = process.argv.slice(2);
const read = (name) => readFile(join(folder, name));

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: [
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--enable-unsafe-webgpu",
    "--use-webgpu-adapter=swiftshader",
    "--enable-features=Vulkan",
    "--disable-background-networking",
  ],
});
try {
  const page = await browser.newPage();
  // WebGPU is there only for secure origins.
  await page.route("**/*", (route) => route.fulfill({ contentType: "text/html", body: "<title>samples</title>" }));
  await page.goto("https://samples.test/");
  const snippet = await readFile(join(folder, "snippet"), "utf8");
  const host = await readFile(new URL("host.wgsl", import.meta.url), "utf8");
  const points = (await read("u.bin")).toString("base64");
  for (const name of (await readdir(folder)).filter((name) => name.endsWith(".tables"))) {
    const file = await read(name);
    const [columns, tables] = [file.readUInt32LE(), file.subarray(4).toString("base64")];
    const samples = await page.evaluate(language === "wgsl" ? wgsl : glsl, { snippet, host, tables, points, columns });
    await writeFile(join(folder, name.replace("tables", "samples")), Buffer.from(samples, "base64"));
  }
} finally {
  await browser.close();
}

async function wgsl({ snippet, host, tables, points }) {
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const code = `${snippet}\n${host}`;
  const adapter = await navigator.gpu.requestAdapter();
  const device = await adapter.requestDevice();
  const module = device.createShaderModule({ code });
  const { messages } = await module.getCompilationInfo();
  if (messages.length) throw new Error(messages.map((m) => `${m.lineNum}: ${m.message}`).join("\n"));
  const pipeline = device.createComputePipeline({ layout: "auto", compute: { module, entryPoint: "main" } });
  const { STORAGE, COPY_SRC, COPY_DST, MAP_READ } = GPUBufferUsage;
  const input = (data) => {
    const buffer = device.createBuffer({ size: data.byteLength, usage: STORAGE | COPY_DST });
    device.queue.writeBuffer(buffer, 0, data);
    return buffer;
  };
  const u = bytes(points);
  const [n, size] = [u.byteLength / 8, 4 * u.byteLength];
  const output = device.createBuffer({ size, usage: STORAGE | COPY_SRC });
  const result = device.createBuffer({ size, usage: COPY_DST | MAP_READ });
  const entries = [input(bytes(tables)), input(u), output].map((buffer, binding) => ({ binding, resource: { buffer } }));
  const encoder = device.createCommandEncoder();
  const pass = encoder.beginComputePass();
  pass.setPipeline(pipeline);
  pass.setBindGroup(0, device.createBindGroup({ layout: pipeline.getBindGroupLayout(0), entries }));
  pass.dispatchWorkgroups(Math.ceil(n / 64));
  pass.end();
  encoder.copyBufferToBuffer(output, 0, result, 0, size);
  device.queue.submit([encoder.finish()]);
  await result.mapAsync(GPUMapMode.READ);
  const samples = new Uint8Array(result.getMappedRange());
  let text = "";
  for (let i = 0; i < samples.length; i += 8192) text += String.fromCharCode(...samples.subarray(i, i + 8192));
  return btoa(text);
}

function glsl({ snippet, tables, points, columns }) {
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const floats = (text) => new Float32Array(bytes(text).buffer);
  const gl = document.createElement("canvas").getContext("webgl2");
  if (!gl.getExtension("EXT_color_buffer_float")) throw new Error("no targets of floats");
  const shader = (kind, source) => {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    return shader;
  };
  const program = gl.createProgram();
  gl.attachShader(program, shader(gl.VERTEX_SHADER, `#version 300 es
    void main() { gl_Position = vec4(ivec2(gl_VertexID % 2, gl_VertexID / 2) * 4 - 1, 0, 1); }`));
  gl.attachShader(program, shader(gl.FRAGMENT_SHADER, `#version 300 es
precision highp float;
precision highp int;
${snippet}
uniform highp sampler2D points;
layout(location = 0) out vec4 first;
layout(location = 1) out vec4 second;
void main() {
    DomelightSample s = domelight_sample(texelFetch(points, ivec2(gl_FragCoord.xy), 0).xy);
    first = vec4(s.direction, s.pdf);
    second = vec4(s.radiance, domelight_pdf(s.direction));
}`));
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
  gl.useProgram(program);
  const texture = (unit, internal, format, width, data, height = data.length / 4 / width) => {
    gl.activeTexture(gl.TEXTURE0 + unit);
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, internal, width, height, 0, format, gl.FLOAT, data);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    return texture;
  };
  const width = 1000;
  const u = floats(points);
  const n = u.length / 2;
  const height = Math.ceil(n / width);
  const padded = new Float32Array(2 * width * height);
  padded.set(u);
  texture(0, gl.RGBA32F, gl.RGBA, columns, floats(tables));
  gl.uniform1i(gl.getUniformLocation(program, "domelight_tables"), 0);
  texture(1, gl.RG32F, gl.RG, width, padded, height);
  gl.uniform1i(gl.getUniformLocation(program, "points"), 1);
  gl.bindFramebuffer(gl.FRAMEBUFFER, gl.createFramebuffer());
  const targets = [gl.COLOR_ATTACHMENT0, gl.COLOR_ATTACHMENT1];
  for (const target of targets) {
    const output = texture(2, gl.RGBA32F, gl.RGBA, width, null, height);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, target, gl.TEXTURE_2D, output, 0);
  }
  gl.drawBuffers(targets);
  gl.viewport(0, 0, width, height);
  gl.drawArrays(gl.TRIANGLES, 0, 3);
  const samples = new Float32Array(8 * n);
  targets.forEach((target, half) => {
    const numbers = new Float32Array(4 * width * height);
    gl.readBuffer(target);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.FLOAT, numbers);
    for (let i = 0; i < n; i++) samples.set(numbers.subarray(4 * i, 4 * i + 4), 8 * i + 4 * half);
  });
  if (gl.getError()) throw new Error("WebGL failed");
  let text = "";
  const all = new Uint8Array(samples.buffer);
  for (let i = 0; i < all.length; i += 8192) text += String.fromCharCode(...all.subarray(i, i + 8192));
  return btoa(text);
}
