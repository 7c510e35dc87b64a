"use strict";
(async () => {
  const $ = (id) => document.getElementById(id);
  const data = JSON.parse($("data").textContent);
  const report = data.report;
  const [width, height] = report.scene.size;

  // ---- Pictures: bytes from base64, zlib and differences; see pixels.rs.

  const bytesOf = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));

  async function planes(text) {
    const packed = new Blob([bytesOf(text)]).stream().pipeThrough(new DecompressionStream("deflate"));
    const bytes = new Uint8Array(await new Response(packed).arrayBuffer());
    for (let row = 0; row < bytes.length; row += width) {
      for (let x = 1; x < width; x++) bytes[row + x] += bytes[row + x - 1];
    }
    return bytes;
  }

  async function unpack(picture) {
    const [radiance, relative, flip] = await Promise.all(
      [picture.radiance, picture.relative, picture.flip].map((text) => text && planes(text)));
    return { radiance, relative, flip };
  }

  // ---- What is shown: entry 0 is the reference, then every strategy that took part.

  const number = (x, digits = 3) => Number(x.toPrecision(digits));
  const scientific = (x) => x.toExponential(2).replace("e", " · 10^").replace("^+", "^");
  const superscript = (text) => text.replace(/\^(-?\d+)/, (_, digits) =>
    [...digits].map((d) => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["-0123456789".indexOf(d)]).join(""));
  const stops = (x) => `${x > 0 ? "+" : ""}${Number(x.toFixed(2))} EV`.replace("-", "−");
  const error = (x) => (x >= 0.1 && x < 1000 ? number(x).toString() : superscript(scientific(x)));

  const shown = [{ name: "reference", caption: "converged", packed: { radiance: data.reference } }];
  let color = 0;
  report.strategies.forEach((strategy, i) => {
    if (!strategy.result) return;
    strategy.color = data.palette[color++ % data.palette.length];
    shown.push({ name: strategy.name, caption: "relMSE " + error(strategy.result.rel_mse.mean), packed: data.pictures[i] });
  });
  await Promise.all(shown.map(async (entry) => Object.assign(entry, await unpack(entry.packed))));
  for (const entry of shown) {
    delete entry.packed;
    entry.canvas = Object.assign(document.createElement("canvas"), { width, height });
    entry.pixels = new ImageData(width, height);
    entry.stale = true;
  }

  const state = { mode: "radiance", exposure: report.exposure, tone: report.tone, zoom: 1, x: 0.5, y: 0.5, divider: 0.5, left: 1, right: 0 };
  const best = bestOf((result) => -result.rel_mse.mean);
  if (shown.length > 1) state.left = 1 + measured().findIndex((s) => s.name === "mis" || s.name.startsWith("mis:"));
  if (state.left < 1) state.left = Math.min(1, shown.length - 1);
  if (best && shown.length > 2) state.right = 1 + measured().indexOf(best);
  if (state.right === state.left) state.right = 0;

  function measured() { return report.strategies.filter((s) => s.result); }
  function bestOf(merit, among = measured()) {
    return among.reduce((a, b) => (a && merit(a.result) >= merit(b.result) ? a : b), null);
  }
  // A biased strategy is as quick as it is wrong.
  function mostEfficient() {
    return bestOf((result) => result.efficiency, measured().filter((s) => s.unbiased !== false));
  }

  // ---- From radiance to the screen: the curves of the program, see picture/tone.rs and picture/agx.rs. A value is
  // mantissa · 2^(exponent − 136), one byte of each. Curves change the color c in place.

  const c = new Float64Array(3);
  const luminance = () => 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
  const multiply = (m) => {
    const [r, g, b] = c;
    for (let i = 0; i < 3; i++) c[i] = m[3 * i] * r + m[3 * i + 1] * g + m[3 * i + 2] * b;
  };

  // The sigmoid of AgX over log2 of light, -10 to 6.5 stops around middle gray.
  const AGX_STEPS = 4096;
  const agxCurve = Float64Array.from({ length: AGX_STEPS + 2 }, (_, i) => {
    const d = 2.4 * (i / AGX_STEPS - 10 / 16.5);
    const scale = d < 0 ? -0.5656756 : 0.7151983;
    const u = d / scale;
    return Math.max(scale * u / (1 + u ** 1.5) ** (1 / 1.5) + 0.18 ** (1 / 2.4), 0) ** 2.4;
  });
  function agxShaped(light) {
    const stops = Math.min(Math.max(Math.log2(Math.max(light, 1e-10) / 0.18), -10), 6.5);
    const at = (stops + 10) / 16.5 * AGX_STEPS, i = Math.floor(at);
    return agxCurve[i] + (at - i) * (agxCurve[i + 1] - agxCurve[i]);
  }
  const agxPurity = (y) => 1 - Math.min(y ** 0.08, 1);
  const AGX_IN = [0.54481475, 0.3737874, 0.081397855, 0.14041695, 0.75413756, 0.1054455, 0.08881042, 0.17887176, 0.7323178];
  const AGX_OUT = [1.9648874, -0.8559885, -0.10889892, -0.29931337, 1.326398, -0.0270846, -0.16435274, -0.23818397, 1.4025367];

  const curves = {
    standard() {},
    reinhard() {
      const scale = 1 / (1 + luminance());
      for (let i = 0; i < 3; i++) c[i] *= scale;
    },
    aces() {
      multiply([0.59719, 0.35458, 0.04823, 0.076, 0.90834, 0.01566, 0.0284, 0.13383, 0.83777]);
      for (let i = 0; i < 3; i++) {
        const x = Math.min(c[i], 1e9);
        c[i] = (x * (x + 0.0245786) - 0.000090537) / (x * (0.983729 * x + 0.432951) + 0.238081);
      }
      multiply([1.60475, -0.53108, -0.07367, -0.10208, 1.10813, -0.00605, -0.00327, -0.07276, 1.07602]);
    },
    agx() {
      multiply(AGX_IN);
      const [r, g, b] = c;
      for (let i = 0; i < 3; i++) c[i] = agxShaped(c[i]);
      const least = Math.min(r, g, b), range = Math.max(r, g, b) - least;
      const low = Math.min(c[0], c[1], c[2]), formed = Math.max(c[0], c[1], c[2]) - low;
      if (range > 0 && formed > 0) {
        // Six tenths of the hue before the curve come back.
        c[0] = low + 0.6 * formed * (r - least) / range + 0.4 * (c[0] - low);
        c[1] = low + 0.6 * formed * (g - least) / range + 0.4 * (c[1] - low);
        c[2] = low + 0.6 * formed * (b - least) / range + 0.4 * (c[2] - low);
      }
      multiply(AGX_OUT);
      const below = -Math.min(c[0], c[1], c[2]);
      if (below <= 0) return;
      const y = Math.max(0.2067738 * c[0] + 0.6581298 * c[1] + 0.1350964 * c[2], 0), raised = y + below;
      const factor = Math.min((y + agxPurity(y) * raised) / (raised + agxPurity(raised) * raised), 1);
      for (let i = 0; i < 3; i++) c[i] = (c[i] + below) * factor;
    },
    neutral() {
      const least = Math.min(c[0], c[1], c[2]);
      const offset = least < 0.08 ? least - 6.25 * least * least : 0.04;
      for (let i = 0; i < 3; i++) c[i] -= offset;
      const peak = Math.max(c[0], c[1], c[2]);
      if (peak < 0.76) return;
      const top = 1 - 0.24 * 0.24 / (peak + 0.24 - 0.76);
      const white = 1 - 1 / (0.15 * (peak - top) + 1);
      for (let i = 0; i < 3; i++) c[i] = c[i] * (top / peak) * (1 - white) + top * white;
    },
  };

  // Bytes of sRGB from linear light in [0, 1], finer than the eye.
  const SRGB_STEPS = 4096;
  const encoded = Uint8Array.from({ length: SRGB_STEPS + 1 }, (_, i) => {
    const x = i / SRGB_STEPS;
    return Math.round(255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055));
  });
  const byteOf = (x) => encoded[Math.round(SRGB_STEPS * Math.min(Math.max(x, 0), 1))];

  const scales = { relative: bytesOf(data.viridis), flip: bytesOf(data.magma) };

  function develop(entry) {
    const out = entry.pixels.data, n = width * height;
    const values = entry[state.mode];
    if (state.mode === "radiance") {
      const curve = curves[state.tone];
      const scales = Float64Array.from({ length: 256 }, (_, e) => e && 2 ** (e - 136 + state.exposure));
      for (let i = 0, o = 0; i < n; i++, o += 4) {
        const scale = scales[values[3 * n + i]];
        for (let channel = 0; channel < 3; channel++) c[channel] = Math.min(values[channel * n + i] * scale, 1e30);
        curve();
        for (let channel = 0; channel < 3; channel++) out[o + channel] = byteOf(c[channel]);
        out[o + 3] = 255;
      }
    } else {
      // The reference has no error.
      const colors = scales[state.mode];
      for (let i = 0, o = 0; i < n; i++, o += 4) {
        const c = values ? 3 * values[i] : 0;
        out[o] = colors[c]; out[o + 1] = colors[c + 1]; out[o + 2] = colors[c + 2]; out[o + 3] = 255;
      }
    }
    entry.canvas.getContext("2d").putImageData(entry.pixels, 0, 0);
    entry.stale = false;
  }

  // ---- Viewers: the pair of two pictures, the grid with all; one zoom and place for all.

  const pairViewer = { box: $("pair-viewer"), canvas: $("pair-viewer").querySelector("canvas") };
  const cards = shown.map((entry, i) => card(entry, i));
  const viewers = [pairViewer, ...cards];
  document.documentElement.style.setProperty("--viewer-width", `min(100%, calc(86vh * ${width / height}))`);

  function card(entry, i) {
    const figure = document.createElement("figure");
    const box = document.createElement("div");
    box.className = "viewer";
    box.tabIndex = 0;
    box.setAttribute("role", "group");
    box.setAttribute("aria-label", `Picture of ${entry.name}`);
    const canvas = document.createElement("canvas");
    canvas.setAttribute("role", "img");
    box.append(canvas);
    const caption = document.createElement("figcaption");
    const choose = element("div", "choose");
    const buttons = ["left", "right"].map((side) => {
      const button = element("button", "", side === "left" ? "◧ left" : "right ◨");
      button.type = "button";
      button.setAttribute("aria-label", `Show ${entry.name} on the ${side}`);
      button.addEventListener("click", () => { state[side] = i; refresh(); });
      choose.append(button);
      return button;
    });
    caption.append(element("div", "name", entry.name), element("div", "numbers", entry.caption), choose);
    figure.append(box, caption);
    $("grid").append(figure);
    return { box, canvas, entry, buttons };
  }

  function element(tag, className, text) {
    const made = document.createElement(tag);
    if (className) made.className = className;
    if (text !== undefined) made.textContent = text;
    return made;
  }

  function draw(canvas, paint) {
    const ratio = window.devicePixelRatio || 1;
    const w = Math.max(1, Math.round(canvas.clientWidth * ratio)), h = Math.max(1, Math.round(w * height / width));
    if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
    const context = canvas.getContext("2d");
    // Pixels are seen as such once they are large.
    context.imageSmoothingEnabled = state.zoom * w / width < 2;
    context.imageSmoothingQuality = "high";
    const [sw, sh] = [width / state.zoom, height / state.zoom];
    const [sx, sy] = [state.x * width - sw / 2, state.y * height - sh / 2];
    paint(context, (entry) => {
      if (entry.stale) develop(entry);
      context.drawImage(entry.canvas, sx, sy, sw, sh, 0, 0, w, h);
    }, w, h);
  }

  let waiting = false;
  function refresh() {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => { waiting = false; paintAll(); });
  }

  function paintAll() {
    const half = 0.5 / state.zoom;
    state.x = Math.min(Math.max(state.x, half), 1 - half);
    state.y = Math.min(Math.max(state.y, half), 1 - half);
    const [left, right] = [shown[state.left], shown[state.right]];
    draw(pairViewer.canvas, (context, put, w, h) => {
      put(right);
      context.save();
      context.beginPath();
      context.rect(0, 0, state.divider * w, h);
      context.clip();
      put(left);
      context.restore();
    });
    pairViewer.canvas.setAttribute("aria-label", `${left.name} on the left, ${right.name} on the right`);
    for (const card of cards) {
      draw(card.canvas, (_, put) => put(card.entry));
      card.canvas.setAttribute("aria-label", card.entry.name);
      card.buttons.forEach((button, side) => {
        button.setAttribute("aria-pressed", String(card.entry === [left, right][side]));
      });
    }
    const percent = Math.round(100 * state.divider);
    $("divider").style.left = `${100 * state.divider}%`;
    $("divider").setAttribute("aria-valuenow", percent);
    $("divider").setAttribute("aria-valuetext", `${percent} % ${left.name}`);
    $("left").value = state.left;
    $("right").value = state.right;
    $("exposure").value = state.exposure;
    $("exposure-value").textContent = stops(state.exposure);
    $("zoom-value").textContent = `${number(state.zoom, 2)}×`;
    document.body.classList.toggle("zoomed", state.zoom > 1);
  }

  function restyle() {
    for (const entry of shown) entry.stale = true;
    legend();
    refresh();
  }

  // ---- Zoom and pan.

  const MOST = Math.max(8, width / 8);

  // Keeps what is at the fraction (u, v) of a viewer where it is.
  function zoomTo(zoom, u = 0.5, v = 0.5) {
    zoom = Math.min(Math.max(zoom, 1), MOST);
    const gain = 1 / state.zoom - 1 / zoom;
    state.x += (u - 0.5) * gain;
    state.y += (v - 0.5) * gain;
    state.zoom = zoom;
    refresh();
  }

  function pan(du, dv) {
    state.x += du / state.zoom;
    state.y += dv / state.zoom;
    refresh();
  }

  function fraction(box, event) {
    const r = box.getBoundingClientRect();
    return [(event.clientX - r.left) / r.width, (event.clientY - r.top) / r.height];
  }

  for (const { box } of viewers) {
    const pointers = new Map();
    box.addEventListener("wheel", (event) => {
      // Over the grid the wheel scrolls the page until a picture has the focus.
      const takes = box === pairViewer.box || event.ctrlKey || box.contains(document.activeElement);
      if (!takes || (state.zoom === 1 && event.deltaY > 0 && !event.ctrlKey)) return;
      event.preventDefault();
      const lines = event.deltaMode === 1 ? 24 : event.deltaMode === 2 ? 240 : 1;
      zoomTo(state.zoom * Math.exp(-event.deltaY * lines * (event.ctrlKey ? 0.01 : 0.002)), ...fraction(box, event));
    }, { passive: false });
    box.addEventListener("pointerdown", (event) => {
      if (event.button !== 0 || event.target.closest("#divider")) return;
      pointers.set(event.pointerId, fraction(box, event));
      box.setPointerCapture(event.pointerId);
      box.classList.add("dragging");
    });
    box.addEventListener("pointermove", (event) => {
      if (!pointers.has(event.pointerId)) return;
      const before = [...pointers.values()];
      const was = pointers.get(event.pointerId), now = fraction(box, event);
      pointers.set(event.pointerId, now);
      const after = [...pointers.values()];
      if (after.length === 1) {
        pan(was[0] - now[0], was[1] - now[1]);
      } else if (after.length === 2) {
        const r = box.getBoundingClientRect();
        const apart = ([a, b]) => Math.hypot((a[0] - b[0]) * r.width, (a[1] - b[1]) * r.height);
        const middle = ([a, b]) => [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2];
        const [from, to] = [middle(before), middle(after)];
        pan(from[0] - to[0], from[1] - to[1]);
        zoomTo(state.zoom * apart(after) / Math.max(apart(before), 1), ...to);
      }
    });
    for (const end of ["pointerup", "pointercancel"]) {
      box.addEventListener(end, (event) => {
        pointers.delete(event.pointerId);
        if (!pointers.size) box.classList.remove("dragging");
      });
    }
    box.addEventListener("dblclick", (event) => {
      if (event.target.closest("#divider")) return;
      const [u, v] = fraction(box, event);
      zoomTo(state.zoom > 1 ? 1 : 4, u, v);
    });
    box.addEventListener("keydown", (event) => {
      if (event.target !== box || event.ctrlKey || event.metaKey || event.altKey) return;
      const act = {
        "+": () => zoomTo(state.zoom * 1.5), "=": () => zoomTo(state.zoom * 1.5), "-": () => zoomTo(state.zoom / 1.5),
        "0": () => zoomTo(1), "[": () => expose(state.exposure - 0.5), "]": () => expose(state.exposure + 0.5),
        ArrowLeft: () => pan(-0.1, 0), ArrowRight: () => pan(0.1, 0), ArrowUp: () => pan(0, -0.1), ArrowDown: () => pan(0, 0.1),
      }[event.key];
      const scrolls = event.key.startsWith("Arrow") && state.zoom === 1;
      if (!act || scrolls) return;
      event.preventDefault();
      act();
    });
  }

  $("zoom-in").addEventListener("click", () => zoomTo(state.zoom * 1.5));
  $("zoom-out").addEventListener("click", () => zoomTo(state.zoom / 1.5));
  $("zoom-fit").addEventListener("click", () => zoomTo(1));

  // ---- The divider.

  const divider = $("divider");
  function divide(part) {
    state.divider = Math.min(Math.max(part, 0), 1);
    refresh();
  }
  divider.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    divider.setPointerCapture(event.pointerId);
    event.preventDefault();
    divider.focus({ preventScroll: true });
  });
  divider.addEventListener("pointermove", (event) => {
    if (divider.hasPointerCapture(event.pointerId)) divide(fraction(pairViewer.box, event)[0]);
  });
  divider.addEventListener("keydown", (event) => {
    const step = event.shiftKey ? 0.1 : 0.02;
    const to = {
      ArrowLeft: state.divider - step, ArrowDown: state.divider - step, ArrowRight: state.divider + step,
      ArrowUp: state.divider + step, PageDown: state.divider - 0.1, PageUp: state.divider + 0.1, Home: 0, End: 1,
    }[event.key];
    if (to === undefined) return;
    event.preventDefault();
    divide(to);
  });

  // ---- Controls.

  for (const side of ["left", "right"]) {
    shown.forEach((entry, i) => $(side).append(new Option(entry.name, i)));
    $(side).addEventListener("change", () => { state[side] = Number($(side).value); refresh(); });
  }
  $("swap").addEventListener("click", () => {
    [state.left, state.right] = [state.right, state.left];
    refresh();
  });
  // Ten stops to each side of the exposure with which the page opens, and no exposure at all.
  const RANGE = [Math.min(report.exposure - 10, 0), Math.max(report.exposure + 10, 0)];
  [$("exposure").min, $("exposure").max] = RANGE;
  $("exposure").step = "any";
  function expose(exposure) {
    state.exposure = Math.min(Math.max(exposure, RANGE[0]), RANGE[1]);
    if (state.mode === "radiance") for (const entry of shown) entry.stale = true;
    refresh();
  }
  $("exposure").addEventListener("input", () => expose(Number($("exposure").value)));
  $("exposure").addEventListener("dblclick", () => expose(report.exposure));
  $("exposure").addEventListener("keydown", (event) => {
    const step = { ArrowLeft: -0.25, ArrowDown: -0.25, ArrowRight: 0.25, ArrowUp: 0.25, PageDown: -1, PageUp: 1 }[event.key];
    if (step === undefined) return;
    event.preventDefault();
    expose(state.exposure + step);
  });
  $("tone").value = state.tone;
  $("tone").addEventListener("change", () => { state.tone = $("tone").value; restyle(); });
  for (const radio of document.querySelectorAll("input[name=mode]")) {
    radio.addEventListener("change", () => {
      state.mode = radio.value;
      const radiance = state.mode === "radiance";
      $("exposure").disabled = !radiance;
      $("tone").disabled = !radiance;
      restyle();
    });
  }

  function legend() {
    $("scale").hidden = state.mode === "radiance";
    if (state.mode === "radiance") return;
    const bar = $("scale-bar").getContext("2d"), line = new ImageData(256, 1);
    for (let i = 0; i < 256; i++) line.data.set([...scales[state.mode].subarray(3 * i, 3 * i + 3), 255], 4 * i);
    bar.putImageData(line, 0, 0);
    const [low, high] = data.relativeErrors;
    const relative = state.mode === "relative";
    const decades = Math.round(Math.log10(high / low));
    const ticks = relative
      ? Array.from({ length: decades + 1 }, (_, i) => [i / decades, `${number(100 * low * 10 ** i)} %`])
      : [0, 0.25, 0.5, 0.75, 1].map((v) => [v, String(v)]);
    if (relative) { ticks[0][1] = "≤ " + ticks[0][1]; ticks[decades][1] = "≥ " + ticks[decades][1]; }
    $("scale-name").textContent = relative ? "Relative error of each pixel" : "ꟻLIP: difference that the eye sees";
    $("scale-bar").setAttribute("aria-label", `Colors from ${ticks[0][1]} to ${ticks[ticks.length - 1][1]}`);
    $("scale-ticks").replaceChildren(...ticks.map(([at, text]) => {
      const tick = element("span", "", text);
      tick.style.left = `${100 * at}%`;
      return tick;
    }));
  }

  // ---- Lead, table, notes, settings.

  const [kind, value] = report.budget.split(":");
  const budget = {
    rays: `${value} shadow rays per pixel`, time: `${value.replace("s", "")} CPU seconds`, spp: `${value} camera samples per pixel`,
  }[kind];

  function lead() {
    const others = report.strategies.filter((s) => s.unbiased === null).length;
    const n = report.strategies.length - others;
    const beside = others ? `, beside ${others} ${others === 1 ? "picture" : "pictures"} by other renderers` : "";
    const parts = [document.createTextNode(`${n} ${n === 1 ? "strategy" : "strategies"} at ${budget}, ${report.seeds} ${report.seeds === 1 ? "picture" : "pictures"} each${beside}. `)];
    $("other-renderers").hidden = !others;
    if (best) {
      parts.push(document.createTextNode("Least error: "), element("strong", "", best.name));
      const ratio = best.result.error_ratio_to_mis;
      if (ratio && ratio > 1.005) parts.push(document.createTextNode(`, relMSE ${number(ratio, 2)} times below mis`));
      parts.push(document.createTextNode("."));
    }
    const quick = mostEfficient();
    if (quick && quick !== best) {
      parts.push(document.createTextNode(" Most efficient: "), element("strong", "", quick.name), document.createTextNode("."));
    }
    $("lead").append(...parts);
  }

  function tableRows() {
    const columns = ["Strategy", "relMSE", "relMSE / mis", "Bias", "ꟻLIP", "Rays", "CPU s", "Efficiency", "Eff. / mis", "spp"];
    const head = element("thead"), row = element("tr");
    for (const name of columns) {
      const cell = element("th", "", name);
      cell.scope = "col";
      row.append(cell);
    }
    head.append(row);
    const body = element("tbody");
    const fastest = mostEfficient(), clearest = bestOf((r) => -r.flip);
    for (const strategy of report.strategies) {
      const row = element("tr");
      const name = element("th");
      name.scope = "row";
      name.title = strategy.settings;
      row.append(name);
      const r = strategy.result;
      if (!r) {
        name.textContent = strategy.name;
        const why = element("td", "left-out", `left out: ${strategy.left_out}`);
        why.colSpan = columns.length - 1;
        row.append(why);
        body.append(row);
        continue;
      }
      const swatch = element("span", "swatch");
      swatch.style.background = strategy.color;
      swatch.dataset.color = strategy.color;
      name.append(swatch, strategy.name);
      const cell = (text, isBest, small) => {
        const made = element("td", isBest ? "best" : "", text);
        if (small) made.append(" ", element("small", "", small));
        row.append(made);
      };
      const off = kind === "rays" && r.rays !== null ? r.rays / Number(value) - 1 : 0;
      const late = kind === "time" ? r.cpu_seconds.mean / parseFloat(value) - 1 : 0;
      const deviation = (part) => Math.abs(part) < 0.02 ? "" : `${part > 0 ? "+" : "−"}${Math.round(100 * Math.abs(part))} %`;
      const ratio = (x) => x === null ? "–" : number(x).toString();
      const sd = r.rel_mse.sd;
      cell(error(r.rel_mse.mean), best === strategy, sd === null ? "" : `± ${number(100 * sd / r.rel_mse.mean, 2)} %`);
      cell(r.error_ratio_to_mis === null ? "–" : ratio(1 / r.error_ratio_to_mis));
      cell(biasText(strategy));
      cell(r.flip.toFixed(3), clearest === strategy);
      cell(r.rays === null ? "–" : r.rays.toFixed(1), false, deviation(off));
      cell(number(r.cpu_seconds.mean).toString(), false, r.spp === null ? "" : deviation(late));
      cell(number(r.efficiency).toLocaleString("en"), fastest === strategy);
      cell(ratio(r.efficiency_ratio_to_mis));
      cell(r.spp === null ? "–" : r.spp);
      body.append(row);
    }
    $("table").append(head, body);
  }

  function biasText(strategy) {
    if (strategy.unbiased === null) return "–";
    if (strategy.unbiased) return "none";
    const { bias, rel_mse } = strategy.result;
    if (bias === null) return "yes";
    return `${Math.round(100 * Math.min(Math.max(bias / rel_mse.mean, 0), 1))} % of it`;
  }

  function notes() {
    const add = (text) => $("notes").append(element("li", "", text));
    const noise = report.reference.rel_mse;
    if (noise !== null) add(`The reference's own relMSE is ${error(noise)}; errors near it are not to be trusted.`);
    if (kind === "rays") add("Equal rays: as many whole camera samples as come nearest to the budget, by the rays that a pilot traced.");
    if (kind === "time") add("Equal time: the number of camera samples was found by measuring CPU seconds; what the pictures then took is in the table.");
    if (kind === "spp") add("Equal camera samples: rays and time differ.");
    const biased = report.strategies.filter((s) => s.unbiased === false).map((s) => s.name);
    const others = report.strategies.filter((s) => s.unbiased === null).map((s) => s.name);
    if (others.length) add(`By other renderers: ${others.join(", ")}. Their times are as stated, and not measured on this machine by this program.`);
    if (biased.length) add(`Biased: ${biased.join(", ")}. Fixed lights leave an error that more samples do not take away (what does fall is that of edges within pixels); their efficiency says little.`);
    if (measured().every((s) => s.result.error_ratio_to_mis === null)) add("Without mis in the list there is nothing to take ratios to.");
  }

  function settings() {
    const { scene, reference } = report;
    const view = scene.camera;
    const list = [
      ["Scene", `${scene.scene}, ${scene.triangles.toLocaleString("en")} triangles${scene.material ? `, material ${scene.material}` : ""}${scene.ground ? ", on a ground" : ""}`],
      ["Environment", `${scene.environment.probe}, ${scene.environment.size.join(" × ")}, rotated by ${scene.environment.rotate}°, scale ${scene.environment.scale}, exposure ${scene.environment.exposure} EV`],
      ["Camera", `from (${view.origin.map((x) => number(x)).join(", ")}) to (${view.target.map((x) => number(x)).join(", ")}), ${view.fov === null ? `orthographic, height ${number(view.ortho)}` : `field of view ${number(view.fov)}°`}`],
      ["Picture", `${width} × ${height}, filter ${report.filter}, sampler ${report.sampler}`],
      ["Budget", report.budget],
      ["Seeds", `${report.seed} to ${report.seed + report.seeds - 1}; the pictures shown are of the first`],
      ["Reference", reference.source === "file" ? reference.file : `${reference.strategy}, ${reference.spp} camera samples per pixel${reference.source === "cache" ? ", from the cache" : ""}`],
      ["ꟻLIP at", `${stops(report.exposure)}, tone curve ${report.tone}`],
      ["Threads", report.threads],
      ["Version", report.version],
    ];
    for (const strategy of report.strategies) list.push([strategy.name, strategy.settings + (strategy.unbiased === null ? "" : `; setup ${number(strategy.setup_seconds, 2)} CPU s`)]);
    for (const [term, text] of list) $("settings").append(element("dt", "", term), element("dd", "", String(text)));
  }

  lead();
  tableRows();
  notes();
  settings();
  legend();
  new ResizeObserver(refresh).observe(pairViewer.box);
  for (const { box } of cards) new ResizeObserver(refresh).observe(box);
  paintAll();
  document.documentElement.dataset.ready = "true";
})();
