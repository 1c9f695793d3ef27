/** What each download holds: the files of `predict` and `simulate`, of what is seen. */

import { toToml } from "./case.js";
import { paired } from "./compare.js";
import { stl, vtp } from "./formats.js";
import { report } from "./report.js";
import { sheet } from "./sheet.js";
import { lumenMesh } from "./vessel_mesh.js";

/** {kind: () → content} for the page's planner. */
export function files(planner) {
  return {
    vtp: () => wires(possible(planner)),
    stl: () => lumen(possible(planner)),
    png: () => sheet(shownPictures(planner), planner.scale),
    toml: () => caseFile(planner, planner.state.tables),
    html: () => page(possible(planner)),
  };
}

/** What is seen of an impossible case is another one. */
function possible(planner) {
  if (planner.impossible) throw new Error("the case is impossible");
  return planner;
}

/** [{view, caption}] from left to right: A, if it is there, before B. */
function shownPictures({ pictures, captions }) {
  return captions.map((caption, i) => ({ view: pictures[i].view, caption })).reverse();
}

function caseFile({ start }, tables) {
  const beside = start.surface ? `# ${tables.vessel.surface} and the other files named here are looked for from this file's folder.\n` : "";
  return beside + toToml(tables);
}

/** The braid in colours with all its values; the simulation has the place of a missing prediction. */
function wires({ seen, looker }) {
  const { prediction, simulation, braid, departure } = seen;
  if (!braid) throw new Error("there is no braid yet, simulate the case first");
  const arrays = { gap_mm: braid.gaps };
  if (prediction?.std) Object.assign(arrays, { std_mm: prediction.std, std_norm_mm: prediction.stdNorm });
  if (departure) Object.assign(arrays, { departure_from_simulation_mm: departure, simulated_position_mm: simulation.positions });
  return vtp(braid.positions, looker.wires, arrays, looker.device.segments);
}

function lumen({ seen }) {
  const { vessel } = seen.shape;
  const { vertices, triangles } = vessel.kind === "surface" ? vessel : lumenMesh(vessel.case, vessel.geometry, { facets: 120, beyond: 0, closed: true });
  return stl(vertices, triangles);
}

async function page(planner) {
  const { start, state, seen, model, strip, pictures } = planner;
  const images = [];
  pictures.forEach((each) => each.view.setDark(false)); // for paper
  const shown = shownPictures(planner);
  images.push({ caption: shown.map(({ caption }) => caption).filter(Boolean).join(" | ") || "As seen", url: await dataUrl(await sheet(shown, planner.scale)) });
  const { view } = pictures[0];
  const { pose } = view;
  for (const name of state.compare === "sides" ? [] : ["front", "top"]) {
    view.view(name);
    images.push({ caption: `From the ${name}`, url: await dataUrl(await view.png()) });
  }
  view.pose = pose;
  pictures.forEach((each) => each.view.setDark(planner.isDark));
  const { a, b } = planner.bothRows;
  const rows = (a ? paired(a, b) : b).map(([, ...texts]) => texts);
  const remarks = [...document.querySelectorAll(".banner.error, .banner.warning")].map((banner) => banner.textContent);
  if (model) remarks.push(`Success is called from a probability of ${(100 * model.threshold).toFixed(0)} % on.`);
  if (start.withoutModel) remarks.push(start.withoutModel);
  return report({
    title: start.case.title, version: start.version, modelName: start.modelName, remarks, pictures: images,
    made: new Date().toISOString().slice(0, 16).replace("T", " ") + " UTC",
    tables: [{ title: "Numbers", head: a ? ["", "A", "B"] : null, rows }],
    strip: strip?.probabilities && { probabilities: strip.probabilities, threshold: strip.threshold, eta: state.tables.site.eta },
    toml: state.pinned ? `# Case B\n${caseFile(planner, state.tables)}\n# Case A\n${caseFile(planner, state.pinned)}` : caseFile(planner, state.tables),
    markdown: start.card,
  });
}

function dataUrl(blob) {
  return new Promise((done) => {
    const reader = new FileReader();
    reader.addEventListener("load", () => done(reader.result));
    reader.readAsDataURL(blob);
  });
}
