"""How good predictions are: of success, and of the positions of the nodes (paper, 2.2.1 and 2.3).

Success is the positive class and the definitions are the usual ones; Table 2 of the paper reads
differently (errata, row 17), see ``ClassMetrics.paper_convention``.
"""

import warnings
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import binomtest, rankdata
from sklearn.metrics import roc_curve

from braidcast.errors import InputError

Array = NDArray[np.float64]
Interval = tuple[float, float]

LARGE_ERROR = 0.15
"""Distance of a node from its true place above which a case counts as badly predicted, mm."""


@dataclass(frozen=True)
class ClassMetrics:
    """Confusion counts and what follows from them; nan where undefined."""

    TP: int
    FN: int
    FP: int
    TN: int
    accuracy: float
    sensitivity: float
    specificity: float
    precision: float
    F1: float
    AUC: float
    Brier: float

    @classmethod
    def of(cls, success: ArrayLike, probability: ArrayLike, threshold: float = 0.5) -> Self:
        """From what happened (n,) and the predicted probability of success (n,).

        A case is called a success if its probability is above the threshold.
        """
        values = _metrics(*_outcomes(success, probability), threshold)
        return cls(**{name: value.item() for name, value in values.items()})

    def paper_convention(self) -> dict[str, float]:
        """The same counts under the column names of the paper's Table 2.

        There failures are counted as positive and the matrix is transposed: its "precision" is the
        specificity, its "specificity" the precision, its "sensitivity" the share of failures among
        the cases called failures.
        """
        called_failure = self.TN + self.FN
        F1_parts = 2 * self.TN + self.FP + self.FN
        return {
            "accuracy": self.accuracy,
            "sensitivity": self.TN / called_failure if called_failure else np.nan,
            "specificity": self.precision,
            "precision": self.specificity,
            "F1": 2 * self.TN / F1_parts if F1_parts else np.nan,
        }


def intervals(
    success: ArrayLike,
    probability: ArrayLike,
    threshold: float = 0.5,
    *,
    level: float = 0.95,
    count: int = 1000,
    seed: int = 0,
) -> dict[str, Interval]:
    """Confidence intervals of all values of ``ClassMetrics``, by name.

    Shares (accuracy, sensitivity, specificity, precision) have the exact binomial interval (Clopper
    & Pearson 1934): no error in 33 cases is a share of 0.89 or more. The others have that of
    ``count`` bootstraps: cases drawn with replacement whatever their outcome, as the cases
    themselves were sampled; draws for which a value is undefined are left out.
    """
    success, probability = _outcomes(success, probability)
    drawn = np.random.default_rng(seed).integers(success.size, size=(count, success.size))
    values = _metrics(success[drawn], probability[drawn], threshold)
    tail = 0.5 * (1.0 - level)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "All-NaN slice", RuntimeWarning)
        found = {
            name: tuple(np.nanquantile(value, [tail, 1.0 - tail]).tolist())
            for name, value in values.items()
        }
    m = ClassMetrics.of(success, probability, threshold)
    for name, right, wrong in (
        ("accuracy", m.TP + m.TN, m.FP + m.FN),
        ("sensitivity", m.TP, m.FN),
        ("specificity", m.TN, m.FP),
        ("precision", m.TP, m.FP),
    ):
        if right + wrong:
            found[name] = tuple(binomtest(right, right + wrong).proportion_ci(level))
    return found


def roc(success: ArrayLike, probability: ArrayLike) -> tuple[Array, Array, Array]:
    """False positive rate, true positive rate and threshold (k,) each, thresholds falling."""
    success, probability = _outcomes(success, probability)
    if success.all() or not success.any():
        raise InputError("A ROC needs successes and failures; only one of them is there")
    return roc_curve(success, probability)


@dataclass(frozen=True)
class NodeErrors:
    """Distances between predicted and true positions of the nodes, mm.

    ``AE`` (n,) is the mean over the nodes of a case and ``ME`` (n,) the largest.
    """

    AE: Array
    ME: Array

    @classmethod
    def of(cls, predicted: Array, true: Array) -> Self:
        """From positions (n, N, 3), mm."""
        if predicted.shape != true.shape or predicted.ndim != 3:
            raise InputError(
                f"Positions have shapes {predicted.shape} and {true.shape}, must be (n, N, 3) both"
            )
        distances = np.linalg.norm(predicted - true, axis=2)
        return cls(distances.mean(axis=1), distances.max(axis=1))

    @property
    def AE_p(self) -> float:
        """Mean of AE, mm."""
        return float(self.AE.mean())

    @property
    def ME_p(self) -> float:
        """Mean of ME, mm."""
        return float(self.ME.mean())

    @property
    def large(self) -> int:
        """How many cases have a node off by more than ``LARGE_ERROR``."""
        return int((self.ME > LARGE_ERROR).sum())


def share_inside(predicted: Array, std: Array, true: Array, z: float = 1.96) -> float:
    """Share of the components with ``|predicted - true| <= z std``; any shape, the same for all."""
    return float((np.abs(predicted - true) <= z * std).mean())


def _metrics(
    success: NDArray[np.bool_], probability: Array, threshold: float
) -> dict[str, NDArray[Any]]:
    """Values of ``ClassMetrics`` (...), by name, from outcomes and probabilities (..., n)."""
    called = probability > threshold
    TP = (success & called).sum(axis=-1)
    FN = (success & ~called).sum(axis=-1)
    FP = (~success & called).sum(axis=-1)
    TN = (~success & ~called).sum(axis=-1)
    successes, failures = TP + FN, FP + TN
    # the share of pairs of a success and a failure that are ranked rightly (Mann and Whitney)
    ranks = (rankdata(probability, axis=-1) * success).sum(axis=-1)
    with np.errstate(invalid="ignore"):
        return {
            "TP": TP,
            "FN": FN,
            "FP": FP,
            "TN": TN,
            "accuracy": (TP + TN) / success.shape[-1],
            "sensitivity": TP / successes,
            "specificity": TN / failures,
            "precision": TP / (TP + FP),
            "F1": 2 * TP / (2 * TP + FP + FN),
            "AUC": (ranks - successes * (successes + 1) / 2) / (successes * failures),
            "Brier": ((probability - success) ** 2).mean(axis=-1),
        }


def _outcomes(success: ArrayLike, probability: ArrayLike) -> tuple[NDArray[np.bool_], Array]:
    """Both as arrays (n,), checked."""
    success, probability = np.asarray(success), np.asarray(probability, dtype=np.float64)
    if success.shape != probability.shape or success.ndim != 1 or success.size == 0:
        raise InputError(
            f"Outcomes and probabilities have shapes {success.shape} and {probability.shape}, "
            "must be (n,) both, n 1 or more"
        )
    if not np.isin(success, [0, 1]).all():
        raise InputError("Outcomes must be True or False")
    if not ((probability >= 0.0) & (probability <= 1.0)).all():
        raise InputError("Probabilities must lie between 0 and 1")
    return success.astype(bool), probability
