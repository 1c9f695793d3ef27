"""The way between two places through centrelines that branch.

VMTK gives one line for each outlet, all from the same inlet, or one for each segment; the lines
are joined where their points meet.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

Array = NDArray[np.float64]

_GAP = 0.5
"""A line's end is joined to another line this near, mm, or one and a half times the usual spacing
of the points."""


def way_through(lines: list[Array], ends: Array) -> tuple[NDArray[np.int64], Array] | None:
    """Points of the way from the place nearest to ends[0] to that nearest to ends[1].

    ``lines`` are points (n, 3) mm in order, ``ends`` is (2, 3) mm. Returns the numbers (k,) of the
    points in the lines put one after another, and how far the ends are from the lines, (2,) mm;
    None if no way joins the two.
    """
    points = np.concatenate(lines)
    start = np.cumsum([0, *(len(line) for line in lines)])
    follows = np.ones(len(points) - 1, dtype=bool)
    follows[start[1:-1] - 1] = False
    here = np.flatnonzero(follows)
    tree = cKDTree(points)
    pairs = np.concatenate([np.stack([here, here + 1], axis=1), _joints(points, start, tree)])
    # scipy takes an edge of length 0 for none.
    lengths = np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1) + 1e-9
    graph = csr_array((lengths, pairs.T), shape=(len(points),) * 2)
    away, (first, last) = tree.query(ends)
    _, before = dijkstra(graph, directed=False, indices=first, return_predecessors=True)
    way = [int(last)]
    while way[-1] != first:
        if before[way[-1]] < 0:
            return None
        way.append(int(before[way[-1]]))
    return np.array(way[::-1]), away


def _joints(points: Array, start: NDArray[np.int64], tree: cKDTree) -> NDArray[np.int64]:
    """Pairs of points (m, 2) where lines meet: at the same place, or where one ends at another."""
    line = np.searchsorted(start, np.arange(len(points)), side="right") - 1
    same = tree.query_pairs(1e-6, output_type="ndarray")
    ends = np.concatenate([start[:-1], start[1:] - 1])
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)[line[1:] == line[:-1]]
    reach = max(_GAP, 1.5 * float(np.median(steps)) if len(steps) else 0.0)
    joints = [same.reshape(-1, 2)]
    for end in ends:
        near = np.array(tree.query_ball_point(points[end], reach), dtype=np.int64)
        near = near[line[near] != line[end]]
        if len(near):
            nearest = near[np.argmin(np.linalg.norm(points[near] - points[end], axis=1))]
            joints.append(np.array([[end, nearest]]))
    return np.concatenate(joints).astype(np.int64)
