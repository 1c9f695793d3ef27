"""Metrics against counts by hand, scikit-learn and closed forms."""

import numpy as np
import pytest
from sklearn import metrics as sk

from braidcast.errors import InputError
from braidcast.surrogate.metrics import ClassMetrics, NodeErrors, intervals, roc, share_inside


def table(TP, FN, FP, TN):
    """Outcomes and probabilities with this confusion matrix."""
    success = np.repeat([True, True, False, False], [TP, FN, FP, TN])
    return success, np.repeat([0.9, 0.2, 0.8, 0.1], [TP, FN, FP, TN])


@pytest.fixture
def sample():
    """Outcomes drawn with the probabilities given, rounded so that some are tied."""
    rng = np.random.default_rng(3)
    probability = np.round(rng.random(200), 2)
    return rng.random(200) < probability, probability


def test_support_vectors_of_the_paper_at_600_read_rightly():
    """Errata, row 17: both readings of the one confusion matrix of Table 2."""
    found = ClassMetrics.of(*table(TP=66, FN=3, FP=2, TN=29))
    assert (found.TP, found.FN, found.FP, found.TN) == (66, 3, 2, 29)
    ours = [found.sensitivity, found.specificity, found.precision, found.F1, found.accuracy]
    assert np.round(100 * np.array(ours), 1).tolist() == [95.7, 93.5, 97.1, 96.4, 95.0]
    paper = found.paper_convention()
    assert paper["accuracy"] == 0.95
    assert paper["sensitivity"] == pytest.approx(0.906, abs=5e-4)
    assert paper["specificity"] == pytest.approx(0.970, abs=1e-3)
    assert paper["precision"] == pytest.approx(0.935, abs=5e-4)
    assert paper["F1"] == pytest.approx(0.920, abs=1e-3)


@pytest.mark.parametrize("threshold", [0.3, 0.5, 0.83])
def test_values_are_those_of_scikit_learn(sample, threshold):
    success, probability = sample
    found, called = ClassMetrics.of(success, probability, threshold), probability > threshold
    assert found.accuracy == pytest.approx(sk.accuracy_score(success, called))
    assert found.sensitivity == pytest.approx(sk.recall_score(success, called))
    assert found.specificity == pytest.approx(sk.recall_score(~success, ~called))
    assert found.precision == pytest.approx(sk.precision_score(success, called))
    assert found.F1 == pytest.approx(sk.f1_score(success, called))
    assert found.AUC == pytest.approx(sk.roc_auc_score(success, probability))
    assert found.Brier == pytest.approx(sk.brier_score_loss(success, probability))
    assert found.paper_convention()["F1"] == pytest.approx(sk.f1_score(~success, ~called))


def test_auc_is_the_share_of_pairs_ranked_rightly(sample):
    success, probability = sample
    above = probability[success][:, None] - probability[~success][None, :]
    share = (above > 0).mean() + 0.5 * (above == 0).mean()
    assert ClassMetrics.of(success, probability).AUC == pytest.approx(share)
    false_positives, true_positives, _ = roc(success, probability)
    assert np.trapezoid(true_positives, false_positives) == pytest.approx(share)


def test_a_probability_at_the_threshold_is_called_a_failure():
    assert ClassMetrics.of([True, False], [0.5, 0.5]).TN == 1


def test_undefined_values_are_nan():
    only_successes = ClassMetrics.of([True, True], [0.9, 0.1])
    assert np.isnan([only_successes.specificity, only_successes.AUC]).all()
    none_called = ClassMetrics.of([True, False], [0.2, 0.1])
    assert np.isnan(none_called.precision) and none_called.F1 == 0.0
    all_right = ClassMetrics.of([True], [0.9]).paper_convention()
    assert np.isnan([all_right["sensitivity"], all_right["precision"], all_right["F1"]]).all()


def test_intervals_of_proportions_are_binomial():
    """Of large numbers the normal one; with no error in n, (α/2)^(1/n) and more."""
    found = intervals(*table(TP=200, FN=40, FP=20, TN=140))
    std = np.sqrt(0.85 * 0.15 / 400)
    assert found["accuracy"] == pytest.approx(
        (0.85 - 1.96 * std, 0.85 + 1.96 * std), abs=0.25 * std
    )
    without = intervals(*table(TP=67, FN=0, FP=0, TN=33))
    for name, n in (("accuracy", 100), ("sensitivity", 67), ("specificity", 33), ("precision", 67)):
        assert without[name] == pytest.approx((0.025 ** (1 / n), 1.0))


def test_intervals_of_other_values_are_bootstraps():
    """The Brier score of large numbers, against the normal one of a mean."""
    success, probability = table(TP=200, FN=40, FP=20, TN=140)
    squares = (np.asarray(probability) - np.asarray(success)) ** 2
    std = squares.std() / 20.0
    low, high = intervals(success, probability, count=4000)["Brier"]
    mean = squares.mean()
    assert (low, high) == pytest.approx((mean - 1.96 * std, mean + 1.96 * std), abs=0.2 * std)


def test_intervals_hold_the_values_and_repeat(sample):
    found, values = intervals(*sample), ClassMetrics.of(*sample)
    assert all(low < getattr(values, name) < high for name, (low, high) in found.items())
    assert found == intervals(*sample)
    assert found != intervals(*sample, seed=1)
    wider = intervals(*sample, level=0.99)
    assert wider["Brier"][0] < found["Brier"][0] and wider["Brier"][1] > found["Brier"][1]


def test_intervals_of_undefined_values_are_nan():
    assert np.isnan(intervals([True, True], [0.9, 0.8])["specificity"]).all()


@pytest.mark.parametrize(
    ("success", "probability", "sentence"),
    [
        ([True], [0.1, 0.2], r"shapes \(1,\) and \(2,\), must be \(n,\) both"),
        ([], [], "n 1 or more"),
        ([2], [0.5], "Outcomes must be True or False"),
        ([True], [1.2], "between 0 and 1"),
        ([True], [np.nan], "between 0 and 1"),
    ],
)
def test_unusable_outcomes(success, probability, sentence):
    with pytest.raises(InputError, match=sentence):
        ClassMetrics.of(success, probability)


def test_roc_needs_both_outcomes():
    with pytest.raises(InputError, match="needs successes and failures"):
        roc([True, True], [0.5, 0.6])


def test_node_errors():
    true = np.random.default_rng(0).normal(size=(2, 4, 3))
    predicted = true.copy()
    predicted[0, 1] += [0.0, 0.3, 0.4]
    predicted[1, :] += [0.1, 0.0, 0.0]
    errors = NodeErrors.of(predicted, true)
    np.testing.assert_allclose(errors.AE, [0.125, 0.1])
    np.testing.assert_allclose(errors.ME, [0.5, 0.1])
    assert errors.AE_p == pytest.approx(0.1125)
    assert errors.ME_p == pytest.approx(0.3)
    assert errors.large == 1


def test_node_errors_of_other_shapes():
    with pytest.raises(InputError, match=r"must be \(n, N, 3\) both"):
        NodeErrors.of(np.zeros((2, 4, 3)), np.zeros((2, 5, 3)))


def test_share_inside_of_normal_errors():
    rng = np.random.default_rng(1)
    std = rng.uniform(0.1, 2.0, size=(200, 50, 3))
    true = std * rng.normal(size=std.shape)
    assert share_inside(np.zeros_like(true), std, true) == pytest.approx(0.95, abs=0.005)
    assert share_inside(np.zeros_like(true), std, true, z=1.0) == pytest.approx(0.683, abs=0.01)
    assert share_inside(true, 0.0 * std, true) == 1.0
