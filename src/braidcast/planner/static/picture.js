/** What one canvas shows: a vessel, its braid with colours, marks and a second braid. */

import { View } from "./view.js";

/** Values of the last colour for the distance to the wall, mm: the same in every picture. */
const FARTHEST = 1;

export class Picture {
  #vessel = "";

  constructor(canvas, dark) {
    this.canvas = canvas;
    this.view = new View(canvas, { dark });
  }

  /**
   * `vessel`: as View.setVessel takes it, with `key`, one text per shape; `braid`: {positions,
   * values} or null; `scale`: {range, palette}; `wires` of `device`; `marks`, `ghost` as View's.
   */
  show({ vessel, braid, scale, wires, device, marks, ghost, stale }) {
    this.canvas.classList.toggle("stale", Boolean(stale));
    if (stale) return;
    if (vessel.key !== this.#vessel) this.view.setVessel(vessel);
    if ((braid || ghost) && !this.view.braid) this.view.setBraid(wires, device.wire_radius, device.segments);
    if (braid) {
      this.view.setPositions(braid.positions);
      this.view.setValues(braid.values, scale.range, scale.palette);
    } else this.view.hideBraid();
    this.view.setMarks(marks);
    this.view.setGhost(ghost);
    if (!this.#vessel) this.view.fit();
    this.#vessel = vessel.key;
    this.view.render();
  }
}

/** What nodes may be coloured by; `of(look)`: values (N) mm, or nothing where a case has none. */
const QUANTITIES = {
  departure: { of: ({ departure }) => departure, palette: "cividis", title: "departure from the simulation, mm" },
  std: { of: ({ prediction }) => prediction?.stdNorm, palette: "cividis", title: "standard deviation, mm" },
  gap: { of: ({ braid }) => braid?.gaps, palette: "viridis", title: "distance to the wall, mm" },
};

/** Whether all the looks have such values. */
export const isThere = (kind, looks) => looks.every((look) => QUANTITIES[kind].of(look));

/** One scale of colours for all the looks that are shown: {kind, of, range, palette, title}. */
export function scaleOf(wanted, looks) {
  const kind = isThere(wanted, looks) ? wanted : "gap";
  const quantity = QUANTITIES[kind];
  return { kind, ...quantity, range: [0, kind === "gap" ? FARTHEST : ceiling(looks.map(quantity.of))] };
}

/** The next of 1, 2, 5, 10 … × 10^k above all values of all fields, so that the scale does not change at every move. */
function ceiling(fields) {
  let largest = 1e-4;
  for (const values of fields) for (const value of values) if (value > largest) largest = value;
  const power = 10 ** Math.floor(Math.log10(largest));
  return [1, 2, 5, 10].map((step) => step * power).find((step) => step >= largest);
}
