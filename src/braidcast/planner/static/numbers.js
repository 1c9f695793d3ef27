/** The numbers of a case that the page lets a user change, and what any case file allows. */

const point = ([table, name], axis) => ({
  name: `${table}_${name}_${"xyz"[axis]}`, label: `${name === "centre" ? "Sac centre" : name} ${"xyz"[axis]}`, unit: "mm",
  path: [table, name, axis], low: -1000, high: 1000, rule: "from -1000 to 1000 mm",
});

/**
 * `name` as in the model's limits; `path` into the case's tables; `range` of a slider where no model
 * has limits; low, high, above, below and their `rule`: what a case file may hold.
 */
export const NUMBERS = [
  { name: "site_eta", label: "Site η", unit: "", path: ["site", "eta"], low: 0, high: 1, rule: "from 0 to 1", range: [0, 1] },
  ...["P0", "P1", "P2"].flatMap((name) => [0, 1, 2].map((axis) => point(["vessel", name], axis))),
  { name: "vessel_diameter", label: "Vessel diameter", unit: "mm", path: ["vessel", "diameter"], above: 0, high: 50, rule: "above 0, at most 50 mm", range: [1, 6] },
  { name: "aneurysm_diameter", label: "Aneurysm diameter", unit: "mm", path: ["aneurysm", "diameter"], above: 0, high: 100, rule: "above 0, at most 100 mm", range: [3, 15] },
  { name: "aneurysm_protrusion", label: "Sac position f", unit: "", path: ["aneurysm", "protrusion"], above: 0, below: 1, rule: "between 0 and 1, both excluded", range: [0.1, 0.9] },
  ...[0, 1, 2].map((axis) => point(["aneurysm", "centre"], axis)),
  { name: "aneurysm_neck_fillet", label: "Neck fillet", unit: "mm", path: ["aneurysm", "neck_fillet"], above: 0, high: 1, rule: "above 0, at most 1 mm" },
  { name: "site_crimped_radius", label: "Crimped radius", unit: "mm", path: ["site", "crimped_radius"], above: 0, high: 50, rule: "above 0, at most 50 mm" },
  { name: "wall_friction", label: "Friction", unit: "", path: ["wall", "friction"], low: 0, high: 2, rule: "from 0 to 2" },
];

const ALWAYS = ["site_eta", "vessel_P1_y", "vessel_P1_z", "vessel_diameter", "aneurysm_diameter", "aneurysm_protrusion"];

/** The numbers that the page shows of a case, each with the `range` of its slider. */
export function shownNumbers(tables, limits) {
  return NUMBERS.filter((field) => read(tables, field) !== undefined).flatMap((field) => {
    const value = read(tables, field);
    const [low, high] = limits?.[field.name] ?? [value, value];
    if (low < high) return [{ ...field, range: [low, high], trained: true }];
    if (ALWAYS.includes(field.name)) return [{ ...field, range: field.range ?? [value - 15, value + 15] }];
    return field.path[1] === "centre" ? [{ ...field, range: [value - 3, value + 3] }] : [];
  });
}

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
