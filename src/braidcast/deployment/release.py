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

WALL_STIFFNESS = 12.0
"""Line force per penetration of the stiff wall, in EI/l^4 with l the length of an element."""

YIELDING = (0.01, 0.06, 0.3)
"""Share of that stiffness while the braid moves, and on the way to the stiff wall."""


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


def wall(braid: Braid, surface: SignedDistance, friction: float, share: float = 1.0) -> Contact:
    """Contact of the braid's wires with a wall of a share of the full stiffness."""
    unit = wire_section(braid).EIy / braid.segment_length**4
    return Contact(
        surface,
        wire_radius=braid.wire_radius,
        stiffness=share * WALL_STIFFNESS * unit,
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
    keep_path: bool = False,
    progress: Progress | None = None,
) -> Release:
    """Let go of a positioned braid; ``system`` has the wall as its only contact.

    Returns the last state, converged or not, with the reason.
    """
    stiff = system.problem.contacts[0]
    force = wire_section(braid).EIy / braid.axis_radius**2
    drag = 1.0
    natural_time = drag * braid.axis_radius**2 / (force * braid.segment_length)
    newton_options = NewtonOptions(
        tolerance=options.tolerance * force,
        iterations=6,
        largest_step=options.move,
        largest_turn=0.6,
    )
    yielding = system.with_contacts((_softened(stiff, YIELDING[0]),))
    motion = relax(
        yielding,
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
        keep_path=keep_path,
        progress=progress,
    )
    last, iterations = motion.last, motion.iterations
    if not motion.completed:
        return Release(
            replace(last, converged=False, reason=motion.reason), iterations, motion.path
        )
    drags = Springs(
        stiffness=np.full(len(positioned.positions), drag / (0.6 * natural_time)),
        targets=last.state.positions,
    )
    for share in (*YIELDING[1:], 1.0):
        hardened = system.with_contacts((_softened(stiff, share),))
        last = newton(
            hardened,
            last.state,
            replace(newton_options, iterations=40),
            axial=last.axial,
            springs=drags,
            memories=last.memories,
        )
        iterations += last.iterations
        last = replace(last, memories=remembered(last))
        drags = replace(drags, targets=last.state.positions)
    total = sum(contact.total for contact in last.evaluation.contacts)
    last = newton(
        system,
        last.state,
        replace(newton_options, iterations=40, tolerance=options.balance * total),
        axial=last.axial,
        memories=last.memories,
    )
    return Release(last, iterations + last.iterations, motion.path)


def _softened(contact: Contact, share: float) -> Contact:
    return replace(contact, stiffness=share * contact.stiffness)
