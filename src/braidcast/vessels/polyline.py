"""A centreline through points: a smooth curve by its arc length, with the lumen's radius."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from math import factorial

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import BSpline, CubicHermiteSpline, PPoly
from scipy.spatial import cKDTree

from braidcast.errors import InputError
from braidcast.vessels.centreline import as_rows
from braidcast.vessels.smooth_spline import DEGREE, smooth_spline

Array = NDArray[np.float64]

SMOOTHING = 0.9
"""Smoothing length, mm: a bend of radius 3 mm shrinks by 2 µm, near its ends by up to 40 µm."""
_GRID = 0.05
"""Spacing of the table of arc lengths, mm: its arc lengths are exact to about 1e-9 mm."""
_SAMPLE = 4
"""Every so many of the table's places start the search for the nearest place."""


@dataclass(frozen=True, eq=False)
class Polyline:
    """A curve x(u) with a continuous curvature, and the lumen's radius along it if known.

    Made by ``Polyline.through``. Beyond its ends it goes on along its end tangents. Arc lengths
    are in mm from its first point.
    """

    curve: BSpline
    """x(u), (3,) mm, in a parameter near the arc length."""
    radius_curve: BSpline | None = None
    """Lumen radius (1,) mm at u."""
    radius_range: tuple[float, float] = (0.0, np.inf)
    """Least and largest of the given radii, mm: the curve of radii is kept between them."""

    @classmethod
    def through(
        cls, points: ArrayLike, radii: ArrayLike | None = None, smoothing: float = SMOOTHING
    ) -> Polyline:
        """Curve near points (n, 3) mm in their order, with radii (n,) mm if given.

        Waves much shorter than 2π ``smoothing`` (mm), the steps of voxels, are smoothed away.
        Points that repeat the one before are dropped. ``InputError`` for fewer than four
        different points, a coordinate that is not finite, a radius that is not positive, or a
        curve that turns back on itself.
        """
        points, radii = _checked(points, radii)
        chord = np.linalg.norm(np.diff(points, axis=0), axis=1)
        u = np.concatenate([[0.0], np.cumsum(chord)])
        curve = None
        # Jitter makes chords too long: the places of the points on the smooth curve replace them.
        for _ in range(4):
            if curve is not None:
                u = _moved_to_nearest(curve, u, points)
            curve = smooth_spline(u, points, smoothing, 3, _spans(u, smoothing))
        line = (
            cls(curve)
            if radii is None
            else cls(
                curve,
                smooth_spline(u, radii[:, None], smoothing, 2, _spans(u, smoothing)),
                (float(radii.min()), float(radii.max())),
            )
        )
        line._refuse_sharp_turns(smoothing)
        return line

    def arrays(self) -> dict[str, NDArray]:
        """Everything as arrays, for a file; ``from_arrays`` is the way back."""
        arrays = {"knots": self.curve.t, "places": self.curve.c}
        if self.radius_curve is not None:
            arrays["radius_knots"], arrays["radii"] = self.radius_curve.t, self.radius_curve.c
            arrays["radius_range"] = np.array(self.radius_range)
        return arrays

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray]) -> Polyline:
        """The centreline whose ``arrays`` these are; ``KeyError`` if one is missing."""
        curve = BSpline(arrays["knots"], arrays["places"], DEGREE)
        if "radii" not in arrays:
            return cls(curve)
        low, high = arrays["radius_range"]
        radii = BSpline(arrays["radius_knots"], arrays["radii"], DEGREE)
        return cls(curve, radii, (float(low), float(high)))

    @cached_property
    def _motion(self) -> PPoly:
        """x, dx/du and d²x/du² side by side, (9,), as polynomials between the ends."""
        breaks = self.curve.t[DEGREE:-DEGREE]
        powers = [self.curve(breaks[:-1], k) / factorial(k) for k in range(DEGREE, -1, -1)]
        x = np.stack(powers)
        rows = np.arange(DEGREE, 0, -1.0)[:, None, None]
        velocity = np.zeros_like(x)
        velocity[1:] = rows * x[:-1]
        acceleration = np.zeros_like(x)
        acceleration[1:] = rows * velocity[:-1]
        return PPoly(np.concatenate([x, velocity, acceleration], axis=2), breaks)

    def _at(self, u: Array) -> tuple[Array, Array, Array]:
        """x, dx/du and d²x/du², each (n, 3), at u (n,)."""
        motion = self._motion(u)
        return motion[:, :3], motion[:, 3:6], motion[:, 6:]

    @cached_property
    def _table(self) -> tuple[CubicHermiteSpline, CubicHermiteSpline]:
        """Arc length by u, and u by arc length."""
        breaks = self._motion.x
        u = np.linspace(breaks[0], breaks[-1], 1 + int(np.ceil(np.ptp(breaks) / _GRID)))
        nodes, weights = np.polynomial.legendre.leggauss(4)
        half = 0.5 * np.diff(u)[:, None]
        speeds = np.linalg.norm(self._motion(u[:-1, None] + half * (1.0 + nodes))[..., 3:6], axis=2)
        s = np.concatenate([[0.0], np.cumsum((half * weights * speeds).sum(axis=1))])
        speed = np.linalg.norm(self._at(u)[1], axis=1)
        return CubicHermiteSpline(u, s, speed), CubicHermiteSpline(s, u, 1.0 / speed)

    @cached_property
    def _starts(self) -> tuple[cKDTree, Array]:
        """Places along the curve, close together, and their u."""
        u = self._table[0].x[::_SAMPLE]
        u = np.append(u, self._table[0].x[-1])
        return cKDTree(self._at(u)[0]), u

    @property
    def length(self) -> float:
        """Arc length between the ends, mm."""
        return float(self._table[1].x[-1])

    @property
    def start(self) -> Array:
        """First point, (3,) mm."""
        return self.at_arc_length(0.0)[0]

    @property
    def end(self) -> Array:
        """Last point, (3,) mm."""
        return self.at_arc_length(self.length)[0]

    @cached_property
    def max_curvature(self) -> float:
        """Largest curvature between the ends, 1/mm."""
        return float(self.curvature_at_arc_length(self._table[1].x).max())

    def at_arc_length(self, s: ArrayLike) -> Array:
        """Points (n, 3) mm at arc lengths s (n,) mm, on a tangent outside [0, length]."""
        s = _row(s)
        inside = np.clip(s, 0.0, self.length)
        beyond = (s - inside)[:, None] * self.tangent_at_arc_length(inside)
        return self._at(self._table[1](inside))[0] + beyond

    def tangent_at_arc_length(self, s: ArrayLike) -> Array:
        """Unit tangents (n, 3) at arc lengths s (n,) mm."""
        velocity = self._at(self._table[1](np.clip(_row(s), 0.0, self.length)))[1]
        return velocity / np.linalg.norm(velocity, axis=1, keepdims=True)

    def curvature_at_arc_length(self, s: ArrayLike) -> Array:
        """Curvature (n,) 1/mm at arc lengths s (n,) mm; 0 on the straight beyond the ends."""
        s = _row(s)
        u = self._table[1](np.clip(s, 0.0, self.length))
        _, velocity, acceleration = self._at(u)
        across = np.linalg.norm(np.cross(velocity, acceleration), axis=1)
        curvature = across / np.linalg.norm(velocity, axis=1) ** 3
        return np.where((s < 0.0) | (s > self.length), 0.0, curvature)

    def lumen_radius(self, s: ArrayLike) -> Array:
        """Radius (n,) mm of the lumen at arc lengths s (n,) mm, constant beyond the ends.

        ``ValueError`` if it is not known.
        """
        if self.radius_curve is None:
            raise ValueError("the radius along this centreline is not known")
        u = self._table[1](np.clip(_row(s), 0.0, self.length))
        return np.clip(self.radius_curve(u)[:, 0], *self.radius_range)

    def closest(self, points: ArrayLike) -> tuple[Array, Array]:
        """Distance (n,) mm and arc length (n,) mm of the nearest place to each of points (n, 3).

        An arc length outside [0, length] is a place on the end tangent.
        """
        points = as_rows(points)
        tree, starts = self._starts
        nearest = tree.query(points)[1]
        low = starts[np.maximum(nearest - 1, 0)]
        high = starts[np.minimum(nearest + 1, len(starts) - 1)]
        u = self._nearest(points, starts[nearest], low, high)
        distance = np.linalg.norm(self._at(u)[0] - points, axis=1)
        s = self._table[0](u)
        for at, way in ((0.0, -1.0), (self.length, 1.0)):
            end, out = self.at_arc_length(at)[0], way * self.tangent_at_arc_length(at)[0]
            along = (points - end) @ out
            beside = np.linalg.norm(points - end - along[:, None] * out, axis=1)
            beyond = (along > 0.0) & (beside <= distance)
            distance = np.where(beyond, beside, distance)
            s = np.where(beyond, at + way * along, s)
        return distance, s

    def _nearest(self, points: Array, u: Array, low: Array, high: Array) -> Array:
        """u in [low, high] where (x − p)·x' = 0, or the end of it that is nearest."""
        u, low, high = u.copy(), low.copy(), high.copy()
        left = np.arange(len(u))
        for _ in range(60):
            x, v, acceleration = self._at(u[left])
            off = x - points[left]
            slope = np.einsum("ij,ij->i", off, v)
            bend = np.einsum("ij,ij->i", v, v) + np.einsum("ij,ij->i", off, acceleration)
            low[left] = np.where(slope < 0.0, u[left], low[left])
            high[left] = np.where(slope > 0.0, u[left], high[left])
            bottom, top = low[left], high[left]
            # Newton's step, or the middle where the distance is not convex.
            new = u[left] - slope / np.where(bend > 0.1, bend, np.inf)
            new = np.where(bend > 0.1, np.clip(new, bottom, top), 0.5 * (bottom + top))
            moved = np.abs(new - u[left]) > 1e-9
            u[left] = new
            left = left[moved]
            if len(left) == 0:
                break
        return u

    def _refuse_sharp_turns(self, smoothing: float) -> None:
        """``InputError`` if the curve turns by more than 90° within ``smoothing`` mm."""
        s = self._table[1].x
        ahead = self.tangent_at_arc_length(s + smoothing)
        along = np.einsum("ij,ij->i", self.tangent_at_arc_length(s), ahead)
        if along.min() < 0.0:
            raise _turning_back(self.at_arc_length(s[np.argmin(along)] + 0.5 * smoothing)[0])


