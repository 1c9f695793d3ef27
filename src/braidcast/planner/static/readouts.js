/** The numbers of a prediction or a simulation as rows of text: [key, what, value]. */

import { element, write } from "./elements.js";
import { ringCentres } from "./braid.js";
import { measure } from "./numbers.js";

export const percent = (share) => `${(100 * share).toFixed(1)} %`;

/** Arc lengths, mm, of the two ends of a deployed braid. */
function ends(positions, along, device) {
  const centres = ringCentres(device, positions);
  return [centres.slice(0, 3), centres.slice(-3)].map((centre) => along.closest([...centre]));
}

/** How far the ends reach past the neck's edges along the centreline; negative: within the neck. */
function endRows(positions, along, neck, device) {
  const [first, last] = ends(positions, along, device);
  if (!neck) return [["proximal", "Proximal end at", measure(first, 2, "mm")], ["distal", "Distal end at", measure(last, 2, "mm")]];
  const past = (distance) => measure(distance, 2, "mm");
  return [
    ["proximal", "Proximal end past the neck", past(neck[0] - first)],
    ["distal", "Distal end past the neck", past(last - neck[1])],
  ];
}

/** Rows of a prediction; `along` and `neck` of its vessel, `milliseconds` it took. */
export function predictionRows(prediction, along, neck, device, milliseconds) {
  const { positions, stdNorm } = prediction;
  const rows = [
    ["length", "Deployed length", measure(prediction.deployedLength, 2, "mm")],
    ["foreshortening", "Foreshortening", measure(prediction.foreshorteningPercent, 1, "%")],
    ...endRows(positions, along, neck, device),
  ];
  if (stdNorm) {
    const { mean, largest, node } = spread(stdNorm);
    rows.push(
      ["std-mean", "Uncertainty (1 std), mean", measure(mean, 4, "mm")],
      ["std-max", "Uncertainty, largest", measure(largest, 4, "mm")],
      ["std-where", "Largest at", place(node, positions, along, device)],
    );
  } else rows.push(["std-mean", "Uncertainty (1 std), mean", "being prepared …"]);
  rows.push(
    ["nearest", "Nearest training case", `no. ${prediction.nearestCase}, ${measure(prediction.nearestDistance, 2, "std")} away`],
    ["time", "Prediction took", measure(milliseconds, 1, "ms")],
  );
  return rows;
}

/** Rows of a simulation's summary; `departure` (N) mm from the prediction, or null without one. */
export function simulationRows(simulation, departure, along, neck, device) {
  const rows = [
    ["sim-outcome", "Outcome", simulation.outcome],
    ["sim-clinical", "Outcome, clinical label", simulation.clinical_outcome],
    ["sim-converged", "Equilibrium", simulation.converged ? "reached" : `not reached: ${simulation.reason}`],
    ["sim-length", "Deployed length", measure(simulation.deployed_length_mm, 2, "mm")],
    ["sim-foreshortening", "Foreshortening", measure(simulation.foreshortening_percent, 1, "%")],
    ...endRows(simulation.positions, along, neck, device).map(([key, ...rest]) => [`sim-${key}`, ...rest]),
  ];
  if (departure) {
    const { mean, largest, node } = spread(departure);
    rows.push(
      ["sim-mean", "Prediction’s departure, mean", measure(mean, 4, "mm")],
      ["sim-max", "Departure, largest", measure(largest, 4, "mm")],
      ["sim-where", "Largest at", place(node, simulation.positions, along, device)],
    );
  }
  rows.push(
    ["sim-energy", "Strain energy", measure(simulation.strain_energy_mJ, 3, "mJ")],
    ["sim-iterations", "Newton iterations", String(simulation.newton_iterations)],
    ["sim-time", "Simulation took", measure(simulation.wall_seconds, 1, "s")],
  );
  return rows;
}

/** Distance, mm, of every node from the same node of another braid. */
export function departure(positions, others) {
  const away = new Float64Array(positions.length / 3);
  for (let i = 0; i < away.length; i++) {
    away[i] = Math.hypot(positions[3 * i] - others[3 * i], positions[3 * i + 1] - others[3 * i + 1], positions[3 * i + 2] - others[3 * i + 2]);
  }
  return away;
}

/** Mean, largest and where the largest is, of values at nodes. */
export function spread(values) {
  let [sum, node] = [0, 0];
  for (let i = 0; i < values.length; i++) {
    sum += values[i];
    if (values[i] > values[node]) node = i;
  }
  return { mean: sum / values.length, largest: values[node], node };
}

function place(node, positions, along, device) {
  const ring = node % (device.segments + 1);
  return `ring ${ring} of ${device.segments}, ${measure(along.closest([...positions.slice(3 * node, 3 * node + 3)]), 1, "mm")} along`;
}

/** Shows rows in a <dl>; its elements stay as long as the rows' names do. */
export function showRows(list, rows) {
  const keys = rows.map(([key]) => key).join();
  if (list.dataset.keys !== keys) {
    list.dataset.keys = keys;
    list.replaceChildren(...rows.map(([key, what]) => element("div", {}, element("dt", { text: what }), element("dd", { "data-key": key }))));
  }
  [...list.querySelectorAll("dd")].forEach((cell, i) => write(cell, rows[i][2]));
}
