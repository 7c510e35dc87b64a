// Playback of a figure: a slider that moves by itself, with buttons for play, pause and single steps.

import { h } from "./dom";

/** The duration of a step in playback [ms]. */
const STEP = 160;

/** Buttons that move `input` by `by` at each step, once `isDrawn` says that the last step is seen; playing from the last
 *  step starts over. */
export function player(input: HTMLInputElement, by: number, isDrawn: () => boolean): HTMLElement {
  let timer = 0;
  const button = (name: string, act: () => void) => {
    const element = h("button", { type: "button" }, name);
    element.addEventListener("click", act);
    return element;
  };
  const isLast = () => Number(input.value) >= Number(input.max);
  const set = (value: number) => {
    input.value = String(value);
    input.dispatchEvent(new Event("input", { bubbles: true }));
  };
  const play = (on: boolean) => {
    clearInterval(timer);
    timer = on ? setInterval(tick, STEP) as unknown as number : 0;
    toggle.textContent = on ? "Pause" : "Play";
  };
  const tick = () => {
    // A figure that is not shown stands still.
    if (!input.isConnected || input.offsetParent === null || isLast()) return play(false);
    if (isDrawn()) set(Number(input.value) + by);
  };
  const step = (direction: number) => {
    play(false);
    set(Number(input.value) + direction * by);
  };
  const toggle = button("Play", () => {
    if (!timer && isLast()) set(Number(input.min));
    play(!timer);
  });
  return h("div", { class: "row player", role: "group", "aria-label": `Playback of ${input.dataset.name}` }, button("Step back", () => step(-1)), toggle, button("Step forward", () => step(1)));
}
