"""Beams with large turns against closed forms and published values."""

from collections.abc import Callable
from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from braidcast.mechanics import (
    BeamNet,
    Equilibrium,
    NewtonOptions,
    Problem,
    Section,
    Supports,
    follow_path,
)
from braidcast.mechanics.band_cholesky import NotPositiveDefinite
from braidcast.mechanics.system import System
from problems.row import Row, relative


def chain(nodes: ArrayLike, section: Section, second_director: ArrayLike | None = None) -> BeamNet:
    """Nodes joined one after the other."""
    count = len(np.asarray(nodes))
    elements = np.column_stack([np.arange(count - 1), np.arange(1, count)])
    return BeamNet(nodes, elements, section, second_director)


def held(count: int, clamped: list[int], plane: bool = False) -> Supports:
    """Some nodes clamped; with ``plane`` all of them kept in the x-y plane."""
    fixed = np.zeros((count, 6), dtype=bool)
    if plane:
        fixed[:, 2:5] = True
    fixed[clamped] = True
    return Supports(fixed)


def tip_load(count: int, load: ArrayLike) -> np.ndarray:
    loads = np.zeros((count, 6))
    loads[-1] = load
    return loads


# roll-up ------------------------------------------------------------------------------------------

ROLL_UP = Section(EA=1e3, GJ=1.0, EIy=1.0, EIz=1.0)


def roll_up(elements: int) -> tuple[float, float]:
    """Cantilever of length 1 rolled into a circle by M = 2 pi EI/L: tip error/L and energy error.

    The supports keep it in its plane: a spin moment of fixed direction has no potential in space,
    so that the symmetric tangent would not be its derivative there.
    """
    nodes = np.zeros((elements + 1, 3))
    nodes[:, 0] = np.linspace(0.0, 1.0, elements + 1)
    problem = Problem(
        chain(nodes, ROLL_UP),
        supports=held(elements + 1, [0], plane=True),
        loads=tip_load(elements + 1, [0, 0, 0, 0, 0, 2 * np.pi]),
    )
    options = NewtonOptions(tolerance=1e-10, iterations=60)
    result = follow_path(problem, steps=10, options=options)
    assert result.converged, result.reason
    tip = float(np.linalg.norm(result.state.positions[-1]))
    return tip, relative(result.evaluation.strain_energy, 2 * np.pi**2)


def roll_ups() -> list[Row]:
    tips, energies = zip(*(roll_up(n) for n in (5, 10, 20, 40)), strict=True)
    name, source = "roll-up by end moment, 5 to 40 elements", "closed form"
    return [
        Row(f"{name}: tip", source, "0", f"{max(tips):.1e} L", max(tips), 1e-9),
        Row(f"{name}: energy", source, "2 π² EI/L", f"{max(energies):.1e}", max(energies), 1e-10),
    ]


# cantilever ---------------------------------------------------------------------------------------

ELASTICA = {
    1.0: (0.0564332, 0.3017208),
    5.0: (0.3876284, 0.7137915),
    10.0: (0.5549956, 0.8106090),
}
"""Tip displacements (u, v)/L at load lambda = P L^2/EI: inextensible elastica, elliptic integrals
(Mattiasson 1981)."""

THIN = Section(EA=1e8, GJ=1.0, EIy=1.0, EIz=1.0)


@cache
def cantilever(load: float, elements: int) -> tuple[float, float]:
    """Tip displacement (u, v)/L, towards the clamp and along the load."""
    nodes = np.zeros((elements + 1, 3))
    nodes[:, 0] = np.linspace(0.0, 1.0, elements + 1)
    problem = Problem(
        chain(nodes, THIN),
        supports=held(elements + 1, [0]),
        loads=tip_load(elements + 1, [0, load, 0, 0, 0, 0]),
    )
    result = follow_path(problem, steps=2)
    assert result.converged, result.reason
    tip = result.state.positions[-1]
    return 1.0 - float(tip[0]), float(tip[1])


def cantilevers() -> list[Row]:
    rows = []
    for load, exact in ELASTICA.items():
        errors = {
            n: float(np.abs(np.subtract(cantilever(load, n), exact)).max()) for n in (10, 20, 40)
        }
        u, v = cantilever(load, 20)
        reference = f"{exact[0]:.7f}, {exact[1]:.7f}"
        name, source = f"cantilever, λ = {load:g}", "Mattiasson 1981"
        ours = f"{u:.7f}, {v:.7f}"
        rows.append(Row(f"{name}: tip, 20 elements", source, reference, ours, errors[20], 1e-3))
        order = float(np.log2(errors[10] / errors[40]) / 2.0)
        rows.append(Row(f"{name}: order", "h²", "2", f"{order:.3f}", abs(order - 2.0), 0.1))
    return rows


# 45 degree bend -----------------------------------------------------------------------------------

BEND = Section(EA=1e7, GJ=5e6 / 6.0, EIy=1e7 / 12.0, EIz=1e7 / 12.0)
BEND_EIGHT = (47.1786, 15.7162, 53.5209)
BEND_EXACT = (47.1522, 15.6854, 53.4718)
"""Tip at P = 600 with eight straight elements, and exactly (Bathe & Bolourchi 1979's problem)."""


