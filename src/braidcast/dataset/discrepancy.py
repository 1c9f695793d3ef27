"""The centred discrepancy of sets of points, kept up to date while points swap coordinates.

That of m points x in [0, 1]^d (Hickernell 1998; scipy's "CD") is

    CD = (13/12)^d - 2/m Σ_i a(x_i) + 1/m² Σ_ij k(x_i, x_j)

    a(x)    = Π_e (1 + ½u(x_e) - ½u(x_e)²),                      u(x) = |x - ½|
    k(x, y) = Π_e (1 + ½u(x_e) + ½u(y_e) - ½|x_e - y_e|)

If two points swap a coordinate only their own rows of k change, so that the discrepancies follow
in O(n d). Points are the columns of (d, n) arrays here; set s is the points first[s] … last[s] - 1.
"""

from __future__ import annotations

import numba as nb
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]


@nb.njit(cache=True)
def sums(columns: Array, first: IntArray, last: IntArray) -> tuple[Array, Array]:
    """Sum of a over the points of each set, and of k over all pairs of them, (sets,) each."""
    d, n = columns.shape
    a_sums, k_sums = np.zeros(len(first)), np.zeros(len(first))
    row, until = np.empty(n), np.zeros(n + 1)
    for p in range(n):
        a = 1.0
        row[:] = 1.0
        for e in range(d):
            x = columns[e, p]
            a *= _a_factor(x)
            for i in range(n):
                row[i] *= _k_factor(x, columns[e, i])
        for i in range(n):
            until[i + 1] = until[i] + row[i]
        for s in range(len(first)):
            if first[s] <= p < last[s]:
                a_sums[s] += a
                k_sums[s] += until[last[s]] - until[first[s]]
    return a_sums, k_sums


def discrepancies(
    dimensions: int, first: IntArray, last: IntArray, a_sums: Array, k_sums: Array
) -> Array:
    """CD of each set, (sets,)."""
    m = last - first
    return (13.0 / 12.0) ** dimensions - 2.0 * a_sums / m + k_sums / m**2


@nb.njit(cache=True)
def try_swaps(
    columns: Array,
    first: IntArray,
    last: IntArray,
    a_sums: Array,
    k_sums: Array,
    one: IntArray,
    other: IntArray,
    coordinates: IntArray,
) -> None:
    """Swap a coordinate of two points, trial by trial, where that lowers Σ_s log CD_s.

    ``columns`` and the sums are changed in place. ``one``, ``other`` and ``coordinates`` say which
    points and which coordinate, (trials,) each.
    """
    d, n = columns.shape
    of_p, of_q = np.empty(n), np.empty(n)
    until_p, until_q = np.zeros(n + 1), np.zeros(n + 1)
    a_new, k_new = np.empty(len(first)), np.empty(len(first))
    now = _unevenness(d, first, last, a_sums, k_sums)
    for trial in range(len(one)):
        p, q, c = one[trial], other[trial], coordinates[trial]
        _k_changes(columns, p, q, c, of_p)
        _k_changes(columns, q, p, c, of_q)
        for i in range(n):
            until_p[i + 1] = until_p[i] + of_p[i]
            until_q[i + 1] = until_q[i] + of_q[i]
        a_p, a_q = _a_change(columns, p, q, c), _a_change(columns, q, p, c)
        for s in range(len(first)):
            begin, end = first[s], last[s]
            a_new[s], k_new[s] = a_sums[s], k_sums[s]
            if begin <= p < end:
                a_new[s] += a_p
                k_new[s] += 2.0 * (until_p[end] - until_p[begin])
            if begin <= q < end:
                a_new[s] += a_q
                k_new[s] += 2.0 * (until_q[end] - until_q[begin])
        then = _unevenness(d, first, last, a_new, k_new)
        if then < now:
            now = then
            for s in range(len(first)):
                a_sums[s], k_sums[s] = a_new[s], k_new[s]
            columns[c, p], columns[c, q] = columns[c, q], columns[c, p]


@nb.njit(cache=True)
def _unevenness(d: int, first: IntArray, last: IntArray, a_sums: Array, k_sums: Array) -> float:
    """Σ_s log CD_s."""
    total = 0.0
    for s in range(len(first)):
        m = last[s] - first[s]
        total += np.log((13.0 / 12.0) ** d - 2.0 * a_sums[s] / m + k_sums[s] / m**2)
    return total


@nb.njit(cache=True)
def _k_changes(columns: Array, p: int, q: int, c: int, changes: Array) -> None:
    """How k(x_p, x_i) changes for each i if x_p and x_q swap coordinate c.

    k(x_p, x_q) does not. For i = p it is half the change, as a sum over i and j has that term once
    and all others twice.
    """
    d, n = columns.shape
    old, new = columns[c, p], columns[c, q]
    for i in range(n):
        changes[i] = _k_factor(new, columns[c, i]) - _k_factor(old, columns[c, i])
    changes[p] = 0.5 * (_k_factor(new, new) - _k_factor(old, old))
    changes[q] = 0.0
    for e in range(d):
        if e != c:
            x = columns[e, p]
            for i in range(n):
                changes[i] *= _k_factor(x, columns[e, i])


@nb.njit(cache=True)
def _a_change(columns: Array, p: int, q: int, c: int) -> float:
    """How a(x_p) changes if x_p takes coordinate c of x_q."""
    change = _a_factor(columns[c, q]) - _a_factor(columns[c, p])
    for e in range(len(columns)):
        if e != c:
            change *= _a_factor(columns[e, p])
    return change


@nb.njit(cache=True, inline="always")
def _a_factor(x: float) -> float:
    u = abs(x - 0.5)
    return 1.0 + 0.5 * u - 0.5 * u * u


@nb.njit(cache=True, inline="always")
def _k_factor(x: float, y: float) -> float:
    return 1.0 + 0.5 * (abs(x - 0.5) + abs(y - 0.5) - abs(x - y))
