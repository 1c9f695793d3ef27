"""Splines with a penalty on their roughness (P-splines).

P. H. C. Eilers and B. D. Marx, Flexible smoothing with B-splines and penalties, Statistical
Science 11 (1996) 89-121. A spline of order ``p`` and length b fitted to points everywhere damps
a wave of wave number k by 1 + (k b)^(2p): what is much longer than 2π b stays as it is.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline
from scipy.sparse import csc_array, csr_array, diags_array
from scipy.sparse.linalg import spsolve

Array = NDArray[np.float64]

DEGREE = 5


def even_knots(low: float, high: float, spans: int) -> Array:
    """Knots of ``spans`` equal spans from low to high and DEGREE more beyond each end."""
    step = (high - low) / spans
    return np.asarray(low + step * np.arange(-DEGREE, spans + DEGREE + 1), dtype=np.float64)


def basis(knots: Array, u: Array) -> csr_array:
    """Values of the B-splines of ``knots`` at u (n,): (n, len(knots) − DEGREE − 1)."""
    low, high = knots[DEGREE], knots[-DEGREE - 1]
    return csr_array(BSpline.design_matrix(np.clip(u, low, high), knots, DEGREE))


def roughness(knots: Array, order: int) -> csc_array:
    """M of the penalty cᵀ M c ≈ ∫ |d^order x/du^order|² du of a spline with coefficients c."""
    count, step = len(knots) - DEGREE - 1, knots[1] - knots[0]
    signs = [(-1.0) ** (order - k) * math.comb(order, k) for k in range(order + 1)]
    difference = diags_array(signs, offsets=range(order + 1), shape=(count - order, count))
    return csc_array(difference.T @ difference * step ** (1 - 2 * order))


def smooth_spline(
    u: Array, values: Array, length: float, order: int, spans: int, weights: Array | None = None
) -> BSpline:
    """Spline over [min u, max u] near ``values`` (n, k) at u (n,), smoothed over ``length``.

    ``weights`` (n,), by default the share of [min u, max u] of each value, times the squared
    misses plus length^(2 order) times the roughness are least.
    """
    knots = even_knots(float(u.min()), float(u.max()), spans)
    rows = basis(knots, u)
    weighted = rows.T @ diags_array(shares(u) if weights is None else weights)
    matrix = csc_array(weighted @ rows) + length ** (2 * order) * roughness(knots, order)
    coefficients = spsolve(csc_array(matrix), weighted @ values)
    return BSpline(knots, np.reshape(coefficients, (-1, values.shape[1])), DEGREE)


def shares(u: Array) -> Array:
    """Length of the line nearer to each of u (n,), in any order, than to the others."""
    order = np.argsort(u, kind="stable")
    share = np.empty_like(u)
    share[order] = np.gradient(u[order]) if len(u) > 1 else 1.0
    return share
