"""What a vessel from a surface is like, and where along it a device would fit."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from braidcast.devices import Braid
from braidcast.feasibility import MARGIN, least_radius, most_radius
from braidcast.vessels.edges import area_vectors
from braidcast.vessels.surface_vessel import SurfaceVessel

Array = NDArray[np.float64]

STEP = 0.1
"""Between the places looked at, mm."""

NEAR = 0.1
"""From the wall, mm, within which the grid's distance is compared with the exact one."""


@dataclass(frozen=True, eq=False)
class VesselInspection:
    """Profiles along the centreline of a vessel, for one device."""

    vessel: SurfaceVessel
    braid: Braid
    crimped_radius: float

    @cached_property
    def along(self) -> Array:
        """Arc lengths (n,), mm."""
        length = self.vessel.centreline.length
        return np.linspace(0.0, length, max(2, round(length / STEP)))

    @cached_property
    def places(self) -> Array:
        """Points (n, 3) of the centreline, mm."""
        return self.vessel.centreline.at_arc_length(self.along)

    @cached_property
    def lumen_radius(self) -> Array:
        """Of the parent vessel, (n,) mm."""
        return self.vessel.centreline.lumen_radius(self.along)

    @cached_property
    def room(self) -> Array:
        """Distance from the centreline to the wall, (n,) mm."""
        return -self.vessel.distance(self.places)

    @cached_property
    def curvature(self) -> Array:
        """Of the centreline, (n,) 1/mm."""
        return self.vessel.centreline.curvature_at_arc_length(self.along)

    @property
    def crimped_length(self) -> float:
        """Of the device, mm."""
        return self.braid.crimped_length(self.crimped_radius)

    @property
    def least_radius(self) -> float:
        """Of a lumen with room for the crimped device, mm."""
        return least_radius(self.braid, self.crimped_radius)

    @property
    def most_radius(self) -> float:
        """Of a lumen that the free device touches, mm."""
        return most_radius(self.braid)

    @property
    def tightest_bend(self) -> float:
        """Least radius of curvature of the centreline, mm."""
        return float(1.0 / max(self.curvature.max(), 1e-9))

    @cached_property
    def windows(self) -> list[tuple[float, float]]:
        """Where the proximal end of the crimped device may be put: ranges of arc length, mm.

        All along it there is room for the crimped device and a wire, and a lumen that the free one
        would touch.
        """
        fits = self.room > self.least_radius
        touches = self.lumen_radius < self.most_radius
        good = (fits & touches).astype(int)
        edges = np.flatnonzero(np.diff(np.concatenate([[0], good, [0]])))
        runs = zip(self.along[edges[::2]], self.along[edges[1::2] - 1], strict=True)
        needed, last = self.crimped_length, self.along[-1] - MARGIN
        starts = [(float(a), float(min(b, last)) - needed) for a, b in runs]
        return [(a, b) for a, b in starts if b >= a]

    @cached_property
    def grid_error(self) -> float:
        """Largest difference of grid and exact distance at places near the wall, mm."""
        surface, rng = self.vessel.surface, np.random.default_rng(0)
        count = min(20_000, len(surface.triangles))
        chosen = rng.choice(len(surface.triangles), count, replace=False)
        triangles = surface.triangles[chosen]
        shares = rng.dirichlet(np.ones(3), count)
        normals = area_vectors(surface.vertices, triangles)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        points = np.einsum("nk,nki->ni", shares, surface.vertices[triangles])
        points += rng.uniform(-NEAR, NEAR, (count, 1)) * normals
        return float(np.abs(self.vessel.grid.distance(points) - self.vessel.distance(points)).max())
