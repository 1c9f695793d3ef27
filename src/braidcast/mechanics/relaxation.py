"""Overdamped motion: how a structure let go of comes to rest.

Every node moves against a drag, ``c dx/dt = -dPi/dx``, integrated by implicit Euler steps: each is
an equilibrium with springs ``c/dt`` to where the nodes were. The steps grow as the motion slows.
With friction the end is a state that sticks; it does not depend on the drag once the duration is
long enough.
"""

from dataclasses import dataclass, replace

import numpy as np

from braidcast.mechanics.beams import State
from braidcast.mechanics.equilibrium import (
    Equilibrium,
    NewtonOptions,
    Progress,
    newton,
)
from braidcast.mechanics.rotations import Array
from braidcast.mechanics.system import Springs, System

DOUBLINGS = 3
"""So often a motion not yet at rest at the end of its duration goes on for as long again."""


@dataclass(frozen=True)
class RelaxationOptions:
    """``drag`` N s/mm a node; ``duration`` and ``first_step`` s.

    ``largest_move`` mm is how far the fastest node should go in a step, twice that while nothing
    touches a wall; ``growth`` how much longer
    a step may be than the last. A step whose equilibrium is not found is shortened. ``newton``
    says how exactly a step is solved, ``free`` how exactly while nothing touches a wall: what is
    unbalanced then is stretch of the wires, and the next step takes it out. ``held`` N is how much
    unbalanced force friction may hold at the end. Where at the last speed a node would go farther
    than ``rest`` mm in as long again, the motion goes on for as long again, three times at most.
    """

    drag: float
    duration: float
    first_step: float
    largest_move: float
    newton: NewtonOptions
    free: NewtonOptions
    held: float
    rest: float = np.inf
    growth: float = 2.0
    shortest_step: float = 1e-6


@dataclass(frozen=True)
class Relaxation:
    """The last equilibrium of the motion, ``steps`` taken and all ``iterations`` spent."""

    last: Equilibrium
    completed: bool
    reason: str
    steps: int
    iterations: int
    path: tuple[Array, ...]
    """Positions (N, 3) after every step."""


def relax(
    system: System,
    start: State,
    options: RelaxationOptions,
    *,
    axial: Array | None = None,
    progress: Progress | None = None,
) -> Relaxation:
    """Let go of a net at ``start`` and follow it for the duration, or until friction holds it.

    Friction holds where less than ``held`` is unbalanced and a step, meant to bring that down, only
    makes points stick and slip in turn.
    """
    last: Equilibrium | None = None
    touching = False
    memories = system.at_rest(start)
    drag = np.full(len(start.positions), options.drag)
    state, time, step = start, 0.0, options.first_step
    duration, longest = options.duration, 2.0**DOUBLINGS * options.duration
    steps = iterations = 0
    path: list[Array] = []
    while True:
        step = min(step, duration - time)
        springs = Springs(drag / step, state.positions)
        accuracy = options.newton if touching else options.free
        attempt = newton(system, state, accuracy, axial=axial, springs=springs, memories=memories)
        iterations += attempt.iterations
        if not touching and attempt.converged and _touches(attempt):
            touching = True
            attempt = newton(
                system,
                attempt.state,
                options.newton,
                axial=attempt.axial,
                springs=springs,
                memories=memories,
            )
            iterations += attempt.iterations
        far = options.largest_move if touching else 2.0 * options.largest_move
        move = float(np.linalg.norm(attempt.state.positions - state.positions, axis=1).max())
        if last is not None and not attempt.converged:
            if attempt.residuals[0] <= options.held:
                return Relaxation(last, True, "held by friction", steps, iterations, tuple(path))
        if not attempt.converged or move > 2.0 * far:
            if step <= options.shortest_step * options.duration:
                reason = f"the motion stopped after {time:.3g} of {options.duration:.3g} s"
                failed = replace(attempt, state=state)
                return Relaxation(
                    failed, False, f"{reason}: {attempt.reason}", steps, iterations, tuple(path)
                )
            step *= max(0.3, 0.9 * far / move) if attempt.converged else 1.0 / 3.0
            continue
        time, steps = time + step, steps + 1
        state, axial, memories = attempt.state, attempt.axial, attempt.memories
        last = attempt
        path.append(state.positions)
        if progress is not None:
            scale = options.first_step
            end = longest if np.isfinite(options.rest) else duration
            progress(float(np.log1p(time / scale) / np.log1p(end / scale)))
        if time >= duration * (1.0 - 1e-12):
            if duration == longest or move / step * duration <= options.rest:
                return Relaxation(last, True, "the time is over", steps, iterations, tuple(path))
            duration *= 2.0
        step *= min(options.growth, max(0.3, far / max(move, 1e-12)))


def _touches(equilibrium: Equilibrium) -> bool:
    return any(contact.total > 0.0 for contact in equilibrium.evaluation.contacts)
