// The lumen's wall as triangles: a tube about the centreline, joined to the sphere of the sac.
//
// Of each of the two the part inside the other is cut away. The cut lies on both surfaces, and the
// sphere takes over the tube's vertices there, so that nothing is open or overlaps. The neck's edge
// is sharp: its fillet takes 3/16 of its width off it, 0.04 mm, less than a wire as it is drawn.

import { closest, cross, nearest, placeAt } from "./bezier.js";

/** The wall of a tubular vessel of case.js's geometry:
 *
 * {vertices: Float32Array 3n mm, normals: Float32Array 3n (those of the tube at the neck),
 *  triangles: Uint32Array 3m (anticlockwise from outside), tubeTriangles: so many of them, the
 *  first, are of the tube, necks: [[[x, y, z], …] closed loops of the neck's edge],
 *  watertight: bool | null}
 *
 * `facets` around the tube; it goes on `beyond` mm after its ends. `closed`: as a solid for other
 * programs, with flat ends, and `watertight` says whether every edge has its two triangles. */
export function lumenMesh(case_, geometry, { facets = 30, beyond = 1, closed = false } = {}) {
  const wall = new Wall(geometry);
  const rings = wall.addTube(facets, beyond);
  if (closed) wall.closeEnds(rings, facets);
  const tubeTriangles = wall.triangles.count;
  if (geometry.sacCentre) wall.addSphere(closed ? 72 : 28, closed ? 112 : 44);
  const triangles = wall.triangles.values();
  return {
    vertices: wall.vertices.values(),
    normals: wall.normals.values(),
    triangles,
    tubeTriangles,
    necks: wall.loops.map((loop) => loop.map((vertex) => wall.point(vertex))),
    watertight: closed ? isWatertight(triangles) : null,
  };
}

/** Rows of three numbers, as many as come. */
class Rows {
  count = 0;

  constructor(Kind) {
    this.data = new Kind(3 * 16384);
  }

  push(a, b, c) {
    if (3 * this.count === this.data.length) {
      const { data } = this;
      this.data = new data.constructor(2 * data.length);
      this.data.set(data);
    }
    const start = 3 * this.count++;
    this.data[start] = a;
    this.data[start + 1] = b;
    this.data[start + 2] = c;
  }

  values() {
    return this.data.slice(0, 3 * this.count);
  }
}

class Wall {
  vertices = new Rows(Float32Array);
  normals = new Rows(Float32Array);
  triangles = new Rows(Uint32Array);
  loops = []; // of vertices, the neck's edge as the tube's triangles run along it

  constructor({ curve, length, vesselRadius, sacCentre, sacRadius }) {
    Object.assign(this, { curve, length, radius: vesselRadius, centre: sacCentre, sacRadius });
  }

  add(point, normal) {
    this.vertices.push(point[0], point[1], point[2]);
    this.normals.push(normal[0], normal[1], normal[2]);
    return this.vertices.count - 1;
  }

  point(vertex) {
    return [0, 1, 2].map((k) => this.vertices.data[3 * vertex + k]);
  }

  /** Distance of a point to the sphere of the sac, mm. */
  toSphere(point) {
    const { centre: c } = this;
    if (!c) return Infinity;
    const [x, y, z] = [point[0] - c[0], point[1] - c[1], point[2] - c[2]];
    return Math.sqrt(x * x + y * y + z * z) - this.sacRadius;
  }

  /** The tube outside of the sphere; the number of its rings. */
  addTube(facets, beyond) {
    const { radius } = this;
    const step = (4 * Math.PI * radius) / facets;
    const rings = Math.ceil((this.length + 2 * beyond) / step) + 1;
    const places = Array.from({ length: rings }, (_, i) => placeAt(this.curve, -beyond + (i / (rings - 1)) * (this.length + 2 * beyond)));
    // A quadratic curve is plane: its binormal is the same all along.
    const binormal = binormalOf(places[0].tangent, places[rings - 1].tangent);
    const turns = Array.from({ length: facets }, (_, k) => [Math.cos((2 * Math.PI * k) / facets), Math.sin((2 * Math.PI * k) / facets)]);
    const outside = new Float64Array(rings * facets);
    const [point, normal] = [[0, 0, 0], [0, 0, 0]];
    for (const place of places) {
      const n = cross(binormal, place.tangent);
      for (const [cos, sin] of turns) {
        for (let k = 0; k < 3; k++) {
          normal[k] = cos * n[k] + sin * binormal[k];
          point[k] = place.point[k] + radius * normal[k];
        }
        outside[this.add(point, normal)] = this.toSphere(point);
      }
    }
    const following = new Map();
    const cut = edgeCuts((i, j) => this.tubeCut(i, j, outside));
    const triangle = (a, b, c) =>
      clip(a, b, c, outside, cut, this.triangles, (from, to) => {
        following.set(from, to);
        return [from, to];
      });
    for (let i = 0; i + 1 < rings; i++) {
      for (let k = 0; k < facets; k++) {
        const [a, b] = [i * facets + k, i * facets + ((k + 1) % facets)];
        triangle(a, b, b + facets);
        triangle(a, b + facets, a + facets);
      }
    }
    this.endsCovered = [...outside.slice(0, facets), ...outside.slice(-facets)].some((d) => d < 0);
    this.loops = closedLoops(following);
    return rings;
  }

