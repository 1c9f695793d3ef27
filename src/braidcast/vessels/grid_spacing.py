"""How fine a grid of distances has to be for a vessel, and how fine it can be."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from braidcast.errors import InputError
from braidcast.vessels.edges import area_vectors
from braidcast.vessels.lumen_surface import LumenSurface
from braidcast.vessels.mesh_distance import MeshDistance

Array = NDArray[np.float64]

EXTENSION = 5.0
"""Length by which the wall is continued at each opening, mm."""
MARGIN = 1.0
"""Between the surface and the faces of the grid, mm."""
MOST_POINTS = 250_000_000
"""Largest grid: 1 GB."""
FINEST, USUAL, COARSEST = 0.03, 0.1, 0.15
"""Spacings, mm: the least and the largest that is taken where it fits, and the largest at all."""
# A sharp edge is rounded by some 0.2 h, which stays near the radius of a wire.
_WIRES = 8.0
# Places of the wall at which the lumen's width is measured.
_PLACES = 500


def usual_spacing(surface: LumenSurface, wire_radius: float) -> float:
    """Spacing, mm, of the grid for a vessel and wires of ``wire_radius`` mm.

    At most 0.1 mm, 8 wire radii and 0.1 mm (R/1 mm)^¾, which holds the error of the spline, some
    h⁴/R³, to that of a lumen of radius R = 1 mm; at least 0.03 mm, and as large as a grid of 250
    million points makes necessary. R is the radius of the ball that fits into the lumen at a
    narrow place (5 % of the wall have less). ``InputError``, its text to follow the surface's name,
    if 0.15 mm is too fine for the grid.
    """
    size = grown_size(surface)
    least = least_spacing(size)
    if least > COARSEST:
        raise InputError(
            f"is {' x '.join(f'{side:.0f}' for side in size)} mm with its continued ends, "
            f"too large for a grid of {MOST_POINTS / 1e6:.0f} million points {COARSEST} mm apart: "
            "cut it to the part of the vessel that is needed"
        )
    radius = narrow_radius(surface)
    return max(least, FINEST, min(USUAL, _WIRES * wire_radius, USUAL * radius**0.75))


def grown_size(surface: LumenSurface) -> Array:
    """Box (3,) mm of the surface with its ends continued, and the margin."""
    points = [surface.vertices]
    for opening in surface.openings:
        rim = surface.vertices[opening.rim]
        points.append(rim + (EXTENSION + np.ptp(rim @ opening.normal)) * opening.normal)
    return np.asarray(np.ptp(np.concatenate(points), axis=0) + 2.0 * MARGIN)


def grid_shape(size: Array, spacing: float, block: int = 8) -> tuple[int, int, int]:
    """Nodes each way of a grid over a box of ``size`` (3,) mm, in whole blocks."""
    x, y, z = (block * math.ceil((side / spacing + 3.0) / block) for side in size)
    return x, y, z


def least_spacing(size: Array) -> float:
    """Smallest spacing, mm, in steps of 1 %, whose grid over ``size`` (3,) mm is allowed."""
    spacing = (float(np.prod(size)) / MOST_POINTS) ** (1.0 / 3.0)
    while math.prod(grid_shape(size, spacing)) > MOST_POINTS:
        spacing *= 1.01
    return spacing


def narrow_radius(surface: LumenSurface) -> float:
    """Radius, mm, that the ball touching the wall from inside has at all but 5 % of the wall."""
    vectors = area_vectors(surface.vertices, surface.triangles)
    areas = np.linalg.norm(vectors, axis=1)
    chosen = np.random.default_rng(0).choice(len(areas), _PLACES, p=areas / areas.sum())
    places = surface.vertices[surface.triangles[chosen]].mean(axis=1)
    inward = -vectors[chosen] / areas[chosen, None]
    distance = MeshDistance(surface)
    low, high = np.zeros(_PLACES), np.full(_PLACES, 0.5 * float(np.ptp(surface.vertices)))
    for _ in range(12):
        radius = 0.5 * (low + high)
        near = -distance.distance(places + radius[:, None] * inward)
        fits = near >= 0.95 * radius
        low, high = np.where(fits, radius, low), np.where(fits, high, radius)
    return float(np.quantile(low, 0.05))
