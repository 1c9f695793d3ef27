"""Geometry of a braided tube: wires, nodes, elements and crossings.

Paper, section 2.1.1, read as settled in the project's errata: the height grows
along the wire, the angular step is 2π/N_w so that every crossing is a node, and both families of
wires lie on one cylinder of radius R_s + r_w.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from braidcast.errors import InputError

Scalar = TypeVar("Scalar", bound=np.generic)


@dataclass(frozen=True)
class Braid:
    """A braid of ``wires`` helices, half of them turning each way, free of load.

    Node i of wire n has the index ``n (segments + 1) + i``; wires 0 … N_w/2 − 1 turn
    anticlockwise seen from +z, the others clockwise::

        θ = ±i Δθ + n 2π/(N_w/2),   z = i L/segments,   r = R_s + r_w,   Δθ = 2π/N_w

    Lengths in mm, the modulus in MPa. ``radius`` is R_s, the inner radius of the free braid, and
    ``literal_angle`` takes Δθ = 2π/(N_w/2) as the paper prints it: then every second crossing of
    the wires falls inside an element and stays unjoined.

    Raises ``InputError`` if a field is out of range.
    """

    wires: int = 48
    radius: float = 2.6
    length: float = 15.0
    segments: int = 70
    wire_radius: float = 0.014
    young_modulus: float = 225_000.0
    poisson_ratio: float = 0.33
    literal_angle: bool = False

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not isinstance(value, (int, float, np.integer, np.floating)) or not math.isfinite(
                value
            ):
                raise InputError(f"{field.name} = {value!r} must be a finite number")
        self._require_whole("wires", 4)
        self._require_whole("segments", 1)
        if self.wires % 2:
            raise InputError(
                f"wires = {self.wires} must be even, because half of them turn each way"
            )
        for name in ("radius", "length", "wire_radius", "young_modulus"):
            if getattr(self, name) <= 0.0:
                raise InputError(f"{name} = {getattr(self, name)} must be positive")
        if not -1.0 < self.poisson_ratio <= 0.5:
            raise InputError(
                f"poisson_ratio = {self.poisson_ratio} must be in (-1, 0.5], "
                "the range of a stable isotropic material"
            )
        if self.wire_spacing <= 2.0 * self.wire_radius:
            raise InputError(
                f"wire_radius = {self.wire_radius} mm must be below {self.wire_spacing / 2.0:.4g} "
                "mm, half the distance of neighbouring wires, or the wires overlap"
            )

    def _require_whole(self, name: str, least: int) -> None:
        value = getattr(self, name)
        if isinstance(value, bool) or value != int(value) or value < least:
            raise InputError(f"{name} = {value} must be a whole number, {least} or more")

    @property
    def axis_radius(self) -> float:
        """Radius of the cylinder the wire axes lie on, R_s + r_w, mm."""
        return self.radius + self.wire_radius

    @property
    def usual_crimped_radius(self) -> float:
        """Of the wire axes where nobody says otherwise, 0.3 (R_s + r_w), mm (errata row 8)."""
        return 0.3 * self.axis_radius

    @property
    def angle_step(self) -> float:
        """Angle Δθ between neighbouring nodes of a wire, rad."""
        return 2.0 * math.pi / (self.wires // 2 if self.literal_angle else self.wires)

    @property
    def pitch_angle(self) -> float:
        """Angle between the free helix and the plane across the axis, rad."""
        return math.atan2(self.length, self.segments * self.angle_step * self.axis_radius)

    @property
    def wire_spacing(self) -> float:
        """Distance between the axes of neighbouring wires of one family, square to them, mm."""
        around = 2.0 * math.pi * self.axis_radius / (self.wires // 2)
        return around * math.sin(self.pitch_angle)

    @property
    def segment_length(self) -> float:
        """Length of an element, the chord between neighbouring nodes, mm."""
        return math.hypot(self.length / self.segments, self._chord_across(self.axis_radius))

    @property
    def straight_length(self) -> float:
        """Length of a wire drawn straight, the limit of the braid's length, mm."""
        return self.segments * self.segment_length

    def crimped_length(self, radius: float) -> float:
        """Length of the braid, mm, with its wire axes on a cylinder of ``radius`` mm.

        The elements keep their length l_c and the wires their turns:
        n √(l_c² − (2R sin Δθ/2)²). ``InputError`` if no such braid exists.
        """
        across = self._chord_across(radius)
        if not (radius > 0.0 and across < self.segment_length):
            largest = self.segment_length / (2.0 * math.sin(self.angle_step / 2.0))
            raise InputError(f"crimped radius = {radius} mm must be in (0, {largest:.4g}) mm")
        return self.segments * math.sqrt(self.segment_length**2 - across**2)

    def _chord_across(self, radius: float) -> float:
        return 2.0 * radius * math.sin(self.angle_step / 2.0)

    @property
    def node_count(self) -> int:
        """Number of nodes N."""
        return self.wires * (self.segments + 1)

    @cached_property
    def positions(self) -> NDArray[np.float64]:
        """Nodes of the free braid, (N, 3) mm; axis z, first ring at z = 0."""
        return self.positions_on_cylinder(self.axis_radius, self.length)

    def positions_on_cylinder(self, radius: float, length: float) -> NDArray[np.float64]:
        """Nodes, (N, 3) mm, of the braid drawn to a cylinder of ``radius`` and ``length`` mm."""
        half = self.wires // 2
        start = np.arange(half) * (2.0 * np.pi / half)
        turn = np.arange(self.segments + 1) * self.angle_step
        angle = np.concatenate([start[:, None] + turn, start[:, None] - turn])
        height = np.arange(self.segments + 1) * (length / self.segments)
        x, y, z = np.broadcast_arrays(radius * np.cos(angle), radius * np.sin(angle), height)
        return _fixed(np.stack([x, y, z], axis=-1).reshape(-1, 3))

    @cached_property
    def tangents(self) -> NDArray[np.float64]:
        """Unit tangents of the free helices at the nodes, (N, 3)."""
        across = self.positions[:, 1::-1] * self.angle_step
        sense = np.where(self.wire_of_node < self.wires // 2, 1.0, -1.0)
        rise = np.full(self.node_count, self.length / self.segments)
        along = np.stack([-sense * across[:, 0], sense * across[:, 1], rise], axis=-1)
        return _fixed(along / np.linalg.norm(along, axis=1, keepdims=True))

    @cached_property
    def elements(self) -> NDArray[np.int64]:
        """Node pairs of the beams, (M, 2), wire after wire, along increasing z."""
        nodes = np.arange(self.node_count).reshape(self.wires, -1)
        return _fixed(np.stack([nodes[:, :-1], nodes[:, 1:]], axis=-1).reshape(-1, 2))

    @cached_property
    def crossings(self) -> NDArray[np.int64]:
        """Pairs of coincident nodes, (C, 2), one of each family, ring after ring.

        On ring i the anticlockwise wire n meets the clockwise wire n + 2i Δθ/(4π/N_w), modulo
        N_w/2: whole numbers for both values of Δθ.
        """
        half = self.wires // 2
        ring, wire = np.divmod(np.arange((self.segments + 1) * half), half)
        shift = 2 * ring if self.literal_angle else ring
        other = half + (wire + shift) % half
        return _fixed(np.stack([wire, other], axis=-1) * (self.segments + 1) + ring[:, None])

    @cached_property
    def rings(self) -> NDArray[np.int64]:
        """Ring index 0 … segments of each node, (N,)."""
        return _fixed(np.tile(np.arange(self.segments + 1), self.wires))

    @cached_property
    def wire_of_node(self) -> NDArray[np.int64]:
        """Wire index 0 … N_w − 1 of each node, (N,)."""
        return _fixed(np.repeat(np.arange(self.wires), self.segments + 1))

    @cached_property
    def end_nodes(self) -> NDArray[np.int64]:
        """Nodes of the two end rings, (2 N_w,), increasing."""
        return _fixed(np.flatnonzero((self.rings == 0) | (self.rings == self.segments)))


def _fixed(array: NDArray[Scalar]) -> NDArray[Scalar]:
    # Cached arrays are shared by every caller: nobody may write to them.
    array.flags.writeable = False
    return array
