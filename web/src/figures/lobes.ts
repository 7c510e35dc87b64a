// Steps 2 to 4: lobes, their samples, and the reflection of half vectors.

import { short } from "../dom";
import { figureWidth, framed, isPresenting, plot, type Series } from "../plot";
import { pixels } from "../pointer";
import type { Mark, Stage } from "../stage";
import type { Point } from "./curves";

const RADIANS = Math.PI / 180;
/** The counts of samples that play: doubled at each step. */
const doubled = (k: number) => String(2 ** k);

/** Where a polar plot has its center. */
const polarPlace = () => {
  const width = figureWidth(), x0 = width / 2, radius = Math.min(isPresenting() ? 160 : 240, x0 - 40);
  return { width, x0, radius, y0: radius + 44 };
};
/** The angle of a place in a polar plot from the normal [degrees]. */
const polarAngle = ({ x, y }: { x: number; y: number }) => {
  const { x0, y0 } = polarPlace();
  return Math.atan2(x - x0, Math.max(y0 - y, 0)) / RADIANS;
};

/** A polar plot of densities [1/sr] over the angle from the normal, −90° to 90°, with a direction on the left and one on
 *  the right. */
function polar(series: Series[], directions: [[number, string], [number, string]]): string {
  const { width, x0, radius, y0 } = polarPlace(), height = y0 + 28;
  const most = Math.max(...series.flatMap((s) => s.points.map((p) => p[1])), 1e-9);
  const at = (theta: number, r: number) => `${(x0 + radius * r * Math.sin(theta)).toFixed(1)},${(y0 - radius * r * Math.cos(theta)).toFixed(1)}`;
  const label = (theta: number, r: number, text: string, side: number) => {
    const [x, y] = at(theta, r).split(",");
    return `<text class="name" x="${Number(x) + 4 * side}" y="${Number(y) + 4}" text-anchor="${side < 0 ? "end" : "start"}">${text}</text>`;
  };
  const rings = [0.5, 1].map((r) => `<path class="grid" fill="none" d="M${at(-Math.PI / 2, r)}A${radius * r} ${radius * r} 0 0 1 ${at(Math.PI / 2, r)}"/><text x="${x0 + radius * r}" y="${y0 + 16}" text-anchor="middle">${short(r * most)}${r === 1 ? " per sr" : ""}</text>`);
  const curves = series.map((s) => `<path class="${s.kind} line" d="M${s.points.map(([t, r]) => at(t, r / most)).join("L")}"/>`);
  const arrows = directions.map(([theta, name], i) => `<path class="axis" d="M${x0} ${y0}L${at(theta, 1)}"/>${label(theta, 1.04, name, 2 * i - 1)}`);
  const legend = series.map((s, i) => `<path class="${s.kind} line" d="M8 ${14 + 18 * i}h16"/><text class="name" x="30" y="${18 + 18 * i}">${s.name}</text>`);
  return `<svg viewBox="0 0 ${width} ${height}"${framed(pixels(width, height))} aria-hidden="true">${rings.join("")}<path class="axis" d="M20 ${y0}H${width - 20}"/>${arrows.join("")}${curves.join("")}${legend.join("")}</svg>`;
}

/** How far a direction may be from the plane of incidence to be marked in it [degrees]. */
const IN_PLANE = 4;

/** A direction at the rim of a polar plot. */
const markPolar = (frame: number, angle: number): Mark => {
  const { x0, y0, radius } = polarPlace();
  return { frame, x: x0 + radius * Math.sin(angle), y: y0 - radius * Math.cos(angle) };
};

