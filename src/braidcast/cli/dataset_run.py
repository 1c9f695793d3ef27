"""braidcast dataset run and status."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from braidcast.cli.messages import NOT_WRITTEN, say, told
from braidcast.cli.run_display import run_display
from braidcast.cli.table import table

if TYPE_CHECKING:
    from braidcast.dataset.ledger import Ledger
    from braidcast.dataset.progress import RunReport

Dataset = Annotated[Path, typer.Argument(metavar="DIR", help="The folder of the dataset.")]

#: How many different reasons of failures are shown.
_REASONS = 5


def run(
    folder: Dataset,
    workers: Annotated[
        int | None,
        typer.Option("--workers", metavar="N", help="Processes to start. Default: one a core."),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            "--scheduler",
            metavar="ADDRESS",
            help="Use the Dask cluster of this scheduler instead, for example tcp://node:8786.",
        ),
    ] = None,
    retry_failed: Annotated[
        bool, typer.Option("--retry-failed", help="Do the cases again that failed before.")
    ] = False,
    cases: Annotated[
        int | None,
        typer.Option("--cases", metavar="N", min=1, help="Do the first N only. Default: all."),
    ] = None,
) -> None:
    """Simulate every case of a dataset that has no result yet.

    Each worker writes the file of its case, whole or not at all; whatever ends a run, the next
    one does the cases that are not finished. A case that fails is kept as such, with the reason.

    Exit codes: 0 done; 1 a result could not be written, or the workers are gone; 2 bad input;
    130 interrupted.
    """
    with told():
        from braidcast.dataset.folder import DatasetFolder

        opened = DatasetFolder.open(folder)

        from braidcast.dataset.cluster import RunStopped
        from braidcast.dataset.ledger import Ledger
        from braidcast.dataset.run import run as work

        try:
            with run_display() as display:
                report = work(
                    opened,
                    workers=workers,
                    scheduler=scheduler,
                    retry_failed=retry_failed,
                    cases=cases,
                    progress=display,
                    say=display.say,
                )
        except RunStopped as stopped:
            say(str(stopped))
            raise typer.Exit(NOT_WRITTEN) from None
        typer.echo(table([*state(Ledger.read(opened)), *_effort(report)]))


def status(folder: Dataset) -> None:
    """Show how many cases of a dataset are finished, failed or waiting.

    Exit codes: 0 done; 2 bad input.
    """
    with told():
        from braidcast.dataset.folder import DatasetFolder
        from braidcast.dataset.ledger import Ledger

        opened = DatasetFolder.open(folder)
        ledger = Ledger.read(opened)
        for sentence in ledger.damaged.values():
            say(f"{sentence}; the next run does it again")
        typer.echo(table(state(ledger)))


def state(ledger: Ledger) -> list[tuple[str, str]]:
    import numpy as np

    finished, failed = ledger.finished, ledger.failed
    rows = [
        ("cases", f"{ledger.cases}"),
        ("finished", f"{len(finished)}"),
        ("failed", f"{len(failed)}"),
        *(("", f"{count}: {reason}") for reason, count in ledger.reasons[:_REASONS]),
        ("waiting", f"{ledger.waiting}"),
    ]
    if finished:
        labelled = sum(record.outcome == "failure" for record in finished)
        seconds = [float(record.values["cpu_seconds"]) for record in finished]
        median, slow = np.percentile(seconds, [50, 95])
        rows += [
            ("labelled failure", f"{labelled}, {labelled / len(finished):.1%} of the finished"),
            ("CPU time of a case", f"median {median:.2f} s, 95 % below {slow:.2f} s"),
        ]
    return rows


def _effort(report: RunReport) -> list[tuple[str, str]]:
    if not report.done:
        return [("this run", "nothing to do")]
    return [
        ("this run", f"{len(report.done)} cases in {report.wall_seconds:.1f} s"),
        ("workers", f"{report.workers}"),
        ("overhead", f"{report.overhead:.3f}, wall time x workers / CPU time of the cases"),
    ]
