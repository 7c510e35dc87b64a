// The lecture's steps and their figures, in a page.

/** The lecture under the usual light; its figures need no scene, so this one is loaded quickest, and render small pictures. */
export const LECTURE = "size=32&spp=4&rows=64&scene=sphere&panel=lecture";

/** What the lecture's figure shows. */
export const figureOf = (page) => page.$eval("#figure", (figure) => {
  const canvases = [...figure.querySelectorAll("canvas")].map((canvas) => {
    const copy = Object.assign(document.createElement("canvas"), { width: canvas.width, height: canvas.height });
    const context = copy.getContext("2d", { willReadFrequently: true });
    context.drawImage(canvas, 0, 0);
    return context.getImageData(0, 0, copy.width, copy.height).data.reduce((hash, byte) => Math.imul(hash ^ byte, 16777619), 7);
  });
  return JSON.stringify([[...figure.querySelectorAll("svg")].map((svg) => svg.innerHTML), canvases, figure.querySelector(".result").textContent]);
});

/** Shows a step of the lecture, and waits for its figure. One repeat of the four ways at their counts takes least. */
export async function showStep(page, step) {
  await page.evaluate((hash) => { location.hash = hash; }, `${LECTURE}&step=${step}${step === 12 ? "&figure=counts;0;1" : ""}`);
  await page.waitForSelector(`html[data-step='${step}']`);
  await drawn(page, 1);
  await settled(page);
}

/** Waits until the lecture's figure shows what its controls say. */
export const settled = (page) => page.waitForSelector("#figure:not([data-drawing])");

/** Waits until the lecture's figure was drawn so often. */
export const drawn = (page, n) => page.waitForFunction((n) => Number(document.getElementById("figure")?.dataset.drawn ?? 0) >= n, n);