export const lobes = (stage: Stage) => {
  const exponent = stage.slider("Exponent n", 1, 200, 1, 20);
  const angle = stage.slider("Viewer", 0, 85, 1, 40, (x) => `${x}°`);
  const falling = stage.player("Samples", 0, 10, 7, doubled);
  // Dragging turns the viewer, or the mirror direction on the other side.
  const pointed = stage.pointer((at) => {
    const theta = at.frame === 0 ? polarAngle(at) : directionAt(at, hemisphere(0)).theta;
    angle.set(Math.min(Math.round(Math.abs(theta)), 85));
  });
  stage.draw(async () => {
    const { engines } = stage.app, n = 361, count = 2 ** falling();
    const curve = async (material: string) => {
      const values = (await engines.call("lobeSection", material, angle(), n)) as Float32Array;
      return Array.from({ length: n }, (_, i): Point => [Math.PI * ((i + 0.5) / n - 0.5), values[2 * i + 1]]);
    };
    const phong = `phong:${exponent()}:1:0`;
    const kept = ((await engines.call("lobeSamples", phong, angle(), 2000, 1)) as Float32Array).length / 3;
    const samples = (await engines.call("lobeSamples", phong, angle(), count, 1)) as Float32Array;
    const series: Series[] = [
      { name: `Phong, n = ${exponent()}`, kind: "lobe", points: await curve(phong) },
      { name: "cosine", kind: "light", points: await curve("diffuse:1") },
    ];
    const theta = angle() * RADIANS, view = hemisphere(0);
    stage.svg(polar(series, [[-theta, "viewer"], [theta, "mirror"]]) + fromAboveSvg(view, samples, theta), "Densities in the plane of incidence, and sampled directions from above");
    const peak = Math.max(...series[0].points.map((p) => p[1]));
    const at = pointed();
    if (at?.frame === 0) {
      const t = polarAngle(at), i = Math.min(Math.max(Math.floor((t / 180 + 0.5) * n), 0), n - 1);
      stage.read(`${Math.round(Math.abs(t))}° from the normal on the ${t < 0 ? "viewer’s" : "mirror’s"} side: Phong ${short(series[0].points[i][1])}, cosine ${short(series[1].points[i][1])} per steradian.`);
      stage.mark(markAbove(1, polarDirection({ theta: t, phi: 0 }), view));
    } else if (at) {
      const { theta: t, phi } = directionAt(at, view), [x, y, z] = polarDirection({ theta: t, phi });
      const toMirror = Math.max(x * Math.sin(theta) + z * Math.cos(theta), 0), power = exponent();
      stage.read(t > 90 ? null : `θ = ${Math.round(t)}°, φ = ${Math.round(phi)}°: Phong ${short((power + 1) / (2 * Math.PI) * toMirror ** power)}, cosine ${short(z / Math.PI)} per steradian.`);
      // The plot above is of the plane of incidence.
      if (t <= 90 && Math.abs(Math.asin(y)) < IN_PLANE * RADIANS) stage.mark(markPolar(0, Math.atan2(x, z)));
    } else stage.read(null);
    stage.say(`The maximum density is ${short(peak)} per steradian; ${short(100 * (1 - kept / 2000))} % of the Phong samples are below the surface. ${samples.length / 3} of ${count} samples are above it; the lower picture shows them from above.`);
  });
};

type Vector = [number, number, number];

/** The position of a direction in a hemisphere seen from above, with radius proportional to the polar angle. */
const fromAbove = ([x, y, z]: Vector, [x0, y0, radius]: Vector): Point => {
  const across = Math.hypot(x, y), r = across > 0 ? radius * Math.atan2(across, z) / (Math.PI / 2) / across : 0;
  return [x0 + r * x, y0 - r * y];
};

/** The direction at a place of a hemisphere seen from above [degrees]: theta beyond 90 is outside. */
function directionAt({ x, y }: { x: number; y: number }, [x0, y0, radius]: Vector): { theta: number; phi: number } {
  return { theta: 90 * Math.hypot(x - x0, y - y0) / radius, phi: Math.atan2(y0 - y, x - x0) / RADIANS };
}

/** A direction by its polar angle and azimuth [degrees]. */
const polarDirection = ({ theta, phi }: { theta: number; phi: number }): Vector => {
  const [t, p] = [theta * RADIANS, phi * RADIANS];
  return [Math.sin(t) * Math.cos(p), Math.sin(t) * Math.sin(p), Math.cos(t)];
};

/** The place of a direction in a hemisphere seen from above, as a mark in a picture of the figure. */
const markAbove = (frame: number, direction: Vector, view: Vector): Mark => {
  const [x, y] = fromAbove(direction, view);
  return { frame, x, y };
};

/** A hemisphere from above with sampled directions, and the viewer and the mirror direction at an angle. */
function fromAboveSvg(view: Vector, samples: Float32Array, theta: number): string {
  const dots: string[] = [];
  for (let i = 0; i < samples.length; i += 3) {
    const [x, y, z] = samples.subarray(i, i + 3);
    dots.push(`M${fromAbove([x, y, z], view).map((c) => c.toFixed(1)).join(" ")}h0`);
  }
  const mark = (name: string, side: number) => {
    const [x, y] = fromAbove([side * Math.sin(theta), 0, Math.cos(theta)], view);
    return `<circle class="axis" cx="${x}" cy="${y}" r="5"/><text class="name halo" x="${x + 9 * side}" y="${y + 4}" text-anchor="${side < 0 ? "end" : "start"}">${name}</text>`;
  };
  const [width, height] = [2 * view[0], view[1] + view[2] + 8];
  return `<svg viewBox="0 0 ${width} ${height}"${framed(pixels(width, height))} aria-hidden="true">${rings(view)}<path class="lobe dots" d="${dots.join("")}"/>${mark("viewer", -1)}${mark("mirror", 1)}</svg>`;
}

