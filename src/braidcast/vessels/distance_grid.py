"""The lumen of any surface as a smooth signed distance: a cubic B-spline of samples on a grid."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import ndimage

from braidcast.errors import InputError, OutsideGrid
from braidcast.vessels import spline_kernels
from braidcast.vessels.centreline import as_rows
from braidcast.vessels.distance_sampling import BLOCK, jumps, sample
from braidcast.vessels.extension import BEYOND, extended
from braidcast.vessels.grid_spacing import (
    EXTENSION,
    MARGIN,
    MOST_POINTS,
    grid_shape,
    least_spacing,
)
from braidcast.vessels.lumen_surface import LumenSurface
from braidcast.vessels.mesh_distance import MeshDistance
from braidcast.vessels.wording import place

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class DistanceGrid:
    """Signed distance to a surface, negative in the lumen, with continuous second derivatives.

    Near the wall it is a cubic B-spline; farther than ``reach`` from it, where contact does not
    look, it is interpolated roughly.

    Within 0.1 mm of a smooth wall the error is some 3 h⁴/(100 R³), R the smaller radius of
    curvature, beside that of the mesh; a sharp edge is rounded over about h.
    """

    origin: Array
    """First node, (3,) mm."""
    spacing: float
    """h, mm."""
    bricks: NDArray[np.float32]
    """Coefficients of the B-spline in the blocks near the wall, with those of the nodes around,
    (n, 11, 11, 11)."""
    numbers: NDArray[np.int32]
    """Which brick each block of 8³ nodes has, -1 for none; a block an entry."""
    centres: NDArray[np.float32]
    """Distance at the centre of each block, between which it is interpolated in those without."""
    ends: Array
    """Cylinders beyond the open ends in which nothing is known, (k, 8): centre, unit normal out of
    the lumen, radius, length."""
    remarks: tuple[str, ...] = ()
    """One sentence for each opening whose wall could not be continued by its full length."""

    @staticmethod
    def of(
        surface: LumenSurface,
        spacing: float,
        progress: Callable[[float], None] | None = None,
    ) -> DistanceGrid:
        """Samples a surface, its wall continued by 5 mm at the openings, ``spacing`` mm apart.

        ``progress`` is called with the share done, 0 to 1. ``InputError``, its text to follow the
        surface's name, for one that crosses itself or is turned inside out somewhere, for an
        opening that cannot be continued, and for a grid of more than 250 million points.
        """
        longer = extended(surface, EXTENSION)
        low = longer.vertices.min(axis=0) - MARGIN
        size = longer.vertices.max(axis=0) + MARGIN - low
        # One more node on each side, for the spline.
        low, shape = low - spacing, grid_shape(size, spacing)
        if math.prod(shape) > MOST_POINTS:
            raise InputError(
                f"is {' x '.join(f'{s:.0f}' for s in size)} mm with its continued ends, which "
                f"makes {math.prod(shape) / 1e6:.0f} million points of a grid with the "
                f"distance_spacing of {spacing:.4g} mm, where at most {MOST_POINTS / 1e6:.0f} "
                f"million are allowed: take {least_spacing(size) + 5e-4:.3f} mm or cut the surface "
                "to the part that is needed"
            )
        blocks = (shape[0] // BLOCK, shape[1] // BLOCK, shape[2] // BLOCK)
        reach = max(0.3, 5.0 * spacing)
        field, centres, near = sample(
            MeshDistance(longer), low, spacing, blocks, reach, progress or (lambda share: None)
        )
        ends = _ends(longer)
        _require_one_side(field, low, spacing, reach, ends)
        for axis in range(3):
            ndimage.spline_filter1d(field, 3, axis, output=field)
        numbers = np.full(blocks, -1, dtype=np.int32)
        numbers[tuple(near.T)] = np.arange(len(near))
        remarks = longer.remarks[len(surface.remarks) :]
        return DistanceGrid(low, spacing, _bricks(field, near), numbers, centres, ends, remarks)

    def evaluate(self, points: ArrayLike) -> tuple[Array, Array, Array]:
        """Signed distance (n,) mm, gradient (n, 3) and Hessian (n, 3, 3) 1/mm at points (n, 3).

        ``OutsideGrid`` if one of the points is off the grid or beyond an open end.
        """
        points = as_rows(points)
        count = len(points)
        values, gradients, hessians = np.empty(count), np.empty((count, 3)), np.empty((count, 3, 3))
        outside = spline_kernels.evaluate(*self._spline, points, values, gradients, hessians)
        self._require_inside(points, outside)
        return values, gradients, hessians

    def distance(self, points: ArrayLike) -> Array:
        """Signed distance (n,) mm at points (n, 3); ``OutsideGrid`` as in ``evaluate``."""
        return self.evaluate(points)[0]

    @property
    def _spline(self) -> spline_kernels.Spline:
        return (
            self.bricks,
            self.numbers,
            self.centres,
            self.origin,
            self.spacing,
            self.ends,
        )

    def _require_inside(self, points: Array, outside: int) -> None:
        if outside >= 0:
            raise OutsideGrid(
                f"the point {place(points[outside])} is beyond an open end of the vessel or "
                f"more than {MARGIN} mm outside all of it"
            )

    def arrays(self) -> dict[str, NDArray]:
        """Everything as arrays, for a file; ``from_arrays`` is the way back."""
        return {
            "origin": self.origin,
            "spacing": np.array(self.spacing),
            "bricks": self.bricks,
            "numbers": self.numbers,
            "centres": self.centres,
            "ends": self.ends,
            "remarks": np.array(self.remarks, dtype=np.str_),
        }

    @staticmethod
    def from_arrays(arrays: Mapping[str, NDArray]) -> DistanceGrid:
        """The grid whose ``arrays`` these are; ``KeyError`` if one is missing."""
        return DistanceGrid(
            np.require(arrays["origin"], np.float64, ["C", "W"]),
            float(arrays["spacing"]),
            np.require(arrays["bricks"], np.float32, ["C", "W"]),
            np.require(arrays["numbers"], np.int32, ["C", "W"]),
            np.require(arrays["centres"], np.float32, ["C", "W"]),
            np.require(arrays["ends"], np.float64, ["C", "W"]),
            tuple(str(remark) for remark in arrays["remarks"]),
        )


def _bricks(field: NDArray[np.float32], blocks: NDArray[np.int64]) -> NDArray[np.float32]:
    """The nodes of blocks (n, 3) and those that their splines need besides, (n, 11, 11, 11)."""
    nodes = BLOCK * blocks[:, :, None] + np.arange(-1, BLOCK + 2)
    # On the faces of the grid, where no spline is asked for, there are none outside.
    x, y, z = (np.clip(nodes[:, axis], 0, field.shape[axis] - 1) for axis in range(3))
    return field[x[:, :, None, None], y[:, None, :, None], z[:, None, None, :]]


def _ends(surface: LumenSurface) -> Array:
    ends = np.empty((len(surface.openings), 8))
    for row, opening in zip(ends, surface.openings, strict=True):
        row[0:3], row[3:6], row[7] = opening.centre, opening.normal, BEYOND
        spokes = surface.vertices[opening.rim] - opening.centre
        row[6] = np.linalg.norm(spokes, axis=1).max()
    return ends


def _require_one_side(
    field: NDArray[np.float32], origin: Array, spacing: float, reach: float, ends: Array
) -> None:
    """``InputError`` where the side changes without a wall between, except beyond an open end."""
    corners = field[:: field.shape[0] - 1, :: field.shape[1] - 1, :: field.shape[2] - 1]
    if np.count_nonzero(corners < 0.0) > 4:
        raise InputError("is turned inside out: its triangles must face out of the lumen")
    found = jumps(field, spacing, reach)
    places = origin + spacing * (found[:, :3] + 0.5 * np.eye(3)[found[:, 3]])
    for end in ends:
        offset = places - end[:3]
        along = offset @ end[3:6]
        across = np.linalg.norm(offset - along[:, None] * end[3:6], axis=1)
        behind = (along > 0.0) & (along < end[7] + spacing) & (across < end[6] + spacing)
        found, places = found[~behind], places[~behind]
    if len(found):
        blocks = np.zeros([count // BLOCK for count in field.shape], dtype=bool)
        blocks[tuple(found[:, :3].T // BLOCK)] = True
        labels, count = ndimage.label(blocks, np.ones((3, 3, 3)))
        first = places[labels[tuple(found[:, :3].T // BLOCK)] == 1]
        middle = first[np.argmin(np.linalg.norm(first - first.mean(axis=0), axis=1))]
        raise InputError(
            f"crosses itself, is folded or turned inside out near {place(middle)}"
            + (f" and at {count - 1} more places" if count > 1 else "")
            + ": which side of it is the lumen must be clear everywhere"
        )
