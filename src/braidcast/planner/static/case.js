// One case: its geometry, whether it is possible, its numbers by name, its file; case.py,
// case_tables.py, feasibility.py, case_toml.py and surrogate/applicability.py. mm throughout.
//
// A case is the tables of its file: {title, vessel: {P0, P1, P2, diameter}, aneurysm: {diameter,
// protrusion | centre, neck_fillet} | null, device, site: {eta | proximal_end_mm | distal_end_mm |
// point, crimped_radius}, wall: {friction}}; keys left out or null have the file's defaults.

import { closestPlace, maxCurvature, minus, norm, packCurve, placeAt, turnsBack } from "./bezier.js";
import { axisRadius, crimpedLength } from "./braid.js";
import { float, general } from "./number_text.js";

/** Length of vessel, mm, that the crimped device leaves free at the least. */
const MARGIN = 0.5;

const START = [0, 0, 0], END = [0, 0, 50], NECK_FILLET = 0.2, FRICTION = 0.1;

/** Keys of the device whose values are whole numbers. */
const WHOLE = ["wires", "segments"];

const POINT = "three numbers of mm, each from -1000 to 1000";
const ofMm = (most) => `a number of mm above 0, at most ${most}`;
const isPoint = (p) => p.length === 3 && p.every((x) => Math.abs(x) <= 1000);
const within = (low, high) => (x) => low <= x && x <= high;
const above0 = (most) => (x) => 0 < x && x <= most;

// [table, key, whether a value is allowed, what is], in the order of the file.
const RULES = [
  ["vessel", "P0", isPoint, POINT],
  ["vessel", "P1", isPoint, POINT],
  ["vessel", "P2", isPoint, POINT],
  ["vessel", "diameter", above0(50), ofMm(50)],
  ["aneurysm", "diameter", above0(100), ofMm(100)],
  ["aneurysm", "protrusion", (x) => 0 < x && x < 1, "a number between 0 and 1, both excluded"],
  ["aneurysm", "centre", isPoint, POINT],
  ["aneurysm", "neck_fillet", above0(1), ofMm(1)],
  ["site", "eta", within(0, 1), "a number from 0 to 1"],
  ["site", "proximal_end_mm", within(0, 1000), "a number of mm from 0 to 1000"],
  ["site", "distal_end_mm", within(0, 1000), "a number of mm from 0 to 1000"],
  ["site", "point", isPoint, POINT],
  ["site", "crimped_radius", above0(50), ofMm(50)],
  ["wall", "friction", within(0, 2), "a number from 0 to 2"],
];

/** A deep copy of a case. */
export const copy = (case_) => structuredClone(case_);

/** Lengths, radii and places of a case: {curve (packed), length, vesselRadius, sacCentre [3] | null,
sacRadius, neckFillet, startArcLength, crimpedLength, crimpedRadius, spareLength, eta}; mm. */
export function geometry(case_, device) {
  const { vessel, aneurysm, site } = case_;
  const curve = packCurve(vessel.P0 ?? START, vessel.P1, vessel.P2 ?? END);
  const vesselRadius = vessel.diameter / 2, length = curve[13];
  const crimpedRadius = site.crimped_radius ?? 0.3 * axisRadius(device);
  const crimped = crimpedLength(device, crimpedRadius);
  const spareLength = length - crimped - MARGIN;
  const startArcLength = start(site, curve, crimped, spareLength);
  return {
    curve,
    length,
    vesselRadius,
    sacCentre: aneurysm ? sacCentre(aneurysm, curve, vesselRadius) : null,
    sacRadius: aneurysm ? aneurysm.diameter / 2 : 0,
    neckFillet: aneurysm?.neck_fillet ?? NECK_FILLET,
    startArcLength,
    crimpedLength: crimped,
    crimpedRadius,
    spareLength,
    eta: site.eta ?? (spareLength > 0 ? startArcLength / spareLength : 0),
  };
}

/** Arc length of ring 0 of the crimped device, mm. */
function start(site, curve, crimped, spare) {
  if (site.proximal_end_mm != null) return site.proximal_end_mm;
  if (site.distal_end_mm != null) return site.distal_end_mm - crimped;
  if (site.point != null) return closestPlace(curve, site.point).arcLength - 0.5 * crimped;
  return site.eta * spare;
}

