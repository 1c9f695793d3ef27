"""Gaussian process regression: one independent process for each output (paper, section 2.3.2).

A process has the Matérn 5/2 covariance (errata row 21) with one length scale l for all inputs or
one for each,

    k(x, x') = σ² (1 + √5 r + 5 r²/3) exp(−√5 r),    r² = Σ ((x_i − x'_i)/l_i)²,

and noise s² on what was observed; all are found by maximum likelihood on standardised outputs.
Given observations y at X the outputs at x are normal with (Rasmussen & Williams
2006, section 2.2)

    mean k(x, X) (K + s² I)⁻¹ y,    variance k(x, x) − k(x, X) (K + s² I)⁻¹ k(X, x) + s².

Where a mirror image of the problem is known, x → M x, an output that keeps its sign under it
(parity +1) or changes it (−1) has the covariance k(x, x') ± k(x, M x'), and every observation
counts for its image too.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cho_solve, cholesky
from scipy.linalg.lapack import dtrtri, dtrttp
from scipy.optimize import minimize
from scipy.spatial.distance import cdist

from braidcast.errors import InputError

Array = NDArray[np.float64]

Progress = Callable[[str, float], None]
"""Told the stage of a long computation and its share that is done."""

LENGTH_BOUNDS = (0.05, 1e3)
"""Of length scales, in standard deviations of the inputs."""

NOISE_BOUNDS = (1e-7, 1.0)
"""Of the noise's variance, in variances of the output."""

JITTER = 1e-10
"""Added to the diagonal beside the noise, so that rounding cannot make it indefinite."""


@dataclass(frozen=True)
class GaussianProcesses:
    """L processes over the same n observed inputs.

    ``inputs`` (n, p); ``outputs`` (n, L); ``length_scales`` (L, p), in the inputs' units;
    ``signal``, ``noise`` (L,): variances, in the outputs' units squared; ``offset`` (L,): the mean.
    ``mirror`` (p,): what a mirror image does to the inputs, a factor 1 or -1 each; ``parity``
    (L,): 1 or -1, 0 for outputs of which no mirror image is known.
    """

    inputs: Array
    outputs: Array
    length_scales: Array
    signal: Array
    noise: Array
    offset: Array
    mirror: Array
    parity: Array

    def predict(self, points: Array) -> Array:
        """Means (m, L) at points (m, p)."""
        return self._mean(self._covariance(np.atleast_2d(points)))

    def predict_with_std(self, points: Array) -> tuple[Array, Array]:
        """Means and standard deviations (m, L) at points (m, p), noise included."""
        points = np.atleast_2d(points)
        covariance = self._covariance(points)
        mean = self._mean(covariance)
        prior = self.signal + self.noise
        if self.parity.any():
            prior = prior + self.signal * self.parity * self._mirrored(points)
        variance = prior - _explained(self._inverses, covariance)
        return mean, np.sqrt(np.maximum(variance, 0.0))

    def leave_one_out(self) -> Array:
        """Outputs (n, L) less what all other observations say of them.

        [K⁻¹ y]_i / [K⁻¹]_ii with K the covariance of the observations (Rasmussen & Williams 2006,
        equation 5.12); the hyper-parameters stay.
        """
        inverses = (dtrtri(factor, lower=True)[0] for factor in self._factors)
        diagonals = [(np.tril(inverse) ** 2).sum(axis=0) for inverse in inverses]
        return self.weights / np.stack(diagonals, axis=1)

    def _mean(self, covariance: Array) -> Array:
        return self.offset + np.einsum("mnl,nl->ml", covariance, self.weights)

    @cached_property
    def _factors(self) -> list[Array]:
        """Lower Cholesky factors (n, n) of the observations' covariance."""
        factors = []
        for output, parity in enumerate(self.parity):
            points = self.inputs / self.length_scales[output]
            own, _ = _correlation(points, self.mirror, parity)
            own *= self.signal[output]
            own[np.diag_indices_from(own)] += self.noise[output] + JITTER * self.signal[output]
            factors.append(cholesky(own, lower=True, overwrite_a=True, check_finite=False))
        return factors

    @cached_property
    def _inverses(self) -> Array:
        """Inverses of the factors, their lower halves column after column, (L, n (n + 1)/2)."""
        inverses = (dtrtri(factor, lower=True)[0] for factor in self._factors)
        return np.stack([dtrttp(inverse, uplo="L")[0] for inverse in inverses])

    @cached_property
    def weights(self) -> Array:
        """(K + s² I)⁻¹ y, (n, L)."""
        centred = self.outputs - self.offset
        solved = [cho_solve((f, True), centred[:, i]) for i, f in enumerate(self._factors)]
        return np.stack(solved, axis=1)

    def _covariance(self, points: Array) -> Array:
        """Covariance (m, n, L) of points (m, p) with the observed inputs."""
        own = _matern(points[:, None] - self.inputs, self.length_scales)
        if self.parity.any():
            image = _matern(points[:, None] * self.mirror - self.inputs, self.length_scales)
            own += self.parity * image
        return self.signal * own

    def _mirrored(self, points: Array) -> Array:
        """Correlation (m, L) of points (m, p) with their own images."""
        return _matern(points * (1.0 - self.mirror), self.length_scales)


