// Radiance on a canvas: two pictures with a divider, or their errors against a third, drawn on the GPU, or on the CPU
// in time slices.

import { CURVES, ERROR_GLSL, GLSL, develop, errorColor, type Curve } from "./tone";

/** The luminance of the pixel whose numbers begin at `i`. */
export const luminance = (pixels: Float32Array, i: number) => 0.2126 * pixels[i] + 0.7152 * pixels[i + 1] + 0.0722 * pixels[i + 2];

/** A picture of linear R, G, B and alpha. */
export class Film {
  pixels: Float32Array;
  constructor(readonly width: number, readonly height: number) {
    this.pixels = new Float32Array(4 * width * height);
  }

  /** A film from R, G and B without alpha. */
  static fromRgb(width: number, height: number, rgb: Float32Array): Film {
    const film = new Film(width, height);
    for (let i = 0; i < width * height; i++) film.pixels.set([rgb[3 * i], rgb[3 * i + 1], rgb[3 * i + 2], 1], 4 * i);
    return film;
  }

  /** Writes rectangles into the film; see the engine's `Update`. */
  put(windows: Uint32Array, pixels: Float32Array) {
    let from = 0;
    for (let i = 0; i < windows.length; i += 4) {
      const [x, y, width, height] = windows.subarray(i, i + 4);
      for (let row = 0; row < height; row++, from += 4 * width) {
        this.pixels.set(pixels.subarray(from, from + 4 * width), 4 * ((y + row) * this.width + x));
      }
    }
  }

  /** Averages the n-th of several pictures into the mean of those before. */
  average(film: Film, n: number) {
    const { pixels } = this;
    for (let i = 0; i < pixels.length; i++) pixels[i] += (film.pixels[i] - pixels[i]) / n;
  }

  /** Copies another picture of any size, as a placeholder. */
  underlay(before: Film) {
    if (before.width === this.width && before.height === this.height) {
      this.pixels.set(before.pixels);
      return;
    }
    const columns = Int32Array.from({ length: this.width }, (_, x) => 4 * Math.floor(x * before.width / this.width));
    const to = this.pixels, from = before.pixels;
    for (let y = 0, at = 0; y < this.height; y++) {
      const row = 4 * before.width * Math.floor(y * before.height / this.height);
      for (let x = 0; x < this.width; x++, at += 4) {
        const i = row + columns[x];
        to[at] = from[i];
        to[at + 1] = from[i + 1];
        to[at + 2] = from[i + 2];
        to[at + 3] = from[i + 3];
      }
    }
  }

  /** The exposure that maps the median luminance of nonblack pixels to middle gray [stops]. */
  exposure(): number {
    const n = this.width * this.height, step = Math.max(1, Math.floor(n / 20000)), { pixels } = this;
    const luminances = new Float32Array(Math.ceil(n / step));
    let found = 0;
    for (let i = 0; i < 4 * n; i += 4 * step) {
      const y = 0.2126 * pixels[i] + 0.7152 * pixels[i + 1] + 0.0722 * pixels[i + 2];
      if (pixels[i + 3] > 0 && y > 0 && isFinite(y)) luminances[found++] = y;
    }
    if (!found) return 0;
    const sorted = luminances.subarray(0, found).sort();
    return Math.min(Math.max(Math.log2(0.18 / sorted[found >> 1]), -30), 30);
  }
}

interface Look {
  exposure: number;
  curve: Curve;
  /** The start of the second picture, as a fraction of the width. */
  divider: number;
  /** Whether to show errors against the third picture. */
  errors: boolean;
}

interface Painter {
  /** Paints both pictures and the reference; `changed` lists the rectangles that changed. Resolves when done. */
  paint(films: (Film | null)[], look: Look, changed: (Uint32Array | "all" | null)[]): Promise<void>;
}

export class FilmView {
  /** The left picture, the right picture and the reference. */
  films: (Film | null)[] = [null, null, null];
  look: Look = { exposure: 0, curve: "agx", divider: 1, errors: false };
  private painter: Painter | null = null;
  private changed: (Uint32Array | "all" | null)[] = [null, null, null];
  /** Whether something waits to be painted, and whether painting is in progress. */
  private stale = false;
  private busy = false;

