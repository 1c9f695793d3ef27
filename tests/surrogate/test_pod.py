"""Proper orthogonal decomposition: its identities."""

import numpy as np
import pytest

from braidcast.errors import InputError
from braidcast.surrogate.pod import modes_for, pod

RANDOM = np.random.default_rng(3)
SNAPSHOTS = RANDOM.normal(size=(20, 5)) @ RANDOM.normal(size=(5, 300)) + RANDOM.normal(
    size=(20, 300), scale=0.1
)


@pytest.mark.parametrize("centred", [True, False])
@pytest.mark.parametrize("count", [1, 3, 10])
def test_what_is_left_is_the_tail_of_the_singular_values(count: int, centred: bool) -> None:
    """Eckart & Young."""
    basis = pod(SNAPSHOTS, centred=centred)
    few = basis.truncated(count)
    left = SNAPSHOTS - few.snapshots(few.coefficients(SNAPSHOTS))
    tail = (basis.singular_values[count:] ** 2).sum()
    assert abs((left**2).sum() / tail - 1.0) < 1e-10


def test_no_other_directions_leave_less() -> None:
    few = pod(SNAPSHOTS, centred=False).truncated(4)
    left = np.linalg.norm(SNAPSHOTS - few.snapshots(few.coefficients(SNAPSHOTS)))
    for _ in range(20):
        other = np.linalg.qr(few.modes.T + 0.05 * RANDOM.normal(size=few.modes.T.shape))[0]
        assert left < np.linalg.norm(SNAPSHOTS - SNAPSHOTS @ other @ other.T)


def test_errors_of_projection_and_of_regression_are_square() -> None:
    """‖e_p‖² = ‖e_rb‖² + ‖V (û − Vᵀ u)‖²."""
    few = pod(SNAPSHOTS).truncated(6)
    truth = few.coefficients(SNAPSHOTS)
    wrong = truth + RANDOM.normal(size=truth.shape)
    whole = np.linalg.norm(SNAPSHOTS - few.snapshots(wrong), axis=1) ** 2
    projection = np.linalg.norm(SNAPSHOTS - few.snapshots(truth), axis=1) ** 2
    regression = np.linalg.norm((wrong - truth) @ few.modes, axis=1) ** 2
    assert np.abs(whole / (projection + regression) - 1.0).max() < 1e-10


def test_modes_are_orthonormal_and_no_more_than_the_snapshots_have() -> None:
    basis = pod(SNAPSHOTS)
    assert len(basis.modes) == 19
    assert np.abs(basis.modes @ basis.modes.T - np.eye(19)).max() < 1e-13


def test_both_criteria_count_as_they_say() -> None:
    sigma = np.array([8.0, 4.0, 2.0, 1.0, 1.0])
    assert modes_for(sigma, 0.25, "sum") == 2
    assert modes_for(sigma, 0.1, "sum") == 4
    assert modes_for(sigma, 0.1, "squares") == 2
    with pytest.raises(InputError, match="tolerance = 1.5 must be between 0 and 1"):
        modes_for(sigma, 1.5)


def test_snapshots_with_holes_are_refused() -> None:
    with pytest.raises(InputError, match="finite"):
        pod(np.array([[1.0, np.nan]]))