  /** New vertex where the tube between its vertices i and j meets the sphere. */
  tubeCut(i, j, outside) {
    const [p, q] = [this.point(i), this.point(j)];
    let found;
    root(outside[i], outside[j], (share) => {
      found = this.onTube([0, 1, 2].map((k) => p[k] + share * (q[k] - p[k])));
      return this.toSphere(found.point);
    });
    return this.add(found.point, found.normal);
  }

  /** {point, normal} of the tube beside a point. */
  onTube(point) {
    const distance = closest(this.curve, ...point);
    const { curve: c } = this;
    const { t, beyond } = nearest;
    const end = t === 0 ? 14 : 17;
    const foot = [0, 1, 2].map((k) => c[k] + t * (2 * c[3 + k] + t * c[6 + k]) + beyond * c[end + k]);
    const normal = point.map((v, k) => (v - foot[k]) / distance);
    return { point: foot.map((v, k) => v + this.radius * normal[k]), normal };
  }

  closeEnds(rings, facets) {
    [-1, 1].forEach((sense) => {
      const { point, tangent } = placeAt(this.curve, sense < 0 ? 0 : this.length);
      const middle = this.add(point, tangent.map((v) => sense * v));
      const first = sense < 0 ? 0 : (rings - 1) * facets;
      for (let k = 0; k < facets && !this.endsCovered; k++) {
        const [a, b] = [first + k, first + ((k + 1) % facets)];
        this.triangles.push(middle, sense < 0 ? b : a, sense < 0 ? a : b);
      }
    });
  }

  /** The sphere outside of the tube, its pole opposite to the neck. */
  addSphere(rows, columns) {
    const { centre, sacRadius } = this;
    const first = this.vertices.count;
    closest(this.curve, ...centre);
    const { normal: pole } = nearest.distance > 1e-9 ? this.onTube(centre) : { normal: [0, 1, 0] };
    const across = unit(cross(pole, leastAxis(pole)));
    const other = cross(pole, across);
    const outside = new Float64Array(first + rows * columns);
    const [point, normal] = [[0, 0, 0], [0, 0, 0]];
    const add = (angle, turn) => {
      const [a, b, c] = [Math.sin(angle) * Math.cos(turn), Math.sin(angle) * Math.sin(turn), Math.cos(angle)];
      for (let k = 0; k < 3; k++) {
        normal[k] = a * across[k] + b * other[k] + c * pole[k];
        point[k] = centre[k] + sacRadius * normal[k];
      }
      outside[this.add(point, normal)] = closest(this.curve, point[0], point[1], point[2]) - this.radius;
    };
    for (let row = 1; row < rows; row++) {
      for (let k = 0; k < columns; k++) add((Math.PI * row) / rows, (2 * Math.PI * k) / columns);
    }
    add(0, 0);
    add(Math.PI, 0);
    const top = first + (rows - 1) * columns;

    const place = new Map();
    this.loops.forEach((loop) => loop.forEach((vertex, index) => place.set(vertex, { loop, index })));
    const cut = edgeCuts((i, j) => this.sphereCut(i, j, outside));
    const chain = (from, to) => alongLoop(place, from, to);
    const triangle = (a, b, c) => clip(a, b, c, outside, cut, this.triangles, chain);
    for (let k = 0; k < columns; k++) {
      const right = (k + 1) % columns;
      triangle(top, first + k, first + right);
      for (let row = 0; row + 2 < rows; row++) {
        const [a, b] = [first + row * columns + k, first + row * columns + right];
        triangle(a, a + columns, b + columns);
        triangle(a, b + columns, b);
      }
      const last = first + (rows - 2) * columns;
      triangle(top + 1, last + right, last + k);
    }
  }

