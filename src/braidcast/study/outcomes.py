"""Success or failure: the paper's six classifiers and ours on the fixed tests (paper, Table 2)."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from braidcast.study import published
from braidcast.study.sizes import Size
from braidcast.study.workspace import Study
from braidcast.surrogate.classifiers import CLASSIFIERS
from braidcast.surrogate.ends import EndsClassifier
from braidcast.surrogate.metrics import ClassMetrics, intervals, roc
from braidcast.surrogate.predictors import bezier_predictors
from braidcast.surrogate.recipes import RECIPES
from braidcast.surrogate.thresholds import success_threshold
from braidcast.surrogate.training_set import Simulations

OURS = "ends of the placed braid"
"""Our own classifier, as the tables call it."""

NAMES = (*CLASSIFIERS, OURS)

EXAMINED = "support vector machine"
"""The paper's best; its false negatives are looked at."""

METRICS = ("accuracy", "sensitivity", "specificity", "precision", "F1", "AUC", "Brier")


def threshold(name: str) -> float:
    """From which probability on a classifier of this name calls a success."""
    return success_threshold() if name == OURS else 0.5


def probabilities(
    name: str, simulations: Simulations, training: np.ndarray, tests: np.ndarray
) -> np.ndarray:
    """Probabilities of success (m,) of the cases ``tests``, learned from the cases ``training``."""
    cases = simulations.cases
    if name == OURS:
        view = RECIPES["ours"].view
        seen, asked = (
            np.array([view(cases[k]).ends for k in group]) for group in (training, tests)
        )
        ends = EndsClassifier().fit(seen, simulations.end_in_sac[training])
        return ends.success_probability(asked)
    seen, asked = (np.array([bezier_predictors(cases[k]) for k in g]) for g in (training, tests))
    model = CLASSIFIERS[name]().fit(seen, simulations.success[training])
    return model.predict_proba(asked)[:, 1]


def file_of(name: str, count: int) -> str:
    """The table of a classifier trained on so many cases."""
    return f"outcomes/{name.replace(' ', '_').replace('-', '_')}_{count}"


def classify(study: Study, size: Size, name: str) -> list[str]:
    """Train one classifier; the probability of success it gives to each test."""
    simulations = study.simulations(size.cases)
    tests = simulations.classification_tests
    found = probabilities(name, simulations, size.classification_training(simulations), tests)
    frame = pd.DataFrame(
        {
            "case": simulations.numbers[tests],
            "success": simulations.success[tests].astype(int),
            "success_probability": found,
        }
    )
    return [study.write_table(file_of(name, size.outcomes), frame)]


def table2(study: Study, sizes: Sequence[Size]) -> list[str]:
    """table2.csv by the usual definitions, table2_paper_convention.csv, and roc.csv."""
    rows, printed, curves = [], [], []
    for size in sizes:
        for name in NAMES:
            found = study.table(file_of(name, size.outcomes))
            success, given = found["success"], found["success_probability"]
            metrics = ClassMetrics.of(success, given, threshold(name))
            key = {"N_s": size.cases, "N_train": size.outcomes, "model": name}
            spans = intervals(success, given, threshold(name))
            values = {metric: getattr(metrics, metric) for metric in METRICS}
            ends = {
                f"{metric}_{end}": spans[metric][i]
                for metric in ("accuracy", "specificity")
                for i, end in enumerate(("low", "high"))
            }
            counts = {count: getattr(metrics, count) for count in ("TP", "FN", "FP", "TN")}
            rows.append(key | {"threshold": threshold(name)} | counts | values | ends)
            printed.append(key | metrics.paper_convention())
            false, true, cut = roc(success, given)
            points = pd.DataFrame({"false_positive_rate": false, "true_positive_rate": true})
            curves.append(points.assign(threshold=np.minimum(cut, 1.0), **key))
    theirs = published.table2_read_rightly()
    theirs.loc[~theirs["consistent"], list(theirs.columns[2:-1])] = np.nan
    theirs = _of_the_paper(theirs, [c for c in theirs.columns[2:] if c != "consistent"])
    as_printed = published.table(2)
    both = pd.DataFrame(rows).merge(theirs, "left", ["N_s", "model"])
    convention = pd.DataFrame(printed).merge(
        _of_the_paper(as_printed, list(as_printed.columns[2:])), "left", ["N_s", "model"]
    )
    return [
        study.write_table("table2", both),
        study.write_table("table2_paper_convention", convention),
        study.write_table("roc", pd.concat(curves)),
    ]


def _of_the_paper(frame: pd.DataFrame, columns: list[str]) -> pd.DataFrame:
    """Percentages as shares, under names that say whose they are."""
    shares = (frame[columns] / 100.0).add_prefix("paper_")
    others = [c for c in frame.columns if c not in columns]
    renamed = frame[others].rename(columns={"consistent": "paper_consistent"})
    return pd.concat([renamed, shares], axis=1)


def false_negatives(study: Study, sizes: Sequence[Size]) -> list[str]:
    """false_negatives.csv: successes that are called failures, and how near the sac they end.

    Of the paper's best classifier at the size at which the paper finds it best (600), or the
    largest; ``gap_mm`` is the distance from the sac to the nearer end ring, and beside it the
    median over all successful tests.
    """
    size = next((s for s in sizes if s.cases == 600), sizes[-1])
    found = study.table(file_of(EXAMINED, size.outcomes))
    cases = study.table("cases").set_index("case").loc[found["case"]].reset_index()
    found["gap_mm"] = -cases[["depth_first_mm", "depth_last_mm"]].max(axis=1)
    successes = found[found["success"] == 1]
    missed = successes[successes["success_probability"] <= threshold(EXAMINED)].copy()
    missed["model"], missed["N_train"] = EXAMINED, size.outcomes
    missed["median_gap_of_successes_mm"] = successes["gap_mm"].median()
    return [study.write_table("false_negatives", missed.sort_values("success_probability"))]
