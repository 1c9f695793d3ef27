/** What there is to a case: whether it is possible, its geometry, prediction, simulation, rows. */

import { Along } from "./along.js";
import { complaint, geometry } from "./case.js";
import { nodesOfWires } from "./braid.js";
import { departure, predictionRows, simulationRows } from "./readouts.js";

const SITE_POINTS = 33; // of the part of the centreline that the crimped device takes

/** Looks at cases with one model (or none), in tubes or in the one surface that was opened. */
export class Looker {
  #shape = { key: "" };

  /** `start` as the host's; `model` or null; `simulationOf(tables)` → result or undefined. */
  constructor(start, model, simulationOf) {
    Object.assign(this, { start, model, simulationOf });
    this.device = model?.device ?? start.device;
    this.wires = nodesOfWires(this.device);
  }

  /**
   * {impossible} with a sentence, or {geometry, shape, prediction, simulation, braid, departure,
   * marks, rows, simulated}: `braid` is the prediction or, without one, the simulation; rows of both.
   */
  look(tables) {
    const impossible = this.start.surface ? null : complaint(tables, this.device);
    if (impossible) return { impossible };
    const lengths = this.#geometry(tables);
    const shape = this.#shapeOf(tables, lengths);
    const before = performance.now();
    const prediction = this.model?.predict(tables) ?? null;
    const took = performance.now() - before;
    const simulation = this.simulationOf(tables) ?? null;
    const away = prediction && simulation ? departure(prediction.positions, simulation.positions) : null;
    const { along, neck } = shape;
    return {
      impossible, geometry: lengths, shape, prediction, simulation, braid: prediction ?? simulation, departure: away,
      marks: this.#marks(tables, lengths, shape),
      rows: prediction ? predictionRows(prediction, along, neck, this.device, took) : [],
      simulated: simulation ? simulationRows(simulation, away, along, neck, this.device) : [],
    };
  }

  #geometry(tables) {
    const { surface } = this.start;
    return surface ? { ...surface, startArcLength: tables.site.eta * surface.spareLength } : geometry(tables, this.device);
  }

  /** What does not depend on the site: the vessel as the view takes it, its centreline and neck. */
  #shapeOf(tables, lengths) {
    const { surface } = this.start;
    const key = surface ? surface.name : JSON.stringify([tables.vessel, tables.aneurysm]);
    if (key === this.#shape.key) return this.#shape;
    if (surface) {
      this.#shape = { key, along: new Along(surface.centreline), neck: null, vessel: { kind: "surface", key, vertices: Float64Array.from(surface.vertices), triangles: Uint32Array.from(surface.triangles) } };
    } else {
      const { P0 = [0, 0, 0], P1, P2 = [0, 0, 50] } = tables.vessel;
      const along = Along.bezier({ P0, P1, P2 });
      const neck = lengths.sacCentre && along.neck(lengths.vesselRadius, lengths.sacCentre, lengths.sacRadius);
      this.#shape = { key, along, neck, vessel: { kind: "tube", key, case: tables, geometry: lengths } };
    }
    return this.#shape;
  }

  #marks({ aneurysm }, { startArcLength, crimpedLength, sacCentre, sacRadius, vesselRadius }, { along }) {
    const site = Array.from({ length: SITE_POINTS }, (_, i) => along.at(startArcLength + (i / (SITE_POINTS - 1)) * crimpedLength));
    const top = sacCentre ?? aneurysm?.neck;
    if (!top) return { neck: null, sac: null, site };
    const below = along.at(along.closest(top));
    const away = top.map((x, k) => x - below[k]);
    const height = Math.hypot(...away);
    const normal = away.map((x) => x / height);
    if (!sacCentre) return { neck: { centre: top, radius: aneurysm.neck_radius, normal }, sac: null, site };
    const radius = Math.sqrt(Math.max(0, sacRadius ** 2 - (height - vesselRadius) ** 2));
    return { neck: { centre: below.map((x, k) => x + vesselRadius * normal[k]), radius, normal }, sac: { centre: sacCentre, radius: sacRadius }, site };
  }
}