def _turning_back(place: Array) -> InputError:
    x, y, z = place
    return InputError(
        f"the centreline turns back on itself near ({x:.4g}, {y:.4g}, {z:.4g}) mm: its points "
        "must follow the vessel in order"
    )


def _checked(points: ArrayLike, radii: ArrayLike | None) -> tuple[Array, Array | None]:
    points = as_rows(points)
    if not np.isfinite(points).all():
        row = int(np.argmin(np.isfinite(points).all(axis=1)))
        raise InputError(
            f"point {row + 1} of the centreline, {points[row].tolist()}, must be three finite "
            "numbers"
        )
    new = np.concatenate([[True], np.any(np.diff(points, axis=0) != 0.0, axis=1)])
    if len(np.unique(points, axis=0)) < 4:
        raise InputError(
            f"the centreline has {len(np.unique(points, axis=0))} different points, must have "
            "four or more"
        )
    if radii is None:
        return points[new], None
    radii = np.asarray(radii, dtype=np.float64)
    if radii.shape != (len(points),):
        raise ValueError(f"radii have the shape {radii.shape}, must be ({len(points)},)")
    good = np.isfinite(radii) & (radii > 0.0)
    if not good.all():
        row = int(np.argmin(good))
        raise InputError(
            f"radius {radii[row]} mm of point {row + 1} of the centreline must be positive"
        )
    return points[new], radii[new]


def _spans(u: Array, smoothing: float) -> int:
    """Spans of the spline: fine enough for the smoothing, not many more than there are points."""
    return int(np.clip(np.ceil(2.0 * np.ptp(u) / smoothing), 4, 4 * len(u)))


def _moved_to_nearest(curve: BSpline, u: Array, points: Array) -> Array:
    """u (n,) moved one step towards the nearest places of points (n, 3), as arc lengths from 0."""
    grid = np.linspace(u.min(), u.max(), 20 * len(u))
    speeds = np.linalg.norm(curve(grid, 1), axis=1)
    if speeds.min() < 0.25 * np.median(speeds):
        raise _turning_back(curve(grid[np.argmin(speeds)]))
    s = np.concatenate([[0.0], np.cumsum(0.5 * (speeds[1:] + speeds[:-1]) * np.diff(grid))])
    velocity = curve(u, 1)
    step = np.einsum("ij,ij->i", points - curve(u), velocity) / np.linalg.norm(velocity, axis=1)
    s = np.interp(u, grid, s) + step
    return s - s.min()


def _row(s: ArrayLike) -> Array:
    return np.atleast_1d(np.asarray(s, dtype=np.float64))
