"""Identities that hold for any element in any configuration."""

from collections.abc import Callable

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from braidcast.mechanics import BeamNet, Problem, Section, State
from braidcast.mechanics.friction import FrictionMemory
from braidcast.mechanics.rotations import Array, exp_so3, log_tangent_coefficients
from braidcast.mechanics.system import Evaluation, System, moved
from problems.row import Row

SECTION = Section(EA=300.0, GJ=0.7, EIy=1.0, EIz=2.5)
"""Directions of bending told apart, stretch stiffer than bending."""

Memories = tuple[FrictionMemory, ...] | None


def bent_chain(seed: int = 0, turn: float = 0.6) -> tuple[BeamNet, State]:
    """Three beams in a zigzag, every freedom of them disturbed."""
    rng = np.random.default_rng(seed)
    nodes = np.cumsum(rng.normal(size=(4, 3)) + [1.5, 0.0, 0.0], axis=0)
    net = BeamNet(nodes, [[0, 1], [1, 2], [2, 3]], SECTION)
    rotations = exp_so3(rng.uniform(-turn, turn, (4, 3)))
    return net, State(nodes + rng.uniform(-0.2, 0.2, (4, 3)), rotations)


def left_jacobian(spin: Array) -> Array:
    """J of exp(w + dw) = exp(J dw) exp(w) to first order."""
    x, y, z = spin
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    c, _ = log_tangent_coefficients(float(spin @ spin))
    return np.linalg.inv(np.eye(3) - 0.5 * cross + c * cross @ cross)


def gradient_at(system: System, state: State, step: Array, memories: Memories = None) -> Array:
    """Derivative (6 N,) of the energy by the components of ``step`` (N, 6), at that step."""
    evaluation = system.evaluate(moved(state, step), tangent=False, memories=memories)
    nodal = evaluation.nodal.copy()
    for n, spin in enumerate(step[:, 3:]):
        nodal[n, 3:] = left_jacobian(spin).T @ nodal[n, 3:]
    return nodal.ravel()


def energy_of(evaluation: Evaluation) -> float:
    return evaluation.strain_energy + sum(c.energy for c in evaluation.contacts)


def dense_tangent(system: System, evaluation: Evaluation) -> Array:
    shape = (system.size, system.size)
    return sp.csr_matrix((evaluation.data, system.indices, system.indptr), shape=shape).toarray()


def difference(function: Callable[[Array], ArrayLike], size: int, h: float) -> Array:
    """Derivatives by the fourth-order central difference, one per component of ``size``."""

    def change(e: Array) -> Array:
        return np.subtract(function(e), function(-e))

    return np.array([(8 * change(e) - change(2 * e)) / (12 * h) for e in h * np.eye(size)])


def force_error(problem: Problem, state: State, h: float = 1e-3) -> float:
    """Force against differences of the energy, relative."""
    system = System(problem)
    count = len(problem.net.nodes)

    def energy(step: Array) -> float:
        there = moved(state, step.reshape(count, 6))
        return energy_of(system.evaluate(there, tangent=False))

    exact = system.evaluate(state).nodal.ravel()
    return float(np.abs(difference(energy, 6 * count, h) - exact).max() / np.abs(exact).max())


def tangent_error(
    problem: Problem, state: State, h: float = 1e-3, memories: Memories = None
) -> float:
    """Tangent against differences of the force, relative; all freedoms free, no joints."""
    system = System(problem)
    count = len(problem.net.nodes)

    def gradient(step: Array) -> Array:
        return gradient_at(system, state, step.reshape(count, 6), memories)

    dense = dense_tangent(system, system.evaluate(state, memories=memories))
    numbers = system.dofs.ravel()
    error = difference(gradient, 6 * count, h) - dense[np.ix_(numbers, numbers)]
    return float(np.abs(error).max() / np.abs(dense).max())


def objectivity_error(net: BeamNet, state: State) -> float:
    """Change of energy and turned forces under a rigid motion, relative."""
    system = System(Problem(net))
    q = exp_so3(np.array([[0.9, -1.7, 2.1]]))[0]
    there = State(
        state.positions @ q.T + [3.0, -2.0, 5.0], np.ascontiguousarray(q @ state.rotations)
    )
    here, turned = system.evaluate(state), system.evaluate(there)
    forces = here.nodal.reshape(-1, 2, 3) @ q.T - turned.nodal.reshape(-1, 2, 3)
    return max(
        abs(turned.strain_energy / here.strain_energy - 1.0),
        float(np.abs(forces).max() / np.abs(here.nodal).max()),
    )


def equilibrium_error(net: BeamNet, state: State) -> float:
    """Resultant force and moment of every element's forces, relative to the largest of them."""
    system = System(Problem(net))
    system.evaluate(state)
    forces = system.forces.reshape(-1, 2, 2, 3)
    arms = state.positions[net.elements]
    force = forces[:, :, 0].sum(axis=1)
    moment = (forces[:, :, 1] + np.cross(arms, forces[:, :, 0])).sum(axis=1)
    largest = np.abs(forces[:, :, 0]).max()
    reach = np.ptp(state.positions, axis=0).max()
    return float(max(np.abs(force).max(), np.abs(moment).max() / reach) / largest)


def identities() -> list[Row]:
    """The worst of random configurations: five for differences, twenty for the others."""
    chains = [bent_chain(seed) for seed in range(20)]
    some = [(Problem(net), state) for net, state in chains[:5]]
    rows = [
        ("element: force = dU/dx", max(force_error(*p) for p in some), 1e-7),
        ("element: tangent against differences", max(tangent_error(*p) for p in some), 1e-6),
        ("element: objectivity", max(objectivity_error(*c) for c in chains), 1e-10),
        ("element: self-equilibrium", max(equilibrium_error(*c) for c in chains), 1e-12),
    ]
    return [Row(name, "identity", "0", f"{error:.1e}", error, bar) for name, error, bar in rows]


PROBLEMS = (identities,)
