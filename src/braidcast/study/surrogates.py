"""Ours against the paper's recipe, on the same simulations, and the model that ships."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from braidcast.study.sizes import Size
from braidcast.study.workspace import Study
from braidcast.surrogate.evaluate import Evaluation, evaluate
from braidcast.surrogate.metrics import LARGE_ERROR
from braidcast.surrogate.model import SurrogateModel
from braidcast.surrogate.model_card import model_card
from braidcast.surrogate.model_file import load_model, save_model
from braidcast.surrogate.recipes import RECIPES
from braidcast.surrogate.train import train, train_and_test
from braidcast.surrogate.training_set import Simulations

MODEL = "models/braidcast.npz"
"""The model of all training cases: the one that ships."""

EXAMPLES = 6


def model_of(recipe: str, shapes: int) -> str:
    """The model file of a recipe and so many training shapes."""
    return f"models/{recipe}_{shapes}.npz"


def file_of(recipe: str, shapes: int) -> str:
    """The table of its errors, test by test."""
    return f"recipes/{recipe}_{shapes}"


def train_recipe(study: Study, size: Size, recipe: str) -> list[str]:
    """A model by ``ours`` or ``paper``, and its errors, those of null models beside them."""
    simulations = study.simulations(size.cases)
    model = train(
        simulations,
        RECIPES[recipe],
        shapes=size.training(simulations),
        outcomes=size.classification_training(simulations),
    )
    return _written(study, model, evaluate(model, simulations), recipe, size.shapes)


def train_shipped(study: Study, samples: int) -> list[str]:
    """``ours`` from all training cases; the model with its test figures, and its card."""
    simulations = study.simulations(samples)
    model, found = train_and_test(simulations, RECIPES["ours"])
    assert found is not None
    files = _written(study, model, found, "ours", len(model.numbers), MODEL)
    return [*files, study.write("model_card.md", model_card(model).encode())]


def _written(
    study: Study,
    model: SurrogateModel,
    found: Evaluation,
    recipe: str,
    shapes: int,
    name: str | None = None,
) -> list[str]:
    frame = pd.DataFrame({"case": found.numbers, "AE": found.prediction.AE})
    frame["ME"] = found.prediction.ME
    for null in ("projection", "nearest", "geometry"):
        errors = getattr(found, null)
        frame[f"AE_{null}"], frame[f"ME_{null}"] = errors.AE, errors.ME
    frame["modes"], frame["inside_95"] = model.rom.modes, found.inside
    name = name or model_of(recipe, shapes)
    save_model(model, study.place(name))
    return [name, study.write_table(file_of(recipe, shapes), frame)]


def table_recipes(study: Study, trained: Sequence[tuple[str, int]]) -> list[str]:
    """recipes.csv: both recipes at all sizes, means over the tests, mm."""
    rows = []
    for recipe, shapes in trained:
        found = study.table(file_of(recipe, shapes))
        errors = [c for c in found.columns if c.startswith(("AE", "ME"))]
        row = {"recipe": recipe, "N_train": shapes, "L": int(found["modes"].iloc[0])}
        row |= found[errors].mean().to_dict()
        row |= {"AE_SD": found["AE"].std(ddof=0), "ME_SD": found["ME"].std(ddof=0)}
        row |= {
            "ME_worst": found["ME"].max(),
            "ME_above_3DRA": int((found["ME"] > LARGE_ERROR).sum()),
        }
        rows.append(row | {"inside_95": found["inside_95"].iloc[0]})
    return [study.write_table("recipes", pd.DataFrame(rows))]


def examples(study: Study, size: Size) -> list[str]:
    """examples.csv and data/examples.npz: six tests from the best to the worst, both recipes.

    They are those at six even ranks of the error of the paper's recipe, so that nobody picks them.
    """
    ranked = study.table(file_of("paper", size.shapes)).sort_values("AE")["case"].to_numpy()
    numbers = ranked[np.linspace(0, len(ranked) - 1, EXAMPLES).round().astype(int)]
    simulations = study.simulations(size.cases)
    indices = np.searchsorted(simulations.numbers, numbers)
    cases, true = [simulations.cases[k] for k in indices], simulations.positions[indices]
    rows, arrays = [], {"case": numbers, "simulated": true}
    for recipe in ("paper", "ours"):
        model = load_model(study.home / model_of(recipe, size.shapes))
        predicted = np.array([model.predict(case).positions for case in cases])
        distances = np.linalg.norm(predicted - true, axis=2)
        arrays |= {f"{recipe}_positions": predicted, f"{recipe}_error": distances}
        rows += [
            {
                "case": number,
                "recipe": recipe,
                "D_v_mm": 2.0 * case.vessel_radius,
                "D_a_mm": case.sac.diameter,
                "AE": distance.mean(),
                "ME": distance.max(),
            }
            for number, case, distance in zip(numbers, cases, distances, strict=True)
        ]
    return [
        study.write_table("examples", pd.DataFrame(rows)),
        study.write_arrays("examples", **arrays),
    ]


def shipped(study: Study, samples: int) -> list[str]:
    """shipped.csv: the model of this study against the one that came with braidcast, test by test.

    Distances of the nodes, mm, and difference of the probabilities of success.
    """
    simulations = study.simulations(samples)
    ours, theirs = load_model(study.home / MODEL), load_model()
    rows = []
    for index in _tests_of(simulations, theirs):
        case = simulations.cases[index]
        here, there = ours.predict(case), theirs.predict(case)
        distance = np.linalg.norm(here.positions - there.positions, axis=1)
        probability = abs(here.success_probability - there.success_probability)
        row = {"case": simulations.numbers[index], "distance_max_mm": distance.max()}
        rows.append(row | {"probability_difference": probability})
    columns = ["case", "distance_max_mm", "probability_difference"]
    return [study.write_table("shipped", pd.DataFrame(rows, columns=columns))]


def _tests_of(simulations: Simulations, model: SurrogateModel) -> list[int]:
    """Indices of the tests, none if the model is of another plan."""
    same = simulations.plan_id == model.record["plan_id"]
    return [int(k) for k in simulations.classification_tests] if same else []
