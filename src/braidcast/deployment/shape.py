"""A deployed braid, simulated or predicted, and what is measured on it."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from braidcast.case import Case
from braidcast.devices import Braid

Array = NDArray[np.float64]


class DeployedBraid(Protocol):
    """What every kind of result has."""

    @property
    def case(self) -> Case: ...

    @property
    def positions(self) -> Array: ...

    @property
    def wires(self) -> NDArray[np.int64]: ...

    @property
    def wire_distance(self) -> Array: ...


def nodes_of_wires(braid: Braid) -> NDArray[np.int64]:
    """Nodes along each wire, (wires, segments + 1)."""
    return np.arange(braid.node_count).reshape(braid.wires, -1)


def ring_centres(braid: Braid, positions: Array) -> Array:
    """Means of the nodes (N, 3) of each ring, (rings, 3) mm."""
    count = np.bincount(braid.rings)
    sums = [np.bincount(braid.rings, weights=coordinate) for coordinate in positions.T]
    return np.stack(sums, axis=1) / count[:, None]


def braid_length(braid: Braid, positions: Array) -> float:
    """Length of the line through the ring centres of nodes (N, 3), mm."""
    segments = np.diff(ring_centres(braid, positions), axis=0)
    return float(np.linalg.norm(segments, axis=1).sum())


def wire_distance(case: Case, positions: Array) -> Array:
    """Free space between wire and wall at nodes (N, 3), (N,) mm, negative in penetration."""
    return -case.vessel_geometry.distance(positions) - case.braid.wire_radius


def foreshortening_percent(deployed_length: float, crimped_length: float) -> float:
    """Length lost from the crimped to the deployed stent, in percent of the crimped length."""
    return 100.0 * (1.0 - deployed_length / crimped_length)
