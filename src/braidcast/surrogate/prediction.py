"""What a prediction is: one immutable record, in the terms of a ``Deployment``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from braidcast.case import Case
from braidcast.deployment import shape
from braidcast.deployment.polydata import polydata

if TYPE_CHECKING:
    import pyvista

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Prediction:
    """A deployed braid of N nodes as a surrogate expects it; mm, s.

    The shape is that of a successful deployment whatever the outcome: shapes are learned from
    successes only.
    """

    case: Case
    positions: Array
    """Nodes, (N, 3) mm."""
    std: Array
    """Standard deviation of each coordinate of each node, (N, 3) mm."""
    success_probability: float
    threshold: float
    """The outcome is "success" from this probability on."""
    in_range: bool
    """Whether all predictors lie within the training data."""
    out_of_range: tuple[str, ...]
    """A phrase for each predictor that does not: its value, and what was trained."""
    nearest_case: int
    """Number of the training case with the nearest predictors."""
    nearest_distance: float
    """How far that is, in standard deviations of the predictors."""
    model: str
    """Which model predicts."""
    wall_seconds: float
    cpu_seconds: float
    _sampler: Callable[[int, np.random.Generator], Array] = field(repr=False)

    def sample(self, n: int, rng: np.random.Generator | int | None = None) -> Array:
        """Draw ``n`` shapes from the predicted distribution, (n, N, 3) mm; ``rng`` or its seed.

        They differ in what the modes hold; ``std`` counts what they leave out as well.
        """
        return self._sampler(n, np.random.default_rng(rng))

    @property
    def outcome(self) -> str:
        """Whether success is probable enough: "success", else "failure"."""
        return "success" if self.success_probability >= self.threshold else "failure"

    @cached_property
    def deployed_length_mm(self) -> float:
        """Length of the line through the ring centres."""
        return shape.braid_length(self.case.braid, self.positions)

    @property
    def free_length_mm(self) -> float:
        return self.case.braid.length

    @property
    def crimped_length_mm(self) -> float:
        return self.case.crimped_length

    @property
    def foreshortening_percent(self) -> float:
        """Length lost from the crimped to the deployed stent, in percent of the crimped length."""
        return shape.foreshortening_percent(self.deployed_length_mm, self.crimped_length_mm)

    @property
    def std_norm(self) -> Array:
        """Root of the summed variances of each node's coordinates, (N,) mm."""
        return np.linalg.norm(self.std, axis=1)

    @cached_property
    def wire_distance(self) -> Array:
        """Free space between the wire and the wall at each node, (N,) mm, negative in penetration:
        depth of the node inside the lumen, less the wire's radius."""
        return shape.wire_distance(self.case, self.positions)

    @property
    def point_arrays(self) -> dict[str, NDArray[Any]]:
        """Values at the nodes, (N,) or (N, components), under the names that files give them."""
        braid = self.case.braid
        return {
            "gap_mm": self.wire_distance,
            "displacement_mm": self.positions - braid.positions,
            "std_mm": self.std,
            "std_norm_mm": self.std_norm,
            "wire": braid.wire_of_node,
            "ring": braid.rings,
        }

    @property
    def wires(self) -> NDArray[np.int64]:
        """Nodes along each wire, (wires, segments + 1)."""
        return shape.nodes_of_wires(self.case.braid)

    def to_polydata(self) -> pyvista.PolyData:
        """The wires as polylines with their point arrays; needs ``braidcast[pictures]``."""
        return polydata(self.positions, self.wires, self.point_arrays)
