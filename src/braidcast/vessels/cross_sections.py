"""The wall of a lumen seen from its centreline, in planes across it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from braidcast.vessels.lumen_path import Distance

Array = NDArray[np.float64]

RAYS = 32


def wall_points(
    distance: Distance, centres: Array, tangents: Array, reach: Array
) -> tuple[Array, NDArray[np.bool_]]:
    """Where rays from centres (m, 3) mm, square to tangents (m, 3), first meet the wall.

    Returns the wall's places (m, RAYS, 3) mm, within about 1e-4 of the reach, and whether there
    is one (m, RAYS) within ``reach`` (m,) mm; a centre outside the lumen sees none.
    """
    rays = _spokes(tangents)
    depth = -distance(centres)
    station = np.repeat(np.arange(len(centres)), RAYS)
    e = rays.reshape(-1, 3)
    origin, limit = centres[station], reach[station]
    # Inside at ``near``, f < 0; outside at ``far``, once it is known.
    near, f_near = np.zeros(len(e)), -depth[station]
    far, f_far = np.full(len(e), np.inf), np.full(len(e), np.nan)
    seen = np.zeros(len(e), dtype=bool)
    wall = np.full(len(e), np.nan)
    left = np.flatnonzero(f_near < 0.0)
    for _ in range(40):
        if len(left) == 0:
            break
        bracketed = np.isfinite(far[left])
        # No wall is nearer than the depth; a small step more brings the end of the march.
        march = near[left] - f_near[left] + 0.01 * limit[left]
        share = np.clip(f_near[left] / (f_near[left] - f_far[left]), 0.02, 0.98)
        secant = near[left] + share * (far[left] - near[left])
        t = np.where(bracketed, secant, march)
        f = distance(origin[left] + t[:, None] * e[left])
        outside = f >= 0.0
        far[left], f_far[left] = np.where(outside, t, far[left]), np.where(outside, f, f_far[left])
        near[left] = np.where(outside, near[left], t)
        f_near[left] = np.where(outside, f_near[left], f)
        met = np.abs(f) < 1e-4 * limit[left]
        wall[left[met]], seen[left[met]] = t[met], True
        left = left[~met & (near[left] < limit[left])]
    seen &= wall <= limit
    places = origin + np.where(seen, wall, 0.0)[:, None] * e
    return places.reshape(-1, RAYS, 3), seen.reshape(-1, RAYS)


def _spokes(tangents: Array) -> Array:
    """RAYS unit vectors (m, RAYS, 3), evenly round about, square to each of tangents (m, 3)."""
    least = np.eye(3)[np.argmin(np.abs(tangents), axis=1)]
    first = np.cross(tangents, least)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(tangents, first)
    angle = np.arange(RAYS) * (2.0 * np.pi / RAYS)
    return first[:, None] * np.cos(angle)[:, None] + second[:, None] * np.sin(angle)[:, None]
