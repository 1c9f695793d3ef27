"""Success from the two ends of the stent, each a case of its own.

A deployment succeeds if neither end ring has a node in the sac (errata, row 16). Seen from either
end the question is the same, so that one logistic regression learns from both ends of every case:

    p_end = σ(w · (x - offset) / scale + b),    P(success) = (1 - p_0) (1 - p_1).
"""

from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import expit
from sklearn.base import BaseEstimator, ClassifierMixin
from sklearn.linear_model import LogisticRegression
from sklearn.metrics import log_loss
from sklearn.model_selection import StratifiedGroupKFold, cross_val_predict
from sklearn.pipeline import Pipeline, make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.utils.validation import check_is_fitted

from braidcast.errors import InputError

Array = NDArray[np.float64]

CANDIDATES = (0.01, 0.1, 1.0, 10.0, 100.0, 1000.0, 10000.0)
FOLDS = 5


class EndsClassifier(ClassifierMixin, BaseEstimator):
    """Logistic regression for an end in the sac, both ends taken as independent.

    C, the inverse of the regularisation, is the one of ``candidates`` with the least logarithmic
    loss under cross-validation, where both ends of a case lie in the same fold.
    """

    def __init__(self, candidates: ArrayLike = CANDIDATES) -> None:
        self.candidates = candidates

    def fit(self, X: ArrayLike, y: ArrayLike) -> Self:
        """Learn from predictors (n, 2, p), seen from either end, and which lie in the sac (n, 2).

        InputError: shapes that differ, predictors not finite, fewer than ``FOLDS`` ends of a kind.
        """
        X, y = _predictors(X), np.asarray(y)
        if y.shape != X.shape[:2] or not np.isin(y, [0, 1]).all():
            raise InputError(f"Ends in the sac must be True or False, of shape {X.shape[:2]}")
        ends, inside = X.reshape(-1, X.shape[2]), y.ravel().astype(bool)
        if min(inside.sum(), (~inside).sum()) < FOLDS:
            raise InputError(
                f"{inside.sum()} of {inside.size} ends lie in the sac; at least {FOLDS} that do "
                f"and {FOLDS} that do not are needed"
            )
        folds = StratifiedGroupKFold(FOLDS, shuffle=True, random_state=0)
        splits = list(folds.split(ends, inside, groups=np.repeat(np.arange(len(X)), 2)))

        def loss(C: float) -> float:
            probability = cross_val_predict(
                _regression(C), ends, inside, cv=splits, method="predict_proba"
            )
            return log_loss(inside, probability)

        self.C_ = min((float(C) for C in np.asarray(self.candidates)), key=loss)
        scaler, regression = _regression(self.C_).fit(ends, inside)
        self.offset_, self.scale_ = scaler.mean_, scaler.scale_
        self.coefficients_ = regression.coef_[0]
        self.intercept_ = float(regression.intercept_[0])
        self.classes_ = np.array([False, True])
        return self

    def end_probability(self, X: ArrayLike) -> Array:
        """Probability (n, 2) of each end to lie in the sac."""
        check_is_fitted(self, "coefficients_")
        X = _predictors(X, self.coefficients_.size)
        return expit((X - self.offset_) / self.scale_ @ self.coefficients_ + self.intercept_)

    def success_probability(self, X: ArrayLike) -> Array:
        """Probability (n,) of neither end in the sac."""
        return (1.0 - self.end_probability(X)).prod(axis=1)

    def predict_proba(self, X: ArrayLike) -> Array:
        """Probabilities (n, 2) of failure and success."""
        success = self.success_probability(X)
        return np.column_stack([1.0 - success, success])

    def predict(self, X: ArrayLike) -> NDArray[np.bool_]:
        """Success (n,): more probable than failure."""
        return self.success_probability(X) > 0.5


def _regression(C: float) -> Pipeline:
    return make_pipeline(StandardScaler(), LogisticRegression(C=C, max_iter=1000))


def _predictors(X: ArrayLike, count: int | None = None) -> Array:
    """Predictors (n, 2, p) as an array, checked; ``count`` p if it is known."""
    X = np.asarray(X, dtype=np.float64)
    if X.ndim != 3 or X.shape[1] != 2 or (count is not None and X.shape[2] != count):
        raise InputError(
            f"Predictors of the ends have shape {X.shape}, must be (n, 2, {count or 'p'})"
        )
    if not np.isfinite(X).all():
        raise InputError("Predictors of the ends must be finite")
    return X
