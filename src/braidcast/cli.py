"""The command line. Exit codes: 0 done, 1 results could not be written, 2 bad input,
3 not converged, 130 interrupted."""

from __future__ import annotations

import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from braidcast import __version__
from braidcast.errors import InputError

if TYPE_CHECKING:
    from braidcast.deployment.result import Deployment

NOT_WRITTEN, BAD_INPUT, NOT_CONVERGED, INTERRUPTED = 1, 2, 3, 130

app = typer.Typer(
    name="braidcast",
    help="Deployment of braided stents in vessels with an aneurysm.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # plain help appears in a tenth of a second, a decorated one in a half
)


def main() -> None:
    """Entry point of the ``braidcast`` command."""
    # A job that is ended cleans up after itself as one that is interrupted does.
    signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(128 + number))
    with _told():
        app()


def _version(asked: bool) -> None:
    if asked:
        typer.echo(f"braidcast {__version__}")
        raise typer.Exit()


@app.callback()
def _options(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_version, is_eager=True, help="Show the version."),
    ] = False,
) -> None:
    pass


@app.command(epilog="Example:  braidcast simulate examples/success.toml -o demo")
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

    Writes deployed.vtp (wires), vessel.stl, deployed.png and summary.json.

    Exit codes: 0 done; 1 the results could not be written; 2 bad input; 3 not converged (the
    last state is written); 130 interrupted.
    """
    with _told():
        from braidcast.case import Case
        from braidcast.deployment.output import check_folder, write_deployment

        given = Case.from_toml(case)
        folder = f"{case.stem}_deployed" if output is None else output
        check_folder(folder)

        from braidcast.deployment.simulate import simulate as deploy

        with _bars() as progress:
            deployment = deploy(given, progress=progress, keep_frames=frames)
        try:
            written = write_deployment(deployment, folder, frames=frames)
        except OSError as error:
            raise OSError(error.errno, error.strerror or str(error), folder) from None
        for note in written.notes:
            _say(note)
        typer.echo(_report(deployment, written.files))
        if not deployment.converged:
            _say(f"not converged: {deployment.reason}")
            raise typer.Exit(NOT_CONVERGED)


class _Bars:
    """One progress bar for each stage, made when the stage begins."""

    def __init__(self) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

        self.display = Progress(
            TextColumn("{task.description:<10}"),
            BarColumn(),
            TextColumn("{task.percentage:>3.0f} %"),
            TimeElapsedColumn(),
            console=Console(stderr=True),
        )
        self._bars: dict[str, TaskID] = {}

    def __call__(self, stage: str, fraction: float) -> None:
        if stage not in self._bars:
            self._bars[stage] = self.display.add_task(stage, total=1.0)
        self.display.update(self._bars[stage], completed=min(max(fraction, 0.0), 1.0))


@contextmanager
def _bars() -> Iterator[_Bars]:
    bars = _Bars()
    bars("crimp", 0.0)  # the first run of all compiles for some seconds before it says anything
    with bars.display:
        yield bars


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
    return "\n".join(f"{name:<22}{value}" for name, value in rows)


@contextmanager
def _told() -> Iterator[None]:
    """Turn what can go wrong outside our control into one sentence and an exit code."""
    try:
        yield
    except InputError as error:
        _say(str(error))
        sys.exit(BAD_INPUT)
    except KeyboardInterrupt:
        _say("interrupted")
        sys.exit(INTERRUPTED)
    except BrokenPipeError:
        raise
    except OSError as error:
        where = f" {error.filename}:" if error.filename else ""
        _say(f"the results could not be written:{where} {error.strerror or error}")
        sys.exit(NOT_WRITTEN)


def _say(sentence: str) -> None:
    typer.echo(f"braidcast: {sentence}", err=True)
