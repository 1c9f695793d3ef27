"""braidcast study: the paper's tables and figures, from the plan to the report."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from braidcast.cli.messages import NOT_WRITTEN, say, told
from braidcast.cli.run_display import run_display, stage_display
from braidcast.cli.table import table

if TYPE_CHECKING:
    from braidcast.dataset.folder import DatasetFolder
    from braidcast.study.stages import Done


def study(
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="DIR", help="Folder of the study.")
    ],
    samples: Annotated[
        int,
        typer.Option("--samples", metavar="N", help="Simulations: 150, 300, 600 or 900."),
    ] = 900,
    dataset: Annotated[
        Path | None,
        typer.Option(
            "--dataset",
            metavar="DATASET",
            help="Folder of the simulations, for example that of `make study`, or of your own with "
            "tests and subsets. Default: DIR/dataset, made if missing.",
        ),
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option("--workers", metavar="N", help="Processes to start. Default: one a core."),
    ] = None,
) -> None:
    """Repeat the paper's study: simulate, train, test, and write report.html.

    End it and start it again as you like: simulations and stages that are done are kept, and only
    what changed is done again. Every number of the report is in DIR/tables, every figure in
    DIR/figures; DIR/models has the trained models. 150 simulations take some ten minutes on two
    cores, 900 about an hour.

    Exit codes: 0 done; 1 a file could not be written, or a stage failed; 2 bad input;
    130 interrupted.
    """
    with told():
        from braidcast.errors import InputError
        from braidcast.results_folder import check_folder

        missing = [
            name
            for name in ("jinja2", "markdown_it", "matplotlib", "pyvista")
            if find_spec(name) is None
        ]
        if missing:
            raise InputError(
                f"{' and '.join(missing)} must be installed for the report: "
                "pip install 'braidcast[study]'"
            )
        check_folder(output)

        from braidcast.dataset.cluster import RunStopped
        from braidcast.study.stages import StageFailed

        opened = _opened(dataset or output / "dataset", samples, output)
        try:
            _simulate(opened, samples, workers)
            done = _stages(opened, output, samples, workers)
        except (RunStopped, StageFailed) as stopped:
            say(str(stopped))
            raise typer.Exit(NOT_WRITTEN) from None
        again = [stage for stage in done if stage.again]
        rows = [
            ("cases", f"{samples}, in {opened.path}"),
            ("stages", f"{len(done)}, of which {len(again)} done now"),
            ("time of these", f"{sum(stage.cpu_seconds for stage in again):.0f} s of CPU"),
            ("report", str(output / "report.html")),
        ]
        typer.echo(table(rows))


def _opened(folder: Path, samples: int, output: Path) -> DatasetFolder:
    """The dataset, drawn if it is the study's own and not there."""
    from braidcast.dataset.folder import DatasetFolder
    from braidcast.dataset.plan import Plan
    from braidcast.errors import InputError
    from braidcast.study import PLAN
    from braidcast.study.sizes import known_sizes

    own = folder == output / "dataset"
    plan = DatasetFolder.open(folder).plan if not own else Plan.from_toml(PLAN)
    known = known_sizes(plan)
    if samples not in known:
        raise InputError(f"samples = {samples} must be one of: {', '.join(map(str, known))}")
    if plan.tests < 2:
        raise InputError(f"dataset folder = {folder} has tests = {plan.tests}, must have 2 or more")
    if own:
        output.mkdir(exist_ok=True)
        return DatasetFolder.create(plan, folder)
    return DatasetFolder.open(folder)


def _simulate(folder: DatasetFolder, samples: int, workers: int | None) -> None:
    """The cases without a result; nothing is started if there are none."""
    from braidcast.dataset.ledger import Ledger
    from braidcast.dataset.run import run

    ledger = Ledger.read(folder).first(samples)
    if ledger.waiting:
        with run_display() as display:
            run(folder, cases=samples, workers=workers, progress=display, say=display.say)
        ledger = Ledger.read(folder).first(samples)
    if ledger.failed:
        say(f"{len(ledger.failed)} of {samples} cases failed and are left out")


def _stages(folder: DatasetFolder, output: Path, samples: int, workers: int | None) -> list[Done]:
    from braidcast.dataset.cluster import connected
    from braidcast.study.pipeline import open_study, pipeline
    from braidcast.study.stages import run_stages

    output.mkdir(exist_ok=True)
    opened = open_study(output, folder.path)
    stages = pipeline(opened, samples)
    with stage_display(len(stages)) as show, connected(workers, None) as (client, _):
        return run_stages(opened, stages, client, show)
