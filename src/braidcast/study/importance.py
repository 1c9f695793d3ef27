"""Which parameters matter: for the outcome, for the shape, and for the error of the surrogate."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.stats import qmc, sobol_indices
from sklearn.ensemble import RandomForestRegressor
from sklearn.inspection import permutation_importance

from braidcast.case import Case
from braidcast.dataset.folder import DatasetFolder
from braidcast.dataset.plan import Range
from braidcast.errors import InputError
from braidcast.study.surrogates import MODEL
from braidcast.study.workspace import Study
from braidcast.surrogate.model import SurrogateModel
from braidcast.surrogate.model_file import load_model
from braidcast.surrogate.train import learned

Array = NDArray[np.float64]

QUANTITIES = ("probability of success", "deployed length", "standard deviation")

SAMPLES = 512
"""N of Saltelli's scheme: N (parameters + 2) predictions."""

_BOOTSTRAPS = 500
_TREES = 300
_PERMUTATIONS = 30


def sobol(study: Study, samples: int) -> list[str]:
    """sobol.csv: first order and total indices over the plan's ranges, with 95 % intervals.

    The surrogate answers (Sobol 2001; estimators of scipy.stats.sobol_indices, bootstrapped): the
    probability of success, and of the shape it predicts the deployed length and the mean standard
    deviation of a node. Parameters the plan has together but no vessel can have count as the mean
    of the others.
    """
    model = load_model(study.home / MODEL)
    plan = DatasetFolder.open(study.dataset).plan
    rng = np.random.default_rng(0)
    design = _saltelli(plan.ranges, rng)
    found = np.array(
        [_answer(model, plan.case, row) for row in design.reshape(-1, design.shape[2])]
    )
    found[np.isnan(found[:, 0])] = np.nanmean(found, axis=0)
    answers = np.moveaxis(found.reshape(*design.shape[:2], -1), 2, 0)
    values = _indices(answers)
    resampled = [
        _indices(answers[:, :, rng.integers(SAMPLES, size=SAMPLES)]) for _ in range(_BOOTSTRAPS)
    ]
    low, high = np.quantile(resampled, [0.025, 0.975], axis=0)
    rows = []
    for i, quantity in enumerate(QUANTITIES):
        for j, parameter in enumerate(plan.ranges):
            row = {"quantity": quantity, "parameter": parameter.name}
            for k, order in enumerate(("first_order", "total_order")):
                row[order] = values[k, i, j]
                row |= {f"{order}_low": low[k, i, j], f"{order}_high": high[k, i, j]}
            rows.append(row)
    return [study.write_table("sobol", pd.DataFrame(rows))]


def _saltelli(ranges: Sequence[Range], rng: np.random.Generator) -> Array:
    """Samples (p + 2, SAMPLES, p): A, B, and A with each parameter of B in turn."""
    low, high = np.array([(r.low, r.high) for r in ranges]).T
    count = len(low)
    drawn = qmc.Sobol(2 * count, rng=rng).random(SAMPLES)
    A, B = (low + (high - low) * part for part in np.split(drawn, 2, axis=1))
    mixed = [np.where(np.arange(count) == j, B, A) for j in range(count)]
    return np.stack([A, B, *mixed])


def _indices(answers: Array) -> Array:
    """First and total order (2, q, p) of answers (q, p + 2, SAMPLES) to the samples above."""
    mixed = answers[:, 2:].swapaxes(0, 1)
    result = sobol_indices(
        func={"f_A": answers[:, 0], "f_B": answers[:, 1], "f_AB": mixed}, n=SAMPLES
    )
    return np.stack([result.first_order, result.total_order])


def _answer(model: SurrogateModel, case_of: object, values: np.ndarray) -> tuple[float, ...]:
    try:
        case: Case = case_of(values)  # type: ignore[operator]
    except InputError:
        return (np.nan,) * len(QUANTITIES)
    found = model.predict(case)
    return found.success_probability, found.deployed_length_mm, float(found.std_norm.mean())


def leave_one_out(study: Study, samples: int) -> list[str]:
    """leave_one_out.csv: the error of every training success, predicted from all others, mm.

    In closed form (Rasmussen & Williams 2006, equation 5.12): a coefficient less what the others
    say of it is [K⁻¹ y]_i / [K⁻¹]_ii. Modes and hyper-parameters are those of all cases.
    """
    simulations, model = study.simulations(samples), load_model(study.home / MODEL)
    indices = np.searchsorted(simulations.numbers, model.numbers)
    snapshots = learned(model.recipe, simulations, indices).snapshots
    basis, processes = model.rom.basis_, model.rom.processes_
    coefficients = basis.coefficients(snapshots) - processes.leave_one_out()
    left = (basis.snapshots(coefficients) - snapshots).reshape(len(indices), -1, 3)
    distances = np.linalg.norm(left, axis=2)
    errors = {"AE": distances.mean(axis=1), "ME": distances.max(axis=1)}
    return [study.write_table("leave_one_out", pd.DataFrame({"case": model.numbers, **errors}))]


def permutation(study: Study, samples: int) -> list[str]:
    """importance.csv: what a random forest of log AE loses in R² when a parameter is shuffled.

    Errors are those left out one by one; ``R2_out_of_bag`` is what the forest itself is worth
    (Breiman 2001).
    """
    errors = study.table("leave_one_out")
    simulations = study.simulations(samples)
    folder = DatasetFolder.open(study.dataset)
    X, y = folder.values[errors["case"]], np.log(errors["AE"])
    forest = RandomForestRegressor(_TREES, min_samples_leaf=3, oob_score=True, random_state=0)
    forest.fit(X, y)
    found = permutation_importance(forest, X, y, n_repeats=_PERMUTATIONS, random_state=0)
    frame = pd.DataFrame(
        {
            "parameter": list(simulations.limits),
            "importance": found.importances_mean,
            "importance_SD": found.importances_std,
            "R2_out_of_bag": forest.oob_score_,
            "cases": len(errors),
        }
    )
    return [study.write_table("importance", frame)]
