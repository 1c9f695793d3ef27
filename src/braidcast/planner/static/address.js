/** The page's state in the address: what is after the # is all that a reload needs. */

import { changed, parse, read, shown } from "./numbers.js";

const COLOURS = ["gap", "std", "departure"];
const COMPARISONS = ["off", "sides", "ghost"];
/** Decimals of the numbers in the address. */
export const DIGITS = 12;
const PAUSE = 250; // ms; browsers refuse hundreds of history entries in a few seconds

/** State {tables, pinned, colour, compare} → text; `numbers`: the fields that may change, A's with "A.". */
export function toHash(state, numbers) {
  const parts = new URLSearchParams();
  for (const [prefix, tables] of [["", state.tables], ["A.", state.pinned]]) {
    for (const field of tables ? numbers : []) {
      const value = read(tables, field);
      if (value !== undefined) parts.set(prefix + field.name, shown(value, DIGITS));
    }
  }
  if (state.colour !== "gap") parts.set("colour", state.colour);
  if (state.compare !== "off") parts.set("compare", state.compare);
  return `#${parts}`;
}

/** Text → {state, complaints}: what is nonsense keeps the value of `start` and is complained of. */
export function fromHash(hash, start, numbers) {
  const complaints = [];
  const state = { ...start, pinned: null, colour: "gap", compare: "off" };
  const parts = new URLSearchParams(hash.replace(/^#/, ""));
  for (const [key, text] of parts) {
    const pinned = key.startsWith("A.");
    const field = numbers.find(({ name }) => name === (pinned ? key.slice(2) : key));
    if (key === "colour" && COLOURS.includes(text)) state.colour = text;
    else if (key === "compare" && COMPARISONS.includes(text)) state.compare = text;
    else if (field && (read(start.tables, field) !== undefined)) {
      const { value, complaint } = parse(text, field);
      if (complaint) complaints.push(complaint);
      else if (pinned) state.pinned = changed(state.pinned ?? start.tables, field, value);
      else state.tables = changed(state.tables, field, value);
    } else complaints.push(`“${key.slice(0, 24)}” is nothing this page knows.`);
  }
  if (!state.pinned) state.compare = "off";
  else if (state.compare === "off") state.compare = "sides"; // a pinned case is never hidden
  return { state, complaints };
}

/** Writes committed states into the browser's history, the quick ones of a moment as one entry. */
export class History {
  #timer = 0;
  #write;

  constructor(write, read) {
    this.#write = write;
    addEventListener("popstate", () => {
      clearTimeout(this.#timer);
      this.#timer = 0;
      read();
    });
    addEventListener("pagehide", () => this.flush());
  }

  /** A change is complete: keep it soon. */
  commit() {
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => this.flush(), PAUSE);
  }

  flush() {
    if (!this.#timer) return;
    clearTimeout(this.#timer);
    this.#timer = 0;
    const hash = this.#write();
    if (hash !== location.hash) history.pushState(null, "", hash);
  }
}
