// A step of the lecture as text, formulas, a place for its figure, and a question with its answer.

import { h } from "./dom";
import { explain } from "./glossary";
import { STEPS } from "./steps";

export interface Article {
  elements: HTMLElement[];
  figure: HTMLElement;
  /** Replaces the answer by one that the figure shows. */
  answer(text: string): void;
}

/** The step of an index; on paper, the answer is open from the beginning, or left out. */
export function article(i: number, { title = STEPS[i].title, open = false, withAnswer = true } = {}): Article {
  const { text, formulas, algorithm, question, answer, sources } = STEPS[i];
  const figure = h("div", { class: "figure" }), answers = h("p", {}, answer);
  const formulaBox = h("div", { class: "formula", tabindex: "0", role: "group", "aria-label": "Formulas" });
  formulaBox.innerHTML = formulas.map((formula) => `<math display="block">${formula}</math>`).join("");
  const details = h("details", open ? { open: "" } : {}, h("summary", {}, "Answer"), answers);
  const paragraphs = h("div", { class: "text" }, ...text.map((paragraph) => h("p", {}, paragraph)));
  explain(paragraphs);
  const elements = [
    h("h2", { tabindex: "-1" }, title), paragraphs, formulaBox,
    ...(algorithm ? [h("ol", { class: "algorithm" }, ...algorithm.map((line) => h("li", {}, line)))] : []), figure,
    h("div", { class: "question" }, h("p", {}, question), ...(withAnswer ? [details] : [])),
    h("ul", { class: "sources", "aria-label": "Literature" }, ...sources.map((source) => h("li", {}, source))),
  ];
  return { elements, figure, answer: (found) => { answers.textContent = found.replaceAll(" %", "\u00a0%"); } };
}
