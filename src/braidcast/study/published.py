"""The tables of the paper as they are printed, and what its Table 2 says when read rightly."""

from pathlib import Path

import numpy as np
import pandas as pd

_HOME = Path(__file__).with_name("published")

TESTS = 100
"""Test cases of the paper's classifiers."""

FAILURES = 31
"""Failures among them: TP + FP of every consistent row of Table 2 (errata, row 17)."""

_MODELS = {
    "LR": "logistic regression",
    "KNN": "k-nearest neighbours",
    "NB": "naive Bayes",
    "DT": "decision tree",
    "ANN": "neural network",
    "SVM": "support vector machine",
}


RATIOS_TO_146 = pd.DataFrame(
    {
        "N_train": [47, 146, 346],
        "paper_AE_p_ratio": [1.92, 1.0, 1.0 / 1.14],
        "paper_ME_p_ratio": [1.84, 1.0, 1.0 / 1.04],
    }
)
"""Errors over those with 146 training shapes, μ_cl with 8 points (section 3.2)."""


def table(number: int) -> pd.DataFrame:
    """Table ``number`` of the paper, 1 to 4, numbers as numbers; nothing else is changed."""
    frame = pd.read_csv(_HOME / f"table{number}.csv")
    if number == 2:
        frame["model"] = frame["model"].str.rstrip("*").map(_MODELS)
        for column in frame.columns[2:]:
            frame[column] = frame[column].astype(str).str.rstrip("*").astype(float)
    if number == 4:
        for column in [name for name in frame.columns if name.startswith("N(")]:
            frame[column] = frame[column].str.partition("(")[0].astype(int)
    return frame


def table2_read_rightly() -> pd.DataFrame:
    """Table 2 by the usual definitions, success being the positive class, in percent.

    Its "precision" is the specificity, so that TN = 31 precision, TP = 100 accuracy − TN, and all
    else follows. ``consistent``: whether the two columns that were not used agree with that.
    """
    printed = table(2)
    TN = (FAILURES * printed["precision"] / 100.0).round()
    TP = (TESTS * printed["accuracy"] / 100.0).round() - TN
    FP, FN = FAILURES - TN, TESTS - FAILURES - TP
    precision, negative = 100.0 * TP / (TP + FP), 100.0 * TN / (TN + FN)
    consistent = np.isclose(precision, printed["specificity"], atol=0.7) & np.isclose(
        negative, printed["sensitivity"], atol=0.7
    )
    return pd.DataFrame(
        {
            "N_s": printed["N_s"],
            "model": printed["model"],
            "accuracy": printed["accuracy"],
            "sensitivity": 100.0 * TP / (TP + FN),
            "specificity": 100.0 * TN / FAILURES,
            "precision": precision,
            "F1": 100.0 * 2.0 * TP / (2.0 * TP + FP + FN),
            "consistent": consistent,
        }
    )