/** The center and radius of a hemisphere from above, with `above` as the space on top. */
const hemisphere = (above: number, radius = isPresenting() ? 105 : 150): Vector => {
  return [figureWidth() / 2, above + radius + 22, radius];
};
/** That of step 3, which has more room. */
const wardView = () => hemisphere(0, isPresenting() ? 140 : 150);

/** Rings at 30°, 60° and 90° from the normal, with the axes x and y. */
function rings([x0, y0, radius]: Vector): string {
  const circle = (degrees: number) => {
    const r = radius * degrees / 90, at = Math.SQRT1_2 * r;
    return `<circle class="grid" fill="none" cx="${x0}" cy="${y0}" r="${r}"/><text class="halo" x="${x0 - at}" y="${y0 - at + 4}" text-anchor="middle">${degrees}°</text>`;
  };
  return `<path class="grid" d="M${x0 - radius} ${y0}h${2 * radius}M${x0} ${y0 - radius}v${2 * radius}"/>${[30, 60, 90].map(circle).join("")}
    <text x="${x0 + radius + 8}" y="${y0 + 4}">x</text><text x="${x0}" y="${y0 - radius - 6}" text-anchor="middle">y</text>`;
}

/** The polar angle and the azimuth of a direction [degrees]. */
const anglesOf = ([x, y, z]: Vector) => ({ theta: Math.atan2(Math.hypot(x, y), z) / RADIANS, phi: Math.atan2(y, x) / RADIANS });
const unit = (v: Vector) => v.map((c) => c / Math.hypot(...v)) as Vector;
const scalar = (a: Vector, b: Vector) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
/** A direction mirrored about a half vector. */
const mirrored = (wo: Vector, wh: Vector) => wh.map((c, k) => 2 * scalar(wo, wh) * c - wo[k]) as Vector;
const halfOf = (wi: Vector, wo: Vector) => unit(wi.map((c, k) => c + wo[k]) as Vector);

/** What samples become if the arc tangent is not put into its quadrant: half vectors at x < 0 turn by 180°. */
function withoutQuadrants(samples: Float32Array, wo: Vector): Float32Array {
  const all: number[] = [];
  for (let i = 0; i < samples.length; i += 3) {
    const [x, y, z] = halfOf([...samples.subarray(i, i + 3)] as Vector, wo), wi = mirrored(wo, x < 0 ? [-x, -y, z] : [x, y, z]);
    if (wi[2] > 0) all.push(...wi);
  }
  return Float32Array.from(all);
}

