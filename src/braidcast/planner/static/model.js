// The surrogate in the browser, with the numbers of surrogate/model.py.

import { braidLength, nodeCount } from "./braid.js";
import { complaint, fields, geometry, otherDevice } from "./case.js";
import { GaussianProcesses } from "./gaussian_processes.js";
import { general } from "./number_text.js";
import { PlacedBraid } from "./placed_braid.js";
import { predictors } from "./predictors.js";
import { wireDistance } from "./vessel.js";

const MAGIC = "BRDCAST1", UNIT = 8;

const ROUNDING = 1e-9;

const PURE = ["aneurysm_protrusion", "site_eta", "wall_friction"];

/** {header, arrays: {name: Float64Array}} of a container that model_arrays.py packed. */
export function unpack(buffer) {
  const text = new TextDecoder();
  if (text.decode(new Uint8Array(buffer, 0, Math.min(UNIT, buffer.byteLength))) !== MAGIC) {
    throw new Error("the data from the server are not of this planner, reload the page");
  }
  const begin = UNIT + 4, length = new DataView(buffer).getUint32(UNIT, true);
  const header = JSON.parse(text.decode(new Uint8Array(buffer, begin, length)));
  let place = Math.ceil((begin + length) / UNIT) * UNIT;
  const arrays = {};
  for (const { name, shape } of header.arrays) {
    arrays[name] = new Float64Array(buffer, place, shape.reduce((a, b) => a * b, 1));
    place += arrays[name].byteLength;
  }
  return { header, arrays };
}

/** " mm" or "", as the field of that name is a length or a pure number. */
export const unit = (name) => (PURE.includes(name) ? "" : " mm");

export class Model {
  /** From the ArrayBuffer that ``model_bytes`` wrote. */
  constructor(buffer) {
    const { header, arrays } = unpack(buffer);
    this.header = header;
    this.device = header.device;
    this.limits = header.limits;
    this.threshold = header.threshold;
    this.name = header.name;
    /** Resolves when ``predict`` gives standard deviations; null until ``prepareStd`` is called. */
    this.stdReady = null;
    this.#arrays = arrays;
    this.#processes = new GaussianProcesses(arrays);
    this.#placed = new PlacedBraid(this.device);
  }

  #arrays;
  #processes;
  #placed;

  /** Compute what standard deviations need, once; ``progress`` is told the share that is done. */
  prepareStd(progress) {
    return (this.stdReady ??= this.#processes.prepare(progress));
  }

  /** Why the model cannot answer a case, as a sentence, or null. */
  complaint(case_) {
    if (!case_.aneurysm) return "aneurysm is missing; the surrogate needs one, with a diameter";
    const other = otherDevice(case_, this.device, this.header.catalogue);
    return other ?? complaint(case_, this.device);
  }

  /** Probability that the deployment succeeds; throws the ``complaint``. */
  successProbability(case_) {
    const g = this.#geometry(case_);
    return this.#success(predictors(g, this.#placed.place(g, true)).ends);
  }

  /** The deployed stent, {positions (3 N) mm, std (3 N) mm and stdNorm (N) mm or null, gaps (N)
  mm, successProbability, success, deployedLength mm, foreshorteningPercent, inRange, outOfRange
  [phrases], nearestCase, nearestDistance}; throws the ``complaint``. */
  predict(case_) {
    const g = this.#geometry(case_);
    const { site, ends } = predictors(g, this.#placed.place(g));
    const { predictor_offset: offset, predictor_scale: scale, numbers } = this.#arrays;
    const point = site.map((x, i) => (x - offset[i]) / scale[i]);
    this.#processes.predict(point);
    const { positions, std, stdNorm } = this.#nodes();
    const successProbability = this.#success(ends);
    const deployedLength = braidLength(this.device, positions);
    const outOfRange = this.#outside(fields(case_, this.device, g));
    const nearest = this.#processes.nearest(point);
    return {
      positions,
      std,
      stdNorm,
      gaps: wireDistance(g, this.device.wire_radius, positions),
      successProbability,
      success: successProbability >= this.threshold,
      deployedLength,
      foreshorteningPercent: 100 * (1 - deployedLength / g.crimpedLength),
      inRange: outOfRange.length === 0,
      outOfRange,
      nearestCase: numbers[nearest.index],
      nearestDistance: nearest.distance,
    };
  }

  #geometry(case_) {
    const reason = this.complaint(case_);
    if (reason) throw new Error(reason);
    return geometry(case_, this.device);
  }

  #success(ends) {
    const { ends_offset: offset, ends_scale: scale, ends_coefficients: factors } = this.#arrays;
    let success = 1;
    for (const end of ends) {
      let sum = this.header.ends_intercept;
      end.forEach((x, i) => (sum += ((x - offset[i]) / scale[i]) * factors[i]));
      success *= 1 / (1 + Math.exp(sum));
    }
    return success;
  }

  /** A phrase for each number of a case that lies outside what was trained. */
  #outside(values) {
    const phrases = [];
    for (const [name, value] of Object.entries(values)) {
      const [low, high] = this.limits[name];
      const slack = ROUNDING * Math.max(1, Math.abs(low), Math.abs(high));
      if (low - slack <= value && value <= high + slack) continue;
      const ends = `from ${general(low)} to ${general(high)}`;
      const trained = low === high ? `at ${general(low)}` : ends;
      phrases.push(`${name} = ${general(value, 4)}${unit(name)}, trained ${trained}${unit(name)}`);
    }
    return phrases;
  }

  /** Nodes and their standard deviations from the coefficients of the processes.

  At each node the departure is mean + Σ c_l v_l and its covariance Σ var c_l v_l v_lᵀ + what the
  modes leave out, both in the axes A of the node's ring: x = placed + A d, var x = diag A C Aᵀ. */
  #nodes() {
    const { mean, modes, left_out: left } = this.#arrays, rings = this.device.segments + 1;
    const { mean: c, std: s, inverses, outputs } = this.#processes, N = nodeCount(this.device);
    const { positions: placed, axes: A } = this.#placed, factor = this.header.interval_factor;
    const positions = new Float64Array(3 * N);
    const std = inverses && new Float64Array(3 * N), stdNorm = inverses && new Float64Array(N);
    for (let node = 0, m = 0; node < N; node++) {
      const i = 3 * node, axes = 9 * (node % rings);
      let u = mean[i], v = mean[i + 1], w = mean[i + 2];
      let uu = left[i], vv = left[i + 1], ww = left[i + 2], uv = 0, uw = 0, vw = 0;
      for (let l = 0; l < outputs; l++, m += 3) {
        const a = modes[m], b = modes[m + 1], d = modes[m + 2], size = s[l] * s[l];
        u += c[l] * a;
        v += c[l] * b;
        w += c[l] * d;
        uu += size * a * a;
        vv += size * b * b;
        ww += size * d * d;
        uv += size * a * b;
        uw += size * a * d;
        vw += size * b * d;
      }
      let total = 0;
      for (let k = 0; k < 3; k++) {
        const x = A[axes + 3 * k], y = A[axes + 3 * k + 1], z = A[axes + 3 * k + 2];
        positions[i + k] = placed[i + k] + x * u + y * v + z * w;
        if (!std) continue;
        const variance = x * x * uu + y * y * vv + z * z * ww
          + 2 * (x * y * uv + x * z * uw + y * z * vw);
        std[i + k] = factor * Math.sqrt(Math.max(variance, 0));
        total += std[i + k] * std[i + k];
      }
      if (std) stdNorm[node] = Math.sqrt(total);
    }
    return { positions, std, stdNorm };
  }
}