  /** The vertex of the neck nearest to where the sphere between i and j meets the tube. */
  sphereCut(i, j, outside) {
    const [p, q] = [this.point(i), this.point(j)];
    let found;
    root(outside[i], outside[j], (share) => {
      const way = unit([0, 1, 2].map((k) => p[k] + share * (q[k] - p[k]) - this.centre[k]));
      found = way.map((v, k) => this.centre[k] + this.sacRadius * v);
      return closest(this.curve, ...found) - this.radius;
    });
    let best = Infinity;
    let vertex = -1;
    for (const loop of this.loops) {
      for (const candidate of loop) {
        const [k, { data }] = [3 * candidate, this.vertices];
        const square = (data[k] - found[0]) ** 2 + (data[k + 1] - found[1]) ** 2 + (data[k + 2] - found[2]) ** 2;
        if (square < best) [best, vertex] = [square, candidate];
      }
    }
    // The tube's own triangles were too coarse to meet the sphere at all here.
    return vertex < 0 ? this.add(found, unit(found.map((v, k) => v - this.centre[k]))) : vertex;
  }
}

/** The part of a triangle outside, where `outside` ≥ 0, to `triangles`; `chain(from, to)` gives the
 * vertices along its cut. */
function clip(a, b, c, outside, cut, triangles, chain) {
  const count = (outside[a] < 0) + (outside[b] < 0) + (outside[c] < 0);
  if (count === 0) triangles.push(a, b, c);
  if (count === 0 || count === 3) return;
  // Turned so that the first corner is the one that differs from the others.
  while (outside[a] < 0 !== (count === 1)) [a, b, c] = [b, c, a];
  const rim = count === 2 ? chain(cut(a, b), cut(a, c)) : chain(cut(a, c), cut(a, b));
  const polygon = count === 2 ? [a, ...rim] : [b, c, ...rim];
  for (let k = 1; k + 1 < polygon.length; k++) triangles.push(polygon[0], polygon[k], polygon[k + 1]);
}

/** `make(i, j)` once for each edge. */
function edgeCuts(make) {
  const made = new Map();
  return (i, j) => {
    const key = i < j ? i * 2 ** 26 + j : j * 2 ** 26 + i;
    if (!made.has(key)) made.set(key, i < j ? make(i, j) : make(j, i));
    return made.get(key);
  };
}

/** The vertices of the neck from one to another, the shorter way. */
function alongLoop(place, from, to) {
  const [start, end] = [place.get(from), place.get(to)];
  if (from === to) return [from];
  if (!start || start.loop !== end?.loop) return [from, to];
  const { loop } = start;
  const forward = (end.index - start.index + loop.length) % loop.length;
  const [sense, steps] = forward <= loop.length / 2 ? [1, forward] : [-1, loop.length - forward];
  return Array.from({ length: steps + 1 }, (_, i) => loop[(start.index + sense * i + loop.length) % loop.length]);
}

/** Loops of a map from each vertex to the following one; what does not come back is left out. */
function closedLoops(following) {
  const loops = [];
  const seen = new Set();
  for (const start of following.keys()) {
    const loop = [];
    for (let v = start; v !== undefined && !seen.has(v); v = following.get(v)) {
      seen.add(v);
      loop.push(v);
    }
    if (loop.length > 2 && following.get(loop.at(-1)) === start) loops.push(loop);
  }
  return loops;
}

/** Walks to the share of a way, 0…1, where `at(share)`, f0 and f1 at its ends, is zero (Illinois). */
function root(f0, f1, at) {
  let [low, high] = [0, 1];
  for (let i = 0; i < 8; i++) {
    const share = (low * f1 - high * f0) / (f1 - f0);
    const f = at(share);
    if (Math.abs(f) < 1e-7) return;
    if (f < 0 === f1 < 0) {
      f0 *= 0.5;
    } else {
      [low, f0] = [high, f1];
    }
    [high, f1] = [share, f];
  }
}

/** Whether every directed edge is there once, and its opposite too. */
function isWatertight(triangles) {
  const edges = new Set();
  for (let t = 0; t < triangles.length; t += 3) {
    for (let k = 0; k < 3; k++) edges.add(triangles[t + k] * 2 ** 26 + triangles[t + ((k + 1) % 3)]);
  }
  if (edges.size !== triangles.length) return false;
  for (const edge of edges) {
    if (!edges.has((edge % 2 ** 26) * 2 ** 26 + Math.floor(edge / 2 ** 26))) return false;
  }
  return true;
}

const unit = (a) => a.map((v) => v / Math.hypot(...a));
const leastAxis = (a) => {
  const sizes = a.map(Math.abs);
  return [0, 1, 2].map((i) => (i === sizes.indexOf(Math.min(...sizes)) ? 1 : 0));
};

/** Unit vector square to the curve's plane, or to the line, from its two end tangents. */
function binormalOf(first, last) {
  const across = cross(first, last);
  return unit(Math.hypot(...across) > 1e-9 ? across : cross(first, leastAxis(first)));
}
