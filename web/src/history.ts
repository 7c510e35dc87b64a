// Undo and redo of all changes of the state.

import { DEFAULT, type State } from "./state";

/** Changes of the same things that follow each other this fast are one, such as those of a dragged slider [ms]. */
const PAUSE = 700;
/** The most changes that are kept. */
const MOST = 200;

/** Where one is: Back in the browser changes it, so undo does not. */
const PLACES: (keyof State)[] = ["panel", "step"];

const copy = (state: State): State => structuredClone(state);

/** The things that differ between two states. */
const differing = (a: State, b: State) => (Object.keys(DEFAULT) as (keyof State)[]).filter((key) => JSON.stringify(a[key]) !== JSON.stringify(b[key]));

export class History {
  private before: State[] = [];
  private after: State[] = [];
  private last = { keys: "", time: -Infinity };

  constructor(private now: State) {
    this.now = copy(now);
  }

  /** Notes the state after a change. */
  note(state: State) {
    const keys = differing(this.now, state), time = performance.now();
    if (keys.some((key) => !PLACES.includes(key))) {
      const isSame = keys.join() === this.last.keys && time - this.last.time < PAUSE;
      if (!isSame) this.before = [...this.before, this.now].slice(-MOST);
      this.after = [];
      this.last = { keys: keys.join(), time };
    }
    this.now = copy(state);
  }

  get canUndo() {
    return this.before.length > 0;
  }
  get canRedo() {
    return this.after.length > 0;
  }

  /** The state before the last change, or after the last that was undone; null if there is none. */
  undo(): State | null {
    return this.move(this.before, this.after);
  }
  redo(): State | null {
    return this.move(this.after, this.before);
  }

  private move(from: State[], to: State[]): State | null {
    const state = from.pop();
    if (!state) return null;
    to.push(this.now);
    this.now = state;
    this.last = { keys: "", time: -Infinity };
    return copy(state);
  }
}
