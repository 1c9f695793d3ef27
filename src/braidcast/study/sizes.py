"""How many simulations there are, and how many of them train and test (paper, Table 1)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from braidcast.dataset.plan import Plan
from braidcast.errors import InputError
from braidcast.study import published
from braidcast.study.workspace import Study
from braidcast.surrogate.predictors import end_depths
from braidcast.surrogate.training_set import Simulations

FEWEST = 10
"""Successes, and failures, without which no classifier is trained: folds within folds need some."""


@dataclass(frozen=True)
class Size:
    """A subset of the study: its first ``cases``; ``outcomes`` of them train classifiers, and
    ``shapes`` successes the reduced order models."""

    cases: int
    outcomes: int
    shapes: int

    def training(self, simulations: Simulations) -> NDArray[np.int64]:
        """Indices of the successes that train, of the first ``cases``."""
        inside = simulations.regression_training
        return inside[simulations.numbers[inside] < self.cases][: self.shapes]

    def classification_training(self, simulations: Simulations) -> NDArray[np.int64]:
        """Indices of the cases that train classifiers."""
        inside = simulations.classification_training
        return inside[simulations.numbers[inside] < self.cases]


def known_sizes(plan: Plan) -> list[int]:
    """Numbers of cases that a study may have: the plan's subsets, and all."""
    return [*plan.subsets, plan.cases]


def sizes(plan: Plan, simulations: Simulations, samples: int) -> list[Size]:
    """The subsets of a plan up to ``samples`` cases, less those that are too small to learn from.

    Where the paper has a subset of as many cases, as many successes train; else all there are.
    ``InputError`` if none is left, or the tests have no failure or fewer than two successes.
    """
    paper = published.table(1).set_index("N_s")["N_train_regr"]
    numbers, success = simulations.numbers, simulations.success
    tests = success[simulations.classification_tests]
    if tests.all() or tests.sum() < 2:
        raise InputError(
            f"{tests.sum()} of {tests.size} tests succeed, must be at least 2, and not all of them"
        )
    found = []
    for count in (size for size in known_sizes(plan) if size <= samples):
        outcomes = Size(count, 0, 0).classification_training(simulations)
        fewest = min(success[outcomes].sum(), (~success[outcomes]).sum())
        successes = int((numbers[simulations.regression_training] < count).sum())
        if fewest >= FEWEST:
            shapes = min(successes, int(paper.get(count, successes)))
            found.append(Size(count, len(outcomes), shapes))
    if not found:
        raise InputError(
            f"{fewest} of the less frequent outcome among {len(outcomes)} cases to train with, "
            f"must be at least {FEWEST}"
        )
    return found


def cases_table(study: Study, samples: int) -> list[str]:
    """cases.csv: every finished case, its parameters, how deep its ends lie, and its labels."""
    found = study.simulations(samples)
    depths = np.array(
        [end_depths(c, nodes) for c, nodes in zip(found.cases, found.positions, strict=True)]
    )
    frame = pd.DataFrame(
        {
            "case": found.numbers,
            "test": found.test.astype(int),
            "y_P1_mm": [case.tube.P1[1] for case in found.cases],
            "z_P1_mm": [case.tube.P1[2] for case in found.cases],
            "D_v_mm": [2.0 * case.vessel_radius for case in found.cases],
            "D_a_mm": [case.sac.diameter for case in found.cases],
            "y_Ca_mm": [
                case.aneurysm_centre[1] for case in found.cases if case.aneurysm_centre is not None
            ],
            "eta": [case.eta for case in found.cases],
            "depth_first_mm": depths[:, 0],
            "depth_last_mm": depths[:, 1],
            "success": found.success.astype(int),
        }
    )
    return [study.write_table("cases", frame)]


def table1(study: Study, sizes: Sequence[Size]) -> list[str]:
    """table1.csv: the paper's Table 1, ours and theirs."""
    simulations = study.simulations(sizes[-1].cases)
    rows = []
    for size in sizes:
        inside = simulations.numbers < size.cases
        successes = int((inside & simulations.success).sum())
        rows.append(
            {
                "N_s": size.cases,
                "N_success": successes,
                "N_failure": int(inside.sum()) - successes,
                "not_converged": size.cases - int(inside.sum()),
                "N_train_class": len(size.classification_training(simulations)),
                "N_test_class": len(simulations.classification_tests),
                "N_train_regr": len(size.training(simulations)),
                "N_test_regr": len(simulations.regression_tests),
            }
        )
    theirs = published.table(1).rename(columns=lambda c: c if c == "N_s" else f"paper_{c}")
    return [study.write_table("table1", pd.DataFrame(rows).merge(theirs, "left", "N_s"))]
