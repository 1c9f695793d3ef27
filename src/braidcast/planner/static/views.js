// Standard views: the vessel's own axes, and where the eye is in them.

import { cross, dot, minus } from "./bezier.js";

/** Direction to the eye in the vessel's axes: x along it, y to the sac, z square to both. The sac
 * stays above except where it is looked at from above: there z points down. */
export const VIEWS = {
  front: [0, 0, 1],
  back: [0, 0, -1],
  side: [1, 0, 0], // from the distal end
  top: [0, 1, 0.001], // on the sac; not the pole itself, where left and right are undefined
  along: [-1, 0, 0], // from the proximal end, with the flow
  reset: [-0.25, 0.18, 1], // a little to the side and from above, so that tubes look round
};

/** a (3) at length 1, or `otherwise` where it has none. */
function unit(a, otherwise) {
  const size = Math.hypot(...a);
  return size > 1e-9 ? a.map((v) => v / size) : otherwise;
}

/** The vessel's axes [along, up, towards], unit vectors (3), of points (3) mm of its centreline and
 * the centre of the sac; without a sac the bend points up. */
export function axesOf(first, middle, last, sacCentre) {
  const along = unit(minus(last, first), [0, 0, 1]);
  const upward = sacCentre ? minus(sacCentre, middle) : middle.map((v, i) => v - 0.5 * (first[i] + last[i]));
  const square = minus(upward, along.map((v) => v * dot(upward, along)));
  // A straight vessel without a sac has no plane: any direction across it will do.
  const least = along.map(Math.abs).indexOf(Math.min(...along.map(Math.abs)));
  const across = cross(along, [0, 1, 2].map((i) => (i === least ? 1 : 0)));
  const up = unit(square, unit(across));
  return [along, up, cross(along, up)];
}

/** The longest round number of millimetres that is no longer than `longest` mm. */
export function roundLength(longest) {
  const power = 10 ** Math.floor(Math.log10(longest));
  return power * [5, 2, 1].find((digit) => digit * power <= longest * (1 + 1e-9));
}
