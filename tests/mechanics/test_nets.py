"""Nets of unusual shape, paths that end early, and what cannot be used."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from braidcast.errors import InputError
from braidcast.mechanics import (
    BeamNet,
    Contact,
    Cylinder,
    Joints,
    NewtonOptions,
    Plane,
    Problem,
    Section,
    Supports,
    follow_path,
)
from braidcast.mechanics.system import System
from problems.nets import SOLVERS, WIRE, distance, lattice, solved
from problems.statics import chain, held, tip_load

SECTION = Section(EA=1e4, GJ=1.0, EIy=1.0, EIz=1.0)
NODES = np.column_stack([np.arange(5.0), np.zeros(5), np.zeros(5)])
CHAIN = np.column_stack([np.arange(4), np.arange(1, 5)])


def cantilever(shift=0.0):
    return Problem(
        chain(NODES + [0.0, shift, 0.0], SECTION),
        supports=held(5, [0]),
        loads=tip_load(5, [0.0, 0.02, 0.01, 0.0, 0.0, 0.0]),
    )


@pytest.mark.parametrize("key", SOLVERS)
def test_disconnected_nets_do_not_know_of_each_other(key):
    one = cantilever()
    nodes = np.concatenate([NODES, NODES + [0.0, 5.0, 0.0]])
    net = BeamNet(nodes, np.concatenate([CHAIN, CHAIN + 5]), SECTION)
    loads = np.zeros((10, 6))
    loads[[4, 9]] = one.loads[4]
    both = Problem(net, supports=Supports.clamp(10, [0, 5]), loads=loads)
    alone, together = solved(one).state.positions, solved(both, key).state.positions
    assert_allclose(together[:5], alone, atol=1e-9)
    assert_allclose(together[5:], alone + [0.0, 5.0, 0.0], atol=1e-9)


@pytest.mark.parametrize("key", SOLVERS)
@pytest.mark.parametrize("clamped", [[0, 2], [0, 1, 2], [0, 3, 4], [0, 4]])
def test_levels_without_free_unknowns(key, clamped):
    problem = Problem(
        chain(NODES, SECTION),
        supports=held(5, clamped),
        loads=np.tile([0.0, 0.01, 0.0, 0.0, 0.0, 0.0], (5, 1)),
        levels=np.arange(5),
    )
    unnumbered = Problem(problem.net, supports=problem.supports, loads=problem.loads)
    assert distance(solved(problem, key), solved(unnumbered, "superlu")) < 1e-9


def test_levels_change_nothing_but_the_order():
    problem = lattice()
    x = np.round(problem.net.nodes[:, 0] * 4).astype(int)
    numbered = Problem(problem.net, problem.joints, problem.supports, levels=x)
    assert distance(solved(problem), solved(numbered)) < 1e-7


def test_numbering_of_nodes_does_not_matter():
    problem = lattice()
    count = len(problem.net.nodes)
    order = np.random.default_rng(1).permutation(count)
    place = np.argsort(order)
    net = BeamNet(problem.net.nodes[order], place[problem.net.elements], WIRE)
    supports = Supports(problem.supports.fixed[order], problem.supports.motion[order])
    shuffled = solved(Problem(net, Joints(place[problem.joints.pairs]), supports))
    assert_allclose(shuffled.state.positions[place], solved(problem).state.positions, atol=1e-7)


def test_unknowns_are_numbered_once_each():
    system = System(lattice())
    numbers = system.dofs[system.dofs >= 0]
    assert_allclose(np.unique(numbers), np.arange(system.size))
    pairs = system.problem.joints.pairs
    assert_allclose(system.dofs[pairs[:, 0], :3], system.dofs[pairs[:, 1], :3])
    assert (system.dofs[pairs[:, 0], 3:] != system.dofs[pairs[:, 1], 3:]).all()


def test_a_path_that_cannot_go_on_says_where_and_why():
    problem = Problem(chain(NODES, SECTION), loads=tip_load(5, [1.0, 0, 0, 0, 0, 0]))
    result = follow_path(problem, options=NewtonOptions(iterations=4), smallest_step=0.05)
    assert not result.converged
    assert result.reason.startswith("stopped at load factor 0: ")
    assert np.isfinite(result.residual)


def test_progress_ends_at_one():
    seen = []
    follow_path(cantilever(), progress=seen.append)
    assert seen == sorted(seen) and seen[-1] == 1.0


def test_a_state_can_be_copied_and_is_not_changed():
    problem = cantilever()
    start = problem.net.reference.copy()
    follow_path(problem, start)
    assert_allclose(start.positions, NODES)
    assert_allclose(start.rotations, np.tile(np.eye(3), (5, 1, 1)))


def build(nodes=NODES, elements=CHAIN, section=SECTION, director=None, ends=None):
    return BeamNet(nodes, elements, section, director, ends)


def spoilt(array, where, value):
    copy = np.array(array, dtype=float)
    copy[where] = value
    return copy


FREE = np.zeros((5, 6), dtype=bool)
WALL = Plane([0, 0, 0], [0, 0, 1])


@pytest.mark.parametrize(
    "make, names",
    [
        (lambda: build(nodes=spoilt(NODES, (2, 1), np.nan)), r"nodes\[2, 1\] is nan"),
        (lambda: build(nodes=NODES[:, :2]), r"nodes has shape \(5, 2\)"),
        (lambda: build(nodes=[[0, 0, 0], [1, 0]]), "nodes must be numbers"),
        (lambda: build(nodes="none"), "nodes must be numbers"),
        (lambda: build(nodes=spoilt(NODES, 3, NODES[2])), "element 2 has no length"),
        (lambda: build(elements=[[0, 1], [1, 1]]), "element 1 has no length"),
        (lambda: build(elements=[[0, 5]]), "elements must name nodes 0 to 4"),
        (lambda: build(elements=[[-1, 2]]), "elements must name nodes 0 to 4"),
        (lambda: build(elements=[]), "elements"),
        (lambda: build(elements=[0, 1]), "elements"),
        (lambda: build(elements=[[0.5, 1.0]]), "elements must be whole numbers"),
        (lambda: build(director=[1, 0, 0]), "second_director must not lie along"),
        (lambda: build(director=[0, np.nan, 0]), "second_director"),
        (lambda: build(director=np.ones((3, 3))), "second_director has shape"),
        (lambda: build(ends=np.ones((4, 3))), "end_tangents"),
        (lambda: build(ends=-np.ones((4, 2, 3))), "end_tangents must point along"),
        (lambda: Section(1.0, 0.0, 1.0, 1.0), "section.GJ is 0"),
        (lambda: Section(np.inf, 1.0, 1.0, 1.0), "section.EA is inf"),
        (lambda: Section.circular(-0.1, 1.0, 0.3), "radius"),
        (lambda: Section.circular(0.1, 1.0, -1.0), "poisson_ratio"),
        (lambda: Section.circular(0.1, np.nan, 0.3), "young_modulus"),
        (lambda: Joints([[0, 1, 2]]), "joints.pairs"),
        (lambda: Joints([[0, 1]], "glued"), 'joints.method is "glued"'),
        (lambda: Joints([[0, 1]], "penalty", -1.0), "joints.stiffness is -1"),
        (lambda: Problem(build(), Joints([[0, 7]])), "joints.pairs must name nodes 0 to 4"),
        (lambda: Supports(np.zeros((5, 3))), "supports.fixed has shape"),
        (lambda: Supports(FREE, np.zeros((4, 6))), "supports.motion has shape"),
        (lambda: Supports(FREE, spoilt(FREE, (1, 2), np.inf)), r"supports.motion\[1, 2\] is inf"),
        (lambda: Supports(FREE, spoilt(FREE, (1, 2), 0.1)), "may only move freedoms"),
        (
            lambda: Supports(spoilt(FREE, (1, 4), 1), spoilt(FREE, (1, 4), 0.1)),
            "may only turn nodes",
        ),
        (lambda: Supports(FREE, axes=np.ones((5, 3, 3))), "supports.axes must be orthonormal"),
        (lambda: Supports(FREE, axes=np.eye(3)), "supports.axes has shape"),
        (lambda: Supports.clamp(5, [5]), "must name nodes 0 to 4"),
        (lambda: Problem(build(), supports=Supports.clamp(4, [0])), "supports are for 4 nodes"),
        (lambda: Problem(build(), loads=np.zeros((5, 3))), "loads has shape"),
        (lambda: Problem(build(), loads=np.full((5, 6), np.nan)), r"loads\[0, 0\] is nan"),
        (lambda: Problem(build(), levels=[0, 1, 2, 3]), "levels must be whole numbers"),
        (lambda: Problem(build(), levels=[0, 1, 2, 4, 4]), "nodes 2 and 3 have 2 and 4"),
        (
            lambda: Problem(build(), Joints([[0, 4]]), levels=[0, 1, 2, 3, 4]),
            "nodes 0 and 4 have 0 and 4",
        ),
        (lambda: Contact(WALL, 0.0, 1.0, 0.1), "contact.wire_radius is 0"),
        (lambda: Contact(WALL, 0.1, -1.0, 0.1), "contact.stiffness is -1"),
        (lambda: Contact(WALL, 0.1, 1.0, np.nan), "contact.threshold is nan"),
        (lambda: Contact(Cylinder(1.0), 0.1, 1.0, 0.1, -0.1), "contact.friction is -0.1"),
        (lambda: Contact(WALL, 0.1, 1.0, 0.1, points=0), "contact.points is 0"),
    ],
)
def test_bad_input_is_named(make, names):
    with pytest.raises(InputError, match=names):
        make()


def test_unknown_solver_is_named_before_anything_is_solved():
    with pytest.raises(InputError, match='"magic" is unknown'):
        follow_path(cantilever(), linear_solver="magic")