function sacCentre(aneurysm, curve, vesselRadius) {
  if (aneurysm.centre != null) return aneurysm.centre;
  const [x, y, z] = placeAt(curve, curve[13] / 2).point;
  return [x, y + vesselRadius + (aneurysm.protrusion * aneurysm.diameter) / 2, z];
}

/** One sentence on the first thing that makes the case impossible, or null. */
export function complaint(case_, device) {
  for (const [table, key, allowed, rule] of RULES) {
    const value = case_[table]?.[key];
    if (value != null && !allowed(value)) return `${table}.${key} = ${shown(value)} must be ${rule}`;
  }
  const g = geometry(case_, device);
  return crimpable(g, device) ?? across(case_, g, device) ?? along(case_, g, device)
    ?? saccular(case_, g);
}

function crimpable(g, device) {
  const least = (device.wires * device.wire_radius) / Math.PI, free = axisRadius(device);
  if (least <= g.crimpedRadius && g.crimpedRadius < free) return null;
  return `site.crimped_radius = ${general(g.crimpedRadius, 4)} mm must be from ${general(least, 4)} `
    + `mm, where the wires lie side by side, to below ${general(free, 4)} mm, the free device's`;
}

function across({ vessel }, g, device) {
  const P1 = `vessel.P1 = ${floats(vessel.P1)}`;
  if (turnsBack(g.curve)) {
    return `${P1} must differ from P0 and P2 and, if it is in line with them, lie between them: `
      + "otherwise the centreline turns back on itself";
  }
  const curvature = maxCurvature(g.curve);
  if (g.vesselRadius * curvature >= 1) {
    return `${P1} bends the centreline to a radius of ${general(1 / curvature, 3)} mm, must be more `
      + `than the vessel's radius of ${general(g.vesselRadius, 4)} mm`;
  }
  const least = 2 * (g.crimpedRadius + 2 * device.wire_radius);
  const most = 2 * (axisRadius(device) + device.wire_radius);
  const diameter = `vessel.diameter = ${general(vessel.diameter, 6)} mm must be`;
  if (vessel.diameter <= least) {
    return `${diameter} above ${general(least, 4)} mm, the crimped stent and a wire either side`;
  }
  if (vessel.diameter < most) return null;
  return `${diameter} below ${general(most, 4)} mm, the free stent's, or the stent lies loose`;
}

function along({ site }, g, device) {
  const { length, spareLength: spare, startArcLength: begin, crimpedLength: crimped } = g;
  if (spare < 0) {
    return `device.length = ${general(device.length, 6)} mm gives a stent of ${general(crimped, 4)} `
      + `mm when crimped, must be at most ${general(length - MARGIN, 4)} mm: the vessel's centreline `
      + `is ${general(length, 4)} mm long and ${MARGIN} mm stay free`;
  }
  if (0 <= begin && begin <= spare) return site.point == null ? null : beside(site.point, g);
  const middle = 0.5 * crimped;
  let [name, value, low, high] = ["point", "", middle, spare + middle];
  if (site.proximal_end_mm != null) {
    [name, value, low, high] = ["proximal_end_mm", `${float(site.proximal_end_mm)} mm`, 0, spare];
  } else if (site.distal_end_mm != null) {
    [name, value] = ["distal_end_mm", `${float(site.distal_end_mm)} mm`];
    [low, high] = [crimped, spare + crimped];
  } else {
    value = `${floats(site.point)}, at ${general(begin + middle, 4)} mm of the line,`;
  }
  return `site.${name} = ${value} must be from ${general(low, 4)} to ${general(high, 4)} mm along the `
    + `centreline of ${general(length, 4)} mm, or the crimped stent of ${general(crimped, 4)} mm `
    + "reaches beyond its ends";
}

/** A site's point lies within so many lumen radii of the centreline, or about the sac. */
const MOST_RADII = 3;

function beside(point, g) {
  const away = closestPlace(g.curve, point).distance;
  const sac = g.sacCentre ? closestPlace(g.curve, g.sacCentre).distance + g.sacRadius : 0;
  const most = Math.max(MOST_RADII * g.vesselRadius, sac);
  if (away <= most) return null;
  return `site.point = ${floats(point)} is ${general(away, 4)} mm from the vessel's centreline, must be `
    + `at most ${general(most, 4)} mm from it`;
}

