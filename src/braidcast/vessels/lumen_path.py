"""A way through a lumen from end to end that keeps away from its wall, on a grid.

The grid is refined only where the signed distance says that the lumen may be.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from braidcast.errors import InputError

Array = NDArray[np.float64]
Distance = Callable[[Array], Array]
"""Signed distance (n,) mm at points (n, 3), negative in the lumen."""

_COARSE, _FINE, _FINEST = 2.0, 0.25, 0.125
"""Spacings of the grid, mm: at first, where an end must be in it, and at last."""
_CELLS_ACROSS = 6.0
"""Cells across the vessel at its narrower end."""
_FIRST_NODES, _MOST_NODES = 20_000, 60_000

_CHILDREN = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
_NEIGHBOURS = np.array(
    [[x, y, z] for x in (0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if (x, y, z) > (0, 0, 0)]
)


@dataclass(frozen=True, eq=False)
class _Grid:
    """Nodes ``origin`` + (index + 1/2) ``spacing`` near the lumen, and their depths in it."""

    origin: Array
    spacing: float
    index: NDArray[np.int64]
    depth: Array

    @property
    def points(self) -> Array:
        return self.origin + (self.index + 0.5) * self.spacing

    def halved(self, distance: Distance) -> _Grid:
        """The grid of half the spacing."""
        near = self.depth > -0.5 * np.sqrt(3.0) * self.spacing
        index = (2 * self.index[near, None] + _CHILDREN).reshape(-1, 3)
        spacing = 0.5 * self.spacing
        return _Grid(self.origin, spacing, index, -distance(self.origin + (index + 0.5) * spacing))


def lumen_path(
    distance: Distance, bounds: Array, ends: Array, end_radii: Array | None
) -> tuple[Array, Array]:
    """Points (n, 3) mm from near ends[0] to near ends[1], and the radii (2,) mm of the ends.

    It is the path on which ∫ ds / min(depth, larger radius of the ends)² is least: an aneurysm,
    however deep, draws it aside no more than the vessel itself. ``bounds`` (2, 3) mm hold the
    lumen. ``InputError``, its text to follow the ends, if one is not in the lumen or the lumen does
    not join them.
    """
    grid = _whole_grid(distance, bounds)
    radii = None
    while True:
        found = [_ball_around(grid, end) for end in ends]
        if end_radii is not None:
            radii = np.asarray(end_radii, dtype=np.float64)
        elif min(found) > 0.0:
            radii = np.array(found)
        fine_enough = radii is not None and grid.spacing <= 2.0 * radii.min() / _CELLS_ACROSS
        finest = _FINEST if radii is not None else _FINE
        if fine_enough or grid.spacing <= finest or len(grid.index) > _MOST_NODES:
            break
        grid = grid.halved(distance)
    for name, radius in zip(("first", "second"), found, strict=True):
        if radius <= 0.0:
            raise InputError(f"the {name} must lie in the lumen or at its wall")
    assert radii is not None
    path = _cheapest(grid, ends, radii)
    if path is None and len(grid.index) <= _MOST_NODES:
        # A stenosis may be narrower than the grid.
        path = _cheapest(grid.halved(distance), ends, radii)
    if path is None:
        raise InputError("they must be joined by the lumen")
    return path, radii


def _whole_grid(distance: Distance, bounds: Array) -> _Grid:
    size = bounds[1] - bounds[0]
    spacing = max(_COARSE, float(np.prod(size) / _FIRST_NODES) ** (1.0 / 3.0))
    count = np.maximum(np.ceil(size / spacing).astype(int), 1)
    index = np.stack(np.meshgrid(*map(np.arange, count), indexing="ij"), axis=-1).reshape(-1, 3)
    origin = 0.5 * (bounds[0] + bounds[1] - count * spacing)
    return _Grid(origin, spacing, index, -distance(origin + (index + 0.5) * spacing))


def _ball_around(grid: _Grid, end: Array) -> float:
    """Radius of the largest ball in the lumen that holds ``end``, or nearly; 0 if none does."""
    away = np.linalg.norm(grid.points - end, axis=1)
    held = (away <= 1.25 * grid.depth + 0.5 * grid.spacing) & (grid.depth > 0.0)
    return float(grid.depth[held].max(initial=0.0))


def _cheapest(grid: _Grid, ends: Array, radii: Array) -> Array | None:
    inside = grid.depth > 0.0
    index, depth, points = grid.index[inside], grid.depth[inside], grid.points[inside]
    low = index.min(axis=0) - 1
    width = index.max(axis=0) + 2 - low
    key = np.ravel_multi_index(tuple((index - low).T), tuple(width))
    order = np.argsort(key)
    cost = 1.0 / np.minimum(depth, radii.max()) ** 2
    pairs, weights = [], []
    for step in _NEIGHBOURS:
        wanted = np.ravel_multi_index(tuple((index + step - low).T), tuple(width))
        there = order[np.minimum(np.searchsorted(key, wanted, sorter=order), len(key) - 1)]
        here = np.flatnonzero(key[there] == wanted)
        pairs.append(np.stack([here, there[here]]))
        weights.append(0.5 * np.linalg.norm(step) * (cost[here] + cost[there[here]]))
    rows, columns = np.concatenate(pairs, axis=1)
    graph = csr_array((np.concatenate(weights), (rows, columns)), shape=(len(key),) * 2)
    start, goal = (
        # The deepest place near the end; deeper than its radius is no better.
        int(np.argmax(np.minimum(depth, r) - 0.3 * np.linalg.norm(points - end, axis=1)))
        for end, r in zip(ends, radii, strict=True)
    )
    _, before = dijkstra(graph, directed=False, indices=start, return_predecessors=True)
    path = [goal]
    while path[-1] != start:
        if before[path[-1]] < 0:
            return None
        path.append(before[path[-1]])
    return points[path[::-1]]
