"""Latin hypercubes whose first points are subsets, each of them as evenly spread as the whole.

scipy draws the hypercube. Then pairs of points swap a coordinate, which leaves it Latin, wherever
that lowers the sum of the logarithms of the centred discrepancies of the whole and of all subsets:
a measure that favours no size. Each subset gets its share of the trials, however small it is.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from braidcast.dataset.discrepancy import discrepancies, sums, try_swaps

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
Sets = Sequence[tuple[int, int]]
"""Sets of successive points: where each begins and, exclusively, ends."""

#: A hypercube of more points is left as it was drawn: swapping them would take minutes.
MOST_SWAPPED = 20_000

_TRIALS_PER_POINT = 1500
_MOST_WORK = 2e9  # trials times points: some ten seconds
_CHUNKS = 50


def nested_hypercube(
    count: int,
    dimensions: int,
    subsets: Sequence[int],
    tests: int,
    seed: int,
    progress: Callable[[float], None] | None = None,
) -> Array:
    """Points of a Latin hypercube in [0, 1)^d, (count, dimensions), in nested order.

    The first k points are evenly spread for k = ``tests``, each of ``subsets`` and ``count``; and
    so is each of these subsets less the tests. ``progress`` is told the share that is done.
    """
    rng = np.random.default_rng(seed)
    points = qmc.LatinHypercube(dimensions, rng=rng).random(count)
    if count > MOST_SWAPPED:
        return points
    trials = int(min(_TRIALS_PER_POINT * count, _MOST_WORK / count))
    return spread(points, nested_sets(count, subsets, tests), trials, rng, progress)[0]


def nested_sets(count: int, subsets: Sequence[int], tests: int) -> Sets:
    """The test set, all subsets and the whole, and each of them less the test set."""
    sizes = {tests, *subsets, count}
    sets = {(0, size) for size in sizes} | {(tests, size) for size in sizes}
    return sorted((begin, end) for begin, end in sets if begin < end)


def spread(
    points: Array,
    sets: Sets,
    trials: int,
    rng: np.random.Generator,
    progress: Callable[[float], None] | None = None,
) -> tuple[Array, Array]:
    """Points after so many trials of swaps, (n, d), and the discrepancy of each set, (sets,)."""
    count, dimensions = points.shape
    columns = np.array(points.T, order="C")
    first, last = np.array(sets).T.copy()
    a_sums, k_sums = sums(columns, first, last)
    for chunk in range(_CHUNKS):
        size = trials * (chunk + 1) // _CHUNKS - trials * chunk // _CHUNKS
        within = rng.integers(len(sets), size=size)
        one = rng.integers(first[within], last[within])
        other = rng.integers(count, size=size)
        coordinates = rng.integers(dimensions, size=size)
        try_swaps(columns, first, last, a_sums, k_sums, one, other, coordinates)
        if progress is not None:
            progress((chunk + 1) / _CHUNKS)
    return columns.T.copy(), discrepancies(dimensions, first, last, a_sums, k_sums)


def best_candidate(
    candidates: Array, place: int, points: Array, present: BoolArray, sets: Sets, region: Array
) -> int:
    """Which of ``candidates``, put at ``place``, leaves the sets it is in most evenly spread.

    Spread over the region of which ``region`` is a uniform sample: a(x), which is the mean of
    k(x, y) over all y of the cube, becomes that over y in the region. Of ``points`` those count
    that are ``present``. The least sum of m CD over the sets: the discrepancy falls as 1/m, so that
    sets of all sizes weigh alike.
    """
    if len(candidates) == 1:
        return 0
    to_points = np.where(present, _kernel(candidates[:, None], points[None]), 0.0)
    itself = _kernel(candidates, candidates)
    to_region = _kernel(candidates[:, None], region[None]).mean(axis=1)
    cost = np.zeros(len(candidates))
    for begin, end in sets:
        if begin <= place < end:
            m = 1 + present[begin:end].sum()
            cost += (2.0 * to_points[:, begin:end].sum(axis=1) + itself) / m - 2.0 * to_region
    return int(np.argmin(cost))


def _kernel(x: Array, y: Array) -> Array:
    """k(x, y) along the last axis (see ``discrepancy``)."""
    factors = 1.0 + 0.5 * (np.abs(x - 0.5) + np.abs(y - 0.5) - np.abs(x - y))
    return factors.prod(axis=-1)
