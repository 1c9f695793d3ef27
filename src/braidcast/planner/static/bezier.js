// A quadratic Bézier curve continued by its end tangents; vessels/bezier.py and centreline.py.
//
//   B(t) = P0 + 2t a + t² b,   a = P1 − P0,   b = P2 − 2 P1 + P0,   B' = 2 (a + t b)
//
// A packed curve is one Float64Array: P0 [0:3], a [3:6], b [6:9], b·b [9], a·b [10], a·a [11],
// |a × b|² [12], length [13], unit tangents at P0 [14:17] and P2 [17:20], P2 [20:23]. Lengths in mm.

// Gauss-Legendre rule on [0, 1]: nodes below 1/2, whose images 1 − x have the same weights.
const RULE = [
  [0.009219682876640378, 0.023587668193255706], [0.0479413718147626, 0.05346966299765953],
  [0.11504866290284765, 0.08003916427167321], [0.20634102285669126, 0.10158371336153287],
  [0.31608425050090994, 0.1167462682691773], [0.43738329574426554, 0.12457352290670134],
];

/** a·b of vectors of three. */
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/** a − b of vectors of three. */
export const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];

/** a × b of vectors of three. */
export const cross = (a, b) => [
  a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0],
];

/** |a| of a vector of three. */
export const norm = (a) => Math.sqrt(dot(a, a));

