"""Nets of beams: cross-sections, states, nodes and elements; the element is ``corotational``."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from braidcast.errors import InputError
from braidcast.mechanics.arrays import IntArray, as_array, as_indices, require_nodes
from braidcast.mechanics.rotations import Array


@dataclass(frozen=True)
class Section:
    """Stiffnesses of a cross-section: ``EA`` in N, ``GJ``, ``EIy``, ``EIz`` in N mm^2.

    ``EIy`` resists bending about the second director, ``EIz`` about the third.
    """

    EA: float
    GJ: float
    EIy: float
    EIz: float

    def __post_init__(self) -> None:
        for name in ("EA", "GJ", "EIy", "EIz"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0.0):
                raise InputError(f"section.{name} is {value}; it must be a positive number")

    @classmethod
    def circular(cls, radius: float, young_modulus: float, poisson_ratio: float) -> Self:
        """Solid circle: ``radius`` in mm, ``young_modulus`` in MPa."""
        for name, value in (("radius", radius), ("young_modulus", young_modulus)):
            if not (np.isfinite(value) and value > 0.0):
                raise InputError(f"section.{name} is {value}; it must be a positive number")
        if not -1.0 < poisson_ratio <= 0.5:
            raise InputError(
                f"section.poisson_ratio is {poisson_ratio}; it must be above -1 and at most 0.5"
            )
        area = np.pi * radius**2
        inertia = np.pi * radius**4 / 4.0
        shear_modulus = young_modulus / (2.0 * (1.0 + poisson_ratio))
        bending = young_modulus * inertia
        return cls(young_modulus * area, 2.0 * shear_modulus * inertia, bending, bending)


@dataclass(frozen=True)
class State:
    """Configuration of a net: ``positions`` (N, 3) mm; ``rotations`` (N, 3, 3) from reference."""

    positions: Array
    rotations: Array

    def copy(self) -> "State":
        return State(self.positions.copy(), self.rotations.copy())


class BeamNet:
    """Nodes joined by straight, stress-free beams.

    Parameters: ``nodes`` (N, 3) mm; ``elements`` (M, 2) node indices; ``section`` one for all;
    ``second_director`` (3,) or (M, 3), the direction of the section's second axis (made normal to
    the beam; any normal when omitted, which is enough for circular sections); ``end_tangents``
    (M, 2, 3), the directions of the axis at both ends of each beam where it only approximates a
    curve: contact then sees the curve and not the polygon (the chords when omitted).

    Raises InputError for elements without length, indices out of range or values not finite.
    """

    def __init__(
        self,
        nodes: ArrayLike,
        elements: ArrayLike,
        section: Section,
        second_director: ArrayLike | None = None,
        end_tangents: ArrayLike | None = None,
    ) -> None:
        self.nodes: Array = as_array("nodes", nodes, (None, 3))
        self.elements: IntArray = as_indices("elements", elements)
        self.section = section
        if not len(self.elements):
            raise InputError("elements must be node indices of shape (M, 2), at least one")
        require_nodes("elements", self.elements, len(self.nodes))
        chords = self.nodes[self.elements[:, 1]] - self.nodes[self.elements[:, 0]]
        self.lengths: Array = np.linalg.norm(chords, axis=1)
        if not (self.lengths > 0.0).all():
            raise InputError(f"element {int(np.argmin(self.lengths))} has no length")
        e1 = chords / self.lengths[:, None]
        self.triads = _reference_triads(e1, second_director)
        self.end_tangents: Array = np.repeat(e1[:, None], 2, axis=1)
        if end_tangents is not None:
            given = as_array("end_tangents", end_tangents, (len(e1), 2, 3))
            norm = np.linalg.norm(given, axis=2, keepdims=True)
            if not ((given * self.end_tangents).sum(axis=2) > 0.0).all():
                raise InputError("end_tangents must point along their beams, from first to second")
            self.end_tangents = given / norm

    @property
    def reference(self) -> State:
        """The stress-free state."""
        return State(self.nodes.copy(), np.tile(np.eye(3), (len(self.nodes), 1, 1)))


def _reference_triads(e1: Array, second_director: ArrayLike | None) -> Array:
    """Directors (M, 3, 3) as columns, the first along the beam."""
    if second_director is None:
        least = np.argmin(np.abs(e1), axis=1)
        hint = np.eye(3)[least]
    else:
        shape = (3,) if np.ndim(second_director) == 1 else e1.shape
        hint = np.broadcast_to(as_array("second_director", second_director, shape), e1.shape)
    e3 = np.cross(e1, hint)
    norm = np.linalg.norm(e3, axis=1, keepdims=True)
    if not (norm > 1e-9).all():
        raise InputError("second_director must not lie along a beam")
    e3 = e3 / norm
    return np.ascontiguousarray(np.stack([e1, np.cross(e3, e1), e3], axis=2))
