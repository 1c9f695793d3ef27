"""Overdamped motion: when it is over."""

from dataclasses import replace

import numpy as np

from braidcast.mechanics import NewtonOptions, Problem, Section
from braidcast.mechanics.equilibrium import newton
from braidcast.mechanics.relaxation import DOUBLINGS, RelaxationOptions, relax
from braidcast.mechanics.system import System
from problems.statics import chain, held, tip_load

COUNT = 9
NODES = np.column_stack([np.arange(float(COUNT)), np.zeros(COUNT), np.zeros(COUNT)])
PROBLEM = Problem(
    chain(NODES, Section(EA=1e4, GJ=1.0, EIy=1.0, EIz=1.0)),
    supports=held(COUNT, [0]),
    loads=tip_load(COUNT, [0, 1e-4, 0, 0, 0, 0]),
)
SYSTEM = System(PROBLEM)
EXACT = NewtonOptions(tolerance=1e-10)
STATIC = newton(SYSTEM, PROBLEM.net.reference, EXACT).state.positions[-1, 1]
# Of the slowest motion, c L^4/(l EI 1.875^4) with l the length of an element; the tip, where it is
# twice its root mean square, has the drag of a whole node and not of half a one.
TIME = (COUNT - 1) ** 4 / 1.875**4 * (1.0 + 0.5 * 2.0**2 / (COUNT - 1))
OPTIONS = RelaxationOptions(
    drag=1.0,
    duration=TIME,
    first_step=TIME / 8.0,
    largest_move=1.0,
    newton=EXACT,
    free=EXACT,
    held=0.0,
    growth=1.0,
)


def left(options: RelaxationOptions) -> tuple[float, int]:
    """What the tip still has to go, as a share of it all, and the steps it took."""
    motion = relax(SYSTEM, PROBLEM.net.reference, options)
    assert motion.completed
    return 1.0 - motion.last.state.positions[-1, 1] / STATIC, motion.steps


def test_a_fixed_time_leaves_what_the_slowest_motion_leaves() -> None:
    share, steps = left(OPTIONS)
    # Implicit Euler of eight steps leaves (1 + 1/8)^-8 of the first mode, 97 % of it all.
    assert steps == 8
    assert abs(share - 0.97 * 1.125**-8) < 0.02


def test_it_goes_on_until_it_is_at_rest() -> None:
    share, steps = left(replace(OPTIONS, rest=0.15 * STATIC))
    assert steps == 32
    assert abs(share - 0.97 * 1.125**-32) < 0.01
    assert left(replace(OPTIONS, rest=0.6 * STATIC))[1] == 8


def test_but_not_for_ever() -> None:
    assert left(replace(OPTIONS, rest=0.0))[1] == 8 * 2**DOUBLINGS