def bend_problem(elements: int) -> Problem:
    """Eighth of a circle of radius 100 in the x-y plane, loaded out of it by 600 at its tip."""
    angle = np.linspace(0.0, np.pi / 4, elements + 1)
    nodes = 100.0 * np.column_stack([np.sin(angle), 1.0 - np.cos(angle), np.zeros_like(angle)])
    # the frame follows the second director: published values take it in the plane of the arc
    in_plane = np.cross([0.0, 0.0, 1.0], np.diff(nodes, axis=0))
    return Problem(
        chain(nodes, BEND, in_plane),
        supports=held(elements + 1, [0]),
        loads=tip_load(elements + 1, [0, 0, 600, 0, 0, 0]),
    )


@cache
def bend(elements: int) -> Equilibrium:
    result = follow_path(bend_problem(elements), steps=6)
    assert result.converged, result.reason
    return result


def bends() -> list[Row]:
    tips = {n: bend(n).state.positions[-1] for n in (8, 16, 32)}
    richardson = tips[32] + (tips[32] - tips[16]) / 3.0
    order = float(np.log2(np.linalg.norm(tips[8] - tips[16]) / np.linalg.norm(tips[16] - tips[32])))
    back = follow_path(bend_problem(8), bend(8).state, steps=6, path=(1.0, 0.0))
    assert back.converged, back.reason
    left = float(np.abs(back.state.positions - bend_problem(8).net.nodes).max())
    name, source = "45° bend, P = 600", "Bathe & Bolourchi 1979"
    eight = float(np.abs(tips[8] - BEND_EIGHT).max())
    exact = float(np.abs(richardson - BEND_EXACT).max())
    return [
        Row(f"{name}: tip, 8 elements", source, text(BEND_EIGHT), text(tips[8]), eight, 1e-4),
        Row(f"{name}: order", "h²", "2", f"{order:.3f}", abs(order - 2.0), 0.1),
        Row(
            f"{name}: tip, Richardson of 16 and 32",
            "exact value",
            text(BEND_EXACT),
            text(richardson),
            exact,
            1e-4,
        ),
        Row(f"{name}: loaded and unloaded", "elasticity", "0", f"{left:.1e}", left, 1e-9),
    ]


def text(vector: ArrayLike) -> str:
    return ", ".join(f"{v:.4f}" for v in np.asarray(vector))


# lateral buckling ---------------------------------------------------------------------------------

FRAME_CRITICAL = 1.088
"""Argyris et al. 1979; Simo & Vu-Quoc 1986."""


def frame_problem(elements_per_leg: int) -> Problem:
    """Right angle of two legs of 240, 30 high in their plane and 0.6 thick, under a unit load."""
    modulus, poisson = 71240.0, 0.31
    shear = modulus / (2.0 * (1.0 + poisson))
    section = Section(
        EA=modulus * 30.0 * 0.6,
        GJ=shear * 2.16,
        EIy=modulus * 30.0 * 0.6**3 / 12.0,
        EIz=modulus * 0.6 * 30.0**3 / 12.0,
    )
    along = np.linspace(0.0, 240.0, elements_per_leg + 1)
    first = np.column_stack([along, 0 * along, 0 * along])
    second = np.column_stack([0 * along + 240.0, -along, 0 * along])[1:]
    nodes = np.concatenate([first, second])
    count = len(nodes)
    # bending out of the plane turns about the director that lies in it
    e1 = np.repeat([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0]], elements_per_leg, axis=0)
    in_plane = np.cross([0.0, 0.0, 1.0], e1)
    return Problem(
        chain(nodes, section, in_plane),
        supports=held(count, [0]),
        loads=tip_load(count, [1, 0, 0, 0, 0, 0]),
    )


def first_singular(problem: Problem, stable: float, unstable: float, tolerance: float) -> float:
    """Load factor at which the tangent of the unbuckled path stops being positive definite."""
    system = System(problem)

    def is_stable(factor: float) -> bool:
        result = follow_path(problem, steps=1, path=(0.0, factor))
        assert result.converged, result.reason
        try:
            system.linear_solver(system.evaluate(result.state, factor).data)
        except NotPositiveDefinite:
            return False
        return True

    assert is_stable(stable) and not is_stable(unstable)
    while unstable - stable > tolerance:
        middle = 0.5 * (stable + unstable)
        stable, unstable = (middle, unstable) if is_stable(middle) else (stable, middle)
    return 0.5 * (stable + unstable)


def frame_critical_load(elements_per_leg: int) -> float:
    return first_singular(frame_problem(elements_per_leg), 0.5, 1.5, 1e-4)


def lateral_buckling() -> list[Row]:
    found = frame_critical_load(16)
    return [
        Row(
            "lateral buckling of the right-angle frame, 2 × 16 elements: P_cr",
            "Argyris et al. 1979",
            f"{FRAME_CRITICAL}",
            f"{found:.4f}",
            relative(found, FRAME_CRITICAL),
            5e-3,
        )
    ]


PROBLEMS: tuple[Callable[[], list[Row]], ...] = (roll_ups, cantilevers, bends, lateral_buckling)
