"""When Newton's method stops."""

import numpy as np
import pytest

from braidcast.mechanics import NewtonOptions, Problem, Section, State, equilibrium
from braidcast.mechanics.equilibrium import PATIENCE, _rises, newton
from braidcast.mechanics.system import System
from problems.statics import chain, held, tip_load

SECTION = Section(EA=1e4, GJ=1.0, EIy=1.0, EIz=1.0)
NODES = np.column_stack([np.arange(5.0), np.zeros(5), np.zeros(5)])


def bent(**options):
    problem = Problem(
        chain(NODES, SECTION), supports=held(5, [0]), loads=tip_load(5, [0, 0.1, 0, 0, 0, 0])
    )
    start = State(NODES.copy(), np.tile(np.eye(3), (5, 1, 1)))
    return newton(System(problem), start, NewtonOptions(**options))


@pytest.mark.parametrize("relative", [0.5, 1e-3, 1e-6])
def test_a_relative_tolerance_is_a_share_of_the_first_residual(relative):
    loose = bent(relative=relative)
    assert loose.converged
    assert loose.residual <= relative * loose.residuals[0]
    assert all(residual > relative * loose.residuals[0] for residual in loose.residuals[:-1])


def test_the_larger_tolerance_counts():
    assert bent(tolerance=1e-3, relative=1e-12).iterations == bent(tolerance=1e-3).iterations


@pytest.mark.parametrize(
    ("later", "rises"),
    [([], 0), ([3.0], 0), ([3.0, 2.0], 0), ([3.0, 4.0], 1), ([3.0, 4.0, 5.0], 2),
     ([3.0, 4.0, 3.5], 0), ([3.0, 2.0, 2.5, 2.6], 2)],
)  # fmt: skip
def test_rises_are_counted_in_a_row_after_the_first_iterations(later, rises):
    assert _rises([1.0, 10.0, 100.0][:PATIENCE] + later) == rises


@pytest.mark.parametrize("rises", [0, 1, 4])
def test_an_attempt_that_diverges_is_given_up(monkeypatch, rises):
    counted = iter(range(1, 100))
    monkeypatch.setattr(equilibrium, "residual_norm", lambda system, gradient: float(next(counted)))
    result = bent(rises=rises, iterations=50)
    assert not result.converged and "kept rising" in result.reason
    assert result.iterations == PATIENCE + rises + 1
