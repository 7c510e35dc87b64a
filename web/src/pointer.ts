// The pointer over a figure, or the mark that keys move: where it is in the units of the plot or map below it, and whether
// it drags.

export interface Pointed {
  /** The index of the plot or map among those of the figure. */
  frame: number;
  x: number;
  y: number;
  dragged: boolean;
  /** Where dragging began. */
  from: { x: number; y: number };
  /** Whether it is the mark that keys move, which is drawn. */
  byKeys: boolean;
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

export type Framed = (SVGSVGElement | HTMLCanvasElement) & { dataset: DOMStringMap };

/** The framed pictures of a figure. */
export const framedIn = (figure: HTMLElement) => [...figure.querySelectorAll<Framed>("[data-frame]")];

const frameOf = (on: Framed) => JSON.parse(on.dataset.frame!) as Frame;
/** The size of a picture in its own pixels. */
const sizeOf = (on: Framed): [number, number] => (on instanceof SVGSVGElement ? [on.viewBox.baseVal.width, on.viewBox.baseVal.height] : [on.width, on.height]);
const within = (c: number) => Math.min(Math.max(c, 0), 1);

/** A place as shares of a frame, from its lower left corner. */
type Share = [number, number];

/** The share at which an event is. */
function shareOf(event: PointerEvent, on: Framed): Share {
  const { left, right, top, bottom } = frameOf(on), box = on.getBoundingClientRect(), scale = sizeOf(on)[0] / box.width;
  return [within(((event.clientX - box.left) * scale - left) / (right - left)), within((bottom - (event.clientY - box.top) * scale) / (bottom - top))];
}

/** The place at a share, in the units of a frame. */
function unitsOf(on: Framed, [u, v]: Share): { x: number; y: number } {
  const { xs, ys, logs } = frameOf(on);
  const at = (share: number, [low, high]: [number, number], log?: boolean) => (log ? low * (high / low) ** share : low + share * (high - low));
  return { x: at(u, xs, logs?.[0]), y: at(v, ys, logs?.[1]) };
}

/** Where units are on a picture, from its upper left corner in parts of its size. */
export function placeOn(on: Framed, x: number, y: number): [number, number] {
  const { left, right, top, bottom, xs, ys, logs } = frameOf(on), [width, height] = sizeOf(on);
  const share = (c: number, [low, high]: [number, number], log?: boolean) => within(log ? Math.log(c / low) / Math.log(high / low) : (c - low) / (high - low));
  return [(left + (right - left) * share(x, xs, logs?.[0])) / width, (bottom - (bottom - top) * share(y, ys, logs?.[1])) / height];
}

/** How far an arrow key moves the mark, as a share of the frame; less with Shift. */
const STEP = 0.02, SMALL_STEP = 0.004;
const ARROWS: Record<string, Share> = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
export const isArrow = (key: string) => key in ARROWS;

/** The share after an arrow key. */
export function moved([u, v]: Share, { key, shiftKey }: { key: string; shiftKey: boolean }): Share {
  const [x, y] = ARROWS[key], step = shiftKey ? SMALL_STEP : STEP;
  return [within(u + step * x), within(v + step * y)];
}

/** Calls `act` while the pointer is over, or drags from, a framed picture in `figure`, and with null when it leaves. In a
 *  picture with the focus, arrow keys move a mark instead. Enter or Space picks up what is at the mark, or drags it there;
 *  the arrow keys then carry it until either is pressed again, Escape is, or the focus leaves. */
export function onPointer(figure: HTMLElement, act: (at: Pointed | null) => void) {
  let held: { frame: number; x: number; y: number } | null = null;
  const under = (event: Event) => framedIn(figure).findIndex((picture) => picture.contains(event.target as Node));
  const place = (event: PointerEvent, on: Framed) => unitsOf(on, shareOf(event, on));
  const report = (event: PointerEvent) => {
    const frame = held ? held.frame : under(event), picture = framedIn(figure)[frame];
    if (!picture) return act(null);
    const at = place(event, picture);
    act({ frame, ...at, dragged: !!held, from: held ?? at, byKeys: false });
  };
  figure.addEventListener("pointerdown", (event) => {
    const frame = under(event);
    if (event.button !== 0 || frame < 0) return;
    held = { frame, ...place(event, framedIn(figure)[frame]) };
    figure.setPointerCapture(event.pointerId);
    event.preventDefault();
    report(event);
  });
  figure.addEventListener("pointermove", report);
  for (const end of ["pointerup", "pointercancel"]) figure.addEventListener(end, () => { held = null; });
  figure.addEventListener("pointerleave", () => { if (!held) act(null); });

  /** The mark of keys in each picture, and where keys have picked something up. */
  const marks = new Map<number, Share>();
  let carried: { x: number; y: number } | null = null;
  const mark = (frame: number) => {
    const share = marks.get(frame) ?? [0.5, 0.5], at = unitsOf(framedIn(figure)[frame], share);
    marks.set(frame, share);
    act({ frame, ...at, dragged: !!carried, from: carried ?? at, byKeys: true });
  };
  /** Picks up what is at a picture's mark, or puts down what is carried. */
  const carry = (frame: number | null) => {
    carried = frame === null ? null : unitsOf(framedIn(figure)[frame], marks.get(frame) ?? [0.5, 0.5]);
    figure.toggleAttribute("data-carrying", !!carried);
  };
  figure.addEventListener("focusin", (event) => {
    const frame = under(event);
    if (frame >= 0 && (event.target as Element).matches(":focus-visible")) mark(frame);
  });
  figure.addEventListener("focusout", () => {
    carry(null);
    act(null);
  });
  figure.addEventListener("keydown", (event) => {
    const frame = under(event);
    if (frame < 0 || event.ctrlKey || event.altKey || event.metaKey) return;
    if (isArrow(event.key)) {
      marks.set(frame, moved(marks.get(frame) ?? [0.5, 0.5], event));
      mark(frame);
    } else if (event.key === "Enter" || event.key === " ") {
      carry(carried ? null : frame);
      mark(frame);
    } else if (event.key === "Escape" && carried) {
      carry(null);
      mark(frame);
    } else if (event.key === "Escape") act(null);
    else return;
    event.preventDefault();
    event.stopPropagation();
  });
}
