"""braidcast train, evaluate and card."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from braidcast.cli.dataset_run import Dataset
from braidcast.cli.messages import told
from braidcast.cli.progress import bars
from braidcast.cli.table import table

if TYPE_CHECKING:
    from braidcast.surrogate.evaluate import Evaluation


def train(
    folder: Dataset,
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="MODEL", help="The model file to write.")
    ],
    recipe: Annotated[
        str, typer.Option("--recipe", metavar="NAME", help="ours, or paper: that of the paper.")
    ] = "ours",
    cases: Annotated[
        int | None,
        typer.Option("--cases", metavar="N", help="Learn from the first N successes only."),
    ] = None,
    finished_only: Annotated[
        bool, typer.Option("--finished-only", help="Leave out cases that failed or wait.")
    ] = False,
) -> None:
    """Train a surrogate on the simulations of a dataset.

    Its test cases stay out, and give the figures that the model carries.

    Exit codes: 0 done; 1 the file could not be written; 2 bad input; 130 interrupted.
    """
    with told():
        from braidcast.dataset.folder import DatasetFolder
        from braidcast.errors import InputError
        from braidcast.results_folder import check_file
        from braidcast.surrogate.recipes import RECIPES

        if recipe not in RECIPES:
            raise InputError(f"recipe = {recipe!r} must be one of: {', '.join(RECIPES)}")
        check_file(output)
        opened = DatasetFolder.open(folder)

        from braidcast.surrogate.model_file import save_model
        from braidcast.surrogate.train import train_and_test
        from braidcast.surrogate.training_set import Simulations

        with bars("tune") as progress:
            simulations = Simulations.of(opened, finished_only=finished_only)
            model, evaluation = train_and_test(
                simulations, RECIPES[recipe], cases=cases, progress=progress
            )
        save_model(model, output)
        tuning = model.record["cross_validation"]
        rows = [
            ("model", f"{model.record['name']}"),
            ("modes", f"{tuning['modes']}"),
            ("file", f"{output}, {output.stat().st_size / 1e6:.3g} MB"),
        ]
        tested = [] if evaluation is None else test_rows(evaluation)
        typer.echo(table([*rows, *tested]))


def evaluate(
    model: Annotated[Path, typer.Argument(metavar="MODEL", help="A model file.")],
    folder: Dataset,
    output: Annotated[
        str | None,
        typer.Option("--output", "-o", metavar="DIR", help="Folder for the tables, if wanted."),
    ] = None,
    finished_only: Annotated[
        bool, typer.Option("--finished-only", help="Leave out cases that failed or wait.")
    ] = False,
) -> None:
    """Compare a surrogate with simulations that it has not seen.

    Those are the tests of the dataset it was trained on, or all cases of another. With -o writes
    evaluation.json (all figures), shapes.csv and outcomes.csv (case by case).

    Exit codes: 0 done; 1 the files could not be written; 2 bad input; 130 interrupted.
    """
    with told():
        from braidcast.atomic import write_atomically
        from braidcast.dataset.folder import DatasetFolder
        from braidcast.results_folder import check_folder
        from braidcast.surrogate.evaluate import evaluate as compare
        from braidcast.surrogate.model_file import load_model
        from braidcast.surrogate.training_set import Simulations

        trained = load_model(model)
        if output is not None:
            check_folder(output)
        with bars("predict", delay=1.0) as progress:
            simulations = Simulations.of(DatasetFolder.open(folder), finished_only=finished_only)
            found = compare(trained, simulations, progress)
        rows = [("model", f"{trained.record['name']}"), *test_rows(found)]
        if output is not None:
            into = Path(output)
            into.mkdir(exist_ok=True)
            figures = json.dumps(found.figures(), indent=2) + "\n"
            for name, text in (("evaluation.json", figures), *_case_by_case(found).items()):
                write_atomically(into / name, text.encode())
            rows.append(("in", str(into)))
        typer.echo(table(rows))


def card(
    model: Annotated[
        Path | None,
        typer.Argument(metavar="[MODEL]", help="A model file. Default: braidcast's own."),
    ] = None,
) -> None:
    """Print what to know of a surrogate before trusting it: data, ranges, errors, use, limits.

    Exit codes: 0 done; 2 bad input.
    """
    with told():
        from braidcast.surrogate.model_card import model_card
        from braidcast.surrogate.model_file import load_model

        typer.echo(model_card(load_model(model)), nl=False)


def test_rows(found: Evaluation) -> list[tuple[str, str]]:
    """What the terminal shows of an evaluation."""
    shapes = [("prediction", found.prediction), ("modes alone", found.projection)]
    if found.nearest is not None:
        shapes.append(("nearest case", found.nearest))
    shapes.append(("placed by geometry", found.geometry))
    rows = [("test of shapes", f"{len(found.numbers)} cases; mean and largest distance of nodes")]
    rows += [
        (f"  {name}", f"{e.AE_p:.4f} mm; {e.ME_p:.4f} mm, {e.large} cases above 0.15 mm")
        for name, e in shapes
    ]
    classes = found.classes
    rows += [
        ("  95 % intervals", f"hold {found.inside:.1%} of the coordinates"),
        ("test of outcomes", f"{len(found.success)} cases, success from {found.threshold:.2f} on"),
    ]
    for name in ("accuracy", "sensitivity", "specificity", "AUC", "Brier"):
        low, high = found.intervals[name]
        rows.append((f"  {name}", f"{getattr(classes, name):.3f} (95 %: {low:.3f} to {high:.3f})"))
    counts = f"{classes.FP} of {classes.FP + classes.TN} called successes"
    return [*rows, ("  failures", counts)]


def _case_by_case(found: Evaluation) -> dict[str, str]:
    shapes = ["case,AE_mm,ME_mm"]
    errors = zip(found.numbers, found.prediction.AE, found.prediction.ME, strict=True)
    shapes += [f"{number},{mean:.6f},{most:.6f}" for number, mean, most in errors]
    outcomes = ["case,success,success_probability"]
    pairs = zip(found.outcome_numbers, found.success, found.probability, strict=True)
    outcomes += [f"{number},{int(success)},{p:.6f}" for number, success, p in pairs]
    return {"shapes.csv": "\n".join(shapes) + "\n", "outcomes.csv": "\n".join(outcomes) + "\n"}
