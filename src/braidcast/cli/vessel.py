"""braidcast vessel: what a surface is, and where along it a device would fit."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from braidcast.cli.messages import naming, say, told
from braidcast.cli.progress import bars
from braidcast.cli.table import table
from braidcast.errors import InputError

if TYPE_CHECKING:
    from braidcast.deployment.vessel_inspection import VesselInspection


def vessel(
    surface: Annotated[
        Path,
        typer.Argument(
            metavar="SURFACE", help="An STL, VTP, PLY or OBJ file; or a case file that names one."
        ),
    ],
    units: Annotated[
        str | None, typer.Option("--units", help="Of the surface: mm (default), cm, m or inch.")
    ] = None,
    centreline: Annotated[
        Path | None,
        typer.Option(
            "--centreline", metavar="FILE", help="VTP, VTK, JSON or CSV. Default: it is found."
        ),
    ] = None,
    ends: Annotated[
        tuple[float, float, float, float, float, float] | None,
        typer.Option(
            "--ends",
            metavar="X Y Z X Y Z",
            help="Two places, mm, between which the centreline runs, proximal first. "
            "Default: the two openings, if there are two; the wider one is proximal.",
        ),
    ] = None,
    output: Annotated[
        str | None,
        typer.Option(
            "--output",
            "-o",
            metavar="DIR",
            help="Folder for the results, made if missing in a folder that exists. "
            "Default: the surface's name and _vessel, in the current folder.",
        ),
    ] = None,
) -> None:
    """Inspect a vessel's surface: what was repaired, how wide and bent it is, where a device fits.

    Writes vessel.png (outline, lumen radius and curvature), vessel.json, centreline.vtp and
    repaired.stl. The device is the paper's, or that of the case file, which also says units,
    centreline and ends.

    Exit codes: 0 done; 1 the results could not be written; 2 bad input; 130 interrupted.
    """
    with told():
        from braidcast.results_folder import check_folder

        folder = f"{surface.stem}_vessel" if output is None else output
        check_folder(folder)
        with bars("surface", delay=1.0) as progress:
            from braidcast.deployment.vessel_inspection import VesselInspection
            from braidcast.deployment.vessel_output import write_inspection

            if surface.suffix.lower() == ".toml":
                from braidcast.case import Case

                options = {"--units": units, "--centreline": centreline, "--ends": ends}
                _require_none(surface, options)
                case = Case.from_toml(surface, progress)
                seen = VesselInspection(case.surface_geometry, case.braid, case.crimped_radius)
            else:
                from braidcast.case_tables import Device
                from braidcast.vessels.surface_vessel import SurfaceSource, load_vessel

                places = None if ends is None else (ends[:3], ends[3:])
                given = None if centreline is None else str(centreline)
                source = SurfaceSource(str(surface), units or "mm", given, places)
                braid = Device().braid
                seen = VesselInspection(
                    load_vessel(source, progress), braid, braid.usual_crimped_radius
                )
        with naming(folder):
            written = write_inspection(seen, folder)
        for note in written.notes:
            say(note)
        names = ", ".join(path.name for path in written.files)
        typer.echo(table([*_rows(seen), ("files", names), ("in", folder)]))


def _require_none(case: Path, options: Mapping[str, object]) -> None:
    given = [name for name, value in options.items() if value is not None]
    if given:
        raise InputError(
            f"{' and '.join(given)} cannot be given with a case file, must be in [vessel] of {case}"
        )


def _rows(seen: VesselInspection) -> list[tuple[str, str]]:
    from braidcast.vessels.wording import place

    vessel, surface, line = seen.vessel, seen.vessel.surface, seen.vessel.centreline
    size = " by ".join(
        f"{extent:.1f}" for extent in surface.vertices.max(0) - surface.vertices.min(0)
    )
    rows = [("surface", f"{len(surface.triangles)} triangles, {size} mm")]
    for opening in surface.openings:
        rows.append(("open end", f"at {place(opening.centre)}, radius {opening.radius:.2f} mm"))
    rows += [("noticed", remark) for remark in vessel.remarks]
    radius = seen.lumen_radius
    windows = "; ".join(f"{a:.1f} to {b:.1f} mm" for a, b in seen.windows)
    grid = vessel.grid
    rows += [
        ("centreline", f"{line.length:.2f} mm, {'found' if vessel.centreline_found else 'given'}"),
        (
            "lumen radius",
            f"{radius.min():.2f} to {radius.max():.2f} mm, {radius.mean():.2f} on average",
        ),
        ("tightest bend", f"{seen.tightest_bend:.1f} mm radius"),
        (
            "crimped stent",
            f"{seen.crimped_length:.1f} mm long; its proximal end may be put at "
            f"{windows} of the centreline"
            if windows
            else "fits nowhere",
        ),
        (
            "signed distance",
            f"every {grid.spacing:.3g} mm, {grid.bricks.size / 1e6:.1f} million points, "
            f"within {1e3 * seen.grid_error:.2g} µm of the surface's near the wall",
        ),
    ]
    return rows
