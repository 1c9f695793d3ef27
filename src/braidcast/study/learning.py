"""Learning curves, and how many simulations a new device needs."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from braidcast.study.outcomes import probabilities, threshold
from braidcast.study.sizes import FEWEST
from braidcast.study.workspace import Study
from braidcast.surrogate.metrics import NodeErrors
from braidcast.surrogate.recipes import RECIPES
from braidcast.surrogate.train import learned
from braidcast.surrogate.training_set import Simulations

SHAPES = (5, 7, 10, 14, 20, 30, 47, 75, 110, 146, 220, 346, 555)
OUTCOMES = (20, 30, 50, 80, 120, 200, 320, 500, 800)

MODES = 15
"""L of all models here, if there are as many shapes: choosing it would need more of them."""

TARGETS = {"AE": 0.03, "ME": 0.03}
"""Errors that are asked for, mm, on average over the tests."""

ACCURACY = 0.95

_REPEATS = 10
_BOOTSTRAPS = 2000


def repeats(count: int) -> int:
    """How many training sets are drawn at random: fewer the larger they are, for they overlap."""
    return max(3, min(_REPEATS, 1500 // count))


def _drawn(pool: NDArray[np.int64], count: int) -> list[NDArray[np.int64]]:
    rng = np.random.default_rng(count)
    return [np.sort(rng.permutation(pool)[:count]) for _ in range(repeats(count))]


def learn_shapes(study: Study, samples: int, recipe: str, count: int) -> list[str]:
    """Errors of every test, mm, for training sets of ``count`` shapes drawn at random."""
    simulations = study.simulations(samples)
    tests, view = simulations.regression_tests, RECIPES[recipe].view
    true = simulations.positions[tests]
    asked = [view(simulations.cases[k]) for k in tests]
    X = np.array([case.predictors for case in asked])
    rows = []
    for repeat, training in enumerate(_drawn(simulations.regression_training, count)):
        data = learned(RECIPES[recipe], simulations, training)
        cases = [simulations.cases[k] for k in training]
        model = RECIPES[recipe].reduced_order_model(cases, min(MODES, count - 1))
        departures = model.fit(data.predictors, data.snapshots).predict(X)
        predicted = [
            case.reference.moved(departure.reshape(-1, 3))
            for case, departure in zip(asked, departures, strict=True)
        ]
        errors = NodeErrors.of(np.array(predicted), true)
        values = {"case": simulations.numbers[tests], "AE": errors.AE, "ME": errors.ME}
        rows.append(pd.DataFrame({"repeat": repeat, **values}))
    return [study.write_table(f"learning/{recipe}_{count}", pd.concat(rows))]


def learn_outcomes(study: Study, samples: int, name: str, count: int) -> list[str]:
    """Whether every test's outcome is predicted rightly, training sets as above.

    Sets with too few cases of either outcome are left out.
    """
    simulations = study.simulations(samples)
    tests = simulations.classification_tests
    success = simulations.success[tests]
    rows = []
    for repeat, training in enumerate(_drawn(simulations.classification_training, count)):
        if not _enough(simulations, training):
            continue
        found = probabilities(name, simulations, training, tests)
        right = (found > threshold(name)) == success
        values = {"case": simulations.numbers[tests], "right": right.astype(int)}
        rows.append(pd.DataFrame({"repeat": repeat, **values}))
    frame = pd.concat(rows) if rows else pd.DataFrame(columns=["repeat", "case", "right"])
    return [study.write_table(f"learning/{_slug(name)}_{count}", frame)]


def _enough(simulations: Simulations, training: NDArray[np.int64]) -> bool:
    failures = int((~simulations.success[training]).sum())
    return min(failures, len(training) - failures) >= FEWEST


def _slug(name: str) -> str:
    return name.replace(" ", "_")


def curves(
    study: Study,
    shapes: Sequence[tuple[str, int]],
    outcomes: Sequence[tuple[str, int]],
) -> list[str]:
    """learning_curves.csv: mean over tests and training sets with a 95 % band."""
    rows = []
    for recipe, count in shapes:
        found = study.table(f"learning/{recipe}_{count}")
        rows += [_row(found, recipe, measure, count) for measure in ("AE", "ME")]
    for name, count in outcomes:
        found = study.table(f"learning/{_slug(name)}_{count}")
        if len(found):
            rows.append(_row(found, name, "right", count))
    return [study.write_table("learning_curves", pd.DataFrame(rows))]


def _row(found: pd.DataFrame, model: str, measure: str, count: int) -> dict[str, object]:
    """Training sets and tests are both drawn with replacement for the band."""
    values = found.pivot(index="repeat", columns="case", values=measure).to_numpy()
    rng = np.random.default_rng(0)
    sets, tests = (rng.integers(n, size=(_BOOTSTRAPS, n)) for n in values.shape)
    means = values[sets[:, :, None], tests[:, None, :]].mean(axis=(1, 2))
    low, high = np.quantile(means, [0.025, 0.975])
    return {
        "model": model,
        "measure": "accuracy" if measure == "right" else measure,
        "N_train": count,
        "training_sets": len(values),
        "mean": values.mean(),
        "low": low,
        "high": high,
    }


def needed(study: Study) -> list[str]:
    """needed.csv: training cases and simulations until the mean, and the band, reach a target.

    Between two sizes the logarithms are interpolated. ``N_simulations``: of shapes, cases to
    simulate so that as many successes are among them; tests come on top. nan: not reached.
    """
    frame, table1 = study.table("learning_curves"), study.table("table1")
    last = table1.iloc[-1]
    share = last["N_success"] / (last["N_success"] + last["N_failure"])
    rows = []
    for (model, measure), found in frame.groupby(["model", "measure"], sort=False):
        accuracy = measure == "accuracy"
        target = ACCURACY if accuracy else TARGETS[measure]
        row = {"model": model, "measure": measure, "target": target}
        for what, column in (("mean", "mean"), ("band", "low" if accuracy else "high")):
            values = found[column].to_numpy()
            # An error is to fall below its target, and so is a share of wrong answers.
            falls, goal = (1.0 - values, 1.0 - target) if accuracy else (values, target)
            count = _first_below(found["N_train"].to_numpy(), falls, goal)
            row[f"N_train_{what}"] = count
            row[f"N_simulations_{what}"] = np.ceil(count if accuracy else count / share)
        rows.append(row)
    return [study.write_table("needed", pd.DataFrame(rows))]


def _first_below(counts: NDArray[np.int64], values: NDArray[np.float64], target: float) -> float:
    below = np.flatnonzero(values <= target)
    if not len(below):
        return np.nan
    k = int(below[0])
    if k == 0:
        return float(counts[0])
    logs = np.log(np.maximum(values[k - 1 : k + 1], 1e-12))
    part = (logs[0] - np.log(target)) / (logs[0] - logs[1])
    first, second = np.log(counts[k - 1 : k + 1])
    return float(np.ceil(np.exp(first + part * (second - first))))