  constructor(readonly canvas: HTMLCanvasElement, private gpu = true) {}

  /** Makes the painter before the first paint, while the page waits for pixels. */
  prepare() {
    this.painter ??= this.makePainter();
  }

  /** Not made before it is needed, because a panel may never be shown. */
  private makePainter(): Painter {
    const gl = this.gpu ? this.canvas.getContext("webgl2", { antialias: false, preserveDrawingBuffer: true }) : null;
    this.canvas.dataset.painter = gl ? "webgl2" : "2d";
    return gl ? new GpuPainter(gl) : new PlainPainter(this.canvas.getContext("2d")!);
  }

  show(side: number, film: Film | null) {
    this.films[side] = film;
    this.changed[side] = "all";
    this.refresh();
  }

  update(side: number, windows: Uint32Array, pixels: Float32Array) {
    this.films[side]?.put(windows, pixels);
    this.repaint(side, windows);
  }

  /** Repaints pixels of a film. */
  repaint(side: number, windows: Uint32Array) {
    const before = this.changed[side];
    if (before !== "all") {
      const all = new Uint32Array((before?.length ?? 0) + windows.length);
      if (before) all.set(before);
      all.set(windows, before?.length ?? 0);
      this.changed[side] = all;
    }
    this.refresh();
  }

  set(look: Partial<Look>) {
    Object.assign(this.look, look);
    this.refresh();
  }

  /** Paints at the next frame, or after the paint in progress. */
  private refresh() {
    this.stale = true;
    this.canvas.toggleAttribute("data-stale", true);
    if (this.busy) return;
    this.busy = true;
    const paint = async () => {
      this.stale = false;
      const { changed } = this;
      this.changed = [null, null, null];
      if (this.films[0]) await (this.painter ??= this.makePainter()).paint(this.films, this.look, changed);
      this.busy = false;
      this.canvas.dispatchEvent(new Event("painted"));
      if (this.stale) this.refresh();
      else this.canvas.removeAttribute("data-stale");
    };
    // Background tabs get no animation frames.
    if (document.hidden) setTimeout(paint, 100);
    else requestAnimationFrame(paint);
  }
}

/** Draws into a texture and shows it when the GPU is done, so that the page never waits, even for a software GPU. */
class GpuPainter implements Painter {
  private textures: WebGLTexture[];
  private target: { framebuffer: WebGLFramebuffer; texture: WebGLTexture; size: string };
  private sizes: string[] = ["", "", ""];
  private uniform!: (name: string) => WebGLUniformLocation | null;
  private ready: Promise<void>;

