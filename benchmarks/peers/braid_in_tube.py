"""The problem both codes solve, numbers only: crimp a braid, open it, release it in a tube.

The paper's device: 48 wires of 70 straight elements, crossings joined in translation and free in
rotation. Three states follow from each other:

1. crimped: every node moved along its radius to ``CRIMPED_RADIUS``;
2. opened: every node moved along its radius to ``OPENED_RADIUS``;
3. released: only the wall of a rigid tube holds the nodes along their radius, by a spring each
   that pushes and never pulls, k times the length of wire that belongs to the node.

Throughout no node moves around the axis and the first ring stays in its plane. Every crossing lies
in a plane of mirror symmetry of the braid, so the symmetric solution does not move around the axis
anyway; holding it there only excludes buckling out of symmetry. Lengths mm, forces N.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

WIRES = 48
SEGMENTS = 70
LENGTH = 15.0
WIRE_RADIUS = 0.014
FREE_RADIUS = 2.6 + WIRE_RADIUS
YOUNG_MODULUS = 225_000.0
POISSON_RATIO = 0.33

CRIMPED_RADIUS = 0.45 * FREE_RADIUS
OPENED_RADIUS = 1.5

TUBE_RADIUS = OPENED_RADIUS + WIRE_RADIUS
"""Inner radius: the opened braid touches the tube everywhere and presses on it nowhere yet."""

WALL_STIFFNESS = 1.0
"""Line force per penetration, N/mm^2: the wall gives way by less than a micrometre."""

TOLERANCE = 1e-8
"""Norm of the unbalanced forces at which both stop, N (mm); wall force is some 0.1 N."""

AREA = np.pi * WIRE_RADIUS**2
INERTIA = np.pi * WIRE_RADIUS**4 / 4.0
POLAR_INERTIA = 2.0 * INERTIA
SHEAR_MODULUS = YOUNG_MODULUS / (2.0 * (1.0 + POISSON_RATIO))


@dataclass(frozen=True)
class Mesh:
    """Nodes (N, 3), each with its ``angle`` (N,) and ``ring`` (N,); the nodes of ``elements``
    (M, 2) and of the joined ``crossings`` (C, 2); ``wire_length`` (N,) that belongs to a node."""

    nodes: NDArray[np.float64]
    angle: NDArray[np.float64]
    ring: NDArray[np.int64]
    elements: NDArray[np.int64]
    crossings: NDArray[np.int64]
    wire_length: NDArray[np.float64]

    def length(self, nodes: NDArray[np.float64]) -> float:
        """Distance along the axis of the centres of first and last ring; ``nodes`` (N, 3)."""
        heights = np.bincount(self.ring, nodes[:, 2]) / WIRES
        return float(heights[-1] - heights[0])


def mesh(refinement: int = 1, rows: int = SEGMENTS) -> Mesh:
    """The braid, or its first ``rows`` rows of cells, ``refinement`` elements to a cell."""
    half, segments = WIRES // 2, refinement * rows
    ring = np.arange(segments + 1)
    turn = ring * (2.0 * np.pi / (WIRES * refinement))
    start = np.arange(half)[:, None] * (2.0 * np.pi / half)
    angle = np.concatenate([start + turn, start - turn]).ravel()
    ring = np.tile(ring, WIRES)
    height = ring * (LENGTH / (SEGMENTS * refinement))
    nodes = np.stack([FREE_RADIUS * np.cos(angle), FREE_RADIUS * np.sin(angle), height], axis=1)
    number = np.arange(len(nodes)).reshape(WIRES, segments + 1)
    elements = np.stack([number[:, :-1], number[:, 1:]], axis=-1).reshape(-1, 2)
    # on the i-th ring of crossings wire n of one family meets wire n + i of the other
    joined, wire = np.divmod(np.arange((rows + 1) * half), half)
    other = half + (wire + joined) % half
    crossings = np.stack([number[wire, refinement * joined], number[other, refinement * joined]], 1)
    lengths = np.linalg.norm(nodes[elements[:, 1]] - nodes[elements[:, 0]], axis=1)
    wire_length: NDArray[np.float64] = np.zeros(len(nodes))
    np.add.at(wire_length, elements, 0.5 * lengths[:, None])
    return Mesh(nodes, angle, ring, elements, crossings, wire_length)
