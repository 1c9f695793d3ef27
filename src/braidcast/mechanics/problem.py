"""What can be asked: a net of beams, how it is joined, held, loaded, and what it touches."""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from braidcast.errors import InputError
from braidcast.mechanics.arrays import Array, IntArray, as_array, as_indices, require_nodes
from braidcast.mechanics.beams import BeamNet
from braidcast.mechanics.contact import Contact


@dataclass(frozen=True)
class Joints:
    """Pairs of nodes (P, 2) tied in translation, free in rotation.

    ``method`` "shared": both nodes have one translation; "penalty": a spring of ``stiffness``
    (N/mm; the paper's 1e3) on their relative displacement.
    """

    pairs: IntArray
    method: Literal["shared", "penalty"] = "shared"
    stiffness: float = 1e3

    def __post_init__(self) -> None:
        object.__setattr__(self, "pairs", as_indices("joints.pairs", self.pairs))
        if self.method not in ("shared", "penalty"):
            raise InputError(f'joints.method is "{self.method}"; use "shared" or "penalty"')
        if not (np.isfinite(self.stiffness) and self.stiffness > 0.0):
            raise InputError(f"joints.stiffness is {self.stiffness}; it must be positive")


class Supports:
    """Freedoms that are held or moved, node by node, if wanted in local axes.

    ``fixed`` (N, 6): which translations and rotations are prescribed; ``motion`` (N, 6): by how
    much at load factor 1 (mm, and a rotation vector in rad), 0 where omitted; ``axes``
    (N, 3, 3): local axes as columns, the global ones where omitted. A rotation is held by its
    local components; a motion other than 0 needs all three of the node.
    """

    def __init__(
        self, fixed: ArrayLike, motion: ArrayLike | None = None, axes: ArrayLike | None = None
    ) -> None:
        self.fixed = as_array("supports.fixed", fixed, (None, 6)) != 0.0
        count = len(self.fixed)
        self.motion: Array = np.zeros((count, 6))
        if motion is not None:
            self.motion = as_array("supports.motion", motion, (count, 6))
        self.axes: Array | None = None
        if axes is not None:
            self.axes = as_array("supports.axes", axes, (count, 3, 3))
            if not np.allclose(self.axes.transpose(0, 2, 1) @ self.axes, np.eye(3), atol=1e-9):
                raise InputError("supports.axes must be orthonormal, the axes as columns")
        if (self.motion[~self.fixed] != 0.0).any():
            raise InputError("supports.motion may only move freedoms that are fixed")
        turned = (self.motion[:, 3:] != 0.0).any(axis=1)
        if not self.fixed[turned, 3:].all():
            raise InputError("supports.motion may only turn nodes whose three rotations are fixed")

    @classmethod
    def clamp(cls, count: int, nodes: ArrayLike) -> "Supports":
        """All six freedoms of some of ``count`` nodes held."""
        held = np.atleast_1d(np.asarray(nodes))
        require_nodes("nodes", held, count)
        fixed = np.zeros((count, 6), dtype=bool)
        fixed[held] = True
        return cls(fixed)


@dataclass(frozen=True)
class Problem:
    """A net with its joints, supports, dead loads (N, 6: N and N mm) and walls.

    ``levels`` (N,), optional: numbers the nodes so that beams and joints lead only to the same or
    a neighbouring level (the rings of a braid); it is what makes the factorisation fast.
    """

    net: BeamNet
    joints: Joints | None = None
    supports: Supports | None = None
    loads: Array | None = None
    contacts: tuple[Contact, ...] = field(default=())
    levels: IntArray | None = None

    def __post_init__(self) -> None:
        count = len(self.net.nodes)
        if self.joints is not None:
            require_nodes("joints.pairs", self.joints.pairs, count)
        if self.supports is not None and len(self.supports.fixed) != count:
            raise InputError(f"supports are for {len(self.supports.fixed)} nodes, not {count}")
        if self.loads is not None:
            object.__setattr__(self, "loads", as_array("loads", self.loads, (count, 6)))
        if self.levels is not None:
            self._check_levels(count)

    def _check_levels(self, count: int) -> None:
        levels = np.asarray(self.levels)
        if levels.shape != (count,) or not np.issubdtype(levels.dtype, np.integer):
            raise InputError(f"levels must be whole numbers of shape ({count},)")
        edges = self.net.elements
        if self.joints is not None:
            edges = np.concatenate([edges, self.joints.pairs])
        far = np.abs(np.diff(levels[edges], axis=1)).ravel() > 1
        if far.any():
            first, second = edges[np.argmax(far)]
            raise InputError(
                f"levels must differ by at most 1 along beams and joints; nodes {first} and "
                f"{second} have {levels[first]} and {levels[second]}"
            )
