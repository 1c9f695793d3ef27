/** The scale of colours with its unit. */

import { element, write } from "./elements.js";

const TICKS = 3;

/** Numbers with a common number of digits for the ends and the middle of a scale. */
export function ticksOf({ kind, range: [low, high] }) {
  const digits = Math.max(0, 1 - Math.floor(Math.log10(high - low)));
  const ticks = Array.from({ length: TICKS }, (_, i) => (low + ((high - low) * i) / (TICKS - 1)).toFixed(digits));
  if (kind === "gap") ticks[TICKS - 1] += " and more";
  return ticks;
}

/** `scale`: {kind, range, palette, title} or null; `gradient(palette)`: CSS colours from low to high. */
export function legend(root, scale, gradient) {
  const key = scale ? [...scale.range, scale.title].join() : "";
  if (root.dataset.key === key) return;
  root.dataset.key = key;
  if (!scale) {
    root.replaceChildren();
    root.setAttribute("aria-label", "");
    return;
  }
  const { palette, title } = scale;
  const bar = element("span", { class: "bar" });
  bar.style.background = `linear-gradient(to right, ${gradient(palette).join(", ")})`;
  const ticks = ticksOf(scale);
  root.replaceChildren(element("span", { class: "title" }), bar, element("span", { class: "ticks" }, ...ticks.map((text) => element("span", { text }))));
  write(root.firstChild, title);
  root.setAttribute("aria-label", `Colours: ${title}, from ${ticks[0]} to ${ticks.at(-1)}`);
}
