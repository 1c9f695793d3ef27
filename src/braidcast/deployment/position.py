"""Positioning: the crimped braid is bent along the centreline of the vessel.

Paper, section 2.1.3: the ring centres R_i of the crimped braid form the straight centreline C_0;
C_T is C_0 laid along the vessel from the deployment site. Each segment of C_T is turned onto the
one before it by an angle theta_i about an axis ax_i; turning back by a part of every theta_i gives
the intermediate centrelines C_t. Springs draw every node to its place in its ring, which moves with
R_i and turns with the segments.
"""

from dataclasses import dataclass, replace

import numpy as np

from braidcast.mechanics import Equilibrium, NewtonOptions, State
from braidcast.mechanics.arrays import IntArray
from braidcast.mechanics.equilibrium import Progress, newton
from braidcast.mechanics.rotations import Array, exp_so3
from braidcast.mechanics.system import Springs, System


@dataclass(frozen=True)
class RingPath:
    """Straight-to-bent motion of the ring centres.

    ``start`` (3,): R_0 in the vessel, mm; ``lengths`` (r,): lengths of the segments; ``turns``
    (r, 3): theta_i ax_i (rad) by which each segment is bent away from the one before it (the first
    from the z-axis), in axes that turn with the segments.
    """

    start: Array
    lengths: Array
    turns: Array

    @classmethod
    def along(cls, points: Array) -> "RingPath":
        """The path that ends with the ring centres at ``points`` (r + 1, 3), the centreline C_T."""
        segments = np.diff(points, axis=0)
        lengths = np.linalg.norm(segments, axis=1)
        turns = np.empty_like(segments)
        frame = np.eye(3)
        for i, segment in enumerate(segments):
            turns[i] = _turn_of_z(frame.T @ segment / lengths[i])
            frame = frame @ exp_so3(turns[i : i + 1])[0]
        return cls(points[0], lengths, turns)

    def rings(self, fraction: float) -> tuple[Array, Array]:
        """Centres (r + 1, 3) and turns (r + 1, 3, 3) of the rings on C_t, a fraction of the bend.

        Fraction 0 is the straight C_0, laid in the direction in which C_T sets out; 1 is C_T. A
        ring is turned by the mean of its two segments.
        """
        whole = np.concatenate([self.turns[:1], fraction * self.turns[1:]])
        steps = exp_so3(whole)
        halves = exp_so3(0.5 * whole)
        centres, turns = [self.start], [steps[0]]
        frame = steps[0]
        for i, length in enumerate(self.lengths):
            if i:
                turns.append(frame @ halves[i])
                frame = frame @ steps[i]
            centres.append(centres[-1] + length * frame[:, 2])
        turns.append(frame)
        return np.array(centres), np.array(turns)


def _turn_of_z(direction: Array) -> Array:
    """Rotation vector (3,) of the smallest turn of the z-axis into a unit direction (3,)."""
    sine = np.hypot(direction[0], direction[1])
    if sine < 1e-14:
        return np.array([0.0 if direction[2] > 0.0 else np.pi, 0.0, 0.0])
    angle = np.arctan2(sine, direction[2])
    return angle / sine * np.array([-direction[1], direction[0], 0.0])


def placed(crimped: State, rings: IntArray, path: RingPath, fraction: float) -> State:
    """Every ring of the straight ``crimped`` braid moved rigidly onto C_t."""
    heights = np.bincount(rings, weights=crimped.positions[:, 2]) / np.bincount(rings)
    centres, turns = path.rings(fraction)
    arms = crimped.positions - heights[rings][:, None] * [0.0, 0.0, 1.0]
    return State(
        centres[rings] + np.einsum("nij,nj->ni", turns[rings], arms),
        np.ascontiguousarray(turns[rings] @ crimped.rotations),
    )


def position(
    system: System,
    crimped: State,
    rings: IntArray,
    path: RingPath,
    stiffness: float,
    options: NewtonOptions,
    progress: Progress | None = None,
) -> tuple[Equilibrium, int]:
    """Bend the crimped braid along the path, in as many intermediate centrelines as it takes.

    Springs of ``stiffness`` (N/mm) draw every node to its place on C_t; wires slide within the
    braid to keep their length. Returns the equilibrium on C_T and all Newton iterations spent;
    it is unconverged, with its reason, if even small turns fail.
    """
    springs = np.full(len(crimped.positions), stiffness)
    fraction, part, iterations = 0.0, 1.0, 0
    state: State | None = None
    while True:
        target = min(1.0, fraction + part)
        aim = placed(crimped, rings, path, target)
        if state is None:
            start = aim
        else:
            start = _carried(state, placed(crimped, rings, path, fraction), aim)
        attempt = newton(
            system,
            start,
            options,
            axial=np.zeros(len(system.problem.net.elements)),
            springs=Springs(springs, aim.positions),
        )
        iterations += attempt.iterations
        if attempt.converged:
            fraction, state = target, attempt.state
            if progress is not None:
                progress(fraction)
            if fraction == 1.0:
                return attempt, iterations
            continue
        part *= 0.5
        if part < 1.0 / 64.0:
            reason = f"positioning stopped at {fraction:.3g} of the bend: {attempt.reason}"
            return replace(attempt, reason=reason), iterations


def _carried(state: State, old: State, new: State) -> State:
    """The state moved with its rings from one centreline to the next."""
    turn = new.rotations @ old.rotations.transpose(0, 2, 1)
    arms = state.positions - old.positions
    return State(
        new.positions + np.einsum("nij,nj->ni", turn, arms),
        np.ascontiguousarray(turn @ state.rotations),
    )
