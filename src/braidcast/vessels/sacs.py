"""What counts as the sac: whether an end of a braid has opened into it is asked of these."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from braidcast.errors import InputError
from braidcast.vessels.centreline import as_rows
from braidcast.vessels.mesh_distance import MeshDistance
from braidcast.vessels.polyline import Polyline
from braidcast.vessels.surface_file import read_surface
from braidcast.vessels.wording import place

Array = NDArray[np.float64]


class Sac(Protocol):
    """A region of the lumen; ``centre`` (3,) and ``radius`` mm of a sphere about where it is."""

    @property
    def centre(self) -> Array: ...

    @property
    def radius(self) -> float: ...

    def depth(self, points: ArrayLike) -> Array:
        """How deep points (n, 3) lie in it, (n,) mm, negative outside."""
        ...


@dataclass(frozen=True, eq=False)
class NeckSac:
    """All beyond the parent vessel at a neck: a point on it (3,) and its radius, mm.

    The parent vessel is the tube about the centreline with its lumen's radius. Beyond the neck is
    what lies out of it, on the side of the neck, and along the vessel no farther from the neck's
    middle than its radius.
    """

    centre: Array
    radius: float
    centreline: Polyline

    def depth(self, points: ArrayLike) -> Array:
        rows, line = as_rows(points), self.centreline
        away, along = line.closest(rows)
        _, middle = line.closest(self.centre)
        beyond = away - line.lumen_radius(along)
        within = self.radius - np.abs(along - middle)
        side = self.centre - line.at_arc_length(middle)
        arms = rows - line.at_arc_length(along)
        facing = np.einsum("ij,ij->i", arms, np.broadcast_to(side, arms.shape))
        return np.minimum(np.minimum(beyond, within), facing / np.linalg.norm(side))


@dataclass(frozen=True, eq=False)
class ClosedSac:
    """The inside of a closed surface, by its signed distance."""

    distance: MeshDistance
    corners: Array
    """Vertices (n, 3) of the surface, mm."""

    @classmethod
    def read(cls, path: str, units: str = "mm") -> ClosedSac:
        """The region inside the surface at ``path``; ``InputError`` if it is none, or open."""
        surface = read_surface(path, units, closed=True)
        if surface.openings:
            raise InputError(
                f"surface = {path} is open at {place(surface.openings[0].centre)}, must be closed "
                "all around the sac"
            )
        return cls(MeshDistance(surface), surface.vertices)

    @cached_property
    def centre(self) -> Array:
        return 0.5 * (self.corners.min(axis=0) + self.corners.max(axis=0))

    @cached_property
    def radius(self) -> float:
        return float(np.linalg.norm(self.corners - self.centre, axis=1).max())

    def depth(self, points: ArrayLike) -> Array:
        return -self.distance.distance(as_rows(points))
