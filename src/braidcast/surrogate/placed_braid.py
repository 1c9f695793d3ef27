"""The braid as geometry alone places it: rings across the centreline, wires at the wall.

Elements keep their length, so that on a cylinder of the lumen's radius a braid has one length
(``Braid.crimped_length``); its middle stays where the middle of the crimped braid was. No sac, no
bending, no friction: what the simulation does beyond this is what is learned, in the vessel's own
axes, and it is one of the null models every surrogate must beat.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from braidcast.case import Case
from braidcast.devices import Braid

Array = NDArray[np.float64]

Z_AXIS = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class PlacedBraid:
    """``positions`` (N, 3) mm and the ``axes`` (rings, 3, 3) of each ring as columns.

    Of the axes the third lies along the vessel; the first two are those of the free braid, turned
    into the start of the vessel and on along it without twisting about it.
    """

    PAIRS: ClassVar = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
    """Components of a symmetric matrix in the order that ``variances_turned`` takes them."""

    positions: Array
    axes: Array
    length: float
    """Of the centreline between the end rings, mm."""

    def departure(self, positions: Array) -> Array:
        """How far nodes (N, 3) lie from their places, in the axes of their rings, (N, 3) mm."""
        return _by_ring(positions - self.positions, self.axes)

    def moved(self, departure: Array) -> Array:
        """Nodes (N, 3) mm that lie so far from their places."""
        return self.positions + self.turned(departure)

    def turned(self, vectors: Array) -> Array:
        """Vectors (N, 3), given in the axes of the nodes' rings, in those of space."""
        return _by_ring(vectors, self.axes.transpose(0, 2, 1))

    def variances_turned(self, covariance: Array) -> Array:
        """Variances (N, 3) along x, y, z from covariances (6, N) in the axes of the rings.

        The diagonal of R C Rᵀ, C by its ``PAIRS``.
        """
        by_ring = covariance.reshape(6, -1, len(self.axes)).transpose(2, 1, 0)
        products = np.stack(
            [
                (1.0 if i == j else 2.0) * self.axes[:, :, i] * self.axes[:, :, j]
                for i, j in self.PAIRS
            ],
            axis=1,
        )
        return (by_ring @ products).transpose(1, 0, 2).reshape(-1, 3)


def placed_braid(case: Case) -> PlacedBraid:
    """The geometrically placed braid of a case."""
    braid = case.braid
    radius = min(case.vessel_radius - braid.wire_radius, braid.axis_radius)
    length = braid.crimped_length(radius)
    middle = case.start_arc_length + 0.5 * case.crimped_length
    places = middle + length * np.linspace(-0.5, 0.5, braid.segments + 1)
    centres, tangents = (
        case.centreline.at_arc_length(places),
        case.centreline.tangent_at_arc_length(places),
    )
    first = case.centreline.tangent_at_arc_length([0.0])
    axes = _smallest_turns(first[0], tangents) @ _smallest_turns(Z_AXIS, first)
    across = radius * _unit_cylinder(braid)
    turned = _by_ring(across, axes.transpose(0, 2, 1))
    positions = np.tile(centres, (braid.wires, 1)) + turned
    return PlacedBraid(positions, axes, length)


@lru_cache
def _unit_cylinder(braid: Braid) -> Array:
    """Nodes (N, 3) of a braid without length on a cylinder of the radius 1."""
    return braid.positions_on_cylinder(1.0, 0.0)


def _by_ring(vectors: Array, factors: Array) -> Array:
    """Vectors (N, 3), wire after wire, as rows times the factors (rings, 3, 3) of their rings."""
    rings = vectors.reshape(-1, len(factors), 3).transpose(1, 0, 2)
    return (rings @ factors).transpose(1, 0, 2).reshape(-1, 3)


def _smallest_turns(start: Array, ends: Array) -> Array:
    """Smallest turns (n, 3, 3) of a unit vector (3,) into others (n, 3).

    R = c I + [v] + v vᵀ/(1 + c),  v = start × end,  c = start · end; half a turn goes about x.
    """
    v, c = ends @ _cross_matrix(start).T, ends @ start
    share = np.divide(1.0, 1.0 + c, out=np.zeros_like(c), where=c > -1.0 + 1e-12)
    turns = c[:, None, None] * np.eye(3) + share[:, None, None] * v[:, :, None] * v[:, None, :]
    turns += _cross_matrix(v)
    turns[c <= -1.0 + 1e-12] = np.diag([1.0, -1.0, -1.0])
    return turns


def _cross_matrix(v: Array) -> Array:
    """[v] (..., 3, 3) with [v] w = v × w, of vectors (..., 3)."""
    matrix = np.zeros((*v.shape, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        matrix[..., j, k], matrix[..., k, j] = -v[..., i], v[..., i]
    return matrix
