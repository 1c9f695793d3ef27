"""The files of a deployment."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from braidcast import __version__
from braidcast.deployment.picture import add_pictures, scene_of_gaps
from braidcast.deployment.result import Deployment
from braidcast.deployment.vtp import write_collection, write_polylines
from braidcast.results_folder import (
    Written,
    check_folder,
    number,
    publish,
    workplace,
    write_summary,
)
from braidcast.vessels.surface import vessel_surface, write_stl


def write_deployment(
    deployment: Deployment, folder: str | Path, *, frames: bool = False, picture: bool = True
) -> Written:
    """Write deployed.vtp, vessel.stl, summary.json and deployed.png into ``folder``.

    With ``frames`` also frames.pvd and frames/stage_0000.vtp …, one for each state the deployment
    kept. Results of an earlier run in the same folder are replaced, and removed where this run has
    none. The picture needs ``braidcast[pictures]``; without it a note says so. ``InputError`` if
    ``folder`` cannot be used, ``OSError`` if the disk is full.
    """
    check_folder(folder)
    folder = Path(folder)
    surface = vessel_surface(deployment.case.vessel_geometry)
    with workplace(folder) as work:
        write_polylines(
            work / "deployed.vtp", deployment.positions, deployment.wires, deployment.point_arrays
        )
        write_stl(work / "vessel.stl", *surface)
        if frames:
            _write_frames(work, deployment)
        write_summary(work / "summary.json", summary(deployment))
        files = publish(work, folder)
    if not picture:
        return Written(files, [])
    scenes = {"deployed.png": scene_of_gaps(deployment, (_caption(deployment),))}
    drawn = add_pictures(scenes, surface, folder)
    return Written(files + drawn.files, drawn.notes)


def summary(deployment: Deployment) -> dict[str, Any]:
    """The keys and values of summary.json; each number in the unit its key ends with."""
    return {
        "title": deployment.case.title,
        "outcome": deployment.outcome,
        "clinical_outcome": deployment.clinical_outcome,
        "converged": bool(deployment.converged),
        "reason": deployment.reason,
        "deployed_length_mm": number(deployment.deployed_length_mm),
        "free_length_mm": number(deployment.free_length_mm),
        "crimped_length_mm": number(deployment.crimped_length_mm),
        "foreshortening_percent": number(deployment.foreshortening_percent),
        "end_nodes_in_sac": int(deployment.end_nodes_in_sac),
        "max_penetration_mm": number(deployment.max_penetration_mm),
        "strain_energy_mJ": number(deployment.strain_energy_mJ),
        "residual_N": number(deployment.residual_N),
        "residual_relative": number(deployment.residual_relative),
        "newton_iterations": int(deployment.newton_iterations),
        "wall_seconds": number(deployment.wall_seconds),
        "cpu_seconds": number(deployment.cpu_seconds),
        "version": __version__,
    }


def _caption(deployment: Deployment) -> str:
    d = deployment
    outcome = f"outcome: {d.outcome}"
    if d.case.aneurysm is not None:
        outcome += f", {d.end_nodes_in_sac} of {len(d.case.braid.end_nodes)} end nodes in the sac"
    return outcome if d.converged else f"{outcome}; NOT CONVERGED"


def _write_frames(work: Path, deployment: Deployment) -> None:
    braid = deployment.case.braid
    (work / "frames").mkdir()
    listed = []
    for index, (stage, positions) in enumerate(deployment.frames):
        name = f"frames/stage_{index:04d}.vtp"
        arrays = {
            "displacement_mm": positions - braid.positions,
            "wire": braid.wire_of_node,
            "ring": braid.rings,
        }
        write_polylines(work / name, positions, deployment.wires, arrays)
        listed.append((stage, name))
    write_collection(work / "frames.pvd", listed)
