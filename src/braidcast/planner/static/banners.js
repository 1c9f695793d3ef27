/** Sentences above the picture: what is wrong or worth knowing, one of a kind at a time. */

import { element } from "./elements.js";

export class Banners {
  #texts = new Map();

  constructor(root) {
    this.root = root;
  }

  /** Shows `text` as the banner of `name`, or takes it away if empty; `kind`: error, warning, note. */
  set(name, kind, text) {
    if ((this.#texts.get(name)?.text ?? "") === text) return;
    this.#texts.get(name)?.root.remove();
    this.#texts.delete(name);
    if (!text) return;
    const close = element("button", { type: "button", "aria-label": "Dismiss", text: "×", onclick: () => this.set(name, kind, "") });
    const root = element("div", { class: `banner ${kind}`, "data-banner": name }, element("span", { text }), kind === "note" ? close : "");
    this.#texts.set(name, { text, root });
    this.root.append(root);
  }

  /** All texts, for the report. */
  get texts() {
    return [...this.#texts.values()].map(({ text }) => text);
  }
}
