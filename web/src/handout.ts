// All steps of the lecture on paper, with their figures, and with or without answers.

import type { App } from "./app";
import { article } from "./article";
import { $, h } from "./dom";
import { FIGURES } from "./figures";
import { Stage } from "./stage";
import { addressOf } from "./state";
import { STEPS } from "./steps";

/** Draws all steps, and prints them. */
export async function printHandout(app: App, withAnswers: boolean) {
  const place = $("handout"), root = document.documentElement;
  app.tell("Drawing all figures …");
  place.replaceChildren();
  for (const [i, { title }] of STEPS.entries()) {
    const { elements, figure, answer } = article(i, { title: `${i + 1}. ${title}`, open: true, withAnswer: withAnswers });
    const address = addressOf({ ...app.state, panel: "lecture", step: i + 1, figure: "" });
    place.append(h("article", {}, ...elements, h("p", { class: "address" }, address)));
    const stage = new Stage(figure, app, [], answer);
    FIGURES[i](stage);
    await stage.firstDrawn;
    app.tell(`Drawing all figures: ${i + 1} of ${STEPS.length} …`);
  }
  // Pictures are painted bit by bit.
  while (place.querySelector("canvas[data-stale]")) await new Promise((done) => setTimeout(done, 20));
  app.tell("The handout is drawn");
  root.toggleAttribute("data-handout", true);
  addEventListener("afterprint", () => {
    root.toggleAttribute("data-handout", false);
    place.replaceChildren();
  }, { once: true });
  print();
}
