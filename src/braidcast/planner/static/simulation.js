/** “Simulate this case”: progress, cancelling, and the results of this visit, each with its case. */

import { DIGITS } from "./address.js";
import { element, write } from "./elements.js";
import { Cancelled, KEPT, NO_SERVER } from "./host.js";
import { shown } from "./numbers.js";
import { showRows } from "./readouts.js";

/** One text for one case, so that a result finds its case again; numbers as the address keeps them. */
export const keyOf = (tables) => JSON.stringify(tables, (_, value) => {
  if (typeof value === "number") return shown(value, DIGITS);
  return value && typeof value === "object" && !Array.isArray(value) ? Object.fromEntries(Object.entries(value).sort(([a], [b]) => (a < b ? -1 : 1))) : value;
});

export class SimulationBox {
  #results = new Map();
  #running = null; // {key, tables, job}
  #message = "";

  /** `current()` → tables; `onChange()` when there is something new; `onGo(tables)` to a case. */
  constructor(root, host, { current, onChange, onGo }) {
    this.host = host;
    this.onChange = onChange;
    this.start = element("button", { type: "button", id: "simulate", class: "primary", text: "Simulate this case", onclick: () => this.#run(current()) });
    this.cancel = element("button", { type: "button", id: "cancel", text: "Cancel", onclick: () => host.cancel() });
    this.bar = element("progress", { max: 1, "aria-label": "Progress of the simulation" });
    this.stage = element("span", { id: "simulation-stage", role: "status" });
    this.progress = element("div", { class: "progress" }, this.bar, this.stage, this.cancel);
    this.message = element("p", { id: "simulation-message", class: "note", role: "status" });
    this.other = element("p", { id: "simulation-other", class: "note" });
    this.go = element("button", { type: "button", text: "Show that case", onclick: () => onGo(this.#other().tables) });
    this.rows = element("dl", { id: "simulation-rows" });
    root.append(element("div", { class: "buttons" }, this.start), this.progress, this.message, this.other, this.go, this.rows);
    this.#resume();
  }

  /** The simulations of before a reload, one after the other: most are done. */
  async #resume() {
    for (const { id, tables } of this.host.kept) {
      await this.#follow(tables, () => this.host.follow(id, (job) => this.#progress(job)));
    }
  }

  /** The result for exactly this case, or undefined. */
  of(tables) {
    return this.#results.get(keyOf(tables));
  }

  /** `impossible`: why the case cannot be simulated, or ""; `rows` of the case's result, or []. */
  show(tables, impossible, rows) {
    const key = keyOf(tables);
    const inFile = this.host.kind === "file";
    this.start.disabled = Boolean(this.#running || impossible || inFile);
    this.progress.hidden = !this.#running;
    const other = this.#other(key);
    this.other.hidden = this.go.hidden = !other;
    write(this.other, this.#running ? "This simulation is of another case than the one shown." : "There is a simulation of another case.");
    write(this.message, inFile ? NO_SERVER : this.#message);
    showRows(this.rows, rows);
  }

  /** The case that runs or was last simulated, if it is not the one of `key`. */
  #other(key = null) {
    const last = this.#running ?? [...this.#results.values()].at(-1);
    return last && last.key !== key && !(key && !this.#running && this.#results.has(key)) ? last : null;
  }

  #run(tables) {
    const copy = structuredClone(tables);
    this.#message = "";
    return this.#follow(copy, () => this.host.simulate(copy, (job) => this.#progress(job)));
  }

  async #follow(tables, simulated) {
    this.#running = { key: keyOf(tables), tables };
    this.#progress({ state: "queued" });
    try {
      const done = await simulated();
      this.#results.set(keyOf(tables), { ...done, key: keyOf(tables), tables });
      if (this.#results.size > KEPT) this.#results.delete(this.#results.keys().next().value);
    } catch (error) {
      this.#message = error instanceof Cancelled ? "The simulation was cancelled." : error.message;
    }
    this.#running = null;
    this.onChange();
  }

  #progress({ state, position, stage, fraction }) {
    if (fraction > 0) this.bar.value = fraction;
    else this.bar.removeAttribute("value");
    const started = `${stage || "starting"}${fraction > 0 ? `, ${Math.round(100 * fraction)} %` : ""}`;
    const ahead = position > 0 ? `waiting for ${position} other${position > 1 ? "s" : ""}` : "starting";
    write(this.stage, { queued: ahead, gone: "waiting for the server" }[state] ?? started);
    if (state === "queued" || !this.progress.dataset.shown) this.onChange();
    this.progress.dataset.shown = this.#running ? "yes" : "";
  }
}
