"""Train a surrogate on the simulations of a dataset."""

import platform
from dataclasses import asdict, dataclass, replace
from importlib.metadata import version

import numpy as np
from numpy.typing import NDArray

from braidcast import __version__
from braidcast.errors import InputError
from braidcast.surrogate.applicability import Applicability
from braidcast.surrogate.ends import EndsClassifier
from braidcast.surrogate.evaluate import Evaluation, evaluate
from braidcast.surrogate.gaussian_process import Progress
from braidcast.surrogate.model import SurrogateModel
from braidcast.surrogate.recipes import Recipe
from braidcast.surrogate.thresholds import success_threshold
from braidcast.surrogate.training_set import Simulations
from braidcast.surrogate.tuning import tune

Array = NDArray[np.float64]

FEWEST = 20
"""Successes without which there is nothing to learn a shape from."""


@dataclass(frozen=True, eq=False)
class Learned:
    """Cases as a recipe sees them: ``predictors`` (n, p) and ``snapshots`` (n, 3N)."""

    predictors: Array
    snapshots: Array


def learned(recipe: Recipe, simulations: Simulations, indices: NDArray[np.int64]) -> Learned:
    """What a recipe makes of simulations."""
    views = [recipe.view(simulations.cases[index]) for index in indices]
    departures = [
        view.reference.departure(simulations.positions[index]).ravel()
        for view, index in zip(views, indices, strict=True)
    ]
    return Learned(np.array([view.predictors for view in views]), np.array(departures))


def train(
    simulations: Simulations,
    recipe: Recipe,
    *,
    shapes: NDArray[np.int64] | None = None,
    outcomes: NDArray[np.int64] | None = None,
    progress: Progress | None = None,
) -> SurrogateModel:
    """A model from the cases ``shapes`` (successes) and ``outcomes``, indices of simulations.

    By default all that are no tests. ``InputError`` if there are too few, or more than one device.
    """
    shapes = simulations.regression_training if shapes is None else shapes
    outcomes = simulations.classification_training if outcomes is None else outcomes
    cases = [simulations.cases[index] for index in shapes]
    if len(cases) < FEWEST:
        raise InputError(f"{len(cases)} successful cases to learn from, must be {FEWEST} or more")
    first = cases[0]
    applicability = Applicability.of(first, simulations.limits)
    for case in cases:
        applicability.check_device(case)
    data = learned(recipe, simulations, shapes)
    rom = recipe.reduced_order_model(cases, max(recipe.modes))
    tuning = tune(rom, data.predictors, data.snapshots, recipe.modes, progress)
    rom.set_params(modes=tuning.modes).fit(data.predictors, data.snapshots, progress)
    seen = np.array([recipe.view(simulations.cases[index]).ends for index in outcomes])
    ends = EndsClassifier().fit(seen, simulations.end_in_sac[outcomes])
    return SurrogateModel(
        recipe=recipe,
        rom=rom,
        ends=ends,
        threshold=success_threshold(),
        interval_factor=tuning.interval_factor,
        applicability=applicability,
        case=first,
        numbers=simulations.numbers[shapes],
        record={
            "name": f"{recipe.name}, {len(shapes)} successes of {len(outcomes)} cases",
            "plan_id": simulations.plan_id,
            "shapes": len(shapes),
            "outcomes": len(outcomes),
            "cross_validation": asdict(tuning),
            "versions": {
                "braidcast": __version__,
                "python": platform.python_version(),
                **{name: version(name) for name in ("numpy", "scipy", "scikit-learn")},
            },
        },
    )


def train_and_test(
    simulations: Simulations,
    recipe: Recipe,
    *,
    cases: int | None = None,
    progress: Progress | None = None,
) -> tuple[SurrogateModel, Evaluation | None]:
    """A model that carries its own test figures, and these; None if the dataset has no tests.

    ``cases``: learn shapes from the first so many successes, outcomes from the cases up to the
    last of them. ``InputError`` if there are not so many.
    """
    shapes = simulations.regression_training
    outcomes = simulations.classification_training
    if cases is not None:
        if not FEWEST <= cases <= len(shapes):
            raise InputError(f"cases = {cases} must be from {FEWEST} to {len(shapes)}")
        shapes = shapes[:cases]
        outcomes = outcomes[outcomes <= shapes[-1]]
    model = train(simulations, recipe, shapes=shapes, outcomes=outcomes, progress=progress)
    if not len(simulations.regression_tests):
        return model, None
    found = evaluate(model, simulations)
    return replace(model, record={**model.record, "test": found.figures()}), found
