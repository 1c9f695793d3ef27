// Gaussian process regression with L independent outputs; surrogate/gaussian_process.py.
//
//   k(x, x') = σ² (1 + √5 r + 5 r²/3) exp(−√5 r),    r² = Σ ((x_i − x'_i)/l_i)²,
//
// and beside it parity · k(x, M x') for the mirror image. Means need no more than the weights;
// standard deviations need the inverse Cholesky factors, which two workers compute once.

import { inverseFactor } from "./std_worker.js";

/** Added to the diagonal beside the noise, in variances of the signal. */
const JITTER = 1e-10;

const WORKERS = 2;

const matern = (square) => {
  const r = Math.sqrt(5 * square);
  return (1 + r + (r * r) / 3) * Math.exp(-r);
};

export class GaussianProcesses {
  /** ``arrays`` as model_arrays.py packs them: inputs (n p), weights (L n), length_scales (L p),
  signal, noise, offset, parity (L), mirror (p). */
  constructor(arrays) {
    this.arrays = arrays;
    this.outputs = arrays.signal.length;
    this.width = arrays.mirror.length;
    this.count = arrays.inputs.length / this.width;
    this.mean = new Float64Array(this.outputs);
    this.std = new Float64Array(this.outputs);
    this.inverses = null;
    this.covariance = new Float64Array(this.count);
    this.shares = arrays.length_scales.map((l) => 1 / (l * l));
    this.squares = new Float64Array(2 * this.count * this.width);
  }

  /** Mean of each output at a point [p], left in ``mean``; in ``std`` its standard deviation, noise
  included, once the inverse factors are there. */
  predict(point) {
    const { signal, noise, offset, parity, weights, mirror } = this.arrays;
    this.#step(point);
    for (let output = 0; output < this.outputs; output++) {
      this.#covary(output);
      let mean = 0;
      for (let i = 0, w = output * this.count; i < this.count; i++) {
        mean += this.covariance[i] * weights[w + i];
      }
      this.mean[output] = offset[output] + mean;
      if (!this.inverses) continue;
      let own = 0;
      for (let k = 0; k < this.width; k++) {
        own += (point[k] * (1 - mirror[k])) ** 2 * this.shares[output * this.width + k];
      }
      const prior = signal[output] * (1 + parity[output] * matern(own)) + noise[output];
      const variance = prior - explained(this.inverses[output], this.covariance);
      this.std[output] = Math.sqrt(Math.max(variance, 0));
    }
  }

  /** Squared differences of a point, and of its image, from each of the inputs. */
  #step(point) {
    const { inputs, mirror } = this.arrays, { squares, width } = this;
    for (let i = 0; i < inputs.length; i++) {
      const k = i % width, own = point[k] - inputs[i], image = point[k] * mirror[k] - inputs[i];
      squares[i] = own * own;
      squares[inputs.length + i] = image * image;
    }
  }

  /** Covariance of the point with each of the inputs, for one output. */
  #covary(output) {
    const { squares, shares, covariance, width, count } = this;
    const { signal, parity } = this.arrays, first = output * width, image = count * width;
    for (let i = 0, place = 0; i < count; i++) {
      let own = 0, other = 0;
      for (let k = 0; k < width; k++, place++) {
        own += squares[place] * shares[first + k];
        other += squares[image + place] * shares[first + k];
      }
      covariance[i] = signal[output] * (matern(own) + parity[output] * matern(other));
    }
  }

  /** Index of the nearest input to a point [p], and how far it is: {index, distance}. */
  nearest(point) {
    const { inputs } = this.arrays;
    let index = 0, least = Infinity;
    for (let i = 0, place = 0; i < this.count; i++) {
      let square = 0;
      for (let k = 0; k < this.width; k++, place++) square += (inputs[place] - point[k]) ** 2;
      if (square < least) [index, least] = [i, square];
    }
    return { index, distance: Math.sqrt(least) };
  }

  /** Compute the inverse factors in workers; ``progress`` is told the share that is done. */
  async prepare(progress) {
    const inverses = new Array(this.outputs);
    const source = `const inverseFactor = ${inverseFactor};
      onmessage = ({ data }) => {
        const inverse = inverseFactor(data);
        postMessage(inverse, [inverse.buffer]);
      };`;
    const address = URL.createObjectURL(new Blob([source], { type: "text/javascript" }));
    let next = 0, done = 0;
    const work = () => new Promise((resolve, reject) => {
      const worker = new Worker(address);
      const finish = (settle, value) => {
        worker.terminate();
        settle(value);
      };
      let output;
      const take = () => {
        if (next === this.outputs) return finish(resolve);
        output = next++;
        worker.postMessage(this.#problem(output));
      };
      worker.onmessage = ({ data }) => {
        inverses[output] = data;
        progress?.(++done / this.outputs);
        take();
      };
      worker.onerror = (event) => finish(reject, new Error(event.message || "a worker failed"));
      take();
    });
    try {
      await Promise.all(Array.from({ length: WORKERS }, work));
    } finally {
      URL.revokeObjectURL(address);
    }
    this.inverses = inverses;
  }

  /** What ``inverseFactor`` needs for one output. */
  #problem(output) {
    const { inputs, length_scales, mirror, parity, signal, noise } = this.arrays, { width } = this;
    return {
      points: inputs.map((x, i) => x / length_scales[output * width + (i % width)]),
      mirror,
      parity: parity[output],
      signal: signal[output],
      noise: noise[output] + JITTER * signal[output],
    };
  }
}

/** |F⁻¹ k|² of a packed inverse factor and a covariance (n): memory is the limit. */
function explained(inverse, covariance) {
  const n = covariance.length;
  let total = 0, first = 0, i = 0;
  // Four rows at a time, so that sums need not wait for each other.
  for (; i + 3 < n; i += 4) {
    const second = first + i + 1, third = second + i + 2, fourth = third + i + 3;
    let a = 0, b = 0, c = 0, d = 0;
    for (let j = 0; j <= i; j++) {
      const k = covariance[j];
      a += inverse[first + j] * k;
      b += inverse[second + j] * k;
      c += inverse[third + j] * k;
      d += inverse[fourth + j] * k;
    }
    const k = covariance[i + 1], l = covariance[i + 2], m = covariance[i + 3];
    b += inverse[second + i + 1] * k;
    c += inverse[third + i + 1] * k + inverse[third + i + 2] * l;
    d += inverse[fourth + i + 1] * k + inverse[fourth + i + 2] * l + inverse[fourth + i + 3] * m;
    total += a * a + b * b + c * c + d * d;
    first = fourth + i + 4;
  }
  for (; i < n; i++) {
    let a = 0;
    for (let j = 0; j <= i; j++) a += inverse[first + j] * covariance[j];
    total += a * a;
    first += i + 1;
  }
  return total;
}
