"""The centreline of a vessel: a quadratic Bézier curve (paper, section 2.1.2)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from braidcast.errors import InputError
from braidcast.vessels import bezier


@dataclass(frozen=True, eq=False)
class QuadraticBezier:
    """B(t) = (1 − t)² P0 + 2t(1 − t) P1 + t² P2, t in [0, 1]; control points (3,) in mm.

    Beyond its ends the curve goes on along its end tangents. ``InputError`` for control points
    that are not three finite numbers, that coincide, or whose curve stops and turns back.
    """

    P0: NDArray[np.float64]
    P1: NDArray[np.float64]
    P2: NDArray[np.float64]

    def __post_init__(self) -> None:
        for name in ("P0", "P1", "P2"):
            value = np.array(getattr(self, name), dtype=np.float64)
            if value.shape != (3,) or not np.isfinite(value).all():
                raise InputError(f"{name} = {getattr(self, name)} must be three finite numbers")
            value.flags.writeable = False
            object.__setattr__(self, name, value)
        a, b = self.P1 - self.P0, self.P2 - 2.0 * self.P1 + self.P0
        size = np.linalg.norm(a) + np.linalg.norm(a + b)
        if np.linalg.norm(a + self._slowest * b) <= 1e-6 * size:
            raise InputError(
                f"P1 = {self.P1.tolist()} must differ from P0 and P2 and, if it is in line with "
                "them, lie between them: otherwise the centreline turns back on itself"
            )

    @property
    def _slowest(self) -> float:
        """t in [0, 1] where |B'| is least and the curvature largest."""
        a, b = self.P1 - self.P0, self.P2 - 2.0 * self.P1 + self.P0
        square = float(b @ b)
        return min(max(-float(a @ b) / square, 0.0), 1.0) if square > 0.0 else 0.0

    @cached_property
    def packed(self) -> NDArray[np.float64]:
        """The curve as the compiled functions of ``vessels.bezier`` read it."""
        return bezier.pack_curve(self.P0, self.P1, self.P2)

    @property
    def length(self) -> float:
        """Arc length from P0 to P2, mm."""
        return float(self.packed[13])

    def point(self, t: ArrayLike) -> NDArray[np.float64]:
        """B(t), (…, 3) mm for t (…)."""
        t = np.asarray(t, dtype=np.float64)[..., None]
        return (1.0 - t) ** 2 * self.P0 + 2.0 * t * (1.0 - t) * self.P1 + t**2 * self.P2

    def curvature(self, t: ArrayLike) -> NDArray[np.float64]:
        """Curvature |a × b|/(2 |a + t b|³), (…) 1/mm for t (…) in [0, 1]."""
        a, b = self.packed[3:6], self.packed[6:9]
        half_velocity = a + np.asarray(t, dtype=np.float64)[..., None] * b
        cubed = np.linalg.norm(half_velocity, axis=-1) ** 3
        return np.asarray(0.5 * np.sqrt(self.packed[12]) / cubed)

    @property
    def max_curvature(self) -> float:
        """Largest curvature between P0 and P2, 1/mm."""
        return float(self.curvature(self._slowest))

    def at_arc_length(self, s: ArrayLike) -> NDArray[np.float64]:
        """Points (n, 3) mm at arc lengths s (n,) mm from P0, on a tangent outside [0, length]."""
        return bezier.places(self.packed, _as_row(s))[0]

    def tangent_at_arc_length(self, s: ArrayLike) -> NDArray[np.float64]:
        """Unit tangents (n, 3) at arc lengths s (n,) mm from P0."""
        return bezier.places(self.packed, _as_row(s))[1]

    def closest(self, points: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Distance (n,) mm and arc length (n,) mm of the nearest place to each of points (n, 3).

        An arc length outside [0, length] is a place on the end tangent.
        """
        return bezier.closest_places(self.packed, as_rows(points))


def as_rows(points: ArrayLike) -> NDArray[np.float64]:
    """Points as the compiled functions take them, (n, 3); a single point (3,) is one row.

    Contiguous and, though nobody writes to it, writable: a read-only array is another type to
    the compiler, which would compile everything again.
    """
    rows = np.require(np.atleast_2d(np.asarray(points)), np.float64, ["C", "W"])
    if rows.ndim != 2 or rows.shape[1] != 3:
        raise ValueError(f"points have the shape {rows.shape}, must be (n, 3)")
    return rows


def _as_row(s: ArrayLike) -> NDArray[np.float64]:
    return np.require(np.atleast_1d(np.asarray(s)), np.float64, ["C", "W"])
