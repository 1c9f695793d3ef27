"""The files of an inspected vessel."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from braidcast import __version__
from braidcast.deployment.vessel_inspection import VesselInspection
from braidcast.deployment.vtp import write_polylines
from braidcast.results_folder import Written, add, check_folder, workplace, write_summary
from braidcast.vessels.surface import write_stl


def write_inspection(seen: VesselInspection, folder: str | Path) -> Written:
    """Write vessel.json, centreline.vtp, repaired.stl and vessel.png into ``folder``.

    The picture needs ``braidcast[pictures]``; without it a note says so. ``InputError`` if
    ``folder`` cannot be used, ``OSError`` if the disk is full.
    """
    check_folder(folder)
    folder, notes = Path(folder), []
    surface = seen.vessel.surface
    with workplace(folder) as work:
        write_polylines(
            work / "centreline.vtp",
            seen.places,
            np.arange(len(seen.places))[None],
            {"lumen_radius_mm": seen.lumen_radius, "curvature_per_mm": seen.curvature},
        )
        write_stl(work / "repaired.stl", surface.vertices, surface.triangles)
        try:
            from braidcast.deployment.vessel_picture import vessel_picture
        except ModuleNotFoundError:
            notes.append("no vessel.png: pip install 'braidcast[pictures]'")
        else:
            (work / "vessel.png").write_bytes(vessel_picture(seen))
        write_summary(work / "vessel.json", inspection_summary(seen))
        return Written(add(work, folder), notes)


def inspection_summary(seen: VesselInspection) -> dict[str, Any]:
    """The keys and values of vessel.json; each number in the unit its key ends with."""
    vessel, surface = seen.vessel, seen.vessel.surface
    return {
        "surface": vessel.name,
        "triangles": len(surface.triangles),
        "size_mm": np.ptp(surface.vertices, axis=0).tolist(),
        "openings": [
            {"centre_mm": opening.centre.tolist(), "radius_mm": opening.radius}
            for opening in surface.openings
        ],
        "remarks": list(vessel.remarks),
        "centreline_found": vessel.centreline_found,
        "centreline_length_mm": vessel.centreline.length,
        "lumen_radius_min_mm": float(seen.lumen_radius.min()),
        "lumen_radius_mean_mm": float(seen.lumen_radius.mean()),
        "lumen_radius_max_mm": float(seen.lumen_radius.max()),
        "tightest_bend_mm": seen.tightest_bend,
        "crimped_length_mm": seen.crimped_length,
        "proximal_end_windows_mm": [list(window) for window in seen.windows],
        "distance_spacing_mm": vessel.grid.spacing,
        "distance_points": vessel.grid.bricks.size,
        "distance_error_mm": seen.grid_error,
        "version": __version__,
    }
