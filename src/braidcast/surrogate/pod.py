"""Proper orthogonal decomposition of snapshots (paper, section 2.3.1).

The singular value decomposition of the snapshot matrix S (a row a snapshot), S = U diag(σ) Vᵀ,
gives the L directions V that leave the least of all snapshots over (Eckart & Young 1936):

    ‖S − S V Vᵀ‖² = σ²_{L+1} + σ²_{L+2} + …
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from braidcast.errors import InputError

Array = NDArray[np.float64]

Criterion = Literal["sum", "squares"]


@dataclass(frozen=True)
class Basis:
    """``mean`` (d,) and ``modes`` (L, d), orthonormal rows; ``singular_values``: of all modes."""

    mean: Array
    modes: Array
    singular_values: Array

    def coefficients(self, snapshots: Array) -> Array:
        """Coordinates (n, L) of snapshots (n, d)."""
        return (snapshots - self.mean) @ self.modes.T

    def snapshots(self, coefficients: Array) -> Array:
        """Snapshots (n, d) of coordinates (n, L)."""
        return self.mean + coefficients @ self.modes

    def truncated(self, count: int) -> "Basis":
        """The first ``count`` modes."""
        return Basis(self.mean, self.modes[:count], self.singular_values)


def pod(snapshots: Array, *, centred: bool = True) -> Basis:
    """All modes of snapshots (n, d), by falling singular value.

    ``centred`` takes the mean of the snapshots away first; the paper does not (errata row 22).
    ``InputError`` for numbers that are not finite.
    """
    if snapshots.ndim != 2 or not len(snapshots) or not np.isfinite(snapshots).all():
        raise InputError("snapshots must be a table (n, d) of finite numbers, n at least 1")
    mean = snapshots.mean(axis=0) if centred else np.zeros(snapshots.shape[1])
    _, sigma, modes = np.linalg.svd(snapshots - mean, full_matrices=False)
    kept = sigma > len(snapshots) * np.finfo(float).eps * sigma[0]
    return Basis(mean, modes[kept], sigma[kept])


def modes_for(singular_values: Array, tolerance: float, criterion: Criterion = "sum") -> int:
    """Fewest modes L that leave no more than ``tolerance`` of the energy.

    ``sum`` takes Σσ as the energy, by which the paper's tables have L = 4, 9, 58; ``squares`` takes
    Σσ², the share of the variance (errata row 22). ``InputError`` if tolerance is not in (0, 1).
    """
    if not 0.0 < tolerance < 1.0:
        raise InputError(f"tolerance = {tolerance} must be between 0 and 1")
    energy = singular_values if criterion == "sum" else singular_values**2
    left = 1.0 - np.cumsum(energy) / energy.sum()
    return int(np.argmax(left <= tolerance + len(energy) * np.finfo(float).eps)) + 1
