"""Joined wires: penalty against shared freedom, and each linear solver against the others."""

from collections.abc import Callable
from importlib.util import find_spec
from typing import Literal

import numpy as np

from braidcast.devices import Braid
from braidcast.mechanics import (
    BeamNet,
    Equilibrium,
    Joints,
    NewtonOptions,
    Problem,
    Section,
    Supports,
    follow_path,
)
from problems.row import Row

WIRE = Section.circular(0.014, 225000.0, 0.33)

SOLVERS = ["band_cholesky", "superlu"] + (["pardiso"] if find_spec("pypardiso") else [])
"""The linear solvers installed here."""


def lattice(
    method: Literal["shared", "penalty"] = "shared",
    *,
    stiffness: float = 1e3,
    wires: int = 4,
    segments: int = 12,
) -> Problem:
    """Two layers of crossing wires 1 mm apart, joined at crossings, warped between two sides.

    One side is clamped; of the other, each end rises by up to 0.4 mm, every second one only by
    half as much, and turns by 0.3 rad; it is free to slide in the plane, so that wires bend more
    than they stretch.
    """
    spots = np.linspace(0.0, wires - 1.0, segments + 1)
    at = np.arange(wires) * (segments // (wires - 1))
    lengthwise = [[[x, y, 0.0] for x in spots] for y in range(wires)]
    crosswise = [[[x, y, 0.0] for y in spots] for x in range(wires)]
    nodes = np.array(lengthwise + crosswise, dtype=float).reshape(-1, 3)
    number = np.arange(len(nodes)).reshape(2 * wires, segments + 1)
    elements = np.stack([number[:, :-1], number[:, 1:]], axis=2).reshape(-1, 2)
    pairs = [
        (number[i, at[j]], number[wires + j, at[i]]) for i in range(wires) for j in range(wires)
    ]
    fixed = np.zeros((len(nodes), 6), dtype=bool)
    motion = np.zeros((len(nodes), 6))
    clamped, lifted = number[:wires, 0], number[:wires, -1]
    fixed[clamped] = True
    fixed[lifted, 2:] = True
    motion[lifted, 2] = 0.4 / (1.0 + np.arange(wires) % 2)
    motion[lifted, 4] = -0.3
    # a node that hangs on a held one by a joint is held with it
    crosswise_first, crosswise_last = number[wires], number[-1]
    for held, beside in ((clamped, crosswise_first), (lifted, crosswise_last)):
        fixed[beside[at], :3] = fixed[held, :3]
        motion[beside[at], :3] = motion[held, :3]
    return Problem(
        BeamNet(nodes, elements, WIRE),
        joints=Joints(np.array(pairs), method, stiffness),
        supports=Supports(fixed, motion),
    )


def bent_braid(method: Literal["shared", "penalty"], wires: int = 12) -> Problem:
    """A braid with one end clamped and the other moved sideways: no symmetry spares a joint."""
    braid = Braid(wires=wires, segments=36, length=8.0)
    rings = np.array(braid.rings)
    fixed = np.zeros((len(rings), 6), dtype=bool)
    motion = np.zeros((len(rings), 6))
    fixed[rings == 0] = True
    last = rings == rings.max()
    fixed[last, :2] = True
    motion[last, 1] = 0.5
    return Problem(
        BeamNet(np.array(braid.positions), np.array(braid.elements), WIRE),
        joints=Joints(np.array(braid.crossings), method, 1e3),
        supports=Supports(fixed, motion),
        levels=rings,
    )


def solved(problem: Problem, linear_solver: str = "band_cholesky") -> Equilibrium:
    options = NewtonOptions(tolerance=1e-9)
    result = follow_path(problem, steps=4, options=options, linear_solver=linear_solver)
    assert result.converged, result.reason
    return result


def distance(first: Equilibrium, second: Equilibrium) -> float:
    """Largest distance between the same node in two states, mm."""
    return float(np.linalg.norm(first.state.positions - second.state.positions, axis=1).max())


def joints() -> list[Row]:
    rows = []
    pairs = {
        "lattice": (lattice("penalty"), lattice("shared")),
        "bent braid of 12 wires": (bent_braid("penalty"), bent_braid("shared")),
    }
    for name, (penalty, shared) in pairs.items():
        error = distance(solved(penalty), solved(shared))
        name = f"{name}: joints by penalty against shared, mm"
        rows.append(Row(name, "each other", "0", f"{error:.1e}", error, 1e-5))
    return rows


def linear_solvers() -> list[Row]:
    states = {key: solved(lattice(), key) for key in SOLVERS}
    rows = []
    for key in SOLVERS[1:]:
        error = distance(states[key], states[SOLVERS[0]])
        name = f"lattice: {key} against {SOLVERS[0]}, mm"
        rows.append(Row(name, "each other", "0", f"{error:.1e}", error, 1e-8))
    return rows


PROBLEMS: tuple[Callable[[], list[Row]], ...] = (joints, linear_solvers)
