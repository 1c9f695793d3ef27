"""Compiled signed distance of a tube and a sphere with a rounded neck.

A vessel is one array made by ``pack_vessel``: the curve (see ``vessels.bezier``), the tube's
radius, the sphere's centre (3) and radius (0: no sphere), the width of the blend. ``evaluate_at``
works on one point, for callers with a compiled loop of their own.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from braidcast.vessels.bezier import CURVE_SIZE, closest_parameter

_TUBE = CURVE_SIZE
_SPHERE = CURVE_SIZE + 1
_SIZE = CURVE_SIZE + 6

# Nearer than this to a centre, in mm, directions are not resolved and 1/r is held back.
_FLOOR = 1e-3
# Least 1 − κ r cos: 0 on the evolute of the centreline, which lies outside the lumen.
_FOCUS = 1e-3

_compile = njit(cache=True, error_model="numpy")


def pack_vessel(
    curve: NDArray[np.float64],
    radius: float,
    centre: NDArray[np.float64] | None = None,
    sphere_radius: float = 0.0,
    fillet: float = 0.0,
) -> NDArray[np.float64]:
    """The array the compiled functions read; without ``centre`` the vessel has no sphere."""
    packed = np.zeros(_SIZE)
    packed[:CURVE_SIZE] = curve
    packed[_TUBE] = radius
    if centre is not None:
        packed[_SPHERE : _SPHERE + 3] = centre
        packed[_SPHERE + 3] = sphere_radius
        packed[_SPHERE + 4] = fillet
    return packed


@_compile
def _tube(
    vessel: NDArray[np.float64], x: float, y: float, z: float
) -> tuple[float, float, float, float, float]:
    """(t, place along the end tangent, vector from the nearest place of the centreline)."""
    t, beyond = closest_parameter(vessel, x, y, z)
    dx = x - vessel[0] - t * (2.0 * vessel[3] + t * vessel[6])
    dy = y - vessel[1] - t * (2.0 * vessel[4] + t * vessel[7])
    dz = z - vessel[2] - t * (2.0 * vessel[5] + t * vessel[8])
    if beyond != 0.0:
        end = 14 if t == 0.0 else 17
        dx -= beyond * vessel[end]
        dy -= beyond * vessel[end + 1]
        dz -= beyond * vessel[end + 2]
    return t, beyond, dx, dy, dz


@_compile
def _blend(u: float, width: float) -> tuple[float, float, float]:
    """φ(u), φ', φ'': |u| rounded over |u| < width."""
    if abs(u) >= width:
        return abs(u), math.copysign(1.0, u), 0.0
    r = u / width
    square = r * r
    return (
        width * (3.0 + square * (6.0 - square)) / 8.0,
        r * (3.0 - square) / 2.0,
        1.5 * (1.0 - square) / width,
    )


@_compile
def distance_at(vessel: NDArray[np.float64], x: float, y: float, z: float) -> float:
    """Signed distance, mm, at one point."""
    _, _, dx, dy, dz = _tube(vessel, x, y, z)
    tube = math.sqrt(dx * dx + dy * dy + dz * dz) - vessel[_TUBE]
    if vessel[_SPHERE + 3] <= 0.0:
        return tube
    cx, cy, cz = x - vessel[_SPHERE], y - vessel[_SPHERE + 1], z - vessel[_SPHERE + 2]
    sphere = math.sqrt(cx * cx + cy * cy + cz * cz) - vessel[_SPHERE + 3]
    phi, _, _ = _blend(tube - sphere, vessel[_SPHERE + 4])
    return 0.5 * (tube + sphere - phi)


