"""Open edges of a wall: which are holes, to be filled, and which are the openings of the vessel.

A hole lies in the wall: the wall beside it is about parallel to its plane. At an opening the wall
stands on that plane.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from braidcast.errors import InputError
from braidcast.vessels.edges import (
    Array,
    IntArray,
    area_vectors,
    boundary_loops,
    edges_of,
    loop_section,
    sides_of,
)
from braidcast.vessels.lumen_surface import Opening
from braidcast.vessels.orientation import lumen_radius
from braidcast.vessels.wording import counted, place

#: Between a hole's plane and the wall beside it the mean cosine is more; at a cut it is ≤ 2/π.
BESIDE = 0.7
#: A loop with less than this share of the area of the circle around it is a tear, no end.
TEAR = 0.15
#: Holes are filled up to this share of the lumen's radius,
FILLED = 0.5
#: and whatever is smaller than these, mm and share of the lumen's radius.
SPECK, SPECK_SHARE = 0.15, 0.1
#: The lumen's radius is at least this share of its extent, or there is none.
FLAT = 1e-4
#: An opening's rim leaves its plane by at most this share of its radius.
UNEVEN = 0.6
#: More holes than these are reported together.
SINGLY = 4
#: Loops of more vertices are closed by a fan.
_LONGEST = 150


@dataclass(frozen=True, eq=False)
class _Loop:
    rim: IntArray
    centre: Array
    normal: Array
    radius: float
    reach: float
    """Largest distance of the rim from the centre, mm."""
    unevenness: float
    """Largest distance of the rim from its plane, mm."""
    beside: float
    """Mean cosine between the normals of wall and loop."""


def holes_and_openings(
    vertices: Array, triangles: IntArray
) -> tuple[Array, IntArray, list[IntArray], list[str]]:
    """Fill the holes of an oriented wall; the rims of its openings, and a remark for each hole.

    ``InputError`` for a hole too large to be filled and for an open edge that is no end.
    """
    lumen = lumen_radius(vertices, triangles)
    if lumen < FLAT * float(np.max(np.ptp(vertices, axis=0))):
        raise InputError(
            "is no wall around a lumen: no volume is enclosed by its "
            f"{counted(len(triangles), 'triangle')}"
        )
    loops = [_loop(vertices, triangles, rim, wall) for rim, wall in _rims(triangles)]
    there = {tuple(ends) for ends in edges_of(triangles).ends.tolist()}
    rims, filled, patches = [], [], []
    for loop in loops:
        where = f"at {place(loop.centre)}, of radius {loop.reach:.2f} mm"
        speck = loop.reach < max(SPECK, SPECK_SHARE * lumen)
        tear = loop.radius**2 < TEAR * loop.reach**2
        if speck or ((tear or loop.beside > BESIDE) and loop.reach < FILLED * lumen):
            patch, vertices = _patch(vertices, loop.rim, there)
            patches.append(patch)
            filled.append((loop.reach, where))
        elif tear or loop.beside > BESIDE:
            raise InputError(
                f"has a hole in its wall {where}, where holes are filled up to "
                f"{FILLED * lumen:.2f} mm, half the lumen's radius"
            )
        elif loop.unevenness > UNEVEN * loop.radius:
            raise InputError(
                f"has an open edge {where}, that is no end of a vessel: it leaves its plane by "
                f"{loop.unevenness:.2f} mm, where at most {UNEVEN * loop.radius:.2f} mm is allowed"
            )
        else:
            rims.append(loop.rim)
    return vertices, np.concatenate([triangles, *patches]), rims, _remarks(filled)


def _remarks(filled: list[tuple[float, str]]) -> list[str]:
    if len(filled) <= SINGLY:
        return sorted(f"the hole {where}, was filled" for _, where in filled)
    return [f"{len(filled)} holes were filled, the largest {max(filled)[1]}"]


def opening(vertices: Array, rim: IntArray) -> Opening:
    """The opening with this rim, in the order in which the wall's triangles run along it."""
    centre, normal, radius = loop_section(vertices[rim])
    return Opening(centre, normal, radius, rim)


