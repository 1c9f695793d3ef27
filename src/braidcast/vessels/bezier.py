"""Compiled arithmetic of a quadratic Bézier curve continued by its end tangents.

    B(t) = P0 + 2t a + t² b,   a = P1 − P0,   b = P2 − 2 P1 + P0,   B' = 2 (a + t b),   B'' = 2b

The functions take the curve as one array made by ``pack_curve``, so that other compiled loops can
carry it about: P0 [0:3], a [3:6], b [6:9], b·b [9], a·b [10], a·a [11], |a × b|² [12], length
[13], unit tangents at P0 [14:17] and P2 [17:20], P2 [20:23]. Lengths in mm.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

CURVE_SIZE = 23

# Gauss-Legendre rule on [0, 1].
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(12)
_NODES = 0.5 * (_NODES + 1.0)
_WEIGHTS = 0.5 * _WEIGHTS

_compile = njit(cache=True, error_model="numpy")


def pack_curve(
    P0: NDArray[np.float64], P1: NDArray[np.float64], P2: NDArray[np.float64]
) -> NDArray[np.float64]:
    """The array the compiled functions read, from three control points (3,) in mm."""
    a, b = P1 - P0, P2 - 2.0 * P1 + P0
    cross = np.cross(a, b)
    curve = np.empty(CURVE_SIZE)
    curve[0:3], curve[3:6], curve[6:9], curve[20:23] = P0, a, b, P2
    curve[9:13] = b @ b, a @ b, a @ a, cross @ cross
    curve[14:17] = a / np.linalg.norm(a)
    curve[17:20] = (a + b) / np.linalg.norm(a + b)
    curve[13] = arc_length(curve, 1.0)
    return curve


@_compile
def half_speed(curve: NDArray[np.float64], t: float) -> float:
    """|a + t b| = |B'(t)|/2, mm; the sum of squares about the minimum does not cancel."""
    bb, ab, aa, cross = curve[9], curve[10], curve[11], curve[12]
    if bb > 1e-2 * aa:
        u = t + ab / bb
        return math.sqrt(bb * u * u + cross / bb)
    return math.sqrt(max(aa + t * (2.0 * ab + t * bb), 0.0))


@_compile
def arc_length(curve: NDArray[np.float64], t: float) -> float:
    """Length of the curve from 0 to t, mm.

    √(b·b) [u √(u² + k²) + k² asinh(u/k)] between its limits, u = t + a·b/b·b,
    k = |a × b|/b·b; a Gauss rule where b is small, because there the closed form cancels and the
    rule is exact to rounding.
    """
    bb, ab, aa, cross = curve[9], curve[10], curve[11], curve[12]
    if bb <= 1e-2 * aa:
        total = 0.0
        for node, weight in zip(_NODES, _WEIGHTS):  # noqa: B905 - not in compiled code
            total += weight * half_speed(curve, t * node)
        return 2.0 * t * total
    k = math.sqrt(cross) / bb
    u0 = ab / bb
    u1 = u0 + t
    total = u1 * math.hypot(u1, k) - u0 * math.hypot(u0, k)
    if k > 0.0:
        total += k * k * (math.asinh(u1 / k) - math.asinh(u0 / k))
    return math.sqrt(bb) * total


@_compile
def parameter_at_arc_length(curve: NDArray[np.float64], s: float) -> float:
    """t in [0, 1] whose arc length is s, by Newton kept inside a bracket."""
    low, high = 0.0, 1.0
    t = min(max(s / curve[13], 0.0), 1.0)
    for _ in range(60):
        excess = arc_length(curve, t) - s
        if excess < 0.0:
            low = t
        else:
            high = t
        step = excess / (2.0 * half_speed(curve, t))
        following = t - step
        if not low <= following <= high:
            following = 0.5 * (low + high)
        if abs(following - t) <= 1e-15 or abs(step) <= 1e-14:
            return following
        t = following
    return t


@_compile
def _root(c0: float, c1: float, c2: float, c3: float, low: float, high: float) -> float:
    """Root of the cubic c0 + c1 t + c2 t² + c3 t³, which increases from low to high through it."""
    f_low = c0 + low * (c1 + low * (c2 + low * c3))
    f_high = c0 + high * (c1 + high * (c2 + high * c3))
    t = low
    if f_high > f_low:
        t = low - f_low * (high - low) / (f_high - f_low)
    for _ in range(60):
        f = c0 + t * (c1 + t * (c2 + t * c3))
        if f < 0.0:
            low = t
        else:
            high = t
        following = t - f / (c1 + t * (2.0 * c2 + 3.0 * t * c3))
        if not low <= following <= high:
            following = 0.5 * (low + high)
        # Newton doubles the digits: the step after one of 1e-9 is below rounding.
        if abs(following - t) <= 1e-9:
            return following
        t = following
    return t


