"""A trained surrogate: from a case to the deployed stent, its uncertainty, and its success."""

import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from braidcast.case import Case
from braidcast.surrogate.applicability import Applicability
from braidcast.surrogate.ends import EndsClassifier
from braidcast.surrogate.placed_braid import PlacedBraid
from braidcast.surrogate.prediction import Prediction
from braidcast.surrogate.recipes import Recipe
from braidcast.surrogate.rom import ReducedOrderModel

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SurrogateModel:
    """What ``train`` makes and a model file keeps. Get one from a file with ``load_model``.

    ``rom`` gives the shape of a successful deployment, ``ends`` the probability that it succeeds,
    called so from ``threshold`` on; ``interval_factor`` widens the standard deviations so that
    95 % intervals hold what they say. ``case``: one of those ``rom`` learned from, and ``numbers``
    (n,) of all of them in their dataset. ``record``: of which data the model was made, by which
    versions, and its own test figures.
    """

    recipe: Recipe
    rom: ReducedOrderModel
    ends: EndsClassifier
    threshold: float
    interval_factor: float
    applicability: Applicability
    case: Case
    numbers: NDArray[np.int64]
    record: Mapping[str, Any] = field(repr=False)

    def predict(self, case: Case) -> Prediction:
        """The deployed stent with the standard deviation of every node.

        ``InputError`` if the case has another device than the model, or no aneurysm. A case outside
        the training data is answered, with ``in_range`` False.
        """
        wall, cpu = time.perf_counter(), time.process_time()
        self.applicability.check_device(case)
        view = self.recipe.view(case)
        point = self.rom.standardised(view.predictors[None])
        mean, std = self.rom.processes_.predict_with_std(point)
        outside = self.applicability.outside(case)
        gaps = np.linalg.norm(self.rom.processes_.inputs - point, axis=1)
        nearest = int(gaps.argmin())

        def sample(count: int, rng: np.random.Generator) -> Array:
            drawn = rng.standard_normal((count, std.shape[1])) * self.interval_factor * std
            return np.stack([self._positions(view.reference, row) for row in mean + drawn])

        return Prediction(
            case=case,
            positions=self._positions(view.reference, mean[0]),
            std=self._node_std(view.reference, std[0]),
            success_probability=float(self.ends.success_probability(view.ends[None])[0]),
            threshold=self.threshold,
            in_range=not outside,
            out_of_range=outside,
            nearest_case=int(self.numbers[nearest]),
            nearest_distance=float(gaps[nearest]),
            model=str(self.record["name"]),
            wall_seconds=time.perf_counter() - wall,
            cpu_seconds=time.process_time() - cpu,
            _sampler=sample,
        )

    def positions(self, case: Case) -> Array:
        """Nodes (N, 3) mm of the deployed stent alone, in a third of the time."""
        view = self.recipe.view(case)
        coefficients = self.rom.processes_.predict(self.rom.standardised(view.predictors[None]))
        return self._positions(view.reference, coefficients[0])

    def success_probability(self, case: Case) -> float:
        """Probability that the deployment succeeds."""
        return float(self.ends.success_probability(self.recipe.view(case).ends[None])[0])

    def projected(self, case: Case, positions: Array) -> Array:
        """The best that the modes can do for nodes (N, 3) mm of a simulated case."""
        reference = self.recipe.view(case).reference
        snapshot = reference.departure(positions).reshape(1, -1)
        return self._positions(reference, self.rom.basis_.coefficients(snapshot)[0])

    def _positions(self, reference: PlacedBraid, coefficients: Array) -> Array:
        snapshot = self.rom.basis_.snapshots(coefficients)
        return reference.moved(snapshot.reshape(-1, 3))

    def _node_std(self, reference: PlacedBraid, std: Array) -> Array:
        """Standard deviations (N, 3) along x, y, z, of coefficients with ``std`` (L,).

        The covariance of each node's components, V K_L Vᵀ, turned from the axes of its ring.
        """
        covariance = (std * std) @ self._pairs + self._left_out
        turned = reference.variances_turned(covariance.reshape(6, -1))
        return self.interval_factor * np.sqrt(np.maximum(turned, 0.0))

    @cached_property
    def _pairs(self) -> Array:
        """Products v_i v_j, (L, 6 N), of the components of each mode at each node."""
        modes = self.rom.basis_.modes.reshape(len(self.rom.basis_.modes), -1, 3)
        return np.concatenate([modes[:, :, i] * modes[:, :, j] for i, j in PlacedBraid.PAIRS], 1)

    @cached_property
    def _left_out(self) -> Array:
        """The same (6 N,) of what the modes leave out, taken as independent along the axes."""
        left = self.rom.left_out_.reshape(-1, 3)
        none = np.zeros(len(left))
        return np.concatenate([left[:, i] if i == j else none for i, j in PlacedBraid.PAIRS])
