"""The threshold against the cost it minimises."""

import numpy as np
import pytest

from braidcast.errors import InputError
from braidcast.surrogate.metrics import ClassMetrics
from braidcast.surrogate.thresholds import COST_RATIO, success_threshold


@pytest.mark.parametrize("ratio", [0.5, 1.0, COST_RATIO])
def test_no_other_threshold_costs_less(ratio):
    """For calibrated probabilities, up to chance."""
    rng = np.random.default_rng(0)
    probability = rng.random(20_000)
    success = rng.random(20_000) < probability

    def cost(threshold):
        found = ClassMetrics.of(success, probability, threshold)
        return ratio * found.FP + found.FN

    least = min(cost(threshold) for threshold in np.linspace(0.02, 0.98, 49))
    assert cost(success_threshold(ratio)) < 1.02 * least
    assert cost(0.5 * success_threshold(ratio)) > 1.05 * least


def test_equal_costs_part_at_one_half():
    assert success_threshold(1.0) == 0.5
    assert success_threshold() == pytest.approx(5 / 6)


@pytest.mark.parametrize("ratio", [0.0, -1.0, np.nan, np.inf])
def test_unusable_ratio(ratio):
    with pytest.raises(InputError, match="cost_ratio = .* must be positive and finite"):
        success_threshold(ratio)
