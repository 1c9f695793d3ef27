"""What can be asked: a net of beams, how it is joined, held, loaded, and what it touches."""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from braidcast.errors import InputError
from braidcast.mechanics.beams import BeamNet, IntArray
from braidcast.mechanics.contact import Contact
from braidcast.mechanics.rotations import Array


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
        pairs = np.asarray(self.pairs)
        if pairs.ndim != 2 or pairs.shape[1] != 2:
            raise InputError("joints.pairs must be node indices of shape (P, 2)")
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
        self.fixed = np.asarray(fixed, dtype=bool)
        if self.fixed.ndim != 2 or self.fixed.shape[1] != 6:
            raise InputError("supports.fixed must have shape (N, 6)")
        count = len(self.fixed)
        self.motion: Array = np.zeros((count, 6))
        if motion is not None:
            self.motion[:] = motion
        self.axes: Array | None = None
        if axes is not None:
            self.axes = np.ascontiguousarray(axes, dtype=np.float64)
            identity = np.einsum("nij,nik->njk", self.axes, self.axes)
            if self.axes.shape != (count, 3, 3) or not np.allclose(identity, np.eye(3)):
                raise InputError("supports.axes must be (N, 3, 3) orthonormal axes as columns")
        if not np.isfinite(self.motion).all():
            raise InputError("supports.motion must be finite")
        if (self.motion[~self.fixed] != 0.0).any():
            raise InputError("supports.motion may only move freedoms that are fixed")
        turned = (self.motion[:, 3:] != 0.0).any(axis=1)
        if not self.fixed[turned, 3:].all():
            raise InputError("supports.motion may only turn nodes whose three rotations are fixed")

    @classmethod
    def clamp(cls, count: int, nodes: ArrayLike) -> "Supports":
        """All six freedoms of some of ``count`` nodes held."""
        fixed = np.zeros((count, 6), dtype=bool)
        fixed[np.asarray(nodes)] = True
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
        shape = (len(self.net.nodes), 6)
        if self.supports is not None and self.supports.fixed.shape != shape:
            raise InputError(f"supports.fixed has shape {self.supports.fixed.shape}, not {shape}")
        if self.loads is not None and (
            np.shape(self.loads) != shape or not np.isfinite(self.loads).all()
        ):
            raise InputError(f"loads must be finite and of shape {shape}")
