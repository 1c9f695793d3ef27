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
from braidcast.mechanics.equilibrium import Equilibrium, Progress, newton, remembered
from braidcast.mechanics.relaxation import RelaxationOptions, relax
from braidcast.mechanics.rotations import Array
from braidcast.mechanics.system import Springs, System

WALL_STIFFNESS = 50.0
"""Line force per penetration of the stiff wall, in EI/l^4 with l the length of an element."""

YIELDING = 0.0025
"""Share of that stiffness while the braid moves."""

HARDENING = 5.0
"""Largest factor by which the wall is then made stiffer at once."""


@dataclass(frozen=True)
class ReleaseOptions:
    """Accuracy of the release.

    ``duration`` in natural times of the braid (drag against the bending of its rings); ``move``
    the largest step of a node, mm; ``tolerance`` the unbalanced force of a step in EI/R^2; the
    final equilibrium is ``balance`` times the sum of the contact forces.
    """

    duration: float = 12.0
    move: float = 0.25
    tolerance: float = 10.0
    balance: float = 1e-5


@dataclass(frozen=True)
class Release:
    """The equilibrium against the wall, and the way there."""

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
        tolerance=options.tolerance * force,
        iterations=6,
        largest_step=options.move,
        largest_turn=0.6,
    )
    motion = relax(
        _softened(system, YIELDING),
        positioned,
        RelaxationOptions(
            drag=drag,
            duration=options.duration * natural_time,
            first_step=0.006 * natural_time,
            largest_move=options.move,
            acceptable=2.0 * newton_options.tolerance,
            newton=newton_options,
        ),
        axial=axial,
        progress=progress,
    )
    if not motion.completed:
        last = replace(motion.last, converged=False, reason=motion.reason)
        return Release(last, motion.iterations, motion.path)
    stiffness = np.full(len(positioned.positions), drag / (0.6 * natural_time))
    hard, iterations = _harden(system, motion.last, stiffness, newton_options)
    iterations += motion.iterations
    if not hard.converged:
        return Release(hard, iterations, motion.path)
    total = sum(contact.total for contact in hard.evaluation.contacts)
    last = newton(
        system,
        hard.state,
        replace(newton_options, iterations=40, tolerance=options.balance * total),
        axial=hard.axial,
        memories=hard.memories,
    )
    return Release(last, iterations + last.iterations, motion.path)


def _harden(
    system: System, start: Equilibrium, drag: Array, options: NewtonOptions
) -> tuple[Equilibrium, int]:
    """Stiffen the wall step by step against a ``drag`` (N,) N/mm; shorter steps where one fails.

    Returns the equilibrium at full stiffness, or the last attempt, and all Newton iterations.
    """
    options = replace(options, iterations=15)
    last, share, factor, iterations = start, YIELDING, HARDENING, 0
    while True:
        target = min(1.0, share * factor)
        attempt = newton(
            _softened(system, target),
            last.state,
            options,
            axial=last.axial,
            springs=Springs(drag, last.state.positions),
            memories=last.memories,
        )
        iterations += attempt.iterations
        if attempt.converged:
            last, share = replace(attempt, memories=remembered(attempt)), target
            if share == 1.0:
                return last, iterations
        elif factor > 1.05:
            factor = np.sqrt(factor)
        else:
            reason = f"the wall could not be stiffened beyond {share:.3g}: {attempt.reason}"
            return replace(attempt, reason=reason), iterations


def _softened(system: System, share: float) -> System:
    contact = system.problem.contacts[0]
    return system.with_contacts((replace(contact, stiffness=share * contact.stiffness),))