  constructor(private gl: WebGL2RenderingContext) {
    const compiled = (type: number, source: string) => {
      const shader = gl.createShader(type)!;
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      return shader;
    };
    const program = gl.createProgram()!;
    gl.attachShader(program, compiled(gl.VERTEX_SHADER, `#version 300 es
      void main() { gl_Position = vec4(vec2(gl_VertexID % 2, gl_VertexID / 2) * 4.0 - 1.0, 0.0, 1.0); }`));
    gl.attachShader(program, compiled(gl.FRAGMENT_SHADER, `#version 300 es
      precision highp float; precision highp int; precision highp sampler2D;
      uniform sampler2D first, second, third; uniform float scale, divider; uniform int curve; uniform vec2 size; uniform bool errors;
      out vec4 color;
      ${GLSL}${ERROR_GLSL}
      void main() {
        vec2 at = vec2(gl_FragCoord.x, size.y - gl_FragCoord.y);
        vec4 texel = at.x / size.x < divider ? texelFetch(first, ivec2(at), 0)
          : texelFetch(second, ivec2(at / size * vec2(textureSize(second, 0))), 0);
        color = vec4(errors ? error_color(texel.rgb, texelFetch(third, ivec2(at), 0).rgb) : shown(texel.rgb * scale, curve), 1.0);
      }`));
    gl.linkProgram(program);
    this.textures = [0, 1, 2].map((i) => {
      const texture = gl.createTexture()!;
      gl.activeTexture(gl.TEXTURE0 + i);
      gl.bindTexture(gl.TEXTURE_2D, texture);
      for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, gl.NEAREST);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, 1, 1, 0, gl.RGBA, gl.FLOAT, new Float32Array(4));
      return texture;
    });
    const texture = gl.createTexture()!, framebuffer = gl.createFramebuffer()!;
    this.target = { framebuffer, texture, size: "" };
    this.ready = this.use(program);
  }

  /** Uses a program once it is linked; earlier queries would block. */
  private async use(program: WebGLProgram) {
    const { gl } = this, parallel = gl.getExtension("KHR_parallel_shader_compile");
    if (parallel) {
      while (!gl.isContextLost() && !gl.getProgramParameter(program, parallel.COMPLETION_STATUS_KHR)) await pause();
    } else await this.finished();
    if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
      throw new Error(gl.getProgramInfoLog(program) ?? "the shader does not link");
    }
    gl.useProgram(program);
    const places = Object.fromEntries(["first", "second", "third", "scale", "divider", "curve", "size", "errors"].map((name) => [name, gl.getUniformLocation(program, name)]));
    this.uniform = (name) => places[name];
    gl.uniform1i(this.uniform("first"), 0);
    gl.uniform1i(this.uniform("second"), 1);
    gl.uniform1i(this.uniform("third"), 2);
  }

  /** Resizes the render texture to the picture, and returns whether its size changed. */
  private resize(width: number, height: number): boolean {
    const { gl, target } = this, size = `${width}x${height}`;
    if (target.size === size) return false;
    target.size = size;
    gl.activeTexture(gl.TEXTURE3);
    gl.bindTexture(gl.TEXTURE_2D, target.texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, width, height, 0, gl.RGBA, gl.UNSIGNED_BYTE, null);
    gl.bindFramebuffer(gl.FRAMEBUFFER, target.framebuffer);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, target.texture, 0);
    return true;
  }

  /** Resolves when the GPU has finished all commands. */
  private async finished() {
    const { gl } = this, sync = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
    if (!sync) return;
    do await pause();
    while (gl.clientWaitSync(sync, 0, 0) === gl.TIMEOUT_EXPIRED);
    gl.deleteSync(sync);
  }

  /** The look of the painted pixels. */
  private painted = "";

  async paint(films: (Film | null)[], look: Look, changed: (Uint32Array | "all" | null)[]) {
    await this.ready;
    const gl = this.gl, { width, height } = films[0]!;
    const key = JSON.stringify([look, films.map((film) => film && [film.width, film.height])]);
    const all = this.resize(width, height) || key !== this.painted || changed.includes("all");
    this.painted = key;
    /** The changed bands of rows. */
    const dirty = new Set<number>();
    const BAND = 16;
    films.forEach((film, i) => {
      const windows = changed[i];
      if (!film || !windows) return;
      if (windows !== "all") for (let k = 1; k < windows.length; k += 4) {
        for (let y = windows[k]; y < windows[k] + windows[k + 2]; y += BAND) dirty.add(Math.floor(y / BAND));
        dirty.add(Math.floor((windows[k] + windows[k + 2] - 1) / BAND));
      }
      gl.activeTexture(gl.TEXTURE0 + i);
      gl.bindTexture(gl.TEXTURE_2D, this.textures[i]);
      const size = `${film.width}x${film.height}`;
      if (windows === "all" || size !== this.sizes[i]) {
        gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, film.width, film.height, 0, gl.RGBA, gl.FLOAT, film.pixels);
        this.sizes[i] = size;
        return;
      }
      for (const [from, to] of runs(dirty)) {
        const top = from * BAND, bottom = Math.min(to * BAND, film.height);
        if (top >= bottom) continue;
        const rows = film.pixels.subarray(4 * film.width * top, 4 * film.width * bottom);
        gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, top, film.width, bottom - top, gl.RGBA, gl.FLOAT, rows);
      }
    });
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.target.framebuffer);
    gl.viewport(0, 0, width, height);
    gl.uniform1f(this.uniform("scale"), 2 ** look.exposure);
    gl.uniform1f(this.uniform("divider"), films[1] ? look.divider : 2);
    gl.uniform1i(this.uniform("curve"), CURVES.indexOf(look.curve));
    gl.uniform2f(this.uniform("size"), width, height);
    gl.uniform1i(this.uniform("errors"), Number(shows(films, look)));
    if (all) gl.drawArrays(gl.TRIANGLES, 0, 3);
    else {
      gl.enable(gl.SCISSOR_TEST);
      for (const [from, to] of runs(dirty)) {
        gl.scissor(0, height - Math.min(to * BAND, height), width, Math.min((to - from) * BAND, height));
        gl.drawArrays(gl.TRIANGLES, 0, 3);
      }
      gl.disable(gl.SCISSOR_TEST);
    }
    await this.finished();
    fit(gl.canvas, width, height);
    gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, null);
    gl.blitFramebuffer(0, 0, width, height, 0, 0, width, height, gl.COLOR_BUFFER_BIT, gl.NEAREST);
  }
}

