"""Both ends of a stent as cases of their own, on synthetic logistic data."""

import numpy as np
import pytest
from scipy.special import expit
from sklearn.base import clone

from braidcast.errors import InputError
from braidcast.surrogate.ends import EndsClassifier
from braidcast.surrogate.metrics import ClassMetrics

SLOPES = np.array([1.5, -0.4, 0.0])
INTERCEPT = -0.7


def draw(count, seed=0):
    """Predictors (n, 2, 3) of any scale, and ends in the sac (n, 2), drawn from a logistic law."""
    rng = np.random.default_rng(seed)
    X = rng.normal([1.0, -20.0, 0.0], [1.0, 5.0, 0.01], size=(count, 2, 3))
    return X, rng.random((count, 2)) < expit(law(X))


def law(X):
    return (X - [1.0, -20.0, 0.0]) @ SLOPES + INTERCEPT


@pytest.fixture(scope="module")
def fitted():
    return EndsClassifier().fit(*draw(4000))


def test_the_law_is_found(fitted):
    slopes = fitted.coefficients_ / fitted.scale_
    assert slopes[:2] == pytest.approx(SLOPES[:2], rel=0.1)
    X, _ = draw(1000, seed=1)
    np.testing.assert_allclose(fitted.end_probability(X), expit(law(X)), atol=0.05)


def test_probabilities_are_calibrated(fitted):
    """Of the cases given p, a share p succeeds."""
    X, inside = draw(20000, seed=2)
    probability, success = fitted.success_probability(X), ~inside.any(axis=1)
    bins = np.minimum((10 * probability).astype(int), 9)
    for k in np.unique(bins):
        here = bins == k
        spread = np.sqrt(0.25 / here.sum())
        assert success[here].mean() == pytest.approx(
            probability[here].mean(), abs=0.03 + 3 * spread
        )


def test_success_is_neither_end_in_the_sac(fitted):
    X, _ = draw(20, seed=3)
    ends = fitted.end_probability(X)
    success = fitted.success_probability(X)
    np.testing.assert_allclose(success, (1 - ends[:, 0]) * (1 - ends[:, 1]))
    np.testing.assert_allclose(fitted.predict_proba(X), np.column_stack([1 - success, success]))
    assert fitted.classes_.tolist() == [False, True]
    np.testing.assert_array_equal(fitted.predict(X), success > 0.5)


def test_it_does_not_matter_which_end_is_called_0(fitted):
    X, inside = draw(300, seed=4)
    np.testing.assert_allclose(
        fitted.success_probability(X[:, ::-1]), fitted.success_probability(X), rtol=1e-12
    )
    one, other = EndsClassifier([1.0]), EndsClassifier([1.0])
    np.testing.assert_allclose(
        one.fit(X, inside).success_probability(X),
        other.fit(X[:, ::-1], inside[:, ::-1]).success_probability(X),
        atol=1e-5,
    )


def test_units_of_predictors_do_not_matter():
    X, inside = draw(300, seed=5)
    factors = np.array([1000.0, -0.01, 3.0])
    np.testing.assert_allclose(
        EndsClassifier().fit(X, inside).success_probability(X),
        EndsClassifier().fit(factors * X + 5.0, inside).success_probability(factors * X + 5.0),
        atol=1e-5,
    )


def test_fitted_state_is_all_there_is(fitted):
    """A model is a few arrays: set on a new classifier they give the same probabilities."""
    X, _ = draw(20, seed=6)
    again = EndsClassifier()
    for name in ("offset_", "scale_", "coefficients_", "intercept_"):
        setattr(again, name, getattr(fitted, name))
    np.testing.assert_array_equal(again.predict_proba(X), fitted.predict_proba(X))


def test_labels_at_random_teach_nothing():
    X, inside = draw(1000, seed=7)
    shuffled = np.random.default_rng(7).permutation(inside.ravel()).reshape(-1, 2)
    model = EndsClassifier().fit(X, shuffled)
    X, inside = draw(2000, seed=8)
    shares = model.end_probability(X)
    assert shares.std() < 0.05
    assert shares.mean() == pytest.approx(shuffled.mean(), abs=0.03)
    learnt = EndsClassifier().fit(*draw(1000, seed=7)).success_probability(X)
    assert ClassMetrics.of(~inside.any(axis=1), learnt).AUC > 0.8


def test_noise_is_regularised_more_than_what_can_be_separated():
    X, inside = draw(60, seed=9)
    noise = np.random.default_rng(9).permutation(inside.ravel()).reshape(-1, 2)
    separable = law(X) > 0.0
    assert EndsClassifier().fit(X, noise).C_ < EndsClassifier().fit(X, separable).C_


def test_it_is_a_scikit_learn_estimator():
    copy = clone(EndsClassifier((1.0, 2.0)))
    assert copy.get_params() == {"candidates": (1.0, 2.0)}


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda X, y: (X[:, 0], y), r"shape \(40, 3\), must be \(n, 2, p\)"),
        (lambda X, y: (X[:, [0, 1, 1]], y), r"shape \(40, 3, 3\), must be \(n, 2, p\)"),
        (lambda X, y: (np.where(X < 0, np.nan, X), y), "must be finite"),
        (lambda X, y: (X, y[:20]), r"True or False, of shape \(40, 2\)"),
        (lambda X, y: (X, 2 * y.astype(int)), "True or False"),
        (lambda X, y: (X, y & False), "0 of 80 ends lie in the sac; at least 5"),
        (lambda X, y: (X, y | True), "80 of 80 ends lie in the sac; at least 5"),
    ],
)
def test_unusable_training(change, sentence):
    with pytest.raises(InputError, match=sentence):
        EndsClassifier().fit(*change(*draw(40)))


def test_unusable_predictors(fitted):
    with pytest.raises(InputError, match=r"shape \(5, 2, 2\), must be \(n, 2, 3\)"):
        fitted.predict_proba(np.zeros((5, 2, 2)))