/** Float64Array(23), the packed curve of three control points in mm. */
export function packCurve(P0, P1, P2) {
  const a = minus(P1, P0);
  const b = [0, 1, 2].map((i) => P2[i] - 2 * P1[i] + P0[i]);
  const after = [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
  const normal = cross(a, b);
  const curve = new Float64Array(23);
  curve.set(P0, 0);
  curve.set(a, 3);
  curve.set(b, 6);
  curve.set([dot(b, b), dot(a, b), dot(a, a), dot(normal, normal)], 9);
  curve.set(a.map((x) => x / norm(a)), 14);
  curve.set(after.map((x) => x / norm(after)), 17);
  curve.set(P2, 20);
  curve[13] = arcLength(curve, 1);
  return curve;
}

/** |B'(t)|/2, mm. */
function halfSpeed(curve, t) {
  const bb = curve[9], ab = curve[10], aa = curve[11];
  if (bb > 1e-2 * aa) {
    const u = t + ab / bb;
    return Math.sqrt(bb * u * u + curve[12] / bb);
  }
  return Math.sqrt(Math.max(aa + t * (2 * ab + t * bb), 0));
}

/** Length of the curve from 0 to t, mm. */
export function arcLength(curve, t) {
  const bb = curve[9], ab = curve[10];
  if (bb <= 1e-2 * curve[11]) {
    let total = 0;
    for (const [x, weight] of RULE) {
      total += weight * (halfSpeed(curve, t * x) + halfSpeed(curve, t * (1 - x)));
    }
    return 2 * t * total;
  }
  const k = Math.sqrt(curve[12]) / bb, u0 = ab / bb, u1 = u0 + t;
  let total = u1 * Math.sqrt(u1 * u1 + k * k) - u0 * Math.sqrt(u0 * u0 + k * k);
  if (k > 0) total += k * k * (Math.asinh(u1 / k) - Math.asinh(u0 / k));
  return Math.sqrt(bb) * total;
}

/** t in [0, 1] whose arc length is s mm, by Newton kept inside a bracket. */
function parameterAtArcLength(curve, s) {
  let low = 0, high = 1, t = Math.min(Math.max(s / curve[13], 0), 1);
  for (let i = 0; i < 60; i++) {
    const excess = arcLength(curve, t) - s;
    if (excess < 0) low = t;
    else high = t;
    const step = excess / (2 * halfSpeed(curve, t));
    let next = t - step;
    if (!(low <= next && next <= high)) next = 0.5 * (low + high);
    if (Math.abs(next - t) <= 1e-15 || Math.abs(step) <= 1e-14) return next;
    t = next;
  }
  return t;
}

/** {point, tangent}, mm and unit, at the arc length s mm, on an end tangent outside the curve. */
export function placeAt(curve, s) {
  const point = [0, 0, 0], tangent = [0, 0, 0];
  if (s < 0 || s > curve[13]) {
    const [start, along, beyond] = s < 0 ? [0, 14, s] : [20, 17, s - curve[13]];
    for (let i = 0; i < 3; i++) {
      tangent[i] = curve[along + i];
      point[i] = curve[start + i] + beyond * tangent[i];
    }
    return { point, tangent };
  }
  const t = parameterAtArcLength(curve, s), speed = halfSpeed(curve, t);
  for (let i = 0; i < 3; i++) {
    tangent[i] = (curve[3 + i] + t * curve[6 + i]) / speed;
    point[i] = curve[i] + t * (2 * curve[3 + i] + t * curve[6 + i]);
  }
  return { point, tangent };
}

/** Root of c0 + c1 t + c2 t² + c3 t³, which increases from low to high through it. */
function root(c0, c1, c2, c3, low, high) {
  const fLow = c0 + low * (c1 + low * (c2 + low * c3));
  const fHigh = c0 + high * (c1 + high * (c2 + high * c3));
  let t = fHigh > fLow ? low - (fLow * (high - low)) / (fHigh - fLow) : low;
  for (let i = 0; i < 60; i++) {
    const f = c0 + t * (c1 + t * (c2 + t * c3));
    if (f < 0) low = t;
    else high = t;
    let next = t - f / (c1 + t * (2 * c2 + 3 * t * c3));
    if (!(low <= next && next <= high)) next = 0.5 * (low + high);
    if (Math.abs(next - t) <= 1e-9) return next;
    t = next;
  }
  return t;
}

function squareDistance(curve, t, x, y, z) {
  const dx = curve[0] - x + t * (2 * curve[3] + t * curve[6]);
  const dy = curve[1] - y + t * (2 * curve[4] + t * curve[7]);
  const dz = curve[2] - z + t * (2 * curve[5] + t * curve[8]);
  return dx * dx + dy * dy + dz * dz;
}

/** What ``closest`` found last: distance mm, t in [0, 1], signed mm beyond an end, or 0. */
export const nearest = { distance: 0, t: 0, beyond: 0 };

/** Nearest place of the continued curve to a point, left in ``nearest``; returns the distance, mm.

All local minima are compared. (B − x)·B'/2 is a cubic in t with b·b ≥ 0 before t³: it can rise
through zero only before the smaller and after the larger root of its derivative. */
export function closest(curve, x, y, z) {
  const px = curve[0] - x, py = curve[1] - y, pz = curve[2] - z;
  const c0 = px * curve[3] + py * curve[4] + pz * curve[5];
  const c1 = 2 * curve[11] + px * curve[6] + py * curve[7] + pz * curve[8];
  const c2 = 3 * curve[10], c3 = curve[9], f1 = c0 + c1 + c2 + c3;
  let best = Infinity, t = 0, beyond = 0;
  if (c0 > 0) {
    beyond = -(px * curve[14] + py * curve[15] + pz * curve[16]);
    best = px * px + py * py + pz * pz - beyond * beyond;
  }
  if (f1 < 0) {
    const qx = x - curve[20], qy = y - curve[21], qz = z - curve[22];
    const along = qx * curve[17] + qy * curve[18] + qz * curve[19];
    const square = qx * qx + qy * qy + qz * qz - along * along;
    if (square < best) [best, t, beyond] = [square, 1, along];
  }
  let first = 1, last = 1;
  const discriminant = c2 * c2 - 3 * c1 * c3;
  if (c3 > 0 && discriminant > 0) {
    const q = -(c2 + (c2 < 0 ? -1 : 1) * Math.sqrt(discriminant));
    const r1 = q / (3 * c3), r2 = c1 / q;
    first = Math.min(Math.max(Math.min(r1, r2), 0), 1);
    last = Math.min(Math.max(Math.max(r1, r2), 0), 1);
  }
  if (c0 <= 0 && c0 + first * (c1 + first * (c2 + first * c3)) >= 0) {
    const inside = root(c0, c1, c2, c3, 0, first);
    const square = squareDistance(curve, inside, x, y, z);
    if (square < best) [best, t, beyond] = [square, inside, 0];
  }
  if (f1 >= 0 && last < 1 && c0 + last * (c1 + last * (c2 + last * c3)) <= 0) {
    const inside = root(c0, c1, c2, c3, last, 1);
    const square = squareDistance(curve, inside, x, y, z);
    if (square < best) [best, t, beyond] = [square, inside, 0];
  }
  // Two roots of the derivative that rounding cannot tell apart hid the crossing.
  if (best === Infinity) t = root(c0, c1, c2, c3, 0, 1);
  if (beyond !== 0) {
    const end = t === 0 ? 14 : 17;
    x -= beyond * curve[end];
    y -= beyond * curve[end + 1];
    z -= beyond * curve[end + 2];
  }
  nearest.t = t;
  nearest.beyond = beyond;
  return (nearest.distance = Math.sqrt(squareDistance(curve, t, x, y, z)));
}

/** {distance, arcLength} mm of the nearest place to a point; beyond the ends along the tangents. */
export function closestPlace(curve, [x, y, z]) {
  const distance = closest(curve, x, y, z);
  return { distance, arcLength: arcLength(curve, nearest.t) + nearest.beyond };
}

/** t in [0, 1] where |B'| is least and the curvature largest. */
function slowest(curve) {
  return curve[9] > 0 ? Math.min(Math.max(-curve[10] / curve[9], 0), 1) : 0;
}

/** Largest curvature between P0 and P2, 1/mm. */
export function maxCurvature(curve) {
  const t = slowest(curve);
  const speed = norm([0, 1, 2].map((i) => curve[3 + i] + t * curve[6 + i]));
  return (0.5 * Math.sqrt(curve[12])) / speed ** 3;
}

/** Whether the curve stops and turns back, or its control points coincide. */
export function turnsBack(curve) {
  const t = slowest(curve);
  const velocity = (u) => norm([0, 1, 2].map((i) => curve[3 + i] + u * curve[6 + i]));
  return velocity(t) <= 1e-6 * (velocity(0) + velocity(1));
}
