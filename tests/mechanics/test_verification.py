"""Every row of the table of verification within its bar."""

import pytest

from problems import PROBLEMS, nets, walls


@pytest.mark.parametrize("problem", PROBLEMS, ids=lambda problem: problem.__name__)
def test_within_its_bar(problem):
    for row in problem():
        assert row.error <= row.bar, row


def test_penalty_error_is_force_over_stiffness():
    exact = nets.solved(nets.lattice())
    soft, stiff = (
        nets.distance(nets.solved(nets.lattice("penalty", stiffness=k)), exact) for k in (1e2, 1e4)
    )
    assert soft / stiff == pytest.approx(100.0, rel=0.02)


@pytest.mark.parametrize("direction", [(1.0, 0.0), (0.6, 0.8)])
@pytest.mark.parametrize("share, holds", [(0.99, True), (1.01, False)])
def test_a_pressed_rod_holds_up_to_coulombs_limit(direction, share, holds):
    limit = walls.FRICTION * 5.0
    problem = walls.pressed_rod([share * limit * d for d in direction])
    assert walls.rests(problem) is holds
