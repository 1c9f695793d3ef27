"""Triangles as flat as the rounding of coordinates: their normals are noise, so they go.

One corner lies on the opposite side; that side's other triangle is split there instead.
"""

from __future__ import annotations

import numpy as np

from braidcast.vessels.edges import Array, IntArray, area_vectors, edges_of, sides_of
from braidcast.vessels.weld import rounding
from braidcast.vessels.wording import counted, was

#: Slivers beside slivers take more than one round.
_ROUNDS = 10


def without_slivers(vertices: Array, triangles: IntArray) -> tuple[IntArray, list[str]]:
    """Oriented triangles (m, 3) without slivers wherever that is possible, and a remark."""
    gone = 0
    for _ in range(_ROUNDS):
        triangles, done = _round(vertices, triangles)
        gone += done
        if not done:
            break
    if not gone:
        return triangles, []
    return triangles, [f"{counted(gone, 'triangle')} without height {was(gone)} removed"]


def _round(vertices: Array, triangles: IntArray) -> tuple[IntArray, int]:
    sides = sides_of(triangles)
    length = np.linalg.norm(vertices[sides[:, 1]] - vertices[sides[:, 0]], axis=1).reshape(-1, 3)
    longest = np.argmax(length, axis=1)
    area = np.linalg.norm(area_vectors(vertices, triangles), axis=1)
    flat = np.flatnonzero(2.0 * area < rounding(vertices) * length.max(axis=1))
    if len(flat) == 0:
        return triangles, 0
    edges = edges_of(triangles)
    other = np.full(len(sides), -1)
    pairs = edges.pairs()
    other[pairs[:, 0]], other[pairs[:, 1]] = pairs[:, 1], pairs[:, 0]
    there = {tuple(ends) for ends in edges.ends.tolist()}
    result = triangles.copy()
    touched: set[int] = set()
    removed: list[int] = []
    for triangle in flat.tolist():
        side = 3 * triangle + int(longest[triangle])
        a, b = sides[side].tolist()
        c = int(triangles[triangle, (longest[triangle] + 2) % 3])
        opposite = int(other[side])
        if opposite < 0:  # at an opening: the two short sides are the rim from now on
            removed.append(triangle)
            continue
        neighbour = opposite // 3
        d = int(triangles[neighbour, (opposite + 2) % 3])
        chord = (min(c, d), max(c, d))
        if chord in there or {triangle, neighbour} & touched:
            continue
        there.add(chord)
        touched |= {triangle, neighbour}
        result[triangle], result[neighbour] = (d, b, c), (c, a, d)
    done = len(touched) // 2 + len(removed)
    return np.delete(result, removed, axis=0), done
