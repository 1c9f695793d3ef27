"""Vessels as exact signed distance fields, negative inside the lumen.

The tube is the set of points nearer to its centreline than its radius; its distance, gradient and
Hessian follow from the nearest place of the Bézier curve, without a mesh or a grid (a mesh tube of
radius 2 mm with 20 facets is up to 25 µm too narrow). A saccular aneurysm is a sphere joined to it
(paper, section 2.1.2).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from braidcast.errors import InputError
from braidcast.vessels import kernels
from braidcast.vessels.centreline import QuadraticBezier, as_rows


class SignedDistance:
    """A lumen known by its signed distance, in mm: the methods shared by the vessels below."""

    @property
    def packed(self) -> NDArray[np.float64]:
        """The vessel as the compiled functions of ``vessels.kernels`` read it."""
        raise NotImplementedError

    def evaluate(
        self, points: ArrayLike
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Signed distance (n,) mm, gradient (n, 3) and Hessian (n, 3, 3) 1/mm at points (n, 3).

        Within 1 µm of the centreline or of the sphere's centre, where the distance has a cusp,
        the gradient fades to zero and the Hessian stays finite.
        """
        return kernels.evaluate(self.packed, as_rows(points))

    def distance(self, points: ArrayLike) -> NDArray[np.float64]:
        """Signed distance (n,) mm at points (n, 3)."""
        return kernels.distance(self.packed, as_rows(points))


@dataclass(frozen=True, eq=False)
class Tube(SignedDistance):
    """A round vessel of ``radius`` mm about its centreline, open at its ends.

    Beyond P0 and P2 the lumen goes on straight. ``InputError`` if the centreline bends more
    sharply than the radius allows.
    """

    centreline: QuadraticBezier
    radius: float

    def __post_init__(self) -> None:
        _require_positive("radius", self.radius)
        if self.radius * self.centreline.max_curvature >= 1.0:
            raise InputError(
                f"radius = {self.radius} mm must be below {1.0 / self.centreline.max_curvature:.4g}"
                " mm, the smallest radius of curvature of the centreline"
            )

    @cached_property
    def packed(self) -> NDArray[np.float64]:
        return kernels.pack_vessel(self.centreline.packed, self.radius)


@dataclass(frozen=True, eq=False)
class Sphere:
    """A sphere: ``centre`` (3,) and ``radius`` in mm."""

    centre: NDArray[np.float64]
    radius: float

    def __post_init__(self) -> None:
        centre = np.array(self.centre, dtype=np.float64)
        if centre.shape != (3,) or not np.isfinite(centre).all():
            raise InputError(f"centre = {self.centre} must be three finite numbers")
        centre.flags.writeable = False
        object.__setattr__(self, "centre", centre)
        _require_positive("radius", self.radius)

    def depth(self, points: ArrayLike) -> NDArray[np.float64]:
        """How deep points (n, 3) lie in it, (n,) mm, negative outside."""
        return self.radius - np.linalg.norm(as_rows(points) - self.centre, axis=1)


@dataclass(frozen=True, eq=False)
class SaccularVessel(SignedDistance):
    """A tube joined to a spherical aneurysm, or the tube alone.

    With d_t and d_s the distances to tube and sphere, u = d_t − d_s and w = ``neck_fillet`` mm,
    the distance is the smooth minimum::

        (d_t + d_s)/2 − φ(u)/2,   φ = w (3 + 6 (u/w)² − (u/w)⁴)/8  if |u| < w, else |u|

    twice continuously differentiable, exactly the smaller distance where the two differ by w or
    more. It takes up to 3w/16 off the sharp edge of the neck. The wall is at distance zero; in
    the depth of the neck the value is a lower bound of the depth.

    ``InputError`` for a sphere that does not meet the lumen or has no neck.
    """

    tube: Tube
    aneurysm: Sphere | None = None
    neck_fillet: float = 0.2

    def __post_init__(self) -> None:
        if not (math.isfinite(self.neck_fillet) and self.neck_fillet >= 0.0):
            raise InputError(f"neck_fillet = {self.neck_fillet} mm must be 0 or more")
        if self.aneurysm is None:
            return
        height = float(self.tube.centreline.closest(self.aneurysm.centre)[0][0])
        reach = self.tube.radius + self.aneurysm.radius
        held = self.tube.radius - self.aneurysm.radius
        if height >= reach:
            raise InputError(
                f"aneurysm centre is {height:.4g} mm from the centreline, must be below "
                f"{reach:.4g} mm, the sum of the radii, or it does not meet the vessel"
            )
        if height <= held:
            raise InputError(
                f"aneurysm centre is {height:.4g} mm from the centreline, must be above "
                f"{held:.4g} mm, or the vessel holds the whole aneurysm"
            )

    @property
    def centreline(self) -> QuadraticBezier:
        """Centreline of the parent vessel."""
        return self.tube.centreline

    def parent_distance(self, points: ArrayLike) -> NDArray[np.float64]:
        """Signed distance (n,) mm of points (n, 3) to the wall of the parent vessel alone."""
        return self.tube.distance(points)

    @cached_property
    def packed(self) -> NDArray[np.float64]:
        if self.aneurysm is None:
            return self.tube.packed
        return kernels.pack_vessel(
            self.centreline.packed,
            self.tube.radius,
            self.aneurysm.centre,
            self.aneurysm.radius,
            self.neck_fillet,
        )


def _require_positive(name: str, value: float) -> None:
    if not (math.isfinite(value) and value > 0.0):
        raise InputError(f"{name} = {value} mm must be positive")