/** Whether to show errors, and the reference exists. */
const shows = ([first, , third]: (Film | null)[], look: Look) =>
  look.errors && !!first && !!third && first.width === third.width && first.height === third.height;

const pause = () => new Promise((done) => setTimeout(done, 2));

/** Merges integers into half-open ranges. */
function runs(numbers: Set<number>): [number, number][] {
  const ranges: [number, number][] = [];
  for (const n of [...numbers].sort((a, b) => a - b)) {
    const last = ranges.at(-1);
    if (last && last[1] === n) last[1]++;
    else ranges.push([n, n + 1]);
  }
  return ranges;
}

/** Resizes a canvas, which clears it; returns whether the size changed. */
function fit(canvas: HTMLCanvasElement | OffscreenCanvas, width: number, height: number): boolean {
  if (canvas.width === width && canvas.height === height) return false;
  canvas.width = width;
  canvas.height = height;
  return true;
}

/** Paints row by row on the CPU, for at most one frame at a time. */
class PlainPainter implements Painter {
  constructor(private context: CanvasRenderingContext2D) {}

  async paint(films: (Film | null)[], look: Look) {
    const { width, height } = films[0]!;
    this.fit(width, height);
    const scale = 2 ** look.exposure;
    const { exposure, curve, divider, errors } = look, withErrors = shows(films, look);
    const split = films[1] ? Math.round(divider * width) : width;
    for (let y = 0; y < height;) {
      const end = performance.now() + 12;
      do {
        const image = this.context.createImageData(width, 1);
        for (let x = 0; x < width; x++) {
          const film = x < split ? films[0]! : films[1]!;
          const column = film.width === width ? x : Math.floor(x * film.width / width);
          const row = film.height === height ? y : Math.floor(y * film.height / height);
          const at = 4 * (row * film.width + column);
          if (withErrors) {
            const i = 4 * (y * width + x);
            errorColor(film.pixels.subarray(at, at + 3), films[2]!.pixels.subarray(i, i + 3), image.data, 4 * x);
          } else develop(scale * film.pixels[at], scale * film.pixels[at + 1], scale * film.pixels[at + 2], curve, image.data, 4 * x);
        }
        this.context.putImageData(image, 0, y);
      } while (++y < height && performance.now() < end);
      if (y < height) await new Promise((done) => setTimeout(done, 0));
      // Another look or picture starts over.
      if (exposure !== look.exposure || curve !== look.curve || divider !== look.divider || errors !== look.errors || films[0]!.width !== width) return;
    }
  }

  /** Resizes the canvas and keeps its contents. */
  private fit(width: number, height: number) {
    const { canvas } = this.context;
    if (canvas.width === width && canvas.height === height) return;
    const before = Object.assign(document.createElement("canvas"), { width: canvas.width, height: canvas.height });
    before.getContext("2d")!.drawImage(canvas, 0, 0);
    fit(canvas, width, height);
    this.context.drawImage(before, 0, 0, width, height);
  }
}
