"""The six classifiers the paper compares, success being the positive class (paper, section 2.2).

Each is an unfitted scikit-learn estimator: standardised predictors, hyper-parameters by
cross-validation on what it is fitted to, and nothing else. The score is the logarithmic loss: it
asks for good probabilities, and on 50 cases moves where the accuracy stands still. Logistic
regression and the network are fitted to that loss; the probabilities of the others are calibrated
by a sigmoid (Platt), learned from cross-validated scores. Fitting needs about ten cases of each
outcome.
"""

import warnings
from collections.abc import Callable
from typing import Any, Self

from sklearn.base import BaseEstimator
from sklearn.calibration import CalibratedClassifierCV
from sklearn.exceptions import ConvergenceWarning
from sklearn.linear_model import LogisticRegression
from sklearn.model_selection import GridSearchCV, StratifiedKFold
from sklearn.naive_bayes import GaussianNB
from sklearn.neighbors import KNeighborsClassifier
from sklearn.neural_network import MLPClassifier
from sklearn.pipeline import Pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.svm import SVC
from sklearn.tree import DecisionTreeClassifier

Grid = dict[str, list[Any]]

FOLDS = StratifiedKFold(5, shuffle=True, random_state=0)


class Network(MLPClassifier):
    """MLPClassifier without warning: one stopped before convergence competes like any other."""

    def fit(self, X: Any, y: Any) -> Self:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ConvergenceWarning)
            return super().fit(X, y)


def logistic_regression() -> BaseEstimator:
    return _tuned(LogisticRegression(max_iter=1000), {"C": [0.001, 0.01, 0.1, 1, 10, 100]})


def nearest_neighbours() -> BaseEstimator:
    grid: Grid = {"n_neighbors": [3, 5, 9, 15, 25], "weights": ["uniform", "distance"]}
    return _tuned(KNeighborsClassifier(), grid, calibrated=True)


def naive_bayes() -> BaseEstimator:
    return _tuned(GaussianNB(), {"var_smoothing": [1e-9, 0.01, 0.1]}, calibrated=True)


def decision_tree() -> BaseEstimator:
    grid = {"max_depth": [3, 5, 8], "min_samples_leaf": [1, 3, 6, 12]}
    return _tuned(DecisionTreeClassifier(random_state=0), grid, calibrated=True)


def neural_network() -> BaseEstimator:
    """Three layers of 10, tanh; ``alpha`` weighs the squares of the weights."""
    network = Network((10, 10, 10), activation="tanh", solver="lbfgs", max_iter=500, random_state=0)
    return _tuned(network, {"alpha": [0.1, 1, 3, 10]})


def support_vectors() -> BaseEstimator:
    """Polynomial kernel of degree 2 with all lower terms."""
    return _tuned(SVC(kernel="poly", degree=2, coef0=1), {"C": [0.1, 1, 10, 100]}, calibrated=True)


CLASSIFIERS: dict[str, Callable[[], BaseEstimator]] = {
    "logistic regression": logistic_regression,
    "k-nearest neighbours": nearest_neighbours,
    "naive Bayes": naive_bayes,
    "decision tree": decision_tree,
    "neural network": neural_network,
    "support vector machine": support_vectors,
}
"""What makes each classifier of the paper, by name."""


def _tuned(classifier: BaseEstimator, grid: Grid, *, calibrated: bool = False) -> BaseEstimator:
    prefix = "classifier__"
    if calibrated:
        classifier = CalibratedClassifierCV(classifier, cv=FOLDS, ensemble=False)
        prefix += "estimator__"
    pipeline = Pipeline([("scaler", StandardScaler()), ("classifier", classifier)])
    parameters = {prefix + name: values for name, values in grid.items()}
    return GridSearchCV(pipeline, parameters, cv=FOLDS, scoring="neg_log_loss")
