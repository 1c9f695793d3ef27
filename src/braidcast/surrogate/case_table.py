"""Many cases as a table of CSV: the numbers that a model was trained to vary, a row a case."""

import csv
import io
from pathlib import Path
from typing import Any

from braidcast.case import Case
from braidcast.errors import InputError
from braidcast.surrogate.applicability import column
from braidcast.surrogate.model import SurrogateModel

IGNORED = ("case", "test", "subset")
"""Columns that the cases.csv of a dataset has besides."""


def columns(model: SurrogateModel) -> dict[str, str]:
    """The field of each column that a table must have: the name with its unit, "_mm" or none."""
    varied = [name for name, (low, high) in model.applicability.limits.items() if low < high]
    return {column(name): name for name in varied}


def read_cases(path: str | Path, model: SurrogateModel) -> list[Case]:
    """The cases of a table; all else is as in the model's training.

    ``InputError`` names the column, or the row and what is wrong in it.
    """
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "it is no text of UTF-8"
        raise InputError(f"case table = {path} cannot be read: {reason}") from None
    rows = list(csv.reader(io.StringIO(text, newline="")))
    known = columns(model)
    header = [name.strip() for name in rows[0]] if rows else []
    wanted = ", ".join(known)
    for name in header:
        if name not in known and name not in IGNORED:
            raise InputError(f"{path}: column {name!r} is not known, must be of: {wanted}")
    for name in known:
        if header.count(name) != 1:
            raise InputError(
                f"{path}: column {name!r} is there {header.count(name)} times, must be once; "
                f"the columns are: {wanted}"
            )
    cases = []
    for line, row in enumerate(rows[1:], start=2):
        if len(row) != len(header):
            raise InputError(
                f"{path}: line {line} has {len(row)} values, must have {len(header)}, one a column"
            )
        tables = model.case.to_dict() | {"title": ""}
        for name, value in zip(header, row, strict=True):
            if name in known:
                _put(tables, known[name], _number(path, line, name, value))
        try:
            cases.append(Case.from_dict(tables))
        except InputError as error:
            raise InputError(f"{path}: line {line}: {error}") from None
    if not cases:
        raise InputError(f"{path} has no cases, must have a line for each below its header")
    return cases


def _number(path: str | Path, line: int, name: str, value: str) -> float:
    try:
        return float(value)
    except ValueError:
        raise InputError(f"{path}: line {line}: {name} = {value!r} must be a number") from None


def _put(tables: dict[str, Any], name: str, value: float) -> None:
    """Set the field "vessel_P1_y" or "site_eta" of a case's tables."""
    table, key = name.split("_", 1)
    point, _, axis = key.partition("_")
    if point in ("P0", "P1", "P2"):
        numbers = list(tables[table][point])
        numbers["xyz".index(axis)] = value
        tables[table] = {**tables[table], point: tuple(numbers)}
    else:
        tables[table] = {**tables[table], key: value}
