/** Case A, pinned, beside case B, which follows the sliders. */

import { element, write } from "./elements.js";

export class CompareBox {
  /** `onPin()`, `onUnpin()`, `onArrange("sides" | "ghost")`, `onSwap()` */
  constructor(root, { onPin, onUnpin, onArrange, onSwap }) {
    this.pin = element("button", { type: "button", id: "pin", text: "Pin this case as A", onclick: onPin });
    this.unpin = element("button", { type: "button", id: "unpin", text: "Unpin A", onclick: onUnpin });
    this.swap = element("button", { type: "button", id: "swap", text: "Swap A and B", onclick: onSwap });
    this.arrange = element("select", { id: "arrange", onchange: () => onArrange(this.arrange.value) },
      element("option", { value: "sides", text: "side by side" }), element("option", { value: "ghost", text: "A as a second braid" }));
    this.how = element("label", { for: "arrange", text: "Show " }, this.arrange);
    this.hint = element("p", { class: "note" });
    this.table = element("table", { id: "compare-table" });
    root.append(element("div", { class: "buttons" }, this.pin, this.unpin, this.swap), this.how, this.hint, this.table);
  }

  /** `arrangement`: "off", "sides" or "ghost"; rows [key, what, value] of A and B. */
  show(arrangement, rowsA, rowsB) {
    const pinned = arrangement !== "off";
    for (const part of [this.unpin, this.swap, this.how, this.table]) part.hidden = !pinned;
    write(this.pin, pinned ? "Pin this case as A instead" : "Pin this case as A");
    write(this.hint, pinned ? "B follows the sliders." : "Pins what is shown, then move the sliders to compare.");
    if (!pinned) return;
    this.arrange.value = arrangement;
    const keys = rowsB.map(([key]) => key).join();
    if (this.table.dataset.keys !== keys) {
      this.table.dataset.keys = keys;
      const head = ["", "A", "B"].map((text) => element("th", { scope: "col", text }));
      const row = ([key, what]) => element("tr", {}, element("th", { scope: "row", text: what }), element("td", { "data-a": key }), element("td", { "data-b": key }));
      this.table.replaceChildren(element("thead", {}, element("tr", {}, ...head)), element("tbody", {}, ...rowsB.map(row)));
    }
    for (const [side, rows] of [["a", rowsA], ["b", rowsB]]) {
      for (const [key, , value] of rows) {
        const cell = this.table.querySelector(`[data-${side}="${key}"]`);
        if (cell) write(cell, value);
      }
    }
  }
}
