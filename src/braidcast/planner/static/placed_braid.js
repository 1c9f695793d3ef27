// The braid as geometry alone places it: rings across the centreline, wires at the wall;
// surrogate/placed_braid.py.

import { placeAt } from "./bezier.js";
import { axisRadius, crimpedLength, nodeCount, unitCircle } from "./braid.js";

const Z_AXIS = [0, 0, 1];

/** Smallest turn of a unit vector into another, nine numbers, rows first; half a turn is about x. */
function smallestTurn([a, b, c], [d, e, f]) {
  const x = b * f - c * e, y = c * d - a * f, z = a * e - b * d, cosine = a * d + b * e + c * f;
  if (cosine <= -1 + 1e-12) return [1, 0, 0, 0, -1, 0, 0, 0, -1];
  const s = 1 / (1 + cosine);
  return [
    cosine + s * x * x, s * x * y - z, s * x * z + y,
    s * x * y + z, cosine + s * y * y, s * y * z - x,
    s * x * z - y, s * y * z + x, cosine + s * z * z,
  ];
}

/** Places a device; what it was placed at last is in its fields:
positions (3 N) mm, axes (9 rings) of each ring, rows first, with the ring's axes as columns (the
third along the vessel), length mm of the centreline between the end rings. */
export class PlacedBraid {
  constructor(device) {
    this.device = device;
    this.circle = unitCircle(device);
    this.positions = new Float64Array(3 * nodeCount(device));
    this.axes = new Float64Array(9 * (device.segments + 1));
    this.length = 0;
  }

  /** Place it as the case's geometry says; on request the two end rings alone. */
  place(geometry, endsAlone = false) {
    const { segments, wire_radius } = this.device;
    const radius = Math.min(geometry.vesselRadius - wire_radius, axisRadius(this.device));
    this.length = crimpedLength(this.device, radius);
    const middle = geometry.startArcLength + 0.5 * geometry.crimpedLength;
    const first = placeAt(geometry.curve, 0).tangent;
    const into = smallestTurn(Z_AXIS, first);
    for (let ring = 0; ring <= segments; ring += endsAlone ? segments : 1) {
      const s = middle + this.length * (ring / segments - 0.5);
      const { point, tangent } = placeAt(geometry.curve, s);
      const on = smallestTurn(first, tangent);
      for (let i = 0; i < 3; i++) {
        for (let j = 0; j < 3; j++) {
          this.axes[9 * ring + 3 * i + j] =
            on[3 * i] * into[j] + on[3 * i + 1] * into[3 + j] + on[3 * i + 2] * into[6 + j];
        }
      }
      this.#placeRing(ring, point, radius);
    }
    return this;
  }

  #placeRing(ring, [x, y, z], radius) {
    const { circle, positions, device: { segments } } = this;
    const [xx, xy, , yx, yy, , zx, zy] = this.axes.subarray(9 * ring, 9 * ring + 9);
    for (let node = ring; 2 * node < circle.length; node += segments + 1) {
      const u = radius * circle[2 * node], v = radius * circle[2 * node + 1];
      positions[3 * node] = x + xx * u + xy * v;
      positions[3 * node + 1] = y + yx * u + yy * v;
      positions[3 * node + 2] = z + zx * u + zy * v;
    }
  }
}
