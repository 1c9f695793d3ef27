// Signed distance of a tube and a spherical sac with a rounded neck; vessels/kernels.py.

import { closest } from "./bezier.js";

/** |u| rounded over |u| < width. */
function blend(u, width) {
  if (Math.abs(u) >= width) return Math.abs(u);
  const square = (u / width) ** 2;
  return (width * (3 + square * (6 - square))) / 8;
}

/** Signed distance of a point to the wall, mm, negative in the lumen; ``geometry``: of the case. */
export function distanceAt(geometry, x, y, z) {
  const tube = closest(geometry.curve, x, y, z) - geometry.vesselRadius;
  if (!geometry.sacCentre) return tube;
  const [cx, cy, cz] = geometry.sacCentre;
  const square = (x - cx) ** 2 + (y - cy) ** 2 + (z - cz) ** 2;
  const sphere = Math.sqrt(square) - geometry.sacRadius;
  return 0.5 * (tube + sphere - blend(tube - sphere, geometry.neckFillet));
}

/** Free space between wire and wall at each node, Float64Array N mm, negative in penetration. */
export function wireDistance(geometry, wireRadius, positions) {
  const gaps = new Float64Array(positions.length / 3);
  for (let i = 0; i < gaps.length; i++) {
    const x = positions[3 * i], y = positions[3 * i + 1], z = positions[3 * i + 2];
    gaps[i] = -distanceAt(geometry, x, y, z) - wireRadius;
  }
  return gaps;
}
