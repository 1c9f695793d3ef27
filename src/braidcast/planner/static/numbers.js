/** The numbers of a case that the page lets a user change, and what any case file allows. */

const point = (name, axis) => ({
  name: `vessel_${name}_${"xyz"[axis]}`, label: `${name} ${"xyz"[axis]}`, unit: "mm",
  path: ["vessel", name, axis], low: -1000, high: 1000, rule: "from -1000 to 1000 mm",
});

/** `name` as in the model's limits; `path` into the case's tables; limits and `rule`: those of a case file. */
export const NUMBERS = [
  { name: "site_eta", label: "Site η", unit: "", path: ["site", "eta"], low: 0, high: 1, rule: "from 0 to 1" },
  ...["P0", "P1", "P2"].flatMap((name) => [0, 1, 2].map((axis) => point(name, axis))),
  { name: "vessel_diameter", label: "Vessel diameter", unit: "mm", path: ["vessel", "diameter"], above: 0, high: 50, rule: "above 0, at most 50 mm" },
  { name: "aneurysm_diameter", label: "Aneurysm diameter", unit: "mm", path: ["aneurysm", "diameter"], above: 0, high: 100, rule: "above 0, at most 100 mm" },
  { name: "aneurysm_protrusion", label: "Sac position f", unit: "", path: ["aneurysm", "protrusion"], above: 0, below: 1, rule: "between 0 and 1, both excluded" },
  { name: "aneurysm_neck_fillet", label: "Neck fillet", unit: "mm", path: ["aneurysm", "neck_fillet"], above: 0, high: 1, rule: "above 0, at most 1 mm" },
  { name: "site_crimped_radius", label: "Crimped radius", unit: "mm", path: ["site", "crimped_radius"], above: 0, high: 50, rule: "above 0, at most 50 mm" },
  { name: "wall_friction", label: "Friction", unit: "", path: ["wall", "friction"], low: 0, high: 2, rule: "from 0 to 2" },
];

/** Shown whatever the model was trained over. */
export const ALWAYS = ["site_eta", "vessel_P1_y", "vessel_P1_z", "vessel_diameter", "aneurysm_diameter", "aneurysm_protrusion"];

/** The number of `field` in a case's tables; undefined where the case leaves it open. */
export function read(tables, field) {
  return field.path.reduce((table, key) => table?.[key], tables);
}

/** The case with one number changed; the given one is left as it is. */
export function changed(tables, field, value) {
  const copy = structuredClone(tables);
  const last = field.path.at(-1);
  field.path.slice(0, -1).reduce((table, key) => (table[key] ??= {}), copy)[last] = value;
  return copy;
}

/** A typed text as a number, or a sentence that says why it is none: {value} or {complaint}. */
export function parse(text, field) {
  const typed = text.trim().replace(",", ".");
  const value = Number(typed);
  if (typed === "" || !Number.isFinite(value)) {
    const shown = text.length > 24 ? `${text.slice(0, 24)}…` : text;
    return { complaint: `“${shown}” is not a number; must be ${field.rule}.` };
  }
  const { low = -Infinity, high = Infinity, above = -Infinity, below = Infinity } = field;
  if (value < low || value > high || value <= above || value >= below) {
    return { complaint: `${field.label} = ${typed} must be ${field.rule}.` };
  }
  return { value };
}

/** A number as a field shows it: no more digits than say something. */
export const shown = (value, digits = 4) => String(Number(value.toFixed(digits)));

/** A number with fixed digits and its unit: "24.71 mm". */
export const measure = (value, digits, unit) =>
  Number.isFinite(value) ? `${value.toFixed(digits).replace(/^-(0\.?0*)$/, "$1")}${unit ? ` ${unit}` : ""}` : "–";