def _rims(triangles: IntArray) -> list[tuple[IntArray, IntArray]]:
    """Vertices of each loop, and the triangle at each of its sides."""
    sides, start = edges_of(triangles).open_sides(), sides_of(triangles)
    at = {tuple(start[side].tolist()): side // 3 for side in sides.tolist()}
    return [
        (
            rim,
            np.array(
                [at[ends] for ends in zip(rim.tolist(), np.roll(rim, -1).tolist(), strict=True)]
            ),
        )
        for rim in boundary_loops(triangles)
    ]


def _loop(vertices: Array, triangles: IntArray, rim: IntArray, wall: IntArray) -> _Loop:
    points = vertices[rim]
    centre, normal, radius = loop_section(points)
    length = np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1)
    vectors = area_vectors(vertices, triangles[wall])
    size = np.maximum(np.linalg.norm(vectors, axis=1), np.finfo(float).tiny)
    return _Loop(
        rim=rim,
        centre=centre,
        normal=normal,
        radius=radius,
        reach=float(np.max(np.linalg.norm(points - centre, axis=1))),
        unevenness=float(np.max(np.abs((points - centre) @ normal))),
        beside=float(length @ np.abs(vectors @ normal / size) / np.sum(length)),
    )


def _patch(vertices: Array, rim: IntArray, there: set[tuple[int, ...]]) -> tuple[IntArray, Array]:
    """Triangles that close a rim, and the vertices with the one they may add."""
    ring = rim[::-1]
    count = len(ring)
    if count <= _LONGEST:
        free = np.ones((count, count), dtype=bool)
        for i in range(count):
            for j in range(i + 2, count):
                free[i, j] = (i == 0 and j == count - 1) or (
                    (min(ring[i], ring[j]), max(ring[i], ring[j])) not in there
                )
        split = _smallest(vertices[ring], free)
        if split[0, count - 1] >= 0:
            found = ring[np.array(_unfolded(split))]
            sides = np.sort(sides_of(found), axis=1)
            there.update(tuple(ends) for ends in sides.tolist())
            return found, vertices
    hub = len(vertices)
    vertices = np.concatenate([vertices, vertices[rim].mean(axis=0)[None]])
    return np.stack([ring, np.roll(ring, -1), np.full(count, hub)], axis=1), vertices


def _smallest(points: Array, free: NDArray[np.bool_]) -> IntArray:
    """Where to split each span i..j of a polygon (k, 3) for the smallest area, -1 for nowhere.

    Barequet and Sharir, Filling gaps in the boundary of a polyhedron, 1995. ``free``: chords that
    no triangle has yet.
    """
    count = len(points)
    square = np.sum((points[:, None] - points) ** 2, axis=2)
    cost = np.zeros((count, count))
    split = np.full((count, count), -1)
    for span in range(2, count):
        for i in range(count - span):
            j = i + span
            if not free[i, j]:
                cost[i, j] = np.inf
                continue
            k = slice(i + 1, j)
            along = 0.5 * (square[i, k] + square[i, j] - square[k, j])
            area = 0.5 * np.sqrt(np.maximum(square[i, k] * square[i, j] - along**2, 0.0))
            total = cost[i, k] + cost[k, j] + area
            best = int(np.argmin(total))
            cost[i, j] = total[best]
            if np.isfinite(total[best]):
                split[i, j] = i + 1 + best
    return split


def _unfolded(split: IntArray) -> list[tuple[int, int, int]]:
    triangles, spans = [], [(0, len(split) - 1)]
    while spans:
        i, j = spans.pop()
        if j - i >= 2:
            k = int(split[i, j])
            triangles.append((i, k, j))
            spans += [(i, k), (k, j)]
    return triangles