function saccular({ vessel, aneurysm }, g) {
  if (!aneurysm) return null;
  const centre = g.sacCentre, sac = g.sacRadius, radius = g.vesselRadius;
  const field = aneurysm.centre != null
    ? `aneurysm.centre = ${floats(aneurysm.centre)}`
    : `aneurysm.protrusion = ${float(aneurysm.protrusion)}`;
  const away = closestPlace(g.curve, centre).distance;
  if (!(radius <= away && away < radius + sac)) {
    return `${field} puts the sac's centre ${general(away, 4)} mm from the centreline, must be from `
      + `${general(radius, 4)} mm (outside the vessel) to below ${general(radius + sac, 4)} mm `
      + "(touching it)";
  }
  const least = Math.min(radius, sac);
  if (g.neckFillet >= least) {
    return `aneurysm.neck_fillet = ${float(g.neckFillet)} mm must be below ${general(least, 4)} mm, `
      + "the smaller radius of vessel and sac";
  }
  const ends = [vessel.P0 ?? START, vessel.P2 ?? END].map((end) => norm(minus(centre, end)));
  const near = Math.min(...ends);
  if (near > radius + sac) return null;
  return `${field} puts the sac's centre ${general(near, 4)} mm from an end of the vessel, must be `
    + `more than ${general(radius + sac, 4)} mm, or the sac swallows that end`;
}

/** The device of a case: one of the catalogue's, by name, with the values that the case replaces. */
export function deviceOf(case_, catalogue) {
  const { name = "paper", ...replaced } = case_.device ?? {};
  const given = Object.entries(replaced).filter(([, value]) => value != null);
  return { ...catalogue[name], ...Object.fromEntries(given) };
}

/** Why a model of ``device`` cannot answer the case, as a sentence, or null. */
export function otherDevice(case_, device, catalogue) {
  const text = (name, value) => {
    if (typeof value === "boolean") return value ? "True" : "False";
    return WHOLE.includes(name) ? value : float(value);
  };
  for (const [name, value] of Object.entries(deviceOf(case_, catalogue))) {
    if (value === device[name]) continue;
    return `device.${name} = ${text(name, value)} must be ${text(name, device[name])}, that of the `
      + "device the model was trained for";
  }
  return null;
}

/** The numbers of a case but those of its device, by name; mm and pure numbers. */
export function fields(case_, device, g = geometry(case_, device)) {
  const { vessel, aneurysm, wall } = case_, numbers = {};
  const points = { P0: vessel.P0 ?? START, P1: vessel.P1, P2: vessel.P2 ?? END };
  for (const [name, point] of Object.entries(points)) {
    ["x", "y", "z"].forEach((axis, i) => (numbers[`vessel_${name}_${axis}`] = point[i]));
  }
  const away = minus(g.sacCentre, placeAt(g.curve, 0.5 * g.length).point);
  return {
    ...numbers,
    vessel_diameter: vessel.diameter,
    aneurysm_diameter: aneurysm.diameter,
    aneurysm_protrusion: (2 * (away[1] - g.vesselRadius)) / aneurysm.diameter,
    aneurysm_aside: Math.hypot(away[0], away[2]),
    aneurysm_neck_fillet: g.neckFillet,
    site_eta: g.eta,
    site_crimped_radius: g.crimpedRadius,
    wall_friction: wall?.friction ?? FRICTION,
  };
}

/** The text of a case file that ``Case.from_toml`` reads back as the same case. */
export function toToml(case_) {
  const lines = [`title = ${tomlValue(case_.title ?? "")}`];
  for (const [name, table] of Object.entries(case_)) {
    if (table === null || typeof table !== "object") continue;
    lines.push("", `[${name}]`);
    for (const [key, value] of Object.entries(table)) {
      if (value == null) continue;
      lines.push(`${key} = ${WHOLE.includes(key) ? value : tomlValue(value)}`);
    }
  }
  return `${lines.join("\n")}\n`;
}

function tomlValue(value) {
  if (typeof value === "number") return float(value);
  if (Array.isArray(value)) return `[${value.map(tomlValue).join(", ")}]`;
  // JSON's escapes are TOML's too; only DEL, which JSON leaves as it is, must be escaped.
  return JSON.stringify(value).replaceAll("\x7f", "\\u007f");
}

const floats = (values) => `[${values.map(float).join(", ")}]`;

/** A value as Python shows what JSON brought it: whole numbers without a point. */
function shown(value) {
  const one = (x) => (Number.isInteger(x) ? String(x) : float(x));
  const text = Array.isArray(value) ? `[${value.map(one).join(", ")}]` : one(value);
  return text.length <= 60 ? text : `${text.slice(0, 57)}...`;
}