@_compile
def _square_distance(curve: NDArray[np.float64], t: float, x: float, y: float, z: float) -> float:
    dx = curve[0] - x + t * (2.0 * curve[3] + t * curve[6])
    dy = curve[1] - y + t * (2.0 * curve[4] + t * curve[7])
    dz = curve[2] - z + t * (2.0 * curve[5] + t * curve[8])
    return dx * dx + dy * dy + dz * dz


@_compile
def closest_parameter(
    curve: NDArray[np.float64], x: float, y: float, z: float
) -> tuple[float, float]:
    """Nearest place of the continued curve: (t in [0, 1], signed distance along the end tangent).

    The second number is 0 on the curve itself, negative before P0 and positive after P2, in mm.
    All local minima are compared. (B − x)·B'/2 is a cubic in t with b·b ≥ 0 before t³: it can
    rise through zero only before the smaller and after the larger root of its derivative.
    """
    px, py, pz = curve[0] - x, curve[1] - y, curve[2] - z
    c0 = px * curve[3] + py * curve[4] + pz * curve[5]
    c1 = 2.0 * curve[11] + px * curve[6] + py * curve[7] + pz * curve[8]
    c2 = 3.0 * curve[10]
    c3 = curve[9]
    f1 = c0 + c1 + c2 + c3
    best, best_t, best_beyond = math.inf, 0.0, 0.0
    if c0 > 0.0:
        along = -(px * curve[14] + py * curve[15] + pz * curve[16])
        best, best_beyond = px * px + py * py + pz * pz - along * along, along
    if f1 < 0.0:
        qx, qy, qz = x - curve[20], y - curve[21], z - curve[22]
        along = qx * curve[17] + qy * curve[18] + qz * curve[19]
        square = qx * qx + qy * qy + qz * qz - along * along
        if square < best:
            best, best_t, best_beyond = square, 1.0, along

    first, last = 1.0, 1.0
    discriminant = c2 * c2 - 3.0 * c1 * c3
    if c3 > 0.0 and discriminant > 0.0:
        q = -(c2 + math.copysign(math.sqrt(discriminant), c2))
        r1, r2 = q / (3.0 * c3), c1 / q
        first, last = min(max(min(r1, r2), 0.0), 1.0), min(max(max(r1, r2), 0.0), 1.0)
    if c0 <= 0.0 and c0 + first * (c1 + first * (c2 + first * c3)) >= 0.0:
        t = _root(c0, c1, c2, c3, 0.0, first)
        square = _square_distance(curve, t, x, y, z)
        if square < best:
            best, best_t, best_beyond = square, t, 0.0
    if f1 >= 0.0 and last < 1.0 and c0 + last * (c1 + last * (c2 + last * c3)) <= 0.0:
        t = _root(c0, c1, c2, c3, last, 1.0)
        square = _square_distance(curve, t, x, y, z)
        if square < best:
            best, best_t, best_beyond = square, t, 0.0
    if best == math.inf:
        # Two roots of the derivative that rounding cannot tell apart hid the crossing.
        best_t = _root(c0, c1, c2, c3, 0.0, 1.0)
    return best_t, best_beyond


@_compile
def places(
    curve: NDArray[np.float64], s: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points (n, 3) mm and unit tangents (n, 3) at arc lengths s (n,) of the continued curve."""
    points = np.empty((s.size, 3))
    tangents = np.empty((s.size, 3))
    for i in range(s.size):
        if s[i] < 0.0:
            for j in range(3):
                tangents[i, j] = curve[14 + j]
                points[i, j] = curve[j] + s[i] * curve[14 + j]
        elif s[i] > curve[13]:
            for j in range(3):
                tangents[i, j] = curve[17 + j]
                points[i, j] = curve[20 + j] + (s[i] - curve[13]) * curve[17 + j]
        else:
            t = parameter_at_arc_length(curve, s[i])
            speed = half_speed(curve, t)
            for j in range(3):
                tangents[i, j] = (curve[3 + j] + t * curve[6 + j]) / speed
                points[i, j] = curve[j] + t * (2.0 * curve[3 + j] + t * curve[6 + j])
    return points, tangents


@_compile
def closest_places(
    curve: NDArray[np.float64], points: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Distance (n,) mm and arc length (n,) mm of the nearest places of the continued curve."""
    distance = np.empty(points.shape[0])
    s = np.empty(points.shape[0])
    for i in range(points.shape[0]):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        t, beyond = closest_parameter(curve, x, y, z)
        end = 14 if t == 0.0 else 17
        distance[i] = math.sqrt(
            _square_distance(
                curve,
                t,
                x - beyond * curve[end],
                y - beyond * curve[end + 1],
                z - beyond * curve[end + 2],
            )
        )
        s[i] = arc_length(curve, t) + beyond
    return distance, s
