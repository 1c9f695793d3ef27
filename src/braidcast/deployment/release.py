"""Release: the positioned braid is let go and springs open against the wall.

The springs that held the rings are gone; the braid moves overdamped against a wall that gives way
a little, with Coulomb friction, until friction holds it. Then the wall is made stiff in steps, and
what is left is brought to static equilibrium. All scales come from the bending of a wire, so that
they fit any device.
"""

from dataclasses import dataclass, replace

import numpy as np

from braidcast.deployment.net import wire_section
from braidcast.devices import Braid
from braidcast.mechanics import Contact, NewtonOptions, SignedDistance, State
from braidcast.mechanics.equilibrium import Equilibrium, Progress, newton
from braidcast.mechanics.relaxation import RelaxationOptions, relax
from braidcast.mechanics.rotations import Array
from braidcast.mechanics.system import Springs, System

WALL_STIFFNESS = 50.0
"""Line force per penetration of the stiff wall, in EI/l^4 with l the length of an element."""

YIELDING = 0.0025
"""Share of that stiffness while the braid moves."""

HARDENING = 20.0
"""Largest factor by which the wall is then made stiffer at once."""

USUAL_SHIFT = 6.4e-3
"""Bent and crimped braids take at least this to make an indefinite tangent positive."""

BALANCING = 60
"""Largest number of equilibria on the way to the one without drag."""

MOST_DRAG, LEAST_DRAG = 32.0, 1.0 / 32.0
"""Drag on that way, in shares of that of the hardening."""


@dataclass(frozen=True)
class ReleaseOptions:
    """Accuracy of the release.

    ``duration`` in natural times of the braid (drag against the bending of its rings), the least;
    ``rest`` how far, mm, a node may still be about to go in as long again; ``move``
    the largest step of a node, mm; ``tolerance`` the unbalanced force of a step, in EI/R^2 a wire;
    ``balance`` that of the final equilibrium, as a share of the sum of the contact forces.
    """

    duration: float = 12.0
    rest: float = 0.005
    move: float = 0.3
    tolerance: float = 0.00625
    balance: float = 1e-5


@dataclass(frozen=True)
class Release:
    """The equilibrium against the wall (in ``system``), and the way there."""

    system: System
    equilibrium: Equilibrium
    iterations: int
    path: tuple[Array, ...]


def wall(braid: Braid, surface: SignedDistance, friction: float) -> Contact:
    """Contact of the braid's wires with a vessel's wall."""
    unit = wire_section(braid).EIy / braid.segment_length**4
    return Contact(
        surface,
        wire_radius=braid.wire_radius,
        stiffness=WALL_STIFFNESS * unit,
        threshold=braid.wire_radius / 4.0,
        friction=friction,
        stick_stiffness=4.0 * unit,
    )


def release(
    system: System,
    positioned: State,
    braid: Braid,
    options: ReleaseOptions,
    *,
    axial: Array | None = None,
    progress: Progress | None = None,
) -> Release:
    """Let go of a positioned braid; ``system`` has the wall as its only contact.

    Returns the last state, converged or not, with the reason.
    """
    force = wire_section(braid).EIy / braid.axis_radius**2
    drag = 1.0
    natural_time = drag * braid.axis_radius**2 / (force * braid.segment_length)
    newton_options = NewtonOptions(
        tolerance=options.tolerance * braid.wires * force,
        iterations=12,
        relative=0.3,
        rises=1,
        largest_step=2.0 * options.move,
        largest_turn=0.6,
        first_shift=USUAL_SHIFT,
    )
    free = replace(newton_options, tolerance=80.0 * newton_options.tolerance, relative=0.9)
    opening = RelaxationOptions(
        drag=drag,
        duration=options.duration * natural_time,
        first_step=0.024 * natural_time,
        largest_move=options.move,
        newton=newton_options,
        free=free,
        held=40.0 * newton_options.tolerance,
        rest=options.rest if system.problem.contacts[0].friction > 0.0 else np.inf,
    )
    motion = relax(_softened(system, YIELDING), positioned, opening, axial=axial, progress=progress)
    if not motion.completed:
        last = replace(motion.last, converged=False, reason=motion.reason)
        return Release(system, last, motion.iterations, motion.path)
    braked = np.full(len(positioned.positions), drag / (0.6 * natural_time))
    last, share, iterations = motion.last, YIELDING, motion.iterations
    while True:
        share, last, spent = _harden(system, last, share, braked, newton_options)
        stiff = _softened(system, share)
        iterations += spent
        if not last.converged:
            break
        total = sum(contact.total for contact in last.evaluation.contacts)
        final = replace(
            newton_options, iterations=8, relative=0.0, tolerance=options.balance * total
        )
        if system.problem.contacts[0].friction == 0.0:
            settling = replace(opening, first_step=natural_time, newton=final)
            last, spent = _settle(stiff, last, settling)
        else:
            last, spent = _balance(stiff, last, braked, final)
        iterations += spent
        if not last.converged or _out_of_the_wall(last, system):
            break
    return Release(stiff, last, iterations, motion.path)


