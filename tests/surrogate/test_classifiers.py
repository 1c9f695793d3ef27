"""The six classifiers of the paper on problems whose answer is known."""

import numpy as np
import pytest
from scipy.special import expit
from sklearn.base import clone

from braidcast.surrogate.classifiers import CLASSIFIERS
from braidcast.surrogate.metrics import ClassMetrics

QUICK = [name for name in CLASSIFIERS if name != "neural network"]


def bent(count, seed=0):
    """A band of successes: no plane parts them from the failures, as with sites along a vessel."""
    X = np.random.default_rng(seed).normal([5.0, 0.0], [2.0, 100.0], size=(count, 2))
    return X, np.abs(X[:, 0] - 5.0) < 1.5


@pytest.mark.parametrize("name", CLASSIFIERS)
def test_all_but_logistic_regression_learn_a_band(name):
    model = CLASSIFIERS[name]().fit(*bent(120))
    X, success = bent(300, seed=1)
    probability = model.predict_proba(X)
    assert model.classes_.tolist() == [False, True]
    np.testing.assert_allclose(probability.sum(axis=1), 1.0)
    found = ClassMetrics.of(success, probability[:, 1])
    if name == "logistic regression":
        assert found.AUC < 0.65
    else:
        assert found.AUC > 0.9


@pytest.mark.parametrize("name", QUICK)
def test_units_do_not_matter(name):
    X, success = bent(60)
    factors = np.array([0.001, 7.0])
    np.testing.assert_allclose(
        CLASSIFIERS[name]().fit(X, success).predict_proba(X),
        CLASSIFIERS[name]().fit(factors * X, success).predict_proba(factors * X),
        atol=1e-4,
    )


@pytest.mark.parametrize("name", QUICK)
def test_probabilities_are_calibrated(name):
    """Where the outcome is a matter of chance: of fresh cases given p, a share p succeeds."""
    rng = np.random.default_rng(2)
    X = rng.normal(size=(200, 1))
    model = CLASSIFIERS[name]().fit(X, rng.random(200) < chance(X))
    X = rng.normal(size=(4000, 1))
    probability = model.predict_proba(X)[:, 1]
    parts = np.array_split(np.argsort(probability), 10)
    off = [abs(probability[part].mean() - chance(X[part]).mean()) for part in parts]
    assert np.mean(off) < 0.1


def chance(X):
    return expit(1.5 * X[:, 0])


@pytest.mark.parametrize("name", CLASSIFIERS)
def test_labels_at_random_teach_nothing(name):
    X, success = bent(120)
    model = CLASSIFIERS[name]().fit(X, np.random.default_rng(4).permutation(success))
    X, success = bent(500, seed=5)
    assert ClassMetrics.of(success, model.predict_proba(X)[:, 1]).AUC == pytest.approx(0.5, abs=0.2)


@pytest.mark.parametrize("name", ["naive Bayes", "neural network", "support vector machine"])
def test_fits_repeat(name):
    model = CLASSIFIERS[name]()
    X, success = bent(60)
    first, second = model.fit(X, success), clone(model).fit(X, success)
    np.testing.assert_array_equal(first.predict_proba(X), second.predict_proba(X))
