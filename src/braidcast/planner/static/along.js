/** Where things are along the centreline: the neck's edges, the ends of the braid; all in mm. */

import { dot } from "./bezier.js";

const POINTS = 400;

/** A centreline as closely spaced points with their arc lengths. */
export class Along {
  /** `points`: [[x, y, z], ...], from proximal to distal. */
  constructor(points) {
    this.points = points;
    this.lengths = [0];
    for (let i = 1; i < points.length; i++) {
      this.lengths.push(this.lengths[i - 1] + Math.hypot(...points[i].map((x, k) => x - points[i - 1][k])));
    }
    this.length = this.lengths.at(-1);
  }

  /** Of the quadratic Bézier curve P0, P1, P2. */
  static bezier({ P0, P1, P2 }) {
    const at = (t) => [0, 1, 2].map((k) => (1 - t) ** 2 * P0[k] + 2 * t * (1 - t) * P1[k] + t * t * P2[k]);
    return new Along(Array.from({ length: POINTS + 1 }, (_, i) => at(i / POINTS)));
  }

  /** The point at an arc length. */
  at(arc) {
    const i = Math.max(1, Math.min(this.points.length - 1, this.lengths.findIndex((s) => s >= arc)));
    const share = (arc - this.lengths[i - 1]) / (this.lengths[i] - this.lengths[i - 1]);
    return this.points[i].map((x, k) => this.points[i - 1][k] + share * (x - this.points[i - 1][k]));
  }

  /** Arc length of the place nearest to a point. */
  closest(point) {
    let [best, arc] = [Infinity, 0];
    for (let i = 1; i < this.points.length; i++) {
      const [a, b] = [this.points[i - 1], this.points[i]];
      const [along, away] = [b.map((x, k) => x - a[k]), point.map((x, k) => x - a[k])];
      const square = dot(along, along);
      const share = Math.max(0, Math.min(1, dot(along, away) / square));
      const distance = Math.hypot(...away.map((x, k) => x - share * along[k]));
      if (distance < best) [best, arc] = [distance, this.lengths[i - 1] + share * Math.sqrt(square)];
    }
    return arc;
  }

  /** From and to, arc lengths, between which the sac's sphere opens the tube's wall; or null. */
  neck(tubeRadius, sacCentre, sacRadius) {
    const open = this.points.map((point, i) => {
      const [a, b] = [this.points[Math.max(0, i - 1)], this.points[Math.min(this.points.length - 1, i + 1)]];
      const tangent = b.map((x, k) => x - a[k]);
      const away = sacCentre.map((x, k) => x - point[k]);
      const along = dot(away, tangent) / Math.hypot(...tangent);
      const across = Math.sqrt(Math.max(0, dot(away, away) - along * along));
      return sacRadius - Math.hypot(along, across - tubeRadius); // of the ring's place nearest to the sac
    });
    const first = open.findIndex((depth) => depth > 0);
    const last = open.findLastIndex((depth) => depth > 0);
    if (first <= 0 || last >= open.length - 1) return null;
    const edge = (i, j) => this.lengths[i] + (open[i] / (open[i] - open[j])) * (this.lengths[j] - this.lengths[i]);
    return [edge(first - 1, first), edge(last + 1, last)];
  }
}
