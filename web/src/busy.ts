// A sign that the engines work, for whatever takes longer than a moment.

import { $ } from "./dom";

/** How long nothing is said [ms], and how long nothing is done between two parts of one task. */
const MOMENT = 150, PAUSE = 30;

let working = 0, appears = 0, goes = 0;

/** Shows the sign until all that is worked on is done. */
export function whileBusy<T>(work: Promise<T>): Promise<T> {
  working++;
  clearTimeout(goes);
  appears ||= setTimeout(() => { $("busy").hidden = false; }, MOMENT) as unknown as number;
  const done = () => {
    if (--working) return;
    goes = setTimeout(() => {
      clearTimeout(appears);
      appears = 0;
      $("busy").hidden = true;
    }, PAUSE) as unknown as number;
  };
  work.then(done, done);
  return work;
}
