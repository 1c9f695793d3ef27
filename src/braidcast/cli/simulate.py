"""braidcast simulate: one case by finite elements."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from braidcast.cli.messages import NOT_CONVERGED, naming, say, told
from braidcast.cli.progress import bars
from braidcast.cli.table import table

if TYPE_CHECKING:
    from braidcast.deployment.result import Deployment


def simulate(
    case: Annotated[Path, typer.Argument(metavar="CASE.toml", help="The case file.")],
    output: Annotated[
        str | None,
        typer.Option(
            "--output",
            "-o",
            metavar="DIR",
            help="Folder for the results, made if missing in a folder that exists. "
            "Default: the case file's name without .toml, and _deployed, in the current folder.",
        ),
    ] = None,
    frames: Annotated[
        bool,
        typer.Option("--frames", help="Keep intermediate states too: frames.pvd and frames/."),
    ] = False,
) -> None:
    """Deploy the device of a case by finite elements.

    The vessel is one of the paper's, or the surface that the case names.

    Writes deployed.vtp (wires), vessel.stl, deployed.png and summary.json.

    Exit codes: 0 done; 1 the results could not be written; 2 bad input; 3 not converged (the
    last state is written); 130 interrupted.
    """
    with told():
        from braidcast.case import Case
        from braidcast.deployment.output import write_deployment
        from braidcast.results_folder import check_folder

        with bars("surface", delay=1.0) as progress:
            given = Case.from_toml(case, progress)
        for remark in given.remarks:
            say(remark)
        folder = f"{case.stem}_deployed" if output is None else output
        check_folder(folder)

        from braidcast.deployment.simulate import simulate as deploy

        # The first run of all compiles for some seconds before it says anything.
        with bars("crimp") as progress:
            deployment = deploy(given, progress=progress, keep_frames=frames)
        with naming(folder):
            written = write_deployment(deployment, folder, frames=frames)
        for note in written.notes:
            say(note)
        typer.echo(_report(deployment, written.files))
        if not deployment.converged:
            say(f"not converged: {deployment.reason}")
            raise typer.Exit(NOT_CONVERGED)


def _report(deployment: Deployment, files: list[Path]) -> str:
    d = deployment
    rows = [
        ("outcome", d.outcome if d.converged else f"{d.outcome}, so far: not at rest"),
        ("clinical outcome", d.clinical_outcome),
        ("end nodes in the sac", f"{d.end_nodes_in_sac}"),
        ("deployed length", f"{d.deployed_length_mm:.3f} mm"),
        ("crimped length", f"{d.crimped_length_mm:.3f} mm"),
        ("free length", f"{d.free_length_mm:.3f} mm"),
        ("foreshortening", f"{d.foreshortening_percent:.1f} % of the crimped length"),
        ("strain energy", f"{d.strain_energy_mJ:.4g} mJ"),
        ("largest penetration", f"{1000.0 * d.max_penetration_mm:.3g} µm"),
        ("residual", f"{d.residual_N:.3g} N, {d.residual_relative:.2g} of the contact forces"),
        ("equilibrium", "reached" if d.converged else f"NOT reached: {d.reason}"),
        ("Newton iterations", f"{d.newton_iterations}"),
        ("time", f"{d.wall_seconds:.1f} s, {d.cpu_seconds:.1f} s of CPU"),
        ("files", ", ".join(path.name for path in files if path.parent == files[-1].parent)),
        ("in", f"{files[-1].parent}"),
    ]
    return table(rows)
