"""Whether what was left out as crumbs is nothing: no sac of its own, no body in the lumen."""

from __future__ import annotations

import numpy as np

from braidcast.errors import InputError
from braidcast.vessels.edges import Array
from braidcast.vessels.lumen_surface import LumenSurface
from braidcast.vessels.mesh_distance import MeshDistance
from braidcast.vessels.orientation import lumen_radius
from braidcast.vessels.wording import place

_TOUCHING = 0.05
"""Corners as far as this on the other side of the wall do not count, mm."""
_BODY = 0.75
"""A body in the lumen counts from this share of the lumen's radius in size on."""


def refuse_serious(corners: Array, surface: LumenSurface) -> None:
    """``InputError`` if triangles that were left out, (m, 3, 3) mm, change what the lumen is.

    That is if they lie on both sides of the wall, or in the lumen and are no small crumb.
    """
    if len(corners) == 0:
        return
    distance, overrun = MeshDistance(surface).distance_and_overrun(corners.reshape(-1, 3))
    known = overrun == 0.0
    inside = (known & (distance < -_TOUCHING)).reshape(-1, 3)
    outside = (known & (distance > _TOUCHING)).reshape(-1, 3)
    through = inside.any(axis=1) & outside.any(axis=1)
    if through.any():
        raise InputError(
            f"has a loose piece that passes through its wall at "
            f"{place(corners[through][0].mean(axis=0))}, must be one surface: join the two"
        )
    within = corners[inside.any(axis=1)].reshape(-1, 3)
    size = float(np.ptp(within, axis=0).max()) if len(within) else 0.0
    radius = lumen_radius(surface.vertices, surface.triangles)
    if size > _BODY * radius:
        raise InputError(
            f"has loose pieces up to {size:.3g} mm wide in its lumen about "
            f"{place(within.mean(axis=0))}, must be at most {_BODY * radius:.2g} mm: remove them, "
            "or cut them out of the lumen"
        )
