/** The scale of colours with its unit. */

import { element, write } from "./elements.js";

const TICKS = 3;

/** `colours`: {range, palette, title}; `gradient(palette)`: CSS colours from low to high. */
export function legend(root, { range: [low, high], palette, title }, gradient) {
  const key = [low, high, palette, title].join();
  if (root.dataset.key === key) return;
  root.dataset.key = key;
  const bar = element("span", { class: "bar" });
  bar.style.background = `linear-gradient(to right, ${gradient(palette).join(", ")})`;
  const digits = Math.max(0, 1 - Math.floor(Math.log10(high - low)));
  const ticks = Array.from({ length: TICKS }, (_, i) => (low + ((high - low) * i) / (TICKS - 1)).toFixed(digits));
  if (title.startsWith("distance to the wall")) ticks[TICKS - 1] += " and more";
  root.replaceChildren(element("span", { class: "title" }), bar, element("span", { class: "ticks" }, ...ticks.map((text) => element("span", { text }))));
  write(root.firstChild, title);
  root.setAttribute("aria-label", `Colours: ${title}, from ${ticks[0]} to ${ticks.at(-1)}`);
}