export const ward = (stage: Stage) => {
  const ax = stage.slider("α along x", 0.02, 0.8, 0.01, 0.3);
  const ay = stage.slider("α along y", 0.02, 0.8, 0.01, 0.08);
  const angle = stage.slider("Viewer", 0, 80, 1, 30, (x) => `${x}°`);
  const falling = stage.player("Samples", 0, 12, 11, doubled);
  const azimuth = stage.choice("Azimuth", [["quadrant", "in the quadrant of 2πu"], ["arctan", "the arc tangent alone (wrong)"]]);
  const pointed = stage.pointer((at) => { if (at.frame === 0) angle.set(Math.min(Math.round(directionAt(at, wardView()).theta), 80)); });
  stage.draw(async () => {
    const all = (await stage.app.engines.call("lobeSamples", `ward:${ax()}:${ay()}:1`, angle(), 2 ** falling(), 1)) as Float32Array;
    const view = wardView(), radians = angle() * RADIANS, wo: Vector = [-Math.sin(radians), 0, Math.cos(radians)];
    const samples = azimuth() === "quadrant" ? all : withoutQuadrants(all, wo);
    let [sx, sy, mx, ahead] = [0, 0, 0, 0];
    const n = Math.max(samples.length / 3, 1);
    for (let i = 0; i < samples.length; i += 3) {
      [sx, sy, mx] = [sx + samples[i] ** 2, sy + samples[i + 1] ** 2, mx + samples[i]];
      ahead += Number(halfOf([...samples.subarray(i, i + 3)] as Vector, wo)[0] >= 0);
    }
    // The density of half vectors, which is as high for all azimuths at θh = 0.
    const density = (theta: number, phi: number) => {
      const [c, s] = [Math.cos(phi * RADIANS) / ax(), Math.sin(phi * RADIANS) / ay()], t = Math.tan(theta * RADIANS);
      return theta < 90 ? Math.exp(-t * t * (c * c + s * s)) / (Math.PI * ax() * ay() * Math.cos(theta * RADIANS) ** 3) : 0;
    };
    const along = (phi: number): Point[] => Array.from({ length: 181 }, (_, i) => [i / 2, density(i / 2, phi)]);
    const at = pointed(), isAbove = at?.frame === 0, { theta: t, phi } = isAbove ? directionAt(at, view) : { theta: 0, phi: 0 };
    const half = isAbove && t <= 90 ? anglesOf(halfOf(polarDirection({ theta: t, phi }), wo)) : null;
    const densities = plot([
      { name: "along x", kind: "lobe", points: along(0) }, { name: "along y", kind: "light", points: along(90) },
      { name: "", kind: "shade", points: half ? [[half.theta, 0], [half.theta, density(half.theta, half.phi)]] : [] },
    ], { x: { name: "θh [degrees]", range: [0, 90], ticks: [0, 30, 60, 90] }, y: { name: "p(ωh) per steradian" }, height: 170, presented: 165 });
    stage.svg(fromAboveSvg(view, samples, radians) + densities, "Directions sampled from Ward’s lobe, seen from above, and the density of its half vectors");
    if (half) {
      stage.read(`θ = ${Math.round(t)}°, φ = ${Math.round(phi)}°: the half vector is at θh = ${Math.round(half.theta)}°, φh = ${Math.round(half.phi)}°, where p(ωh) = ${short(density(half.theta, half.phi))}.`);
      stage.mark({ frame: 1, x: half.theta, y: density(half.theta, half.phi) });
    } else if (at?.frame === 1) {
      stage.read(`θh = ${Math.round(at.x)}°: p(ωh) = ${short(density(at.x, 0))} along x, ${short(density(at.x, 90))} along y.`);
      // Their directions, both ways along each axis.
      for (const turn of [0, 90, 180, 270]) {
        const wi = mirrored(wo, polarDirection({ theta: at.x, phi: turn }));
        if (wi[2] > 0) stage.mark(markAbove(0, wi, view));
      }
    } else stage.read(null);
    stage.say(`Standard deviation of ${n} directions: ${short(Math.sqrt(Math.max(sx / n - (mx / n) ** 2, 0)))} along x, ${short(Math.sqrt(sy / n))} along y. ${short(100 * ahead / n)} % of their half vectors are at x ≥ 0.`);
  });
};

/** Half vectors at the patch centers: polar angle toward the mirror direction and azimuth [degrees]. */
const PATCHES: Point[] = [[0, 0], [18, 60], [20, -70], [40, 115], [38, -140]];
/** The radius of the plane of incidence. */
const planeRadius = (x0: number) => Math.min(isPresenting() ? 150 : 240, x0 - 30);
/** The angular radius of the patches [degrees]. */
const PATCH = 6;

