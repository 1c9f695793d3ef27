"""Where a surface passes through itself: sides of its triangles that pierce other triangles."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from braidcast.errors import InputError
from braidcast.vessels.edges import Array, IntArray, edges_of
from braidcast.vessels.wording import counted, place


def refuse_self_intersection(vertices: Array, triangles: IntArray) -> list[str]:
    """``InputError`` with the number of pairs of triangles that cross, and the place of the first.

    Triangles with a side between them, crossed by noise, are no more than a crease: a remark.
    Triangles that share a vertex are not tested, nor do touching or parallel ones count.
    """
    crossings = self_intersections(vertices, triangles)
    if len(crossings) == 0:
        return []
    far = crossings[~_joined_by_a_side(triangles, crossings)]
    found = far if len(far) else crossings
    where = place(vertices[triangles[found[0]]].mean(axis=(0, 1)))
    if len(far):
        raise InputError(
            f"passes through itself: {counted(len(far), 'pair')} of triangles cross, "
            f"the first at {where}"
        )
    return [
        f"the wall is creased: {counted(len(found), 'pair')} of neighbouring triangles cross, "
        f"the first at {where}"
    ]


def _joined_by_a_side(triangles: IntArray, pairs: IntArray) -> NDArray[np.bool_]:
    """Whether a side of the mesh joins the two triangles of each pair (p, 2)."""
    ends = edges_of(triangles).ends
    base = int(triangles.max()) + 1
    one, two = triangles[pairs[:, 0]][:, :, None], triangles[pairs[:, 1]][:, None, :]
    keys = np.minimum(one, two) * base + np.maximum(one, two)
    there = np.isin(keys, ends[:, 0] * base + ends[:, 1])
    return np.any(there.reshape(len(pairs), -1), axis=1)


def self_intersections(vertices: Array, triangles: IntArray) -> IntArray:
    """Pairs (p, 2) of triangles without a common vertex that cross."""
    corners = vertices[triangles]
    low, high = corners.min(axis=1), corners.max(axis=1)
    axis = int(np.argmax(np.ptp(vertices, axis=0)))
    order = np.argsort(low[:, axis], kind="stable")
    found = _crossings(corners[order], triangles[order], low[order], high[order], axis)
    pairs = np.sort(order[found], axis=1)
    return pairs[np.lexsort(pairs.T[::-1])]


@njit(cache=True, error_model="numpy")
def _crossings(corners: Array, triangles: IntArray, low: Array, high: Array, axis: int) -> IntArray:
    """Pairs that cross, of triangles sorted by ``low`` along ``axis``."""
    second, third = (axis + 1) % 3, (axis + 2) % 3
    found = [(-1, -1)]
    for i in range(len(triangles)):
        for j in range(i + 1, len(triangles)):
            if low[j, axis] > high[i, axis]:
                break
            if low[j, second] > high[i, second] or low[i, second] > high[j, second]:
                continue
            if low[j, third] > high[i, third] or low[i, third] > high[j, third]:
                continue
            if _share(triangles[i], triangles[j]):
                continue
            if _pierces(corners[i], corners[j]) or _pierces(corners[j], corners[i]):
                found.append((i, j))
    return np.array(found)[1:]


@njit(cache=True, error_model="numpy")
def _share(one: IntArray, two: IntArray) -> bool:
    for a in one:
        for b in two:
            if a == b:
                return True
    return False


@njit(cache=True, error_model="numpy")
def _pierces(one: Array, two: Array) -> bool:
    """Whether a side of triangle ``one`` (3, 3) goes through the inside of ``two``."""
    height = (_volume(two, one[0]), _volume(two, one[1]), _volume(two, one[2]))
    for k in range(3):
        following = (k + 1) % 3
        if not height[k] * height[following] < 0.0:
            continue
        p, q = one[k], one[following]
        a = _six_volume(p, q, two[0], two[1])
        b = _six_volume(p, q, two[1], two[2])
        c = _six_volume(p, q, two[2], two[0])
        if (a > 0.0 and b > 0.0 and c > 0.0) or (a < 0.0 and b < 0.0 and c < 0.0):
            return True
    return False


@njit(cache=True, error_model="numpy")
def _volume(triangle: Array, point: Array) -> float:
    return _six_volume(triangle[0], triangle[1], triangle[2], point)


@njit(cache=True, error_model="numpy")
def _six_volume(a: Array, b: Array, c: Array, d: Array) -> float:
    """Six times the signed volume of a tetrahedron."""
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    wx, wy, wz = d[0] - a[0], d[1] - a[1], d[2] - a[2]
    return ux * (vy * wz - vz * wy) + uy * (vz * wx - vx * wz) + uz * (vx * wy - vy * wx)
