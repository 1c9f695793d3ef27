"""braidcast dataset: many cases, planned, run and kept."""

from __future__ import annotations

from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Annotated

import typer

from braidcast.cli.dataset_files import collect, export, merge
from braidcast.cli.dataset_run import run, status
from braidcast.cli.messages import told
from braidcast.cli.progress import bars

if TYPE_CHECKING:
    from braidcast.dataset.folder import DatasetFolder

app = typer.Typer(
    help="Many cases: plan them, run them anywhere, keep them.",
    no_args_is_help=True,
    rich_markup_mode=None,
)


@app.command(epilog="Example:  braidcast dataset create examples/plan.toml -o sixty")
def create(
    plan: Annotated[Path, typer.Argument(metavar="PLAN.toml", help="The plan file.")],
    output: Annotated[
        str | None,
        typer.Option(
            "--output",
            "-o",
            metavar="DIR",
            help="Folder for the dataset, made if missing in a folder that exists. "
            "Default: the plan file's name without .toml, in the current folder.",
        ),
    ] = None,
) -> None:
    """Draw the cases of a plan.

    A plan is a case file under [case] in which numbers may be ranges { min = .., max = .. },
    with cases, seed, subsets and tests above it. Every case is checked to be feasible.

    Writes plan.toml, cases.csv and dataset.json. A folder that holds this plan already is kept.

    Exit codes: 0 done; 1 the folder could not be written; 2 bad input; 130 interrupted.
    """
    with told():
        from braidcast.dataset.folder import DatasetFolder
        from braidcast.dataset.plan import Plan

        given = Plan.from_toml(plan)
        with bars("draw", delay=2.0) as progress:
            folder = DatasetFolder.create(given, plan.stem if output is None else output, progress)
        typer.echo(_plan_report(folder))


def _plan_report(folder: DatasetFolder) -> str:
    plan = folder.plan
    kept = "" if folder.is_new else ", which held this plan already and is kept as it was"
    parameters = [f"{p.name:<24}{p.low:g} to {p.high:g} {p.unit}".rstrip() for p in plan.ranges]
    discrepancies = [f"{size}: {value:.3g}" for size, value in folder.discrepancies.items()]
    rows = [
        ("plan", plan.title or "(no title)"),
        ("cases", f"{plan.cases}"),
        ("subsets", " in ".join(map(str, (*plan.subsets, plan.cases))) if plan.subsets else "none"),
        ("tests", f"the first {plan.tests}, in no training set" if plan.tests else "none"),
        ("seed", f"{plan.seed}"),
        ("parameters", f"\n{'':16}".join(parameters) or "none: one case"),
        ("replaced", f"{folder.replaced} samples that were infeasible"),
        ("discrepancy", ", ".join(discrepancies) or "not computed"),
        ("folder", f"{folder.path}{kept}"),
        ("next", f"braidcast dataset run {quote(str(folder.path))}"),
    ]
    return "\n".join(f"{name:<16}{value}" for name, value in rows)


app.command(epilog="Example:  braidcast dataset run sixty --workers 4")(run)
app.command(epilog="Example:  braidcast dataset status sixty")(status)
app.command(epilog="Example:  braidcast dataset collect sixty -o sixty.nc")(collect)
app.command(epilog="Example:  braidcast dataset export sixty -o tables")(export)
app.command(epilog="Example:  braidcast dataset merge here there -o both")(merge)
