"""Static equilibrium: Newton's method, and the path of load and prescribed motion.

Wires are nearly inextensible, and a plain Newton step that turns an element stretches it to second
order, which the next step pays for. So the geometric stiffness of a step uses the axial force that
the *last* step predicted to first order, N = EA/L (u + du), not the one its stretch shows: Newton's
method on the two-field functional of (x, N) with N condensed (Magisano, Leonetti & Garcea 2017).
The solution is the same; the steps are some ten times longer.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from braidcast.mechanics.band_cholesky import NotPositiveDefinite
from braidcast.mechanics.beams import State
from braidcast.mechanics.corotational import axial_forces
from braidcast.mechanics.friction import FrictionMemory
from braidcast.mechanics.linear_solvers import Solve
from braidcast.mechanics.problem import Problem
from braidcast.mechanics.rotations import Array
from braidcast.mechanics.system import Evaluation, Springs, System, moved

SMALLEST_SHIFT = 1e-4
"""Least raise of an indefinite tangent's diagonal, in units of the bending stiffness."""

PATIENCE = 3
"""Iterations in which a residual may rise: the first step stretches the wires, the next mend it."""

Progress = Callable[[float], None]


@dataclass(frozen=True)
class NewtonOptions:
    """When an equilibrium is reached and how far a step may go.

    ``tolerance``: largest sum of unbalanced nodal forces (moments divided by the mean element
    length), N, or what rounding leaves where that is more, or ``relative`` times the sum before
    the first step; ``largest_step`` mm and
    ``largest_turn`` rad a node and iteration. More than ``rises`` times in a row, after the first
    ``PATIENCE`` iterations, the unbalanced force may not rise. ``first_shift`` is by how much the
    diagonal of an indefinite tangent is raised first, in units of the bending stiffness.
    """

    tolerance: float = 1e-8
    relative: float = 0.0
    iterations: int = 30
    largest_step: float = np.inf
    largest_turn: float = 1.0
    rises: int = 30
    first_shift: float = SMALLEST_SHIFT


@dataclass(frozen=True)
class Equilibrium:
    """How a solution ended: ``reason`` says why, in words; ``residual`` in N.

    ``residuals`` are those of all iterates, the first before any step. ``memories`` is what the
    walls remember: of this state when it converged, else of the one it started from.
    """

    state: State
    converged: bool
    reason: str
    load_factor: float
    iterations: int
    residual: float
    evaluation: Evaluation
    axial: Array
    memories: tuple[FrictionMemory, ...]
    residuals: tuple[float, ...]


def residual_norm(system: System, gradient: Array) -> float:
    """Sum of unbalanced forces over the nodes, N; moments count divided by the element length."""
    return float(np.abs(system.force_weight * gradient).sum())


def rounding_floor(system: System) -> float:
    """Unbalanced force, N, that rounding of the coordinates alone leaves in stiff parts.

    Each end of a beam or joint is known to eps times its coordinates, and pulls on two nodes.
    """
    net = system.problem.net
    stiffness = net.section.EA / net.lengths.mean() * len(net.elements)
    if len(system.penalty_pairs) and system.problem.joints is not None:
        stiffness += system.problem.joints.stiffness * len(system.penalty_pairs)
    return float(4.0 * np.finfo(float).eps * np.abs(net.nodes).max() * stiffness)


def factorise(
    system: System, evaluation: Evaluation, shift: float, first_shift: float = SMALLEST_SHIFT
) -> tuple[Solve, float]:
    """Factor of the tangent, its diagonal raised by as much as it takes to make it positive.

    ``shift`` is what the last tangent took, in units of the bending stiffness of an element; a
    part of it is tried first, then ``first_shift`` and more. Returns the solution operator and the
    shift used.
    """
    shift = shift / 32.0 if shift > 32.0 * SMALLEST_SHIFT else 0.0
    for _ in range(30):
        data = evaluation.data
        if shift > 0.0:
            data = data.copy()
            data[system.diagonal] += shift * system.diagonal_scale
        try:
            return system.linear_solver(data), shift
        except NotPositiveDefinite:
            shift = max(8.0 * shift, first_shift)
    raise NotPositiveDefinite


