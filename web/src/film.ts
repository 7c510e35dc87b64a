// Radiance on a canvas: two pictures with a divider, exposed on the GPU, or without one in slices of time.

import { CURVES, GLSL, develop, type Curve } from "./tone";

/** A picture of linear R, G, B and alpha. */
export class Film {
  pixels: Float32Array;
  constructor(readonly width: number, readonly height: number) {
    this.pixels = new Float32Array(4 * width * height);
  }

  /** From R, G and B alone. */
  static fromRgb(width: number, height: number, rgb: Float32Array): Film {
    const film = new Film(width, height);
    for (let i = 0; i < width * height; i++) film.pixels.set([rgb[3 * i], rgb[3 * i + 1], rgb[3 * i + 2], 1], 4 * i);
    return film;
  }

  /** Puts rectangles in; see the engine's `Update`. */
  put(windows: Uint32Array, pixels: Float32Array) {
    let from = 0;
    for (let i = 0; i < windows.length; i += 4) {
      const [x, y, width, height] = windows.subarray(i, i + 4);
      for (let row = 0; row < height; row++, from += 4 * width) {
        this.pixels.set(pixels.subarray(from, from + 4 * width), 4 * ((y + row) * this.width + x));
      }
    }
  }

  /** The median luminance of what has light, brought to middle gray [stops]. */
  exposure(): number {
    const luminances: number[] = [];
    const step = Math.max(1, Math.floor(this.width * this.height / 20000));
    for (let i = 0; i < this.width * this.height; i += step) {
      const [r, g, b, alpha] = this.pixels.subarray(4 * i, 4 * i + 4);
      const y = 0.2126 * r + 0.7152 * g + 0.0722 * b;
      if (alpha > 0 && y > 0 && isFinite(y)) luminances.push(y);
    }
    if (!luminances.length) return 0;
    luminances.sort((a, b) => a - b);
    return Math.min(Math.max(Math.log2(0.18 / luminances[luminances.length >> 1]), -30), 30);
  }
}

interface Look {
  exposure: number;
  curve: Curve;
  /** Where the second picture begins, as a share of the width. */
  divider: number;
}

interface Painter {
  /** Both pictures; windows say what changed since, none that all did. */
  paint(films: (Film | null)[], look: Look, changed: (Uint32Array | "all" | null)[]): void;
}

export class FilmView {
  films: (Film | null)[] = [null, null];
  look: Look = { exposure: 0, curve: "agx", divider: 1 };
  readonly onGpu: boolean;
  private painter: Painter;
  private changed: (Uint32Array | "all" | null)[] = [null, null];
  private queued = false;

  constructor(readonly canvas: HTMLCanvasElement, gpu = true) {
    const gl = gpu ? canvas.getContext("webgl2", { antialias: false, preserveDrawingBuffer: true }) : null;
    this.onGpu = !!gl;
    this.painter = gl ? new GpuPainter(gl) : new PlainPainter(canvas.getContext("2d")!);
    canvas.dataset.painter = gl ? "webgl2" : "2d";
  }

  show(side: number, film: Film | null) {
    this.films[side] = film;
    this.changed[side] = "all";
    const first = this.films[0];
    if (first && (this.canvas.width !== first.width || this.canvas.height !== first.height)) {
      this.canvas.width = first.width;
      this.canvas.height = first.height;
    }
    this.refresh();
  }

  update(side: number, windows: Uint32Array, pixels: Float32Array) {
    this.films[side]?.put(windows, pixels);
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

  /** Paints at the next frame. */
  private refresh() {
    if (this.queued) return;
    this.queued = true;
    const paint = () => {
      this.queued = false;
      if (!this.films[0]) return;
      this.painter.paint(this.films, this.look, this.changed);
      this.changed = [null, null];
    };
    // A tab in the background has no frames.
    if (document.hidden) setTimeout(paint, 100);
    else requestAnimationFrame(paint);
  }
}

class GpuPainter implements Painter {
  private textures: WebGLTexture[];
  private sizes: string[] = ["", ""];
  private uniform: (name: string) => WebGLUniformLocation | null;

