"""Samples of the distance to a mesh on a fine cubic grid: exact near the wall, cheap far from it.

The grid is divided into blocks of 8³ nodes and those into cells of 2³. The distance changes by no
more than the way walked, so that the exact distance at the centre of a block or cell says whether
any of its nodes can be within ``reach`` of the wall; then the cell's nodes are sampled. Others of
such a block are interpolated between the centres of the cells, and all farther ones between the
centres of the blocks, held to the bounds that their own centre gives. Lengths in mm.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator

from braidcast.vessels.mesh_distance import MeshDistance

Array = NDArray[np.float64]

BLOCK = 8
CELL = 2
# From the centre of a block or cell to the farthest of its nodes, in spacings.
_BLOCK_RADIUS = 0.5 * math.sqrt(3.0) * (BLOCK - 1)
_CELL_RADIUS = 0.5 * math.sqrt(3.0) * (CELL - 1)
# Over this way beyond an open end, mm, the lumen that goes on there is turned into outside.
_FADE = (0.25, 1.0)
# From here on the distance to the wall need not be exact, mm.
_FAR = 2.0
# Blocks sampled at a time: at most 500 000 nodes.
_BLOCKS_AT_A_TIME = 1000

_compile = njit(cache=True, error_model="numpy")


class Samples(NamedTuple):
    """Distances at the nodes of the grid, at the centres of its blocks, and the blocks (n, 3) that
    may have a node within reach of the wall."""

    field: NDArray[np.float32]
    centres: NDArray[np.float32]
    near: NDArray[np.int64]


def sample(
    distance: MeshDistance,
    origin: Array,
    spacing: float,
    blocks: tuple[int, int, int],
    reach: float,
    progress: Callable[[float], None],
) -> Samples:
    """Distances, mm, at the nodes of a grid of ``blocks`` of 8³ nodes.

    Those up to ``reach`` are exact. ``progress`` is called with the share done, 0 to 1.
    """
    coarse = _centres(distance, origin, spacing, blocks)
    field = np.empty([BLOCK * count for count in blocks], dtype=np.float32)
    _interpolate(coarse, _catmull_rom(), spacing * _BLOCK_RADIUS, field)
    progress(0.1)

    far = reach + spacing * _CELL_RADIUS
    halves = np.full([BLOCK // CELL * count for count in blocks], np.nan, dtype=np.float32)
    centres = coarse[2:-2, 2:-2, 2:-2]
    near = np.argwhere(np.abs(centres) <= reach + spacing * _BLOCK_RADIUS)
    for first in range(0, len(near), _BLOCKS_AT_A_TIME):
        part = near[first : first + _BLOCKS_AT_A_TIME]
        cells = _parts(BLOCK * part, BLOCK, CELL)
        values = _values(distance, origin + spacing * (cells + 0.5 * (CELL - 1)))
        halves[tuple(cells.T // CELL)] = values
        nodes = _parts(cells[np.abs(values) <= far], CELL, 1)
        field[tuple(nodes.T)] = _values(distance, origin + spacing * nodes)
        progress(0.1 + 0.9 * min(1.0, (first + len(part)) / len(near)))
    _refine(halves, far, spacing * _CELL_RADIUS, field)
    return Samples(field, np.ascontiguousarray(centres, dtype=np.float32), near)


def _centres(
    distance: MeshDistance, origin: Array, spacing: float, blocks: tuple[int, int, int]
) -> Array:
    """Distances at the centres of the blocks and of two more on each side, for the interpolation.

    Those farther than 2 mm from the wall, which take longest to find, are interpolated between
    every second of them.
    """
    axes = [np.arange(count + 4) for count in blocks]
    everyother = [np.union1d(axis[::2], axis[-1:]) for axis in axes]

    def exact(indices: NDArray[np.int64]) -> Array:
        return _values(distance, origin + spacing * (BLOCK * (indices - 2) + 0.5 * (BLOCK - 1)))

    some = np.stack(np.meshgrid(*everyother, indexing="ij"), axis=-1)
    values = exact(some.reshape(-1, 3)).reshape(some.shape[:3])
    every = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    centres: Array = RegularGridInterpolator(everyother, values)(every)
    # No farther off than the way to the corners of a cube of 16 spacings.
    near = np.abs(centres) <= _FAR + BLOCK * math.sqrt(3.0) * spacing
    centres[near] = exact(every[near])
    return centres


def _parts(corners: NDArray[np.int64], size: int, step: int) -> NDArray[np.int64]:
    """First nodes of the parts, ``step`` wide, of cubes ``size`` wide with these first nodes."""
    offsets = step * np.indices([size // step] * 3).reshape(3, -1).T
    return (corners[:, None] + offsets).reshape(-1, 3)


def _values(distance: MeshDistance, points: Array) -> Array:
    """Distance, with the lumen that goes on beyond an open end turned into outside."""
    values, overrun = distance.distance_and_overrun(points)
    beyond = np.flatnonzero(overrun)
    share = np.clip((overrun[beyond] - _FADE[0]) / (_FADE[1] - _FADE[0]), 0.0, 1.0)
    share *= share * (3.0 - 2.0 * share)
    values[beyond] += share * (np.hypot(values[beyond], overrun[beyond]) - values[beyond])
    return values


def _catmull_rom() -> Array:
    """Weights (8, 5) of five successive centres at the nodes of the middle one's block."""
    weights = np.zeros((BLOCK, 5))
    for node in range(BLOCK):
        place = (node - 0.5 * (BLOCK - 1)) / BLOCK
        first, t = (0, place + 1.0) if place < 0.0 else (1, place)
        weights[node, first : first + 4] = (
            -0.5 * t * (1.0 - t) ** 2,
            1.0 + t * t * (1.5 * t - 2.5),
            0.5 * t * (1.0 + t * (4.0 - 3.0 * t)),
            0.5 * t * t * (t - 1.0),
        )
    return weights