@_compile
def evaluate_at(
    vessel: NDArray[np.float64],
    x: float,
    y: float,
    z: float,
    gradient: NDArray[np.float64],
    hessian: NDArray[np.float64],
) -> float:
    """Signed distance, mm, at one point; fills the gradient (3,) and the Hessian (3, 3), 1/mm.

    Tube, with e the direction from the nearest place of the centreline, T its unit tangent,
    n = T × e, curvature vector k and ρ the distance to it:
    ∇d = e,  ∇∇d = n nᵀ/ρ − (e·k)/(1 − ρ e·k) T Tᵀ.  Sphere: ∇∇d = (I − e eᵀ)/ρ.
    """
    t, beyond, dx, dy, dz = _tube(vessel, x, y, z)
    rho = math.sqrt(dx * dx + dy * dy + dz * dz)
    distance = rho - vessel[_TUBE]
    share_tube, share_sphere, bend = 1.0, 0.0, 0.0
    cx, cy, cz, r = 0.0, 0.0, 0.0, 1.0
    if vessel[_SPHERE + 3] > 0.0:
        cx, cy, cz = x - vessel[_SPHERE], y - vessel[_SPHERE + 1], z - vessel[_SPHERE + 2]
        r = math.sqrt(cx * cx + cy * cy + cz * cz)
        sphere = r - vessel[_SPHERE + 3]
        phi, slope, bend = _blend(distance - sphere, vessel[_SPHERE + 4])
        distance = 0.5 * (distance + sphere - phi)
        share_tube, share_sphere = 0.5 * (1.0 - slope), 0.5 * (1.0 + slope)

    ex, ey, ez = 0.0, 0.0, 0.0
    fx, fy, fz = 0.0, 0.0, 0.0
    xx, xy, xz, yy, yz, zz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if share_tube > 0.0:
        inverse = 1.0 / max(rho, _FLOOR)
        ex, ey, ez = inverse * dx, inverse * dy, inverse * dz
        wx, wy, wz = (
            vessel[3] + t * vessel[6],
            vessel[4] + t * vessel[7],
            vessel[5] + t * vessel[8],
        )
        square = wx * wx + wy * wy + wz * wz
        unit = 1.0 / math.sqrt(square)
        tx, ty, tz = unit * wx, unit * wy, unit * wz
        nx, ny, nz = ty * ez - tz * ey, tz * ex - tx * ez, tx * ey - ty * ex
        along = 0.0
        if beyond == 0.0:
            curvature = 0.5 * (ex * vessel[6] + ey * vessel[7] + ez * vessel[8]) / square
            along = -share_tube * curvature / max(1.0 - rho * curvature, _FOCUS)
        around = share_tube * inverse
        xx = around * nx * nx + along * tx * tx
        xy = around * nx * ny + along * tx * ty
        xz = around * nx * nz + along * tx * tz
        yy = around * ny * ny + along * ty * ty
        yz = around * ny * nz + along * ty * tz
        zz = around * nz * nz + along * tz * tz
    if share_sphere > 0.0:
        inverse = 1.0 / max(r, _FLOOR)
        fx, fy, fz = inverse * cx, inverse * cy, inverse * cz
        around = share_sphere * inverse
        xx += around * (1.0 - fx * fx)
        xy -= around * fx * fy
        xz -= around * fx * fz
        yy += around * (1.0 - fy * fy)
        yz -= around * fy * fz
        zz += around * (1.0 - fz * fz)
    if bend > 0.0:
        gx, gy, gz = ex - fx, ey - fy, ez - fz
        xx -= 0.5 * bend * gx * gx
        xy -= 0.5 * bend * gx * gy
        xz -= 0.5 * bend * gx * gz
        yy -= 0.5 * bend * gy * gy
        yz -= 0.5 * bend * gy * gz
        zz -= 0.5 * bend * gz * gz

    gradient[0] = share_tube * ex + share_sphere * fx
    gradient[1] = share_tube * ey + share_sphere * fy
    gradient[2] = share_tube * ez + share_sphere * fz
    hessian[0, 0], hessian[1, 1], hessian[2, 2] = xx, yy, zz
    hessian[0, 1] = hessian[1, 0] = xy
    hessian[0, 2] = hessian[2, 0] = xz
    hessian[1, 2] = hessian[2, 1] = yz
    return distance


@_compile
def distance(vessel: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Signed distance (n,) mm at points (n, 3)."""
    values = np.empty(points.shape[0])
    for i in range(points.shape[0]):
        values[i] = distance_at(vessel, points[i, 0], points[i, 1], points[i, 2])
    return values


@_compile
def evaluate(
    vessel: NDArray[np.float64], points: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Signed distance (n,) mm, gradient (n, 3) and Hessian (n, 3, 3) 1/mm at points (n, 3)."""
    count = points.shape[0]
    values = np.empty(count)
    gradients = np.empty((count, 3))
    hessians = np.empty((count, 3, 3))
    for i in range(count):
        values[i] = evaluate_at(
            vessel, points[i, 0], points[i, 1], points[i, 2], gradients[i], hessians[i]
        )
    return values, gradients, hessians
