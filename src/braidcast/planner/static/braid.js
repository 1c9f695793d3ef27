// Geometry of a braided tube; devices/braid.py and deployment/shape.py. ``device`` has the numbers
// of the model's header: wires, radius, length, segments, wire_radius, literal_angle, …; mm.
//
// Node i of wire n has the index n (segments + 1) + i; the first half of the wires turns
// anticlockwise seen from +z, the other clockwise.

/** Number of nodes N. */
export const nodeCount = (device) => device.wires * (device.segments + 1);

/** Radius of the cylinder the wire axes lie on, mm. */
export const axisRadius = (device) => device.radius + device.wire_radius;

/** Angle between neighbouring nodes of a wire, rad. */
const angleStep = (device) => (2 * Math.PI) / (device.wires / (device.literal_angle ? 2 : 1));

const chordAcross = (device, radius) => 2 * radius * Math.sin(angleStep(device) / 2);

/** Length, mm, of the braid when its wires lie on a cylinder of ``radius`` mm. */
export function crimpedLength(device, radius) {
  const { length, segments } = device;
  const element = Math.hypot(length / segments, chordAcross(device, axisRadius(device)));
  return segments * Math.sqrt(element ** 2 - chordAcross(device, radius) ** 2);
}

/** Nodes along each wire, Int32Array (wires (segments + 1)). */
export const nodesOfWires = (device) => Int32Array.from({ length: nodeCount(device) }, (_, i) => i);

/** Cosine and sine of each node's angle about the axis, Float64Array (2 N). */
export function unitCircle(device) {
  const { wires, segments } = device, half = wires / 2, step = angleStep(device);
  const circle = new Float64Array(2 * nodeCount(device));
  let place = 0;
  for (let wire = 0; wire < wires; wire++) {
    const start = (wire % half) * ((2 * Math.PI) / half), sense = wire < half ? step : -step;
    for (let ring = 0; ring <= segments; ring++) {
      circle[place++] = Math.cos(start + sense * ring);
      circle[place++] = Math.sin(start + sense * ring);
    }
  }
  return circle;
}

/** Means of the nodes of each ring, Float64Array (3 rings) mm. */
export function ringCentres(device, positions) {
  const width = 3 * (device.segments + 1), centres = new Float64Array(width);
  for (let begin = 0; begin < positions.length; begin += width) {
    for (let i = 0; i < width; i++) centres[i] += positions[begin + i];
  }
  for (let i = 0; i < width; i++) centres[i] /= device.wires;
  return centres;
}

/** Length of the line through the ring centres, mm. */
export function braidLength(device, positions) {
  const c = ringCentres(device, positions);
  let total = 0;
  for (let i = 3; i < c.length; i += 3) {
    total += Math.hypot(c[i] - c[i - 3], c[i + 1] - c[i - 2], c[i + 2] - c[i - 1]);
  }
  return total;
}