@_compile
def _interpolate(coarse: Array, weights: Array, radius: float, field: NDArray[np.float32]) -> None:
    """Fills the field between the centres of its blocks, within the bounds of each centre."""
    row = np.empty(coarse.shape[2])
    for i in range(field.shape[0]):
        for j in range(field.shape[1]):
            a, b = i // BLOCK, j // BLOCK
            row[:] = 0.0
            for p in range(5):
                for q in range(5):
                    weight = weights[i - BLOCK * a, p] * weights[j - BLOCK * b, q]
                    if weight != 0.0:
                        for c in range(row.size):
                            row[c] += weight * coarse[a + p, b + q, c]
            for k in range(field.shape[2]):
                c = k // BLOCK
                value = 0.0
                for r in range(5):
                    value += weights[k - BLOCK * c, r] * row[c + r]
                centre = coarse[a + 2, b + 2, c + 2]
                field[i, j, k] = min(max(value, centre - radius), centre + radius)


@_compile
def _refine(
    halves: NDArray[np.float32],
    far: float,
    radius: float,
    field: NDArray[np.float32],
) -> None:
    """Interpolates between the exact values at the centres of cells that are farther than ``far``.

    Where a cell about a node has no value, NaN, the node is held to the bounds of its own cell.
    """
    for a in range(1, halves.shape[0] - 1):
        for b in range(1, halves.shape[1] - 1):
            for c in range(1, halves.shape[2] - 1):
                centre = halves[a, b, c]
                if not abs(centre) > far:
                    continue
                for p in range(CELL):
                    for q in range(CELL):
                        for r in range(CELL):
                            x, y, z = a + 2 * p - 1, b + 2 * q - 1, c + 2 * r - 1
                            value = (
                                27.0 * centre
                                + 9.0 * (halves[x, b, c] + halves[a, y, c] + halves[a, b, z])
                                + 3.0 * (halves[a, y, z] + halves[x, b, z] + halves[x, y, c])
                                + halves[x, y, z]
                            ) / 64.0
                            i, j, k = CELL * a + p, CELL * b + q, CELL * c + r
                            if math.isnan(value):
                                value = field[i, j, k]
                            field[i, j, k] = min(max(value, centre - radius), centre + radius)


@_compile
def jumps(field: NDArray[np.float32], spacing: float, reach: float) -> NDArray[np.int64]:
    """Nodes (n, 3) and axis, as rows (n, 4), of neighbours farther apart in value than in place.

    Both within ``reach`` of the wall and on different sides of it: a distance has no such places.
    """
    found = np.empty((1024, 4), np.int64)
    count = 0
    size = field.shape
    for i in range(size[0]):
        for j in range(size[1]):
            for k in range(size[2]):
                here = field[i, j, k]
                if abs(here) > reach:
                    continue
                for axis in range(3):
                    p, q, r = i + (axis == 0), j + (axis == 1), k + (axis == 2)
                    if p == size[0] or q == size[1] or r == size[2]:
                        continue
                    there = field[p, q, r]
                    if (
                        (here < 0.0) != (there < 0.0)
                        and abs(there) <= reach
                        and abs(here - there) > 1.001 * spacing
                    ):
                        if count == found.shape[0]:
                            longer = np.empty((2 * count, 4), np.int64)
                            longer[:count] = found
                            found = longer
                        found[count, 0], found[count, 1], found[count, 2] = i, j, k
                        found[count, 3] = axis
                        count += 1
    return found[:count]
