/** Case A, pinned, beside case B, which follows the sliders. */

import { element, write } from "./elements.js";

/** Rows [key, what, value] of A and of B as rows [key, what, A's value, B's value]; "–" for none. */
export function paired(rowsA, rowsB) {
  const keys = new Set(rowsB.map(([key]) => key));
  const valueOf = (rows, wanted) => rows.find(([key]) => key === wanted)?.[2] ?? "–";
  return [...rowsB, ...rowsA.filter(([key]) => !keys.has(key))].map(([key, what]) => [key, what, valueOf(rowsA, key), valueOf(rowsB, key)]);
}

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

  /** `arrangement`: "off", "sides" or "ghost"; rows [key, what, value] of A and B; `impossible`: why
   * B cannot be pinned, or "". */
  show(arrangement, rowsA, rowsB, impossible) {
    const pinned = arrangement !== "off";
    this.pin.disabled = this.swap.disabled = Boolean(impossible);
    for (const part of [this.unpin, this.swap, this.how, this.table]) part.hidden = !pinned;
    write(this.pin, pinned ? "Pin this case as A instead" : "Pin this case as A");
    write(this.hint, pinned ? "B follows the sliders." : "Pins what is shown, then move the sliders to compare.");
    if (!pinned) return;
    this.arrange.value = arrangement;
    const rows = paired(rowsA, rowsB);
    const keys = rows.map(([key]) => key).join();
    if (this.table.dataset.keys !== keys) {
      this.table.dataset.keys = keys;
      const head = ["", "A", "B"].map((text) => element("th", { scope: "col", text }));
      const row = ([key, what]) => element("tr", {}, element("th", { scope: "row", text: what }), element("td", { "data-a": key }), element("td", { "data-b": key }));
      this.table.replaceChildren(element("thead", {}, element("tr", {}, ...head)), element("tbody", {}, ...rows.map(row)));
    }
    const cells = this.table.querySelectorAll("td");
    rows.forEach(([, , a, b], i) => [a, b].forEach((value, k) => write(cells[2 * i + k], value)));
  }
}
