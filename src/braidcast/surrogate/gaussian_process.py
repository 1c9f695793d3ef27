"""Gaussian process regression: one independent process for each output (paper, section 2.3.2).

A process has the Matérn 5/2 covariance (errata row 21) with one length scale l for all inputs or
one for each,

    k(x, x') = σ² (1 + √5 r + 5 r²/3) exp(−√5 r),    r² = Σ ((x_i − x'_i)/l_i)²,

and noise s² on what was observed; all are found by maximum likelihood on standardised outputs
(scikit-learn). Given observations y at X the outputs at x are normal with (Rasmussen & Williams
2006, section 2.2)

    mean k(x, X) (K + s² I)⁻¹ y,    variance k(x, x) − k(x, X) (K + s² I)⁻¹ k(X, x) + s².

Where a mirror image of the problem is known, x → M x, an output that keeps its sign under it
(parity +1) or changes it (−1) has the covariance k(x, x') ± k(x, M x'), and every observation
counts for its image too.
"""

import warnings
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve, cholesky, solve_triangular
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import ConstantKernel, Kernel, Matern, WhiteKernel

from braidcast.errors import InputError

Array = NDArray[np.float64]

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
        variance = np.empty_like(mean)
        for output, factor in enumerate(self._factors):
            half = solve_triangular(factor, covariance[:, :, output].T, lower=True)
            variance[:, output] = prior[..., output] - (half * half).sum(axis=0)
        return mean, np.sqrt(np.maximum(variance, 0.0))

    def _mean(self, covariance: Array) -> Array:
        return self.offset + np.einsum("mnl,nl->ml", covariance, self._weights)

    @cached_property
    def _factors(self) -> list[Array]:
        """Lower Cholesky factors (n, n) of the observations' covariance."""
        covariance = self._covariance(self.inputs)
        diagonal = np.arange(len(self.inputs))
        factors = []
        for output in range(len(self.signal)):
            own = np.array(covariance[:, :, output])
            own[diagonal, diagonal] += self.noise[output] + JITTER * self.signal[output]
            factors.append(cholesky(own, lower=True))
        return factors

    @cached_property
    def _weights(self) -> Array:
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
    count = outputs.shape[1]
    mirror = np.ones(inputs.shape[1]) if mirror is None else mirror
    parity = np.zeros(count) if parity is None else parity
    # what changes its sign in the mirror has the mean 0
    offset = np.where(parity < 0, 0.0, outputs.mean(axis=0))
    scale = np.sqrt(((outputs - offset) ** 2).mean(axis=0))
    scale[scale == 0.0] = 1.0
    scales, signal, noise = np.empty((count, inputs.shape[1])), np.empty(count), np.empty(count)
    for output in range(count):
        start = np.full(1 if isotropic else inputs.shape[1], 3.0)
        own = Matern(start, LENGTH_BOUNDS, nu=2.5)
        if parity[output]:
            own = Mirrored(own, mirror, float(parity[output]))
        kernel = ConstantKernel(1.0, (1e-3, 1e3)) * own + WhiteKernel(1e-3, NOISE_BOUNDS)
        process = GaussianProcessRegressor(kernel, alpha=JITTER)
        with warnings.catch_warnings():
            # a length scale at its bound is an input that does not matter, and no fault
            warnings.simplefilter("ignore", ConvergenceWarning)
            process.fit(inputs, (outputs[:, output] - offset[output]) / scale[output])
        found = np.exp(process.kernel_.theta)
        signal[output], noise[output] = (
            scale[output] ** 2 * found[0],
            scale[output] ** 2 * found[-1],
        )
        scales[output] = found[1:-1]
    return GaussianProcesses(inputs, outputs, scales, signal, noise, offset, mirror, parity)


class Mirrored(Kernel):
    """k(x, x') ± k(x, M x') of a stationary kernel k, for scikit-learn."""

    def __init__(self, kernel: Kernel, mirror: Array, parity: float) -> None:
        self.kernel = kernel
        self.mirror = mirror
        self.parity = parity

    def get_params(self, deep: bool = True) -> dict[str, object]:
        return {"kernel": self.kernel, "mirror": self.mirror, "parity": self.parity}

    @property
    def hyperparameters(self) -> list[object]:
        return self.kernel.hyperparameters

    @property
    def theta(self) -> Array:
        return self.kernel.theta

    @theta.setter
    def theta(self, theta: Array) -> None:
        self.kernel.theta = theta

    @property
    def bounds(self) -> Array:
        return self.kernel.bounds

    def __call__(self, X: Array, Y: Array | None = None, eval_gradient: bool = False):  # type: ignore[no-untyped-def]
        images = (X if Y is None else Y) * self.mirror
        if not eval_gradient:
            return self.kernel(X, Y) + self.parity * self.kernel(X, images)
        # scikit-learn gives gradients for one set of points only: take points and images together
        both, gradient = self.kernel(np.concatenate([X, images]), eval_gradient=True)
        n = len(X)
        value = both[:n, :n] + self.parity * both[:n, n:]
        return value, gradient[:n, :n] + self.parity * gradient[:n, n:]

    def diag(self, X: Array) -> Array:
        return np.array([self(row[None])[0, 0] for row in X])

    def is_stationary(self) -> bool:
        return False


def _matern(steps: Array, length_scales: Array) -> Array:
    """Correlations (..., L) over differences (..., p)."""
    r = np.sqrt(5.0 * (steps * steps) @ (1.0 / length_scales**2).T)
    return (1.0 + r + r * r / 3.0) * np.exp(-r)
