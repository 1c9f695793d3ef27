// What a surrogate is told of a case; surrogate/predictors.py, where the numbers have their names.

import { closestPlace, cross, dot, minus, norm, placeAt } from "./bezier.js";


/** What happens to these when vessel and stent are seen from the other end. */
const MIRROR = [-1, -1, 1, 1, 1, 1, 1];

/** Depth in which an end's exposure to the sac changes by a factor of e, mm. */
const REACH = 2;

/** How deep the first and the last ring reach into the sac, [2] mm, negative outside. */
function endDepths(geometry, placed) {
  const { wires, segments, wire_radius } = placed.device, p = placed.positions;
  const [x, y, z] = geometry.sacCentre;
  return [0, segments].map((ring) => {
    let least = Infinity;
    for (let wire = 0; wire < wires; wire++) {
      const i = 3 * (wire * (segments + 1) + ring);
      least = Math.min(least, (p[i] - x) ** 2 + (p[i + 1] - y) ** 2 + (p[i + 2] - z) ** 2);
    }
    return geometry.sacRadius - Math.sqrt(least) - wire_radius;
  });
}

/** Angles [2] from the tangent ``below`` the sac to those of the first and last ring, rad. */
function turns(below, placed, middle) {
  return [[0, -1], [placed.device.segments, 1]].map(([ring, end]) => {
    const along = [2, 5, 8].map((i) => placed.axes[9 * ring + i]);
    const angle = Math.atan2(norm(cross(below, along)), dot(along, below));
    return angle * Math.sign(middle + 0.5 * placed.length * end);
  });
}

/** {site [11], ends [2][8]}: predictors of the shape, and of the outcome as seen from either end. */
export function predictors(geometry, placed) {
  const { curve, sacCentre, sacRadius, vesselRadius } = geometry;
  const { distance, arcLength } = closestPlace(curve, sacCentre);
  const P0 = curve.subarray(0, 3), a = curve.subarray(3, 6), P2 = curve.subarray(20, 23);
  let chord = minus(P2, P0);
  chord = chord.map((x) => x / norm(chord));
  const arm = [0, 1, 2].map((i) => P0[i] + a[i] - 0.5 * (P0[i] + P2[i]));
  const lean = dot(arm, chord), height = distance - vesselRadius;
  const middle = geometry.startArcLength + 0.5 * geometry.crimpedLength - arcLength;
  const depths = endDepths(geometry, placed);
  const [first, last] = depths.map((depth) => Math.exp(depth / REACH));
  const [back, ahead] = turns(placeAt(curve, arcLength).tangent, placed, middle);
  const shape = [
    middle,
    lean,
    norm(arm.map((x, i) => x - lean * chord[i])),
    vesselRadius,
    Math.sqrt(Math.max(sacRadius * sacRadius - height * height, 0)),
    height / sacRadius,
    sacRadius,
  ];
  const site = [...shape, first + last, first - last, back + ahead, ahead - back];
  const seen = shape.map((x, i) => x * MIRROR[i]);
  return { site, ends: [[depths[0], ...shape], [depths[1], ...seen]] };
}
