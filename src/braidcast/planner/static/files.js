/** What each download holds: the files of `predict` and `simulate`, of what is seen. */

import { toToml } from "./case.js";
import { stl, vtp } from "./formats.js";
import { report } from "./report.js";
import { lumenMesh } from "./vessel_mesh.js";

/** {kind: () → content} for the page's planner. */
export function files(planner) {
  return {
    vtp: () => wires(planner),
    stl: () => lumen(planner),
    png: () => planner.pictures[0].view.png(),
    toml: () => toToml(planner.state.tables),
    html: () => page(planner),
  };
}

/** The braid in colours with all its values; the simulation has the place of a missing prediction. */
function wires({ seen, looker }) {
  const { prediction, simulation, departure } = seen;
  const braid = prediction ?? simulation;
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
  const captions = state.compare === "sides" ? ["Case B", "Case A"] : [document.getElementById("view-b").lastElementChild.textContent || "As seen"];
  const colours = document.getElementById("legend").ariaLabel ?? "";
  const images = [];
  pictures.forEach((each) => each.view.setDark(false)); // for paper
  for (const [i, caption] of captions.entries()) images.push(await picture(pictures[i].view, `${caption}. ${colours}`));
  const { view } = pictures[0];
  const { pose } = view;
  for (const name of state.compare === "sides" ? [] : ["front", "top"]) {
    view.view(name);
    images.push(await picture(view, `From the ${name}`));
  }
  view.pose = pose;
  pictures.forEach((each) => each.view.setDark(planner.isDark));
  const { a, b } = planner.bothRows;
  const own = b.map(([key, what, value]) => (a ? [what, a.find(([other]) => other === key)?.[2] ?? "–", value] : [what, value]));
  const remarks = [...document.querySelectorAll(".banner.error, .banner.warning")].map((banner) => banner.textContent);
  if (model) remarks.push(`Success is called from a probability of ${(100 * model.threshold).toFixed(0)} % on.`);
  if (start.withoutModel) remarks.push(start.withoutModel);
  return report({
    title: start.case.title, version: start.version, modelName: start.modelName, remarks, pictures: images,
    made: new Date().toISOString().slice(0, 16).replace("T", " ") + " UTC",
    tables: [{ title: "Numbers", head: a ? ["", "A", "B"] : null, rows: own }],
    strip: strip?.probabilities && { probabilities: strip.probabilities, threshold: strip.threshold, eta: state.tables.site.eta },
    toml: state.pinned ? `# Case B\n${toToml(state.tables)}\n# Case A\n${toToml(state.pinned)}` : toToml(state.tables),
    markdown: start.card,
  });
}

async function picture(view, caption) {
  return { caption, url: await dataUrl(await view.png()) };
}

function dataUrl(blob) {
  return new Promise((done) => {
    const reader = new FileReader();
    reader.addEventListener("load", () => done(reader.result));
    reader.readAsDataURL(blob);
  });
}
