"""Which columns of which table the report shows, and how: ours, and the paper's beside it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import pandas as pd


@dataclass(frozen=True)
class Column:
    """A column ``name`` of a table under the heading ``title``, values in the format ``form``.

    ``paper``: the column with the paper's values, shown beside it. ``spread``: the column with the
    standard deviation; the paper's is that of ``paper`` with the same ending.
    """

    title: str
    name: str
    form: str = ""
    paper: str = ""
    spread: str = ""


@dataclass(frozen=True)
class View:
    """A table as text: ``headings`` with the number of columns below each, ``rows`` of cells.

    ``paired``: whether a second row of headings says which column is ours and which the paper's.
    """

    headings: list[tuple[str, int]]
    rows: list[list[str]]

    @property
    def paired(self) -> bool:
        return any(span > 1 for _, span in self.headings)


def _with_paper(*columns: tuple[str, str, str]) -> tuple[Column, ...]:
    return tuple(Column(title, name, form, f"paper_{name}") for title, name, form in columns)


def _error(name: str, form: str = ".3f", paper: str = "paper_") -> Column:
    """A mean and its standard deviation, to the digits of the paper or others."""
    return Column(f"{name} (mm)", name, form, f"{paper}{name}" if paper else "", f"{name}_SD")


_SHARES = _with_paper(
    ("accuracy", "accuracy", ".1%"),
    ("sensitivity", "sensitivity", ".1%"),
    ("specificity", "specificity", ".1%"),
    ("precision", "precision", ".1%"),
    ("F1", "F1", ".1%"),
)
_TRAINED = (Column("N_s", "N_s"), Column("N_train", "N_train"), Column("classifier", "model"))

TABLES: dict[str, tuple[Column, ...]] = {
    "table1": (
        Column("N_s", "N_s"),
        *_with_paper(
            ("successes", "N_success", ""),
            ("failures", "N_failure", ""),
            ("train classifiers", "N_train_class", ""),
            ("test classifiers", "N_test_class", ""),
            ("train shapes", "N_train_regr", ""),
            ("test shapes", "N_test_regr", ""),
        ),
        Column("not converged", "not_converged"),
    ),
    "table2": (*_TRAINED, *_SHARES, Column("AUC", "AUC", ".3f"), Column("Brier", "Brier", ".3f")),
    "table2_paper_convention": (*_TRAINED, *_SHARES),
    "false_negatives": (
        Column("case", "case"),
        Column("probability of success", "success_probability", ".3f"),
        Column("from the nearer end to the sac (mm)", "gap_mm", ".2f"),
        Column("median of all successful tests (mm)", "median_gap_of_successes_mm", ".2f"),
    ),
    "table3": (
        Column("N_train", "N_train"),
        Column("ε_POD", "eps_POD"),
        Column("L of Σσ", "L", "", "paper_L"),
        Column("L of Σσ²", "L_of_squares"),
        *(_error(name) for name in ("AE_rb", "ME_rb", "AE_p", "ME_p")),
    ),
    "centring": (
        Column("mean taken away", "centred"),
        Column("N_train", "N_train"),
        *(_error(name, ".4f", paper="") for name in ("AE_rb", "ME_rb", "AE_p", "ME_p")),
    ),
    "table4": (
        Column("predictors", "predictors"),
        Column("N_train", "N_train"),
        _error("AE_p"),
        Column("AE_p > 0.15 mm", "AE_p_above_3DRA", "", "paper_AE_p_above_3DRA"),
        _error("ME_p"),
        Column("ME_p > 0.15 mm", "ME_p_above_3DRA", "", "paper_ME_p_above_3DRA"),
        Column("ME_p > 0.4 mm", "ME_p_above_CTA", "", "paper_ME_p_above_CTA"),
    ),
    "simulations": (
        Column("N_train", "N_train"),
        _error("AE_p", ".4f", paper=""),
        Column("AE_p over that at 146", "AE_p_ratio", ".2f", "paper_AE_p_ratio"),
        _error("ME_p", ".4f", paper=""),
        Column("ME_p over that at 146", "ME_p_ratio", ".2f", "paper_ME_p_ratio"),
    ),
    "recipes": (
        Column("recipe", "recipe"),
        Column("N_train", "N_train"),
        Column("L", "L"),
        _error("AE", ".4f", paper=""),
        _error("ME", ".4f", paper=""),
        Column("largest ME (mm)", "ME_worst", ".4f"),
        Column("ME > 0.15 mm", "ME_above_3DRA"),
        Column("inside 95 % intervals", "inside_95", ".1%"),
        Column("AE, modes alone (mm)", "AE_projection", ".4f"),
        Column("AE, nearest case (mm)", "AE_nearest", ".4f"),
        Column("AE, geometry alone (mm)", "AE_geometry", ".4f"),
    ),
    "examples": (
        Column("case", "case"),
        Column("recipe", "recipe"),
        Column("D_v (mm)", "D_v_mm", ".2f"),
        Column("D_a (mm)", "D_a_mm", ".2f"),
        Column("AE (mm)", "AE", ".4f"),
        Column("ME (mm)", "ME", ".4f"),
    ),
    "sites": (
        Column("η", "eta", ".1f"),
        Column("simulated", "outcome"),
        Column("probability of success", "success_probability", ".3f"),
        Column("depth of first end in the sac (mm)", "depth_first_mm", ".2f"),
        Column("of last end (mm)", "depth_last_mm", ".2f"),
    ),
    "needed": (
        Column("model", "model"),
        Column("measure", "measure"),
        Column("target", "target"),
        Column("training cases, mean", "N_train_mean", ".0f"),
        Column("simulations, mean", "N_simulations_mean", ".0f"),
        Column("training cases, whole band", "N_train_band", ".0f"),
        Column("simulations, whole band", "N_simulations_band", ".0f"),
    ),
    "learning_curves": (
        Column("model", "model"),
        Column("measure", "measure"),
        Column("N_train", "N_train"),
        Column("training sets", "training_sets"),
        Column("mean", "mean", ".4f"),
        Column("from", "low", ".4f"),
        Column("to", "high", ".4f"),
    ),
    "sobol": (
        Column("quantity", "quantity"),
        Column("parameter", "parameter"),
        Column("alone", "first_order", ".3f"),
        Column("from", "first_order_low", ".3f"),
        Column("to", "first_order_high", ".3f"),
        Column("with all others", "total_order", ".3f"),
        Column("from", "total_order_low", ".3f"),
        Column("to", "total_order_high", ".3f"),
    ),
    "importance": (
        Column("parameter", "parameter"),
        Column("loss of R²", "importance", ".3f"),
        Column("standard deviation", "importance_SD", ".3f"),
    ),
}


_WORDS = {
    "Bezier": "μ_B",
    **{f"Ncl={count}": f"μ_cl, {count} points" for count in (3, 5, 8)},
    "True": "yes",
    "False": "no",
    "paper": "paper's",
}
"""What is written otherwise in tables for programs."""


def view(name: str, table: pd.DataFrame) -> View:
    """A table as the report shows it; – where there is no value."""
    headings, cells = [], []
    for column in TABLES[name]:
        names = [column.name, *([column.paper] if column.paper else [])]
        headings.append((column.title, len(names)))
        for value in names:
            spread = f"{value}_SD" if column.spread else ""
            cells.append([_cell(row, value, spread, column.form) for _, row in table.iterrows()])
    return View(headings, [list(row) for row in zip(*cells, strict=True)])


def _cell(row: Any, name: str, spread: str, form: str) -> str:
    text = _text(row[name], form)
    return f"{text} ± {_text(row[spread], form)}" if spread in row and text != "–" else text


def _text(value: Any, form: str) -> str:
    if pd.isna(value):
        return "–"
    if str(value) in _WORDS:
        return _WORDS[str(value)]
    if not form and isinstance(value, float):
        return f"{value:g}"
    return format(value, form)