def newton(
    system: System,
    state: State,
    options: NewtonOptions,
    *,
    load_factor: float = 1.0,
    increment: Array | None = None,
    axial: Array | None = None,
    springs: Springs | None = None,
    memories: tuple[FrictionMemory, ...] | None = None,
) -> Equilibrium:
    """Equilibrium at fixed load; ``increment`` (N, 6) is the supports' motion, local axes."""
    if memories is None:
        memories = system.at_rest(state)
    net = system.problem.net
    tolerance = max(options.tolerance, rounding_floor(system))
    shift = 0.0
    reason = f"no equilibrium within {options.iterations} Newton iterations"
    converged = False
    iterations = 0
    residuals: list[float] = []
    while True:
        evaluation = system.evaluate(
            state,
            load_factor,
            axial=axial,
            increment=increment,
            springs=springs,
            memories=memories,
        )
        residual = residual_norm(system, evaluation.gradient)
        residuals.append(residual)
        tolerance = max(tolerance, options.relative * residuals[0])
        if not np.isfinite(residual):
            reason = "the forces are no longer finite"
            break
        if increment is None and residual <= tolerance:
            converged, reason = True, f"unbalanced force below {tolerance:.3g} N"
            break
        if iterations == options.iterations:
            break
        if _rises(residuals) > options.rises:
            reason = f"the unbalanced force kept rising, to {residual:.3g} N"
            break
        try:
            solve, shift = factorise(system, evaluation, shift, options.first_shift)
        except NotPositiveDefinite:
            reason = "the tangent stayed indefinite"
            break
        step = system.step(-solve(evaluation.gradient), increment)
        if increment is None:
            step *= _shortening(step, options)
        increment = None
        axial = axial_forces(
            state.positions, net.elements, net.lengths, net.section.EA, step[:, :3].copy()
        )
        state = moved(state, step)
        iterations += 1
    if converged:
        memories = tuple(contact.memory for contact in evaluation.contacts)
    return Equilibrium(
        state,
        converged,
        reason,
        load_factor,
        iterations,
        residual,
        evaluation,
        axial if axial is not None else np.full(len(net.elements), np.nan),
        memories,
        tuple(residuals),
    )


def _rises(residuals: list[float]) -> int:
    """How often in a row, up to now, the residual has risen since the first iterations."""
    settled = residuals[PATIENCE:]
    falls = [i for i in range(1, len(settled)) if settled[i] <= settled[i - 1]]
    return len(settled) - 1 - (falls[-1] if falls else 0) if settled else 0


def _shortening(step: Array, options: NewtonOptions) -> float:
    far = np.abs(step[:, :3]).max()
    turn = np.abs(step[:, 3:]).max()
    return min(
        1.0, options.largest_step / max(far, 1e-300), options.largest_turn / max(turn, 1e-300)
    )


def follow_path(
    problem: Problem,
    state: State | None = None,
    *,
    steps: int = 10,
    smallest_step: float = 1e-4,
    options: NewtonOptions | None = None,
    linear_solver: str = "band_cholesky",
    progress: Progress | None = None,
    path: tuple[float, float] = (0.0, 1.0),
    memories: tuple[FrictionMemory, ...] | None = None,
) -> Equilibrium:
    """Raise loads and prescribed motion from one load factor to another, in adaptive steps.

    A step that does not converge is halved, one that does quickly makes the next one longer; the
    path ends unconverged, with its reason and last state, when a step would be below
    ``smallest_step`` of it. ``memories``, from an earlier ``Equilibrium``, is the slip that walls
    hold at the start.
    """
    options = options or NewtonOptions()
    system = System(problem, linear_solver)
    state = problem.net.reference if state is None else state
    begin, end = path
    size = (end - begin) / steps
    reached = begin
    iterations = 0
    result = None
    memories = system.at_rest(state) if memories is None else memories
    axial = None
    while result is None or reached != end:
        target = end if abs(end - reached) <= abs(size) * (1 + 1e-9) else reached + size
        attempt = newton(
            system,
            state,
            options,
            load_factor=target,
            increment=(target - reached) * system.motion if system.motion.any() else None,
            axial=axial,
            memories=memories,
        )
        iterations += attempt.iterations
        if attempt.converged:
            state, reached, axial = attempt.state, target, attempt.axial
            memories = attempt.memories
            result = replace(attempt, iterations=iterations)
            if attempt.iterations <= 5:
                size *= 1.5
            if progress is not None:
                progress((reached - begin) / (end - begin))
            continue
        size *= 0.5
        if abs(size) < smallest_step * abs(end - begin):
            reason = f"stopped at load factor {reached:.4g}: {attempt.reason}"
            return replace(attempt, iterations=iterations, reason=reason)
    return result
