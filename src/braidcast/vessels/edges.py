"""Edges of a triangle mesh: who shares them, and the loops of those that nobody shares."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Edges:
    """The e edges of m triangles. Side 3t + k of triangle t runs from its corner k to the next."""

    ends: IntArray
    """Vertices of each edge, the smaller first, (e, 2)."""
    of_side: IntArray
    """Edge of each side, (3m,)."""
    count: IntArray
    """Triangles at each edge, (e,)."""

    def pairs(self) -> IntArray:
        """The two sides (p, 2) of each edge that two triangles share."""
        shared = self.count[self.of_side] == 2
        sides = np.flatnonzero(shared)
        return sides[np.argsort(self.of_side[sides], kind="stable")].reshape(-1, 2)

    def open_sides(self) -> IntArray:
        """Sides (b,) that have no neighbour."""
        return np.flatnonzero(self.count[self.of_side] == 1)


def edges_of(triangles: IntArray) -> Edges:
    """The edges of triangles (m, 3)."""
    start, end = sides_of(triangles).T
    low, high = np.minimum(start, end), np.maximum(start, end)
    base = int(triangles.max(initial=0)) + 1
    keys, of_side, count = np.unique(low * base + high, return_inverse=True, return_counts=True)
    return Edges(np.stack(np.divmod(keys, base), axis=1), of_side, count)


def sides_of(triangles: IntArray) -> IntArray:
    """Start and end (3m, 2) of each side, as its triangle runs round."""
    return np.stack([triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()], axis=1)


def boundary_loops(triangles: IntArray) -> list[IntArray]:
    """Loops of open sides, vertices in the order in which the triangles run; none meets itself.

    Where loops touch at a vertex they are told apart there. The triangles must be oriented alike.
    """
    sides = sides_of(triangles)[edges_of(triangles).open_sides()]
    onward: dict[int, list[int]] = {}
    for start, end in sides.tolist():
        onward.setdefault(start, []).append(end)
    loops = []
    for first in onward:
        while onward[first]:
            path, place = [first], {first: 0}
            while path and onward[path[-1]]:
                vertex = onward[path[-1]].pop()
                if vertex not in place:
                    place[vertex] = len(path)
                    path.append(vertex)
                    continue
                loop = path[place[vertex] :]
                loops.append(np.array(loop, dtype=np.int64))
                for passed in loop[1:]:
                    del place[passed]
                del path[place[vertex] + 1 :]
    return loops


def loop_section(points: Array) -> tuple[Array, Array, float]:
    """Centre of area, unit normal out of the lumen and radius of the area in a rim (k, 3) mm.

    The rim runs as the wall's triangles do; the other way round the normal points inwards.
    """
    middle, after = points.mean(axis=0), np.roll(points, -1, axis=0)
    # The wall runs round it clockwise, seen from outside.
    vector = -0.5 * np.cross(points - middle, after - middle).sum(axis=0)
    area = float(np.linalg.norm(vector))
    if area == 0.0:
        return middle, np.zeros(3), 0.0
    normal = vector / area
    share = np.cross(after - middle, points - middle) @ normal / (2.0 * area)
    centre = share @ (points + after + middle) / 3.0
    return centre, normal, math.sqrt(area / math.pi)


def area_vectors(vertices: Array, triangles: IntArray) -> Array:
    """Normals of triangles, (m, 3) mm², as long as the triangles are large."""
    a, b, c = vertices[triangles].transpose(1, 0, 2)
    return 0.5 * np.cross(b - a, c - a)
