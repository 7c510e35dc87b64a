// Screen readers say a slider's value as the page writes it beside the slider.

/** Keeps `aria-valuetext` of all sliders, including later ones, equal to the outputs in their labels. */
export function speakValues() {
  const speak = (output: Element) => {
    const input = output.closest("label")?.querySelector<HTMLInputElement>("input[type=range]"), text = output.textContent;
    if (input && text && input.getAttribute("aria-valuetext") !== text) input.setAttribute("aria-valuetext", text);
  };
  const within = (node: Node) => {
    const element = node instanceof Element ? node : node.parentElement;
    if (element?.matches("output, output *")) speak(element.closest("output")!);
    element?.querySelectorAll("output").forEach(speak);
  };
  within(document.body);
  const changes = new MutationObserver((all) => all.forEach(({ target, addedNodes }) => [target, ...addedNodes].forEach((node) => {
    if (node === target && !(node instanceof Element && node.matches("output")) && !(node.parentElement?.matches("output"))) return;
    within(node);
  })));
  changes.observe(document.body, { subtree: true, childList: true, characterData: true });
}