  constructor(private gl: WebGL2RenderingContext) {
    const compiled = (type: number, source: string) => {
      const shader = gl.createShader(type)!;
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader) ?? "shader");
      return shader;
    };
    const program = gl.createProgram()!;
    gl.attachShader(program, compiled(gl.VERTEX_SHADER, `#version 300 es
      void main() { gl_Position = vec4(vec2(gl_VertexID % 2, gl_VertexID / 2) * 4.0 - 1.0, 0.0, 1.0); }`));
    gl.attachShader(program, compiled(gl.FRAGMENT_SHADER, `#version 300 es
      precision highp float; precision highp int; precision highp sampler2D;
      uniform sampler2D first, second; uniform float scale, divider; uniform int curve; uniform vec2 size;
      out vec4 color;
      ${GLSL}
      void main() {
        vec2 at = vec2(gl_FragCoord.x, size.y - gl_FragCoord.y);
        vec4 texel = at.x / size.x < divider ? texelFetch(first, ivec2(at), 0)
          : texelFetch(second, ivec2(at / size * vec2(textureSize(second, 0))), 0);
        color = vec4(shown(texel.rgb * scale, curve), 1.0);
      }`));
    gl.linkProgram(program);
    gl.useProgram(program);
    this.uniform = (name) => gl.getUniformLocation(program, name);
    this.textures = [0, 1].map((i) => {
      const texture = gl.createTexture()!;
      gl.activeTexture(gl.TEXTURE0 + i);
      gl.bindTexture(gl.TEXTURE_2D, texture);
      for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, gl.NEAREST);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, 1, 1, 0, gl.RGBA, gl.FLOAT, new Float32Array(4));
      return texture;
    });
    gl.uniform1i(this.uniform("first"), 0);
    gl.uniform1i(this.uniform("second"), 1);
  }

  /** The look of what is on the canvas. */
  private painted = "";

  paint(films: (Film | null)[], look: Look, changed: (Uint32Array | "all" | null)[]) {
    const gl = this.gl;
    const key = JSON.stringify([look, films.map((film) => film && [film.width, film.height])]);
    const all = key !== this.painted || changed.includes("all");
    this.painted = key;
    /** Bands of rows that changed: all at once would take software longer than a frame. */
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
    const { width, height } = films[0]!;
    gl.viewport(0, 0, width, height);
    gl.uniform1f(this.uniform("scale"), 2 ** look.exposure);
    gl.uniform1f(this.uniform("divider"), films[1] ? look.divider : 2);
    gl.uniform1i(this.uniform("curve"), CURVES.indexOf(look.curve));
    gl.uniform2f(this.uniform("size"), width, height);
    if (all) {
      gl.disable(gl.SCISSOR_TEST);
      gl.drawArrays(gl.TRIANGLES, 0, 3);
      return;
    }
    gl.enable(gl.SCISSOR_TEST);
    for (const [from, to] of runs(dirty)) {
      gl.scissor(0, height - Math.min(to * BAND, height), width, Math.min((to - from) * BAND, height));
      gl.drawArrays(gl.TRIANGLES, 0, 3);
    }
  }
}

/** Ranges of whole numbers that follow each other, from the first to after the last. */
function runs(numbers: Set<number>): [number, number][] {
  const ranges: [number, number][] = [];
  for (const n of [...numbers].sort((a, b) => a - b)) {
    const last = ranges.at(-1);
    if (last && last[1] === n) last[1]++;
    else ranges.push([n, n + 1]);
  }
  return ranges;
}

/** Rows one after the other, no longer than a frame at a time. */
class PlainPainter implements Painter {
  private run = 0;

  constructor(private context: CanvasRenderingContext2D) {}

  paint(films: (Film | null)[], look: Look) {
    const run = ++this.run;
    const { width, height } = films[0]!;
    const scale = 2 ** look.exposure;
    const split = films[1] ? Math.round(look.divider * width) : width;
    const { exposure, curve, divider } = look;
    const rows = (from: number) => {
      if (run !== this.run || exposure !== look.exposure || curve !== look.curve || divider !== look.divider) return;
      const end = performance.now() + 12;
      let y = from;
      do {
        const image = this.context.createImageData(width, 1);
        for (let x = 0; x < width; x++) {
          const film = x < split ? films[0]! : films[1]!;
          const column = film.width === width ? x : Math.floor(x * film.width / width);
          const row = film.height === height ? y : Math.floor(y * film.height / height);
          const at = 4 * (row * film.width + column);
          develop(scale * film.pixels[at], scale * film.pixels[at + 1], scale * film.pixels[at + 2], curve, image.data, 4 * x);
        }
        this.context.putImageData(image, 0, y);
      } while (++y < height && performance.now() < end);
      if (y < height) setTimeout(rows, 0, y);
    };
    rows(0);
  }
}
