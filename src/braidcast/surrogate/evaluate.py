"""How good a surrogate is on simulations it has not seen, and beside models that know nothing."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from braidcast.errors import InputError
from braidcast.results_folder import number
from braidcast.surrogate.gaussian_process import Progress
from braidcast.surrogate.metrics import ClassMetrics, Interval, NodeErrors, intervals, share_inside
from braidcast.surrogate.model import SurrogateModel
from braidcast.surrogate.placed_braid import placed_braid
from braidcast.surrogate.training_set import Simulations

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Evaluation:
    """Test figures; errors of positions in mm, success being the positive class.

    ``numbers`` of the cases whose shapes were predicted, ``prediction`` their errors,
    ``projection`` those of the modes alone. Null models: ``nearest`` is the shape of the nearest
    training case (None for another dataset), ``geometry`` the geometrically placed braid.
    ``inside``: share of coordinates in their 95 % intervals. ``success`` and ``probability`` of the
    cases ``outcome_numbers``, ``classes`` and their ``intervals`` at ``threshold``.
    """

    numbers: Indices
    prediction: NodeErrors
    projection: NodeErrors
    nearest: NodeErrors | None
    geometry: NodeErrors
    inside: float
    outcome_numbers: Indices
    success: NDArray[np.bool_]
    probability: Array
    threshold: float
    classes: ClassMetrics
    intervals: dict[str, Interval]

    def figures(self) -> dict[str, Any]:
        """All of it as plain numbers, for JSON; lengths in mm."""
        shapes = {
            name: {
                "AE_mm": errors.AE_p,
                "AE_std_mm": float(errors.AE.std()),
                "ME_mm": errors.ME_p,
                "ME_std_mm": float(errors.ME.std()),
                "ME_worst_mm": float(errors.ME.max()),
                "cases_above_0.15_mm": errors.large,
            }
            for name in ("prediction", "projection", "nearest", "geometry")
            if (errors := getattr(self, name)) is not None
        }
        return {
            "shapes": {"cases": len(self.numbers), **shapes, "inside_95_percent": self.inside},
            "outcomes": {
                "cases": len(self.success),
                "threshold": self.threshold,
                **{name: number(value) for name, value in asdict(self.classes).items()},
                "intervals_95_percent": {
                    name: [number(end) for end in ends] for name, ends in self.intervals.items()
                },
            },
        }


def evaluate(
    model: SurrogateModel,
    simulations: Simulations,
    progress: Progress | None = None,
) -> Evaluation:
    """Predict what the model has not seen: the tests of its own dataset, or all of another.

    ``InputError`` if there is nothing to predict, or another device.
    """
    own = simulations.plan_id == model.record["plan_id"]
    everything = np.arange(len(simulations.cases))
    outcomes = simulations.classification_tests if own else everything
    shapes = simulations.regression_tests if own else everything[simulations.success]
    if not len(shapes) or not len(outcomes):
        raise InputError(
            "the dataset has no finished successful case that the model has not learned from, "
            "must have one or more"
        )
    true = simulations.positions[shapes]
    cases = [simulations.cases[index] for index in shapes]
    predictions = []
    for done, case in enumerate(cases):
        predictions.append(model.predict(case))
        if progress:
            progress("predict", (done + 1) / len(cases))
    predicted = np.array([prediction.positions for prediction in predictions])
    std = np.array([prediction.std for prediction in predictions])
    success = simulations.success[outcomes]
    probability = np.array([model.success_probability(simulations.cases[k]) for k in outcomes])
    return Evaluation(
        numbers=simulations.numbers[shapes],
        prediction=NodeErrors.of(predicted, true),
        projection=NodeErrors.of(
            np.array([model.projected(c, p) for c, p in zip(cases, true, strict=True)]), true
        ),
        nearest=_nearest(simulations, predictions, true) if own else None,
        geometry=NodeErrors.of(np.array([placed_braid(case).positions for case in cases]), true),
        inside=share_inside(predicted, std, true),
        outcome_numbers=simulations.numbers[outcomes],
        success=success,
        probability=probability,
        threshold=model.threshold,
        classes=ClassMetrics.of(success, probability, model.threshold),
        intervals=intervals(success, probability, model.threshold),
    )


def _nearest(simulations: Simulations, predictions: list[Any], true: Array) -> NodeErrors:
    numbers = [prediction.nearest_case for prediction in predictions]
    return NodeErrors.of(simulations.positions[np.searchsorted(simulations.numbers, numbers)], true)