export const halfVectors = (stage: Stage) => {
  const angle = stage.slider("Viewer", 0, 85, 1, 40, (x) => `${x}°`);
  stage.play(angle, 5);
  const patches = () => hemisphere(figureWidth() < 480 ? 36 : 0);
  const planeAngle = ({ x, y }: { x: number; y: number }) => {
    const x0 = figureWidth() / 2, y0 = planeRadius(x0) + 40;
    return Math.atan2(x - x0, Math.max(y0 - y, 0)) / RADIANS;
  };
  const pointed = stage.pointer((at) => angle.set(Math.min(Math.round(at.frame === 0 ? Math.abs(planeAngle(at)) : directionAt(at, patches()).theta), 85)));
  stage.draw(() => {
    const radians = RADIANS, o = -angle() * radians, width = figureWidth(), x0 = width / 2, r = planeRadius(x0), y0 = r + 40;
    const at = (theta: number, length: number) => `${(x0 + length * Math.sin(theta)).toFixed(1)} ${(y0 - length * Math.cos(theta)).toFixed(1)}`;
    const directions: string[] = [], halves: string[] = [];
    for (let k = -8; k <= 8; k++) {
      const half = k * 5 * radians, direction = 2 * half - o;
      halves.push(`M${x0} ${y0}L${at(half, 0.4 * r)}`);
      if (Math.abs(direction) < Math.PI / 2) directions.push(`M${at(direction, 0.45 * r)}L${at(direction, r)}`);
    }
    const [x, y] = at(o, r + 10).split(" ");
    const plane = `<svg viewBox="0 0 ${width} ${y0 + 12}"${framed(pixels(width, y0 + 12))} aria-hidden="true"><path class="axis" d="M20 ${y0}H${width - 20}M${x0} ${y0}L${at(o, r)}"/>
      <path class="first line" d="${directions.join("")}"/><path class="second line" d="${halves.join("")}"/>
      <text class="name" x="${x}" y="${y}" text-anchor="end">viewer</text>
      <path class="second line" d="M8 14h16"/><text class="name" x="30" y="18">half vectors, every 5°</text><path class="first line" d="M8 32h16"/><text class="name" x="30" y="36">directions, every 10°</text></svg>`;
    const view = patches(), wo: Vector = [Math.sin(o), 0, Math.cos(o)];
    const mirror = (h: Vector) => mirrored(wo, h);
    const factors: number[] = [];
    const drawn = PATCHES.flatMap(([theta, phi]) => {
      const [st, ct, sp, cp] = [Math.sin(theta * radians), Math.cos(theta * radians), Math.sin(phi * radians), Math.cos(phi * radians)];
      const middle: Vector = [st * cp, st * sp, ct], u: Vector = [ct * cp, ct * sp, -st], v: Vector = [-sp, cp, 0];
      const [s, c] = [Math.sin(PATCH * radians), Math.cos(PATCH * radians)];
      const rim = Array.from({ length: 48 }, (_, i) => {
        const [a, b] = [s * Math.cos(i * Math.PI / 24), s * Math.sin(i * Math.PI / 24)];
        return middle.map((m, j) => c * m + a * u[j] + b * v[j]) as Vector;
      });
      const path = (points: Vector[], kind: string) => `<path class="${kind} patch" d="M${points.map((p) => fromAbove(p, view).map((t) => t.toFixed(1)).join(" ")).join("L")}Z"/>`;
      const image = rim.map(mirror), growth = 4 * scalar(middle, wo);
      const shown = path(rim, "second");
      // Patches partly below the surface are not reflected.
      if (growth <= 0 || image.some((p) => p[2] < 0)) return [shown];
      factors.push(growth);
      const [x, y] = fromAbove(mirror(middle), view);
      return [path(image, "first"), shown, `<text class="name halo" x="${x.toFixed(1)}" y="${(y + 4).toFixed(1)}" text-anchor="middle">× ${growth.toFixed(1)}</text>`];
    });
    const [vx, vy] = fromAbove(wo, view);
    const above = `<svg viewBox="0 0 ${width} ${view[1] + view[2] + 8}"${framed(pixels(width, view[1] + view[2] + 8))} aria-hidden="true">${rings(view)}${drawn.join("")}<circle class="axis" cx="${vx}" cy="${vy}" r="5"/><text class="name halo" x="${vx}" y="${vy + 20}" text-anchor="middle">viewer</text>
      <path class="second line" d="M8 14h16"/><text class="name" x="30" y="18">patches of half vectors</text><path class="first line" d="M8 32h16"/><text class="name" x="30" y="36">reflected patches, × magnification</text></svg>`;
    const inPlane = ([x, , z]: Vector, length: number): Mark => ({ frame: 0, x: x0 + length * Math.sin(Math.atan2(x, z)), y: y0 - length * Math.cos(Math.atan2(x, z)) });
    /** The half vector and the magnification of the direction under the pointer. */
    const readHalf = () => {
      const at = pointed();
      if (!at) return null;
      const { theta, phi } = at.frame === 0 ? { theta: planeAngle(at), phi: 0 } : directionAt(at, view);
      if (Math.abs(theta) > 90) return null;
      const wi = polarDirection({ theta, phi }), wh = halfOf(wi, wo), half = anglesOf(wh);
      if (at.frame === 0) stage.mark(markAbove(1, wi, view), markAbove(1, wh, view));
      // The plot above is of the plane of incidence.
      else if (Math.abs(Math.asin(wi[1])) < IN_PLANE * RADIANS) stage.mark(inPlane(wi, r), inPlane(wh, 0.4 * r));
      if (at.frame === 1) stage.mark(markAbove(1, wh, view));
      return `Direction at ${Math.round(Math.abs(theta))}° from the normal: half vector at ${Math.round(half.theta)}°, 4 ωh·ωi = ${short(4 * scalar(wh, wi))}.`;
    };
    stage.svg(plane + above, "Half vectors and their reflected directions, in the plane of incidence and from above");
    stage.read(readHalf());
    stage.say(`${directions.length} of 17 directions are above the surface; reflection enlarges the patches ${factors.length ? `${short(Math.min(...factors))} to ${short(Math.max(...factors))} times` : "beyond the horizon"}: 4 ωh·ωi.`);
  });
};