def _harden(
    system: System, start: Equilibrium, share: float, drag: Array, options: NewtonOptions
) -> tuple[float, Equilibrium, int]:
    """Stiffen the wall step by step against a ``drag`` (N,) N/mm; shorter steps where one fails.

    Where the shortest fails too, all is tried again with ``MOST_DRAG`` times the drag.

    Beyond full stiffness it goes on until no wire is deeper in the wall than the threshold of its
    contact. From ``share`` of the full stiffness on; returns the share reached, the equilibrium
    or the last attempt, and all Newton iterations.
    """
    options = replace(options, iterations=15, relative=0.01)
    last, factor, much, iterations = start, HARDENING, 1.0, 0
    while True:
        target = share * factor if share >= 1.0 else min(1.0, share * factor)
        attempt = newton(
            _softened(system, target),
            last.state,
            options,
            axial=last.axial,
            springs=Springs(much * drag, last.state.positions),
            memories=last.memories,
        )
        iterations += attempt.iterations
        if attempt.converged:
            last, share = attempt, target
            if share >= 1.0 and _out_of_the_wall(last, system):
                return share, last, iterations
        elif factor > 1.05:
            factor = np.sqrt(factor)
        elif much < MOST_DRAG:
            factor, much = HARDENING, MOST_DRAG
        else:
            reason = f"the wall could not be stiffened beyond {share:.3g}: {attempt.reason}"
            return share, replace(attempt, reason=reason), iterations


def _out_of_the_wall(equilibrium: Equilibrium, system: System) -> bool:
    """Whether no wire lies deeper in the wall than the threshold of its contact."""
    depth = equilibrium.evaluation.contacts[0].penetration
    return depth <= system.problem.contacts[0].threshold


def _balance(
    system: System, start: Equilibrium, drag: Array, options: NewtonOptions
) -> tuple[Equilibrium, int]:
    """Equilibrium without drag.

    Where that is not found, because points stick and slip in turn or a loop of wire in the sac has
    a way to go, much drag is put back and taken off by and by.
    """
    last, share, iterations = start, 0.0, 0
    eased = replace(options, relative=0.1, iterations=12)
    for _ in range(BALANCING):
        attempt = newton(
            system,
            last.state,
            eased if share else options,
            axial=last.axial,
            springs=Springs(share * drag, last.state.positions) if share else None,
            memories=last.memories,
        )
        iterations += attempt.iterations
        if attempt.converged and share == 0.0:
            break
        if attempt.converged:
            last, share = attempt, share / 4.0 if share > LEAST_DRAG else 0.0
        else:
            share = 4.0 * share if share else (MOST_DRAG if last is start else 4.0 * LEAST_DRAG)
    return attempt, iterations


def _settle(
    system: System, start: Equilibrium, options: RelaxationOptions
) -> tuple[Equilibrium, int]:
    """Frictionless: the same time again against the stiff wall.

    Nothing holds such a braid along the vessel; the equilibrium it creeps to may be millimetres
    away, so the state at the end of a fixed time is the answer, its static residual reported.
    """
    motion = relax(system, start.state, options, axial=start.axial)
    if not motion.completed:
        return replace(motion.last, converged=False, reason=motion.reason), motion.iterations
    still = newton(
        system,
        motion.last.state,
        replace(options.newton, iterations=0),
        axial=motion.last.axial,
        memories=motion.last.memories,
    )
    reason = f"settled for {options.duration:.3g} s; without friction it may creep on"
    return replace(still, converged=True, reason=reason), motion.iterations


def _softened(system: System, share: float) -> System:
    contact = system.problem.contacts[0]
    return system.with_contacts((replace(contact, stiffness=share * contact.stiffness),))