def fit_processes(
    inputs: Array,
    outputs: Array,
    *,
    isotropic: bool = False,
    mirror: Array | None = None,
    parity: Array | None = None,
    progress: Progress | None = None,
) -> GaussianProcesses:
    """Processes for outputs (n, L) over inputs (n, p), hyper-parameters by maximum likelihood.

    Without ``mirror`` (p,) and ``parity`` (L,) no mirror image is used. ``InputError`` if there
    are fewer than two observations, if their numbers differ, or if not all are finite.
    """
    if len(inputs) != len(outputs) or len(inputs) < 2:
        raise InputError(
            f"{len(inputs)} inputs and {len(outputs)} outputs: there must be as many of both, "
            "at least 2"
        )
    if not (np.isfinite(inputs).all() and np.isfinite(outputs).all()):
        raise InputError("inputs and outputs must be finite numbers")
    count, width = outputs.shape[1], 1 if isotropic else inputs.shape[1]
    mirror = np.ones(inputs.shape[1]) if mirror is None else mirror
    parity = np.zeros(count) if parity is None else parity
    # what changes its sign in the mirror has the mean 0
    offset = np.where(parity < 0, 0.0, outputs.mean(axis=0))
    size = np.sqrt(((outputs - offset) ** 2).mean(axis=0))
    size[size == 0.0] = 1.0
    # from longer lengths the search may end where all is noise
    start = np.log([1.0, *[1.5] * width, 1e-2])
    bounds = np.log([(1e-3, 1e3), *[LENGTH_BOUNDS] * width, NOISE_BOUNDS])
    found = np.empty((count, 2 + width))
    for output in range(count):
        observed = (outputs[:, output] - offset[output]) / size[output]
        data = (inputs, observed, mirror, parity[output])
        best = minimize(_misfit, start, data, "L-BFGS-B", jac=True, bounds=bounds)
        found[output] = np.exp(best.x)
        if progress:
            progress("train", (output + 1) / count)
    scales = np.broadcast_to(found[:, 1:-1], (count, inputs.shape[1])).copy()
    signal, noise = (size[:, None] ** 2 * found[:, [0, -1]]).T
    return GaussianProcesses(inputs, outputs, scales, signal, noise, offset, mirror, parity)


def _correlation(
    points: Array, mirror: Array, parity: float
) -> tuple[Array, list[tuple[Array, Array]]]:
    """Correlation (n, n) of points (n, p), in length scales, and of what it changes with them.

    The latter, (1 + √5 r) exp(−√5 r), for the points themselves and, if there are any, for their
    images; each with the factors (p,) of the view.
    """
    views = [(1.0, np.ones_like(mirror))] + ([(parity, mirror)] if parity else [])
    correlation, slopes = np.zeros((len(points), len(points))), []
    for sign, view in views:
        r = np.sqrt(5.0 * cdist(points, points * view, "sqeuclidean"))
        decay = sign * np.exp(-r)
        correlation += (1.0 + r + r * r / 3.0) * decay
        slopes.append(((1.0 + r) * decay, view))
    return correlation, slopes


def _misfit(
    theta: Array, inputs: Array, observed: Array, mirror: Array, parity: float
) -> tuple[float, Array]:
    """Negative logarithm of the likelihood of ``observed`` (n,), and its gradient.

    ``theta`` are the logarithms of signal, length scales, noise. With a = K⁻¹ y,

        -log p = y·a/2 + log det K / 2 + const,    gradient = tr((K⁻¹ − a aᵀ) ∂K)/2.
    """
    signal, noise = np.exp(theta[0]), np.exp(theta[-1])
    points = inputs / np.exp(theta[1:-1])
    correlation, slopes = _correlation(points, mirror, parity)
    covariance = signal * correlation
    covariance[np.diag_indices_from(covariance)] += noise + JITTER * signal
    try:
        factor = cholesky(covariance, lower=True, check_finite=False)
    except LinAlgError:
        return np.inf, np.zeros_like(theta)
    weights = cho_solve((factor, True), observed)
    left = cho_solve((factor, True), np.eye(len(points)), check_finite=False)
    left -= np.outer(weights, weights)
    gradient = np.empty_like(theta)
    gradient[0] = 0.5 * signal * ((left * correlation).sum() + JITTER * np.trace(left))
    gradient[-1] = 0.5 * noise * np.trace(left)
    along = np.zeros(inputs.shape[1])
    for slope, view in slopes:
        # sum of left_ij slope_ij (z_i − M z_j)² without a table for each input
        pull = left * slope
        crossed = (points * (pull @ points)).sum(axis=0)
        along += 2.0 * (pull.sum(axis=1) @ points**2 - view * crossed)
    along *= 0.5 * signal * 5.0 / 3.0
    gradient[1:-1] = along if len(theta) > 3 else along.sum()
    misfit = 0.5 * observed @ weights + np.log(np.diag(factor)).sum()
    return misfit + 0.5 * len(observed) * np.log(2.0 * np.pi), gradient


@njit(cache=True, error_model="numpy")
def _explained(inverses: Array, covariance: Array) -> Array:
    """|F⁻¹ k|² (m, L) of packed inverse factors and covariances (m, n, L): memory is the limit."""
    m, n, count = covariance.shape
    explained = np.empty((m, count))
    half = np.empty(n)
    for point in range(m):
        for output in range(count):
            half[:] = 0.0
            begin = 0
            for j in range(n):
                pull = covariance[point, j, output]
                column, rest = inverses[output, begin : begin + n - j], half[j:]
                for i in range(n - j):
                    rest[i] += column[i] * pull
                begin += n - j
            explained[point, output] = (half * half).sum()
    return explained


def _matern(steps: Array, length_scales: Array) -> Array:
    """Correlations (..., L) over differences (..., p)."""
    r = np.sqrt(5.0 * (steps * steps) @ (1.0 / length_scales**2).T)
    return (1.0 + r + r * r / 3.0) * np.exp(-r)
