"""Choices made by cross-validation on the training data: how many modes, how wide intervals are."""

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray
from sklearn.base import clone
from sklearn.model_selection import KFold

from braidcast.surrogate.gaussian_process import Progress
from braidcast.surrogate.metrics import NodeErrors
from braidcast.surrogate.rom import ReducedOrderModel

Array = NDArray[np.float64]

FOLDS = 5

TOLERANCE = 0.02
"""Fewer modes are taken if their error is larger by no more than this share."""

LEVEL = 0.95


@dataclass(frozen=True)
class Tuning:
    """``modes`` L; ``interval_factor``: of the standard deviations, so that 95 % intervals hold
    95 % of the components; ``errors``: AE_p, mm, by L; ``ME_p``, mm, at the chosen L."""

    modes: int
    interval_factor: float
    errors: dict[int, float]
    ME_p: float


def tune(
    model: ReducedOrderModel,
    predictors: Array,
    snapshots: Array,
    counts: Sequence[int],
    progress: Progress | None = None,
) -> Tuning:
    """Cross-validate ``model`` on predictors (n, p) and snapshots (n, 3N).

    ``counts``: the numbers of modes to choose from. Modes are independent, so that one fit with
    the most of them serves fewer too.
    """
    folds = KFold(min(FOLDS, len(predictors)), shuffle=True, random_state=0)
    errors: dict[int, list[NodeErrors]] = {count: [] for count in counts}
    ratios: dict[int, list[Array]] = {count: [] for count in counts}
    for done, (train, test) in enumerate(folds.split(predictors)):
        if progress:
            progress("tune", done / folds.n_splits)
        fitted = clone(model).set_params(modes=max(counts))
        fitted.fit(predictors[train], snapshots[train])
        points, true, shape = predictors[test], snapshots[test], (len(test), -1, 3)
        coefficients, spread = fitted.processes_.predict_with_std(fitted.standardised(points))
        for count in counts:
            mean, std = fitted.assembled(coefficients[:, :count], spread[:, :count])
            errors[count].append(NodeErrors.of(mean.reshape(shape), true.reshape(shape)))
            ratios[count].append(np.abs(mean - true).ravel() / std.ravel())
    if progress:
        progress("tune", 1.0)

    def mean_over_cases(count: int, name: str) -> float:
        return float(np.concatenate([getattr(fold, name) for fold in errors[count]]).mean())

    found = {count: mean_over_cases(count, "AE") for count in errors}
    least = min(found.values())
    modes = min(count for count in found if found[count] <= (1.0 + TOLERANCE) * least)
    reached = float(np.quantile(np.concatenate(ratios[modes]), LEVEL))
    factor = reached / NormalDist().inv_cdf(0.5 + 0.5 * LEVEL)
    return Tuning(modes, factor, found, mean_over_cases(modes, "ME"))
