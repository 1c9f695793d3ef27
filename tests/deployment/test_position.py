"""The way of the rings from straight to bent, and the braid that follows them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from braidcast.case import Case
from braidcast.deployment.crimp import crimped_state
from braidcast.deployment.net import braid_net
from braidcast.deployment.position import RingPath, placed, position
from braidcast.deployment.result import Deployment
from braidcast.mechanics import Joints, NewtonOptions, Problem
from braidcast.mechanics.system import System


def space_curve(count: int = 71) -> np.ndarray:
    t = np.linspace(0.0, 2.0, count)
    return np.stack([3.0 * np.sin(2.0 * t), 5.0 * t**2, 10.0 * t + np.cos(3.0 * t)], axis=1)


def lengths(points: np.ndarray) -> np.ndarray:
    return np.linalg.norm(np.diff(points, axis=0), axis=1)


def test_the_whole_way_ends_on_the_target() -> None:
    target = space_curve()
    assert np.abs(RingPath.along(target).rings(1.0)[0] - target).max() < 1e-12


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=30, deadline=None)
def test_any_polygon_is_reached(seed: int) -> None:
    target = np.cumsum(np.random.default_rng(seed).standard_normal((20, 3)), axis=0)
    path = RingPath.along(target)
    assert np.abs(path.rings(1.0)[0] - target).max() < 1e-12
    assert lengths(path.rings(0.3)[0]) == pytest.approx(path.lengths, rel=1e-12)


def test_the_way_begins_straight_in_the_direction_of_the_target() -> None:
    target = space_curve()
    centres, turns = RingPath.along(target).rings(0.0)
    first = (target[1] - target[0]) / np.linalg.norm(target[1] - target[0])
    along = np.concatenate([[0.0], np.cumsum(lengths(target))])
    assert np.abs(centres - (target[0] + along[:, None] * first)).max() < 1e-12
    assert np.abs(turns - turns[0]).max() < 1e-12
    assert turns[0] @ [0.0, 0.0, 1.0] == pytest.approx(first)


@pytest.mark.parametrize("fraction", [0.0, 0.25, 0.7, 1.0])
def test_segments_keep_their_length_and_rings_their_shape(fraction: float) -> None:
    path = RingPath.along(space_curve())
    centres, turns = path.rings(fraction)
    assert np.abs(lengths(centres) - path.lengths).max() < 1e-12
    assert np.abs(turns.transpose(0, 2, 1) @ turns - np.eye(3)).max() < 1e-12
    assert np.linalg.det(turns) == pytest.approx(1.0)


def test_rings_look_half_way_between_their_segments() -> None:
    centres, turns = RingPath.along(space_curve()).rings(1.0)
    along = np.diff(centres, axis=0) / lengths(centres)[:, None]
    between = along[:-1] + along[1:]
    between /= np.linalg.norm(between, axis=1)[:, None]
    assert np.abs(turns[1:-1, :, 2] - between).max() < 1e-12


def test_turns_are_shared_out_evenly() -> None:
    """Half of the way of an arc is the arc of twice the radius."""
    angle = np.linspace(0.0, 1.0, 41)
    arc = 10.0 * np.stack([0 * angle, 1.0 - np.cos(angle), np.sin(angle)], axis=1)
    centres = RingPath.along(arc).rings(0.5)[0]
    directions = np.diff(centres, axis=0) / lengths(centres)[:, None]
    turned = np.arccos(np.clip((directions[:-1] * directions[1:]).sum(axis=1), -1.0, 1.0))
    assert turned == pytest.approx(0.5 / 40.0, rel=1e-6)


@pytest.mark.parametrize("direction", [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [0.6, 0.0, 0.8]])
def test_a_straight_target_needs_no_turn(direction: list[float]) -> None:
    target = np.linspace(0.0, 7.0, 8)[:, None] * direction
    path = RingPath.along(target)
    assert np.abs(path.turns[1:]).max() < 1e-14
    for fraction in (0.0, 0.5, 1.0):
        assert np.abs(path.rings(fraction)[0] - target).max() < 1e-12


def test_a_target_that_folds_back_is_followed() -> None:
    target = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.5], [0.0, 0.0, 2.0]])
    path = RingPath.along(target)
    assert np.isfinite(path.turns).all()
    assert np.abs(path.rings(1.0)[0] - target).max() < 1e-12


def small(bend: float) -> Case:
    return Case.from_dict(
        {
            "vessel": {"P1": [0.0, bend, 25.0], "diameter": 3.0},
            "device": {"wires": 12, "segments": 24},
            "site": {"eta": 0.5},
        }
    )


@pytest.mark.parametrize("bend", [0.0, 15.0, 30.0])
def test_a_braid_follows_its_rings(bend: float) -> None:
    case = small(bend)
    braid = case.braid
    rings = np.array(braid.rings)
    crimped = crimped_state(braid, case.crimped_radius)
    heights = crimped.positions[:25, 2] - crimped.positions[0, 2]
    target = case.centreline.at_arc_length(case.start_arc_length + heights)
    path = RingPath.along(target)
    joints = Joints(np.array(braid.crossings))
    system = System(Problem(braid_net(braid), joints=joints, levels=rings))
    bending = braid.young_modulus * np.pi * braid.wire_radius**4 / 4.0
    stiffness = 10.0 * bending / braid.segment_length**3
    reached: list[float] = []
    last, iterations = position(
        system, crimped, rings, path, stiffness, NewtonOptions(1e-6), reached.append
    )
    assert last.converged and iterations >= last.iterations
    assert reached == sorted(reached) and reached[-1] == 1.0
    centres = centres_of(last.state.positions, rings)
    assert np.linalg.norm(centres - target, axis=1).max() < 0.1
    assert stretch(last.state.positions, braid.elements, braid.segment_length) < 1e-3
    if bend == 0.0:
        # laid along the axis, the crimped braid has nothing to yield to
        aim = placed(crimped, rings, path, 1.0).positions
        assert np.abs(aim[:, :2] - crimped.positions[:, :2]).max() < 1e-12


def centres_of(positions: np.ndarray, rings: np.ndarray) -> np.ndarray:
    sums = [np.bincount(rings, positions[:, i]) for i in range(3)]
    return np.stack(sums, axis=1) / np.bincount(rings)[:, None]


def stretch(positions: np.ndarray, elements: np.ndarray, length: float) -> float:
    first, second = positions[elements[:, 0]], positions[elements[:, 1]]
    return float(np.abs(np.linalg.norm(second - first, axis=1) / length - 1.0).max())


@pytest.mark.slow
def test_the_paper_device_on_the_curve_of_its_vessel(success: Deployment) -> None:
    case = success.case
    (positions,) = [shape for stage, shape in success.frames if stage == "position"]
    rings = np.array(case.braid.rings)
    heights = success.frames[1][1][:71, 2]
    target = case.centreline.at_arc_length(case.start_arc_length + heights - heights[0])
    assert np.linalg.norm(centres_of(positions, rings) - target, axis=1).max() < 0.1
    assert stretch(positions, case.braid.elements, case.braid.segment_length) < 1e-3
    first, second = positions[case.braid.crossings.T]
    assert np.abs(first - second).max() < 1e-9
    # still clear of the wall, so that the release begins without contact
    assert (-case.vessel_geometry.distance(positions) - case.braid.wire_radius).min() > 0.0
    # the paper's crimped radius survives the bend
    away = case.centreline.closest(positions)[0]
    assert np.abs(away - case.crimped_radius).max() < 0.2
