"""braidcast dataset collect, export and merge."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from braidcast.cli.dataset_run import Dataset, state
from braidcast.cli.messages import say, told
from braidcast.cli.table import table


def collect(
    folder: Dataset,
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="FILE.nc", help="The file to write.")
    ],
) -> None:
    """Write a dataset to one netCDF file that xarray opens without braidcast.

    All planned cases are in it; those not finished have NaN, and say so in status and reason.

    Exit codes: 0 done; 1 the file could not be written; 2 bad input; 130 interrupted.
    """
    with told():
        from braidcast.dataset.collect import collect as write
        from braidcast.dataset.folder import DatasetFolder

        ledger = write(DatasetFolder.open(folder), output)
        size = output.stat().st_size / 1e6
        typer.echo(table([*state(ledger), ("file", f"{output}, {size:.1f} MB")]))


def export(
    folder: Dataset,
    output: Annotated[
        Path,
        typer.Option(
            "--output",
            "-o",
            metavar="DIR2",
            help="Folder for the files, made if missing in a folder that exists.",
        ),
    ],
    case: Annotated[
        int | None,
        typer.Option("--case", metavar="N", help="Write the wires of this case instead."),
    ] = None,
) -> None:
    """Write parameters.csv, a table of all cases with what became of them.

    With --case the wires of one case, case_N.vtp, for ParaView or PyVista.

    Exit codes: 0 done; 1 the file could not be written; 2 bad input; 130 interrupted.
    """
    with told():
        from braidcast.atomic import write_atomically
        from braidcast.dataset import export as contents
        from braidcast.dataset.folder import DatasetFolder
        from braidcast.results_folder import check_folder

        opened = DatasetFolder.open(folder)
        check_folder(output)
        if case is None:
            path, content = output / "parameters.csv", contents.table(opened)
        else:
            path, content = output / f"case_{case:05d}.vtp", contents.wires(opened, case)
        output.mkdir(exist_ok=True)
        write_atomically(path, content)
        typer.echo(str(path))


def merge(
    first: Annotated[Path, typer.Argument(metavar="A", help="A dataset.")],
    second: Annotated[Path, typer.Argument(metavar="B", help="A dataset of the same plan.")],
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="C", help="A new folder for both together.")
    ],
) -> None:
    """Put two runs of the same plan together.

    A finished case goes before a failed one. Where both have finished a case with different
    results, A's is taken and the case is named.

    Exit codes: 0 done; 1 the folder could not be written; 2 bad input; 130 interrupted.
    """
    with told():
        from braidcast.dataset.folder import DatasetFolder
        from braidcast.dataset.merge import merge as put_together

        merged = put_together(DatasetFolder.open(first), DatasetFolder.open(second), output)
        if merged.different:
            cases = ", ".join(map(str, merged.different))
            say(
                f"{first} and {second} have different results of the same cases; {first}'s are "
                f"taken: {cases}"
            )
        typer.echo(table([*state(merged.ledger), ("folder", str(output))]))
