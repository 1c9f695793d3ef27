"""braidcast predict: one case, or a table of them, by a surrogate."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from braidcast.cli.messages import naming, say, told
from braidcast.cli.progress import bars
from braidcast.cli.table import table

if TYPE_CHECKING:
    from braidcast.surrogate.prediction import Prediction


def predict(
    case: Annotated[
        Path,
        typer.Argument(
            metavar="CASE.toml", help="The case file; or CASES.csv, a table with a row a case."
        ),
    ],
    model: Annotated[
        Path | None,
        typer.Option(
            "--model", "-m", metavar="MODEL", help="A model file. Default: braidcast's own."
        ),
    ] = None,
    output: Annotated[
        str | None,
        typer.Option(
            "--output",
            "-o",
            metavar="DIR",
            help="Folder for the results, made if missing in a folder that exists. "
            "Default: the file's name without its ending, and _predicted, in the current folder.",
        ),
    ] = None,
) -> None:
    """Predict the deployed stent of a case, and whether its deployment succeeds, by a surrogate.

    Writes deployed.vtp (wires, with the standard deviation of every node), vessel.stl,
    deployed.png, deployed_std.png and summary.json. Of a table of cases, predictions.csv and
    predictions.nc (all nodes, for xarray); its columns are those of a dataset's cases.csv.

    Exit codes: 0 done; 1 the results could not be written; 2 bad input; 130 interrupted.
    """
    with told():
        folder = f"{case.stem}_predicted" if output is None else output
        if case.suffix.lower() == ".csv":
            _predict_table(case, model, folder)
            return

        from braidcast.case import Case
        from braidcast.deployment.picture import Drawer
        from braidcast.results_folder import check_folder

        given = Case.from_toml(case)
        check_folder(folder)
        with Drawer() as drawer:
            from braidcast.surrogate.model_file import load_model
            from braidcast.surrogate.output import write_prediction

            prediction = load_model(model).predict(given)
            with naming(folder):
                written = write_prediction(prediction, folder, drawer=drawer)
        for note in written.notes:
            say(note)
        names = ", ".join(path.name for path in written.files)
        typer.echo(table([*_rows(prediction), ("files", names), ("in", folder)]))
        _warn(prediction)


def _predict_table(path: Path, model: Path | None, folder: str) -> None:
    from braidcast.results_folder import check_folder
    from braidcast.surrogate.case_table import read_cases
    from braidcast.surrogate.model_file import load_model
    from braidcast.surrogate.prediction_table import write_predictions

    trained = load_model(model)
    cases = read_cases(path, trained)
    check_folder(folder)
    with bars("predict", delay=1.0) as progress:
        predictions = []
        for done, case in enumerate(cases):
            predictions.append(trained.predict(case))
            progress("predict", (done + 1) / len(cases))
    files = write_predictions(predictions, folder)
    successes = sum(prediction.outcome == "success" for prediction in predictions)
    outside = sum(not prediction.in_range for prediction in predictions)
    rows = [
        ("cases", f"{len(cases)}"),
        ("success predicted", f"{successes}"),
        ("outside the training", f"{outside}"),
        ("files", ", ".join(file.name for file in files)),
        ("in", folder),
    ]
    typer.echo(table(rows))
    if outside:
        say(f"{outside} of {len(cases)} cases lie outside the training data: in_range is false")


def _rows(p: Prediction) -> list[tuple[str, str]]:
    std = 1e3 * p.std_norm
    return [
        ("outcome", f"{p.outcome} predicted"),
        ("success probability", f"{p.success_probability:.3f}, success from {p.threshold:.2f} on"),
        ("deployed length", f"{p.deployed_length_mm:.3f} mm"),
        ("crimped length", f"{p.crimped_length_mm:.3f} mm"),
        ("free length", f"{p.free_length_mm:.3f} mm"),
        ("foreshortening", f"{p.foreshortening_percent:.1f} % of the crimped length"),
        (
            "standard deviation",
            f"{std.mean():.1f} µm of a node on average, {std.max():.1f} at most",
        ),
        ("in range", "yes" if p.in_range else f"NO: {'; '.join(p.out_of_range)}"),
        (
            "nearest training case",
            f"{p.nearest_case}, {p.nearest_distance:.2f} standard deviations away",
        ),
        ("model", p.model),
        ("time", f"{1e3 * p.wall_seconds:.1f} ms, {1e3 * p.cpu_seconds:.1f} ms of CPU"),
    ]


def _warn(p: Prediction) -> None:
    if not p.in_range:
        say(f"outside the training data: {'; '.join(p.out_of_range)}")
    if p.outcome == "failure":
        say("failure predicted: the shape is that of a successful deployment, do not trust it")
