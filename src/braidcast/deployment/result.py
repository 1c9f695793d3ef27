"""What a deployment is, once simulated: one immutable record."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from braidcast.case import Case
from braidcast.deployment.polydata import polydata
from braidcast.deployment.shape import foreshortening_percent, nodes_of_wires

if TYPE_CHECKING:
    import pyvista

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Deployment:
    """A braid released in its vessel: N nodes, M elements, C crossings; mm, N, mJ, s.

    ``outcome`` is "failure" if a node of an end ring lies in the sac, else "success";
    ``clinical_outcome`` is the stricter label (errata row 16). If the solver did not reach
    equilibrium ``converged`` is False, ``reason`` says why, and the rest is its last state.
    """

    case: Case
    positions: Array
    """Nodes, (N, 3) mm."""
    rotations: Array
    """Rotation of each node's triad from the free braid, (N, 3, 3)."""
    elements: NDArray[np.int64]
    """Node pairs of the beams, (M, 2)."""
    crossings: NDArray[np.int64]
    """Pairs of joined nodes, (C, 2)."""
    wire_distance: Array
    """Free space between the wire and the wall at each node, (N,) mm, negative in penetration:
    depth of the node inside the lumen, less the wire's radius."""
    contact_force: Array
    """Size of the force the wall puts on each node, (N,) N."""
    positioned_centreline: Array
    """Ring centres of the crimped stent laid along the vessel, (rings, 3) mm: the paper's C_T."""
    outcome: str
    clinical_outcome: str
    converged: bool
    reason: str
    newton_iterations: int
    residual_N: float
    """Norm of the unbalanced forces, N."""
    residual_relative: float
    """That norm over the sum of the contact forces."""
    strain_energy_mJ: float
    max_penetration_mm: float
    crimped_length_mm: float
    deployed_length_mm: float
    free_length_mm: float
    end_nodes_in_sac: int
    wall_seconds: float
    cpu_seconds: float
    frames: list[tuple[str, Array]] = field(default_factory=list)
    """Stage and positions of intermediate states, in order; empty unless they were asked for."""

    @property
    def foreshortening_percent(self) -> float:
        """Length lost from the crimped to the deployed stent, in percent of the crimped length."""
        return foreshortening_percent(self.deployed_length_mm, self.crimped_length_mm)

    @property
    def point_arrays(self) -> dict[str, NDArray[Any]]:
        """Values at the nodes, (N,) or (N, components), under the names that files give them."""
        braid = self.case.braid
        return {
            "gap_mm": self.wire_distance,
            "contact_force_N": self.contact_force,
            "displacement_mm": self.positions - braid.positions,
            "rotation": self.rotations.reshape(-1, 9),
            "wire": braid.wire_of_node,
            "ring": braid.rings,
        }

    @property
    def wires(self) -> NDArray[np.int64]:
        """Nodes along each wire, (wires, segments + 1)."""
        return nodes_of_wires(self.case.braid)

    def to_polydata(self) -> pyvista.PolyData:
        """The wires as polylines with their point arrays; needs ``braidcast[pictures]``."""
        return polydata(self.positions, self.wires, self.point_arrays)
