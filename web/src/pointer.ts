// The pointer over a figure: where it is in the units of the plot or map below it, and whether it drags.

export interface Pointed {
  /** The index of the plot or map among those of the figure. */
  frame: number;
  x: number;
  y: number;
  dragged: boolean;
  /** Where dragging began. */
  from: { x: number; y: number };
}

/** The part of a picture that has units, in its own pixels, and the units at its ends. */
export interface Frame {
  left: number;
  right: number;
  top: number;
  bottom: number;
  xs: [number, number];
  ys: [number, number];
  /** Whether x and y are logarithmic. */
  logs?: [boolean, boolean];
}

/** The frame of a picture whose units are its own pixels. */
export const pixels = (width: number, height: number): Frame =>
  ({ left: 0, right: width, top: 0, bottom: height, xs: [0, width], ys: [height, 0] });

type Framed = (SVGSVGElement | HTMLCanvasElement) & { dataset: DOMStringMap };

/** The place of an event in a framed picture. */
function place(event: PointerEvent, on: Framed): { x: number; y: number } {
  const { left, right, top, bottom, xs, ys, logs } = JSON.parse(on.dataset.frame!) as Frame;
  const box = on.getBoundingClientRect(), width = on instanceof SVGSVGElement ? on.viewBox.baseVal.width : on.width;
  const scale = width / box.width;
  const at = (v: number, from: number, to: number, [low, high]: [number, number], log?: boolean) => {
    const share = Math.min(Math.max((v * scale - from) / (to - from), 0), 1);
    return log ? low * (high / low) ** share : low + share * (high - low);
  };
  return { x: at(event.clientX - box.left, left, right, xs, logs?.[0]), y: at(event.clientY - box.top, bottom, top, ys, logs?.[1]) };
}

/** Calls `act` while the pointer is over, or drags from, a framed picture in `figure`, and with null when it leaves. */
export function onPointer(figure: HTMLElement, act: (at: Pointed | null) => void) {
  let held: { frame: number; x: number; y: number } | null = null;
  const framed = () => [...figure.querySelectorAll<Framed>("[data-frame]")];
  const under = (event: PointerEvent) => framed().findIndex((picture) => picture.contains(event.target as Node));
  const report = (event: PointerEvent) => {
    const frame = held ? held.frame : under(event), picture = framed()[frame];
    if (!picture) return act(null);
    const at = place(event, picture);
    act({ frame, ...at, dragged: !!held, from: held ?? at });
  };
  figure.addEventListener("pointerdown", (event) => {
    const frame = under(event);
    if (event.button !== 0 || frame < 0) return;
    held = { frame, ...place(event, framed()[frame]) };
    figure.setPointerCapture(event.pointerId);
    event.preventDefault();
    report(event);
  });
  figure.addEventListener("pointermove", report);
  for (const end of ["pointerup", "pointercancel"]) figure.addEventListener(end, () => { held = null; });
  figure.addEventListener("pointerleave", () => { if (!held) act(null); });
}
