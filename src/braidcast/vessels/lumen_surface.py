"""The wall of a vessel as triangles, and the openings at which it ends."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Opening:
    """An open end of a vessel."""

    centre: Array
    """Centre of its area, (3,) mm."""
    normal: Array
    """Unit vector (3,) out of the lumen."""
    radius: float
    """Radius of the circle of the same area, mm."""
    rim: IntArray
    """Vertices (k,) of the surface around it, in order."""


@dataclass(frozen=True, eq=False)
class LumenSurface:
    """A wall in one piece, oriented outwards, open at its openings and nowhere else."""

    vertices: Array
    """(n, 3) mm."""
    triangles: IntArray
    """Corners (m, 3), anticlockwise seen from outside the lumen."""
    openings: tuple[Opening, ...]
    remarks: tuple[str, ...] = ()
    """One sentence for each thing that was repaired or noticed when it was read."""
