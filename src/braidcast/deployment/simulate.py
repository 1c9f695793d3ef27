"""One deployment from a case: crimp, position, release."""

import time
from collections.abc import Callable
from functools import lru_cache, partial
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from braidcast.case import Case
from braidcast.deployment.crimp import CrimpingFailed, crimped_state
from braidcast.deployment.net import braid_net, wire_section
from braidcast.deployment.outcome import outcome
from braidcast.deployment.position import RingPath, position
from braidcast.deployment.release import USUAL_SHIFT, ReleaseOptions, release, wall
from braidcast.deployment.result import Deployment
from braidcast.deployment.shape import braid_length, ring_centres, wire_distance
from braidcast.devices import Braid
from braidcast.errors import InputError, OutsideGrid
from braidcast.mechanics import Equilibrium, Joints, NewtonOptions, Problem, State
from braidcast.mechanics.rotations import Array
from braidcast.mechanics.system import System

STAGES = ("crimp", "position", "release")

StageProgress = Callable[[str, float], None]
"""Called with the stage and the share of it that is done."""


def simulate(
    case: Case,
    *,
    options: ReleaseOptions | None = None,
    progress: StageProgress | None = None,
    keep_frames: bool = False,
    linear_solver: str = "band_cholesky",
    cache: Path | None = None,
) -> Deployment:
    """Finite element deployment of a case (paper, section 2.1.3).

    A simulation that finds no equilibrium returns its last state with ``converged`` False and the
    reason; ``InputError`` if the stent leaves a vessel from a surface by one of its ends.
    ``keep_frames`` keeps the crimped, positioned and all intermediate released shapes;
    ``cache`` is the folder that keeps crimped devices, by default the user's.

    One BLAS thread is used: the blocks are small, and the answer is the same on any machine size.
    """
    with threadpool_limits(1, "blas"):
        return _simulate(
            case, options or ReleaseOptions(), progress, keep_frames, linear_solver, cache
        )


def _simulate(
    case: Case,
    options: ReleaseOptions,
    progress: StageProgress | None,
    keep_frames: bool,
    linear_solver: str,
    cache: Path | None,
) -> Deployment:
    wall_clock, cpu_clock = time.perf_counter(), time.process_time()
    braid = case.braid
    system = _analysed(braid, linear_solver).with_contacts(
        (wall(braid, case.vessel_geometry, case.wall.friction),)
    )
    frames = [("free", np.array(braid.positions))]
    try:
        system, last, iterations = _stages(
            case, system, options, progress or _no_progress, cache, frames
        )
    except OutsideGrid as error:
        raise InputError(f"the stent leaves the vessel, must stay in it: {error}") from None
    reached = dict(frames)
    under_way = next((stage for stage in STAGES if stage not in reached), STAGES[-1])
    frames.append((under_way, last.state.positions))
    return _deployment(
        case,
        system,
        last,
        iterations,
        frames if keep_frames else [],
        reached.get("crimp", last.state.positions),
        (time.perf_counter() - wall_clock, time.process_time() - cpu_clock),
    )


@lru_cache(maxsize=2)
def _analysed(braid: Braid, linear_solver: str) -> System:
    """The braid without walls; kept, for it is the same in all cases of a device."""
    problem = Problem(
        braid_net(braid), joints=Joints(np.array(braid.crossings)), levels=np.array(braid.rings)
    )
    return System(problem, linear_solver)


def _no_progress(stage: str, fraction: float) -> None:
    pass


def _stages(
    case: Case,
    system: System,
    options: ReleaseOptions,
    report: StageProgress,
    cache: Path | None,
    frames: list[tuple[str, Array]],
) -> tuple[System, Equilibrium, int]:
    """Crimp, position, release; adds to ``frames``.

    Returns the system of the last state, that state, and all Newton iterations.
    """
    braid = case.braid
    try:
        crimped = crimped_state(braid, case.crimped_radius, partial(report, "crimp"), cache)
    except CrimpingFailed as failure:
        return system, failure.equilibrium, failure.equilibrium.iterations
    report("crimp", 1.0)
    frames.append(("crimp", crimped.positions))
    path = RingPath.along(_target_centreline(case, crimped.positions))
    positioned, iterations = _position(system, crimped, path, braid, partial(report, "position"))
    if not positioned.converged:
        return system, positioned, iterations
    report("position", 1.0)
    frames.append(("position", positioned.state.positions))
    released = release(
        system,
        positioned.state,
        braid,
        options,
        axial=positioned.axial,
        progress=partial(report, "release"),
    )
    report("release", 1.0)
    frames += [("release", positions) for positions in released.path]
    return released.system, released.equilibrium, iterations + released.iterations


def _target_centreline(case: Case, crimped: Array) -> Array:
    """The paper's C_T: where the ring centres of the crimped braid go, (rings, 3) mm."""
    heights = ring_centres(case.braid, crimped)[:, 2]
    arc_lengths = case.start_arc_length + heights - heights[0]
    return case.centreline.at_arc_length(arc_lengths)


def _position(
    system: System,
    crimped: State,
    path: RingPath,
    braid: Braid,
    progress: Callable[[float], None],
) -> tuple[Equilibrium, int]:
    bending = wire_section(braid).EIy
    options = NewtonOptions(
        tolerance=3.0 * bending / braid.axis_radius**2, largest_step=0.3, first_shift=USUAL_SHIFT
    )
    stiffness = 0.1 * bending / braid.segment_length**3
    free = system.with_contacts(())
    return position(free, crimped, np.array(braid.rings), path, stiffness, options, progress)


def _deployment(
    case: Case,
    system: System,
    last: Equilibrium,
    iterations: int,
    frames: list[tuple[str, Array]],
    crimped: Array,
    seconds: tuple[float, float],
) -> Deployment:
    braid, state = case.braid, last.state
    # positioning knows no wall, and leaves none of its memories
    evaluation = system.evaluate(state, memories=last.memories or None, tangent=False)
    contacts = evaluation.contacts[0]
    total = contacts.total
    gaps = wire_distance(case, state.positions)
    labels = outcome(case, state.positions, gaps)
    return Deployment(
        case=case,
        positions=state.positions,
        rotations=state.rotations,
        elements=np.array(braid.elements),
        crossings=np.array(braid.crossings),
        wire_distance=gaps,
        contact_force=system.contact_force_at_nodes(contacts),
        outcome=labels.label,
        clinical_outcome=labels.clinical_label,
        converged=last.converged,
        reason=last.reason,
        newton_iterations=iterations,
        residual_N=last.residual,
        residual_relative=last.residual / total if total > 0.0 else float("nan"),
        strain_energy_mJ=evaluation.strain_energy,
        max_penetration_mm=contacts.penetration,
        positioned_centreline=_target_centreline(case, crimped),
        crimped_length_mm=braid_length(braid, crimped),
        deployed_length_mm=braid_length(braid, state.positions),
        free_length_mm=braid.length,
        end_nodes_in_sac=labels.end_nodes_in_sac,
        wall_seconds=seconds[0],
        cpu_seconds=seconds[1],
        frames=frames,
    )
