/** What one canvas shows: a vessel, its braid with colours, marks and a second braid. */

import { View } from "./view.js";

/** Values of the last colour for the distance to the wall, mm: the same in every picture. */
const FARTHEST = 1;

export class Picture {
  #vessel = "";
  #braid = null;

  constructor(canvas, dark) {
    this.canvas = canvas;
    this.view = new View(canvas, { dark });
  }

  /**
   * `vessel`: as View.setVessel takes it, with `key`, one text per shape; `braid`: {positions,
   * device, wires} or null; `colours`: {values, range, palette} or null; `marks`, `ghost` as View's.
   */
  show({ vessel, braid, colours, marks, ghost, stale }) {
    this.canvas.classList.toggle("stale", Boolean(stale));
    if (stale) return;
    if (vessel.key !== this.#vessel) this.view.setVessel(vessel);
    if (braid && !this.#braid) this.view.setBraid(braid.wires, braid.device.wire_radius, braid.device.segments);
    if (braid) {
      this.view.setPositions(braid.positions);
      this.view.setValues(colours.values, colours.range, colours.palette);
    }
    this.view.setMarks(marks);
    this.view.setGhost(ghost);
    if (!this.#vessel) this.view.fit();
    this.#vessel = vessel.key;
    this.#braid = braid ?? this.#braid;
    this.view.render();
  }
}

/** How nodes get their colour: {kind, values, range, palette, title}; values (N) mm. */
export function colouring(kind, { gaps, stdNorm, departure }) {
  if (kind === "departure" && departure) return { kind, values: departure, range: [0, ceiling(departure)], palette: "cividis", title: "departure from the simulation, mm" };
  if (kind === "std" && stdNorm) return { kind, values: stdNorm, range: [0, ceiling(stdNorm)], palette: "cividis", title: "standard deviation, mm" };
  return { kind: "gap", values: gaps, range: [0, FARTHEST], palette: "viridis", title: "distance to the wall, mm" };
}

/** The next of 1, 2, 5, 10 … × 10^k above all values, so that the scale does not change at every move. */
function ceiling(values) {
  let largest = 1e-4;
  for (const value of values) if (value > largest) largest = value;
  const power = 10 ** Math.floor(Math.log10(largest));
  return [1, 2, 5, 10].map((step) => step * power).find((step) => step >= largest);
}
