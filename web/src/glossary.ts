// The page's terms: explained when the pointer is over them or when they have the keyboard's focus.

import { h } from "./dom";

interface Term {
  /** Where the term stands in a text. */
  at: RegExp;
  meaning: string;
}

const TERMS: Term[] = [
  { at: /\bmedian-cut:\d+/, meaning: "Fixed lights from cuts of the probe into regions of equal energy; the number is how many. They are biased, but have no noise of their own." },
  { at: /\bvariance-minimization:\d+/, meaning: "Fixed lights from cuts of the probe into regions of little variance; the number is how many. They are biased, but have no noise of their own." },
  { at: /\bmis:\d+:\d+[\w:-]*/, meaning: "Multiple importance sampling: so many samples of the light, and so many of the BRDF, for each camera sample." },
  { at: /\bproduct:\d+[\w:-]*/, meaning: "Samples the product of light and BRDF; the number is how many shadow rays each camera sample has." },
  { at: /\bbrdf:\d+/, meaning: "Samples in proportion to the BRDF; the number is how many shadow rays each camera sample has." },
  { at: /\benvironment:\d+/, meaning: "Samples in proportion to the light; the number is how many shadow rays each camera sample has." },
  { at: /\bsir:\d+\/\d+/, meaning: "Sampling importance resampling: so many rays, chosen from so many candidates." },
  { at: /\brejection:\d+/, meaning: "Rejection sampling of the product of light and BRDF; the number is how many accepted rays each camera sample has." },
  { at: /\bknown without rays\b/, meaning: "The part of the pixel’s light that a strategy computes without shadow rays, from a model of light, material and visibility. It may differ between camera samples and passes." },
  { at: /\b[Rr]elative RMSE\b/, meaning: "The square root of the mean squared error of the pixels, each relative to its own luminance. Half of it takes four times the samples." },
  { at: /\bRMSE\b/, meaning: "Root mean square error: the typical distance of an estimate from the exact value." },
  { at: /\b[Ll]ight probe\b|\b[Pp]robe\b/, meaning: "A picture of the light that arrives from all directions, stored as radiance: the sky, a studio, a room." },
  { at: /\b[Ss]hadow rays?\b/, meaning: "A ray from a surface toward the light, which tests whether something is in between." },
  { at: /\b[Cc]amera samples?\b/, meaning: "A ray from the camera through a random place in a pixel. Each finds a point that the strategy shades." },
  { at: /\bMonte Carlo\b/, meaning: "Estimating an integral by the average of random samples." },
  { at: /\bunbiased\b/, meaning: "Correct on average: the mean of many estimates is the exact value, for any number of samples." },
  { at: /\b[Cc]onsistent\b/, meaning: "Approaches the exact value as the number of samples or lights grows." },
  { at: /\bstandard deviation\b/, meaning: "The square root of the variance: how far a single estimate typically is from the mean." },
  { at: /\b[Vv]ariance\b(?! minimization)/, meaning: "The mean squared distance of estimates from their mean. It falls with 1/N for N independent samples." },
  { at: /\b[Bb]ias\b/, meaning: "The distance of the mean of all estimates from the exact value: an error that averaging does not remove." },
  { at: /\b[Dd]ensit(?:y|ies)\b/, meaning: "How likely a direction is to be sampled, per unit of solid angle. A density integrates to one." },
  { at: /\b[Ss]olid angles?\b/, meaning: "The size of a set of directions, as its area on the unit sphere, in steradians. The whole sphere has 4π." },
  { at: /\bBRDF\b|\b[Rr]eflectance\b/, meaning: "How much of the light from one direction a surface reflects into another: the bidirectional reflectance distribution function." },
  { at: /\blobes?\b/, meaning: "The directions into which a surface mainly reflects, drawn as a hill around the mirror direction." },
  { at: /\bhalf vectors?\b/, meaning: "The direction halfway between viewer and light: the normal of the facet that reflects one into the other." },
  { at: /\bcumulative distribution\b/, meaning: "The running integral of a density, from 0 to 1. Its inverse turns uniform numbers into samples." },
  { at: /\bstratification\b/, meaning: "Spreading samples evenly by taking one from each of many equal parts, instead of at random." },
  { at: /\b[Mm]ultiple importance sampling\b/, meaning: "Samples of several densities, each weighted by how likely all of them were to find it." },
  { at: /\bpower heuristic\b|\bbalance heuristic\b/, meaning: "A rule for the weights of several densities: in proportion to their samples’ densities, or to the squares of those." },
  { at: /\b[Uu]noccluded radiance\b/, meaning: "The radiance of the pixel as if nothing cast a shadow." },
  { at: /\benvelope\b/, meaning: "A function that is above the target everywhere, and that can be sampled." },
  { at: /\bcandidates?\b/, meaning: "A cheap sample without a shadow ray, from which resampling chooses." },
  { at: /\bcentroid\b/, meaning: "The center of a region, weighted by its light." },
  { at: /\btexels?\b/, meaning: "A pixel of the map." },
  { at: /\b[Ee]xposure\b/, meaning: "A factor on the picture’s brightness before the tone curve, in stops: +1 doubles it." },
  { at: /\b[Ss]eed\b/, meaning: "Chooses the random numbers. The same seed gives the same picture, bit by bit." },
  { at: /\bquadrature\b/, meaning: "An integral as a sum over all texels of the map, without random numbers." },
];

