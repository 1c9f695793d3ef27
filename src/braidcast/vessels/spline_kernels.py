"""Compiled evaluation of a cubic B-spline on the bricks of a cubic grid.

    f(x) = Σ c_ijk β(u − i) β(v − j) β(w − k),   (u, v, w) = (x − origin)/h,   β the cubic B-spline

Lengths in mm.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

Spline = tuple[
    NDArray[np.float32],
    NDArray[np.int32],
    NDArray[np.float32],
    NDArray[np.float64],
    float,
    NDArray[np.float64],
]
"""The first arguments of ``evaluate``."""

_compile = njit(cache=True, error_model="numpy")


@_compile
def _weights(t: float, inverse: float, weights: NDArray[np.float64]) -> None:
    """β at the four nodes about a place t in [0, 1] of a cell, and its derivatives by x: (3, 4)."""
    s = 1.0 - t
    weights[0, 0], weights[0, 3] = s * s * s / 6.0, t * t * t / 6.0
    weights[0, 1] = (4.0 - 3.0 * t * t * (1.0 + s)) / 6.0
    weights[0, 2] = (4.0 - 3.0 * s * s * (1.0 + t)) / 6.0
    weights[1, 0], weights[1, 3] = -0.5 * s * s * inverse, 0.5 * t * t * inverse
    weights[1, 1] = 0.5 * t * (3.0 * t - 4.0) * inverse
    weights[1, 2] = -0.5 * s * (3.0 * s - 4.0) * inverse
    square = inverse * inverse
    weights[2, 0], weights[2, 3] = s * square, t * square
    weights[2, 1], weights[2, 2] = (3.0 * t - 2.0) * square, (3.0 * s - 2.0) * square


@_compile
def _is_outside(
    shape: tuple[int, int, int],
    ends: NDArray[np.float64],
    u: float,
    v: float,
    w: float,
    x: float,
    y: float,
    z: float,
) -> bool:
    """Whether the distance is not known at a place: off the grid or beyond an open end."""
    a, b, c = 8.0 * shape[0] - 2.0, 8.0 * shape[1] - 2.0, 8.0 * shape[2] - 2.0
    # Written so that a coordinate that is not a number is outside.
    if not (1.0 <= u < a and 1.0 <= v < b and 1.0 <= w < c):
        return True
    for k in range(ends.shape[0]):
        dx, dy, dz = x - ends[k, 0], y - ends[k, 1], z - ends[k, 2]
        along = dx * ends[k, 3] + dy * ends[k, 4] + dz * ends[k, 5]
        if 0.0 < along <= ends[k, 7]:
            if dx * dx + dy * dy + dz * dz - along * along <= ends[k, 6] * ends[k, 6]:
                return True
    return False


@_compile
def _between_centres(
    centres: NDArray[np.float32], u: float, v: float, w: float, gradient: NDArray[np.float64]
) -> float:
    """Value between the centres of the blocks, and gradient (3,) by spacings."""
    i, s = _cell((u - 3.5) / 8.0, centres.shape[0])
    j, t = _cell((v - 3.5) / 8.0, centres.shape[1])
    k, r = _cell((w - 3.5) / 8.0, centres.shape[2])
    value = 0.0
    gradient[:] = 0.0
    for p in range(2):
        a, da = (s, 0.125) if p else (1.0 - s, -0.125)
        for q in range(2):
            b, db = (t, 0.125) if q else (1.0 - t, -0.125)
            for o in range(2):
                c, dc = (r, 0.125) if o else (1.0 - r, -0.125)
                f = np.float64(centres[i + p, j + q, k + o])
                value += a * b * c * f
                gradient[0] += da * b * c * f
                gradient[1] += a * db * c * f
                gradient[2] += a * b * dc * f
    return value


@_compile
def _cell(place: float, count: int) -> tuple[int, float]:
    """The first of the two entries, of ``count``, that a place lies between, and its share."""
    first = min(max(int(math.floor(place)), 0), count - 2)
    return first, min(max(place - first, 0.0), 1.0)


@_compile
def evaluate(
    bricks: NDArray[np.float32],
    numbers: NDArray[np.int32],
    centres: NDArray[np.float32],
    origin: NDArray[np.float64],
    spacing: float,
    ends: NDArray[np.float64],
    points: NDArray[np.float64],
    values: NDArray[np.float64],
    gradients: NDArray[np.float64],
    hessians: NDArray[np.float64],
) -> int:
    """Fills value, gradient and Hessian at points (n, 3); the first place that is outside, or -1.

    In blocks without a brick the value is interpolated linearly between the centres of the blocks.
    ``ends`` (k, 8): centre, unit normal, radius and length of the cylinders beyond the open ends,
    in which nothing is known.
    """
    inverse = 1.0 / spacing
    a, b, c = np.empty((3, 4)), np.empty((3, 4)), np.empty((3, 4))
    for n in range(points.shape[0]):
        x, y, z = points[n, 0], points[n, 1], points[n, 2]
        u, v, w = (x - origin[0]) * inverse, (y - origin[1]) * inverse, (z - origin[2]) * inverse
        if _is_outside(numbers.shape, ends, u, v, w, x, y, z):
            return n
        i, j, k = int(u), int(v), int(w)
        brick = numbers[i // 8, j // 8, k // 8]
        if brick < 0:
            values[n] = _between_centres(centres, u, v, w, gradients[n])
            for axis in range(3):
                gradients[n, axis] *= inverse
                for other in range(3):
                    hessians[n, axis, other] = 0.0
            continue
        i, j, k = i % 8, j % 8, k % 8
        _weights(u - math.floor(u), inverse, a)
        _weights(v - math.floor(v), inverse, b)
        _weights(w - math.floor(w), inverse, c)
        f, fx, fy, fz = 0.0, 0.0, 0.0, 0.0
        xx, xy, xz, yy, yz, zz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for p in range(4):
            g, gy, gz, gyy, gyz, gzz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for q in range(4):
                e, ez, ezz = 0.0, 0.0, 0.0
                for r in range(4):
                    value = np.float64(bricks[brick, i + p, j + q, k + r])
                    e += c[0, r] * value
                    ez += c[1, r] * value
                    ezz += c[2, r] * value
                g += b[0, q] * e
                gy += b[1, q] * e
                gyy += b[2, q] * e
                gz += b[0, q] * ez
                gyz += b[1, q] * ez
                gzz += b[0, q] * ezz
            f += a[0, p] * g
            fx += a[1, p] * g
            xx += a[2, p] * g
            fy += a[0, p] * gy
            xy += a[1, p] * gy
            yy += a[0, p] * gyy
            fz += a[0, p] * gz
            xz += a[1, p] * gz
            yz += a[0, p] * gyz
            zz += a[0, p] * gzz
        values[n] = f
        gradients[n, 0], gradients[n, 1], gradients[n, 2] = fx, fy, fz
        hessians[n, 0, 0], hessians[n, 1, 1], hessians[n, 2, 2] = xx, yy, zz
        hessians[n, 0, 1] = hessians[n, 1, 0] = xy
        hessians[n, 0, 2] = hessians[n, 2, 0] = xz
        hessians[n, 1, 2] = hessians[n, 2, 1] = yz
    return -1
