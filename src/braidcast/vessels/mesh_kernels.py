"""Compiled search for the place of a triangle mesh nearest to a point, and the side it is on.

Closest point of a triangle: Ericson, Real-Time Collision Detection (2005), section 5.1.5. Sign by
the angle-weighted normal of the nearest face, edge or corner: Bærentzen & Aanæs, IEEE TVCG 11
(2005) 243. Lengths in mm.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

_compile = njit(cache=True, error_model="numpy")

# Parts of a triangle: its face, edge k from corner k to corner k + 1, corner k.
_FACE, _EDGE, _CORNER = 0, 1, 4


@_compile
def _closest(
    a: NDArray[np.float64],
    b: NDArray[np.float64],
    c: NDArray[np.float64],
    p: NDArray[np.float64],
    place: NDArray[np.float64],
) -> int:
    """Fills ``place`` with the point of triangle abc nearest to p and says on which part it is."""
    abx, aby, abz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    acx, acy, acz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    x, y, z = p[0] - a[0], p[1] - a[1], p[2] - a[2]
    d1, d2 = abx * x + aby * y + abz * z, acx * x + acy * y + acz * z
    bb, cc = abx * abx + aby * aby + abz * abz, acx * acx + acy * acy + acz * acz
    bc = abx * acx + aby * acy + abz * acz
    d3, d4 = d1 - bb, d2 - bc
    d5, d6 = d1 - bc, d2 - cc
    v, w, part = 0.0, 0.0, _FACE
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    if d1 <= 0.0 and d2 <= 0.0:
        part = _CORNER
    elif d3 >= 0.0 and d4 <= d3:
        v, part = 1.0, _CORNER + 1
    elif d6 >= 0.0 and d5 <= d6:
        w, part = 1.0, _CORNER + 2
    elif vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        v, part = d1 / (d1 - d3), _EDGE
    elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        w, part = d2 / (d2 - d6), _EDGE + 2
    elif va <= 0.0 and d4 >= d3 and d5 >= d6:
        w = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        v, part = 1.0 - w, _EDGE + 1
    else:
        v, w = vb / (va + vb + vc), vc / (va + vb + vc)
    place[0] = a[0] + v * abx + w * acx
    place[1] = a[1] + v * aby + w * acy
    place[2] = a[2] + v * abz + w * acz
    return part


@_compile
def _square(p: NDArray[np.float64], q: NDArray[np.float64]) -> float:
    x, y, z = p[0] - q[0], p[1] - q[1], p[2] - q[2]
    return x * x + y * y + z * z


@_compile
def vertex_triangles(
    triangles: NDArray[np.int64], count: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Triangles about each of ``count`` vertices: those of vertex i are around[first[i:i + 2]]."""
    first = np.zeros(count + 1, np.int64)
    for t in range(triangles.shape[0]):
        for k in range(3):
            first[triangles[t, k] + 1] += 1
    for i in range(count):
        first[i + 1] += first[i]
    filled = first[:-1].copy()
    around = np.empty(3 * triangles.shape[0], np.int64)
    for t in range(triangles.shape[0]):
        for k in range(3):
            around[filled[triangles[t, k]]] = t
            filled[triangles[t, k]] += 1
    return first, around


@_compile
def nearest(
    points: NDArray[np.float64],
    start: NDArray[np.int64],
    vertices: NDArray[np.float64],
    triangles: NDArray[np.int64],
    first: NDArray[np.int64],
    around: NDArray[np.int64],
    faces: NDArray[np.float64],
    edges: NDArray[np.float64],
    corners: NDArray[np.float64],
    on_rim: NDArray[np.bool_],
    outward: NDArray[np.float64],
    distance: NDArray[np.float64],
    overrun: NDArray[np.float64],
) -> None:
    """Signed distance and overrun of points (n, 3), from a triangle ``start`` (n,) near each.

    ``faces`` (m, 3), ``edges`` (m, 3, 3) and ``corners`` (n, 3) are normals, ``on_rim`` (m, 3)
    says which edges end the surface, ``outward`` (n, 3) is the normal of the opening a vertex is
    on, else 0. The search goes on from a triangle to those that share a corner with it until none
    is nearer, for the one it starts from was found in single precision.
    """
    place, best_place = np.empty(3), np.empty(3)
    for i in range(points.shape[0]):
        p = points[i]
        triangle, last = start[i], np.int64(-1)
        part = _closest(
            vertices[triangles[triangle, 0]],
            vertices[triangles[triangle, 1]],
            vertices[triangles[triangle, 2]],
            p,
            best_place,
        )
        best = _square(p, best_place)
        while triangle != last:
            last = triangle
            for k in range(3):
                vertex = triangles[last, k]
                for j in range(first[vertex], first[vertex + 1]):
                    t = around[j]
                    here = _closest(
                        vertices[triangles[t, 0]],
                        vertices[triangles[t, 1]],
                        vertices[triangles[t, 2]],
                        p,
                        place,
                    )
                    square = _square(p, place)
                    if square < best:
                        best, triangle, part = square, t, here
                        best_place[:] = place
        if part == _FACE:
            normal, rim, corner = faces[triangle], False, np.int64(0)
        elif part < _CORNER:
            normal, rim = edges[triangle, part - _EDGE], on_rim[triangle, part - _EDGE]
            corner = triangles[triangle, part - _EDGE]
        else:
            corner = triangles[triangle, part - _CORNER]
            normal = corners[corner]
            rim = True
        side, beyond = 0.0, 0.0
        for k in range(3):
            side += (p[k] - best_place[k]) * normal[k]
        if rim:
            for k in range(3):
                beyond += (p[k] - best_place[k]) * outward[corner, k]
            beyond = max(beyond, 0.0)
        distance[i] = math.copysign(math.sqrt(max(best - beyond * beyond, 0.0)), side)
        overrun[i] = beyond
