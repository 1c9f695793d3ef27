"""The braid as geometry alone places it, against the simulation's own rules and results."""

import numpy as np
import pytest

from braidcast.case import Case
from braidcast.deployment.position import RingPath
from braidcast.surrogate.placed_braid import placed_braid

SITE = {"site": {"eta": 0.5}}
BENT = {
    "vessel": {"P1": [0.0, 15.0, 25.0], "diameter": 3.0},
    "aneurysm": {"diameter": 7.0, "protrusion": 0.5},
    "site": {"eta": 0.5},
}


@pytest.fixture
def bent() -> Case:
    return Case.from_dict(BENT)


def test_elements_of_a_straight_vessel_keep_their_length() -> None:
    case = Case.from_dict({"vessel": {"P1": [0.0, 0.0, 25.0], "diameter": 3.0}} | SITE)
    placed = placed_braid(case)
    ends = placed.positions[np.array(case.braid.elements)]
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    assert np.abs(lengths - case.braid.segment_length).max() < 1e-12


def test_wires_touch_the_wall_and_crossings_meet(bent: Case) -> None:
    placed = placed_braid(bent)
    distance, _ = bent.centreline.closest(placed.positions)
    assert np.abs(distance - bent.vessel_radius + bent.braid.wire_radius).max() < 1e-12
    crossing = placed.positions[np.array(bent.braid.crossings)]
    assert np.abs(crossing[:, 0] - crossing[:, 1]).max() < 1e-12


@pytest.mark.parametrize("P0", [(0.0, 0.0, 0.0), (2.0, -3.0, 1.0)])
def test_rings_are_turned_as_the_simulation_turns_them(P0: tuple[float, float, float]) -> None:
    case = Case.from_dict(
        BENT | {"vessel": {"P0": P0, "P1": [1.0, 15.0, 25.0], "diameter": 3.0}} | SITE
    )
    placed = placed_braid(case)
    rings = np.arange(case.braid.segments + 1)
    centres = np.array(
        [placed.positions[np.array(case.braid.rings) == ring].mean(axis=0) for ring in rings]
    )
    turns = RingPath.along(centres).rings(1.0)[1]
    # the first segment's chord is not quite the tangent of the first ring
    assert np.abs(turns - placed.axes).max() < 0.02


def test_departures_lead_back(bent: Case) -> None:
    placed = placed_braid(bent)
    nodes = placed.positions + np.random.default_rng(0).normal(size=placed.positions.shape)
    assert np.abs(placed.moved(placed.departure(nodes)) - nodes).max() < 1e-13
    gone = np.linalg.norm(placed.departure(nodes), axis=1)
    assert np.abs(gone - np.linalg.norm(nodes - placed.positions, axis=1)).max() < 1e-13


def test_a_vessel_that_sets_out_against_the_axis_has_turns_too() -> None:
    vessel = {"P0": [0, 0, 50], "P1": [0, 0, 20], "P2": [0, 0, -10], "diameter": 3.0}
    axes = placed_braid(Case.from_dict({"vessel": vessel} | SITE)).axes
    assert np.abs(axes @ axes.transpose(0, 2, 1) - np.eye(3)).max() < 1e-13
    assert np.abs(np.linalg.det(axes) - 1.0).max() < 1e-13
