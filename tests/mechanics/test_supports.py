"""Supports in any axes, prescribed motion, joints that share them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from braidcast.errors import InputError
from braidcast.mechanics import BeamNet, Joints, Problem, Section, Supports, follow_path
from braidcast.mechanics.rotations import exp_so3, log_so3
from problems.statics import chain, held

SECTION = Section(EA=1e4, GJ=0.8, EIy=1.0, EIz=2.0)
TURN = exp_so3(np.array([[0.4, -1.1, 0.7]]))[0]


def straight(count, direction=(1.0, 0.0, 0.0), director=(0.0, 0.0, 1.0)):
    nodes = np.linspace(0.0, 1.0, count)[:, None] * np.array(direction)
    return chain(nodes, SECTION, director)


def solved(problem, **options):
    result = follow_path(problem, steps=4, **options)
    assert result.converged, result.reason
    return result


def guided(turn, in_local_axes=True):
    """A cantilever turned by ``turn``, its tip on a roller that moves across, under a side load."""
    count = 9
    net = straight(count, turn[:, 0], turn[:, 2])
    fixed = np.zeros((count, 6), dtype=bool)
    motion = np.zeros((count, 6))
    fixed[0] = True
    fixed[-1, [1, 3]] = True
    motion[-1, 1] = 0.3
    loads = np.zeros((count, 6))
    loads[-1, :3] = turn @ [0.0, 0.0, 1.5]
    axes = np.tile(turn, (count, 1, 1)) if in_local_axes else None
    return solved(Problem(net, supports=Supports(fixed, motion, axes), loads=loads))


def test_local_axes_turn_the_whole_problem():
    here, there = guided(np.eye(3), in_local_axes=False), guided(TURN)
    assert_allclose(there.state.positions, here.state.positions @ TURN.T, atol=1e-9)
    assert_allclose(there.state.rotations, TURN @ here.state.rotations @ TURN.T, atol=1e-9)
    assert_allclose(
        there.evaluation.nodal.reshape(-1, 3), here.evaluation.nodal.reshape(-1, 3) @ TURN.T,
        atol=1e-7,
    )  # fmt: skip
    assert_allclose(here.state.positions[-1, 1], 0.3, atol=1e-14)


def test_reactions_balance_the_loads():
    result = guided(TURN)
    # what is left at free freedoms is nothing, at held ones the reaction
    assert_allclose(result.evaluation.nodal[1:-1], 0.0, atol=1e-8)
    force = result.evaluation.nodal[:, :3].sum(axis=0)
    assert_allclose(force, -TURN @ [0.0, 0.0, 1.5], atol=1e-8)


@pytest.mark.parametrize("spin", [[0.0, 0.0, 2.5], [1.2, -0.6, 0.9]])
@pytest.mark.parametrize("axes", [np.eye(3), TURN])
def test_prescribed_rotation_is_reached(spin, axes):
    """The rotation vector, in local axes, is the whole turn of the node about a fixed axis."""
    net = straight(9)
    fixed = np.zeros((9, 6), dtype=bool)
    motion = np.zeros((9, 6))
    fixed[0] = True
    fixed[-1, 3:] = True
    motion[-1, 3:] = spin
    problem = Problem(net, supports=Supports(fixed, motion, np.tile(axes, (9, 1, 1))))
    result = solved(problem)
    assert_allclose(log_so3(result.state.rotations)[-1], axes @ spin, atol=1e-12)


def test_prescribed_turn_bends_into_an_arc():
    net = straight(11)
    fixed, motion = held(11, [0], plane=True).fixed, np.zeros((11, 6))
    fixed[-1, 5] = True
    motion[-1, 5] = np.pi / 2
    result = solved(Problem(net, supports=Supports(fixed, motion)))
    # ten chords of an arc of length 1 that turns by a right angle
    radius = 0.1 / (2.0 * np.sin(np.pi / 40))
    assert_allclose(result.state.positions[-1], [radius, radius, 0.0], atol=1e-9)
    assert_allclose(result.evaluation.nodal[-1, 5], SECTION.EIy * np.pi / 2, rtol=1e-9)


def test_motion_alone_without_free_unknowns():
    net = straight(3)
    fixed, motion = np.ones((3, 6), dtype=bool), np.zeros((3, 6))
    motion[:, 0] = [0.0, 0.1, 0.2]
    result = solved(Problem(net, supports=Supports(fixed, motion)))
    assert_allclose(result.evaluation.strain_energy, 0.5 * SECTION.EA * 0.2**2, rtol=1e-12)
    assert_allclose(result.evaluation.nodal[:, 0], [-0.2e4, 0.0, 0.2e4], atol=1e-9)


def two_pieces(order):
    """Two beams end to end, their common point two nodes joined; ``order`` numbers the nodes."""
    places = np.array([[0.0, 0, 0], [0.5, 0, 0], [0.5, 0, 0], [1.0, 0.2, 0]])
    nodes = np.empty((4, 3))
    nodes[order] = places
    return BeamNet(nodes, [[order[0], order[1]], [order[2], order[3]]], SECTION)


@pytest.mark.parametrize("order", [[0, 1, 2, 3], [3, 2, 1, 0], [0, 2, 1, 3]])
@pytest.mark.parametrize("side", [1, 2])
@pytest.mark.parametrize("method", ["shared", "penalty"])
def test_a_joined_node_is_held_in_the_axes_of_the_one_that_is_supported(order, side, method):
    net = two_pieces(order)
    fixed, motion = np.zeros((4, 6), dtype=bool), np.zeros((4, 6))
    axes = np.tile(np.eye(3), (4, 1, 1))
    fixed[[order[0], order[3]]] = True
    fixed[order[0], 0] = False
    middle = order[side]
    axes[middle] = TURN
    fixed[middle, 1] = True
    motion[middle, 1] = 0.05
    joints = Joints(np.array([[order[1], order[2]]]), method, stiffness=1e6)
    result = solved(Problem(net, joints=joints, supports=Supports(fixed, motion, axes)))
    moved = (result.state.positions - net.nodes)[[order[1], order[2]]]
    assert_allclose(moved @ TURN[:, 1], 0.05, atol=1e-4)
    assert_allclose(moved[0], moved[1], atol=1e-4)
    assert np.linalg.norm(moved[0] - 0.05 * TURN[:, 1]) > 1e-3


def test_joined_nodes_held_in_two_ways_are_refused():
    net = two_pieces([0, 1, 2, 3])
    joints = Joints(np.array([[1, 2]]))
    fixed, motion = np.zeros((4, 6), dtype=bool), np.zeros((4, 6))
    fixed[[1, 2], 1] = True
    motion[2, 1] = 0.1
    with pytest.raises(InputError, match="joined nodes 1 and 2 are moved differently"):
        follow_path(Problem(net, joints=joints, supports=Supports(fixed, motion)))
    axes = np.tile(np.eye(3), (4, 1, 1))
    axes[2] = TURN
    with pytest.raises(InputError, match="joined nodes 1 and 2 are held in different axes"):
        follow_path(Problem(net, joints=joints, supports=Supports(fixed, axes=axes)))


def test_chains_of_joints_share_one_translation():
    """Three wires joined in one point, each clamped at its far end."""
    angle = 2.0 * np.pi * np.arange(3) / 3.0
    far = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    nodes = np.concatenate([far, np.zeros((3, 3))])
    net = BeamNet(nodes, [[0, 3], [1, 4], [2, 5]], SECTION, [0.0, 0.0, 1.0])
    loads = np.zeros((6, 6))
    loads[4, 2] = 1.0
    supports = Supports.clamp(6, [0, 1, 2])
    problem = Problem(net, Joints(np.array([[3, 4], [5, 4]])), supports, loads)
    positions = solved(problem).state.positions
    assert_allclose(positions[3:], positions[[4, 4, 4]], atol=1e-15)
    assert_allclose(positions[3, :2], 0.0, atol=1e-9)
    assert positions[3, 2] > 0.01