/** Marks the first place of each term in a text. */
export function explain(root: HTMLElement) {
  const known = new Set<Term>();
  const texts = document.createTreeWalker(root, NodeFilter.SHOW_TEXT);
  const all: Text[] = [];
  while (texts.nextNode()) all.push(texts.currentNode as Text);
  for (let text of all.filter((text) => !text.parentElement!.closest(".term, math, output, select, button"))) {
    for (;;) {
      const found = TERMS.filter((term) => !known.has(term)).map((term) => ({ term, match: term.at.exec(text.data) })).filter(({ match }) => match)
        .sort((a, b) => a.match!.index - b.match!.index || b.match![0].length - a.match![0].length)[0];
      if (!found) break;
      const [word] = found.match!, rest = text.splitText(found.match!.index).splitText(word.length);
      known.add(found.term);
      const marked = h("span", { class: "term", tabindex: "0", role: "note", "aria-label": `${word}: ${found.term.meaning}`, "data-meaning": found.term.meaning }, word);
      text.nextSibling!.replaceWith(marked);
      text = rest;
    }
  }
}

/** Shows the meanings of terms at the pointer or the focus; Escape hides them. */
export function showMeanings() {
  const box = h("div", { id: "meaning", role: "tooltip", hidden: "" });
  document.body.append(box);
  let shown: Element | null = null, timer = 0;
  const show = (term: HTMLElement) => {
    clearTimeout(timer);
    shown = term;
    box.textContent = term.dataset.meaning!;
    box.hidden = false;
    const at = term.getBoundingClientRect(), own = box.getBoundingClientRect(), edge = 8;
    const isBelow = at.bottom + own.height + edge < innerHeight;
    box.style.left = `${Math.max(edge, Math.min(at.left, document.documentElement.clientWidth - own.width - edge))}px`;
    box.style.top = `${isBelow ? at.bottom + 4 : Math.max(edge, at.top - own.height - 4)}px`;
  };
  const hide = () => {
    clearTimeout(timer);
    shown = null;
    box.hidden = true;
  };
  // The pointer may move onto the meaning.
  const soon = () => { timer = setTimeout(() => { if (shown !== document.activeElement) hide(); }, 200) as unknown as number; };
  const termOf = (event: Event) => (event.target as Element | null)?.closest?.<HTMLElement>("[data-meaning]") ?? null;
  document.addEventListener("pointerover", (event) => {
    const term = termOf(event);
    if (term) show(term);
    else if (box.contains(event.target as Node)) clearTimeout(timer);
    else if (shown) soon();
  });
  document.addEventListener("focusin", (event) => {
    const term = termOf(event);
    if (term) show(term);
    else if (shown) hide();
  });
  document.addEventListener("focusout", () => { if (shown) hide(); });
  document.addEventListener("keydown", (event) => { if (event.key === "Escape" && shown) hide(); });
  addEventListener("scroll", () => { if (shown) hide(); }, { passive: true, capture: true });
}
