// The pointer over a plot: where it is in the plot's own units, and whether it drags.

export interface Pointed {
  x: number;
  y: number;
  dragged: boolean;
}

/** Calls `act` while the pointer is over, or drags from, the first plot in `place`, and with null when it leaves. */
export function onPointer(place: HTMLElement, act: (at: Pointed | null) => void) {
  let dragged = false;
  const plotted = () => place.querySelector<SVGSVGElement>("svg[data-frame]");
  const report = (event: PointerEvent) => {
    const svg = plotted();
    if (!svg || !(dragged || svg.contains(event.target as Node))) return act(null);
    const { left, right, top, bottom, xs, ys } = JSON.parse(svg.dataset.frame!);
    const box = svg.getBoundingClientRect(), scale = svg.viewBox.baseVal.width / box.width;
    const share = (v: number, from: number, to: number) => Math.min(Math.max((v * scale - from) / (to - from), 0), 1);
    const s = share(event.clientX - box.left, left, right), t = share(event.clientY - box.top, bottom, top);
    act({ x: xs[0] + s * (xs[1] - xs[0]), y: ys[0] + t * (ys[1] - ys[0]), dragged });
  };
  place.addEventListener("pointerdown", (event) => {
    if (event.button !== 0 || !plotted()?.contains(event.target as Node)) return;
    dragged = true;
    place.setPointerCapture(event.pointerId);
    event.preventDefault();
    report(event);
  });
  place.addEventListener("pointermove", report);
  for (const end of ["pointerup", "pointercancel"]) place.addEventListener(end, () => { dragged = false; });
  place.addEventListener("pointerleave", () => { if (!dragged) act(null); });
}
