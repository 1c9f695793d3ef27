// The inverse Cholesky factor of one process's covariance, for a worker of its own.
//
// The worker's source is this function's text (it may use nothing from outside), so that the page
// needs no second file and works from a disk.

/** F⁻¹ of K + s² I = F Fᵀ, packed row after row: Float64Array (n (n + 1)/2).

``points`` (n p): the observed inputs in length scales; ``signal``, ``noise`` (with its jitter):
variances; ``mirror`` (p) and ``parity`` as in gaussian_process.py. */
export function inverseFactor({ points, mirror, parity, signal, noise }) {
  const p = mirror.length, n = points.length / p;
  const packed = new Float64Array((n * (n + 1)) / 2), row = new Float64Array(n);

  const correlation = (i, j, view) => {
    let square = 0;
    for (let k = 0; k < p; k++) {
      const step = points[i * p + k] - points[j * p + k] * (view ? mirror[k] : 1);
      square += step * step;
    }
    const r = Math.sqrt(5 * square);
    return (1 + r + (r * r) / 3) * Math.exp(-r);
  };
  for (let i = 0, place = 0; i < n; i++) {
    for (let j = 0; j <= i; j++) {
      const image = parity ? parity * correlation(i, j, true) : 0;
      packed[place++] = signal * (correlation(i, j, false) + image) + (i === j ? noise : 0);
    }
  }

  // Cholesky by rows, and the rows of the inverse, each from those before it.
  for (let i = 0; i < n; i++) {
    const begin = (i * (i + 1)) / 2;
    for (let j = 0; j <= i; j++) {
      const other = (j * (j + 1)) / 2;
      let a = 0, b = 0, k = 0;
      for (; k + 1 < j; k += 2) {
        a += packed[begin + k] * packed[other + k];
        b += packed[begin + k + 1] * packed[other + k + 1];
      }
      if (k < j) a += packed[begin + k] * packed[other + k];
      const rest = packed[begin + j] - (a + b);
      packed[begin + j] = i === j ? Math.sqrt(rest) : rest / packed[other + j];
    }
  }
  for (let i = 0; i < n; i++) {
    const begin = (i * (i + 1)) / 2, diagonal = 1 / packed[begin + i];
    row.fill(0, 0, i);
    for (let k = 0, other = 0; k < i; k++) {
      const share = packed[begin + k];
      for (let j = 0; j <= k; j++) row[j] += share * packed[other++];
    }
    for (let j = 0; j < i; j++) packed[begin + j] = -diagonal * row[j];
    packed[begin + i] = diagonal;
  }
  return packed;
}
