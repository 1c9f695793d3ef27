"""A centreline from a table as text: x, y, z and, with a header that names it, the radius."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from braidcast.errors import InputError

Array = NDArray[np.float64]

RADIUS_NAMES = ("maximuminscribedsphereradius", "radius", "lumen_radius")
"""Names of the radius, in any case."""
_COORDINATES = {f"points{between}{i}": "xyz"[i] for between in ":_" for i in range(3)}
"""What ParaView calls them."""
_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")


def read_table(text: str, where: str) -> tuple[Array, Array | None]:
    """Points (n, 3) mm and radii (n,) mm, if there are any, of a table.

    Between the columns are ``;`` if the first line has one, else tabs, else commas, else blanks;
    with the first two numbers may have decimal commas. Lines that begin with ``#`` are passed over.
    ``InputError``, which names the line, for what is no such table.
    """
    lines = [
        (number, line.strip())
        for number, line in enumerate(text.split("\n"), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not lines:
        raise InputError(f"{where} is empty")
    between = next((mark for mark in ";\t," if mark in lines[0][1]), None)
    rows = [(number, _cells(line, between, f"{where} line {number}")) for number, line in lines]
    first = rows[0][1]
    if any(_number(cell) is not None for cell in first):
        columns, width = _without_header(len(first), where), len(first)
    else:
        columns, width, rows = _columns(first, where), len(first), rows[1:]
    if not rows:
        raise InputError(f"{where} holds no points")
    table = np.array([_values(cells, columns, width, where, n) for n, cells in rows])
    return table[:, :3], table[:, 3] if len(columns) > 3 else None


def _cells(line: str, between: str | None, where: str) -> list[str]:
    if between == "," and re.search(r"\d,\d+\s+[-+]?\d+,\d", line):
        raise InputError(f"{where} has decimal commas, {_REMEDY}, not {line!r}")
    cells = [cell.strip().strip("\"'").strip() for cell in line.split(between)]
    if between in (";", "\t"):
        cells = [c.replace(",", ".") if _DECIMAL_COMMA.fullmatch(c) else c for c in cells]
    return cells[:-1] if len(cells) > 1 and not cells[-1] else cells


_REMEDY = "must have decimal points, or ; or a tab between the columns"


def _values(
    cells: list[str], columns: list[int], width: int, where: str, number: int
) -> list[float]:
    """What is in ``columns`` of a row that must have ``width`` cells at most."""
    if len(cells) > width:
        raise InputError(
            f"{where} line {number} must hold {width} columns as the first line does, not "
            f"{' '.join(cells)!r}; where these are decimal commas, it {_REMEDY}"
        )
    row = [_number(cells[c]) if c < len(cells) else None for c in columns]
    if any(value is None for value in row):
        commas = any("," in cell for cell in cells)
        raise InputError(
            f"{where} line {number} must hold {len(columns)} numbers, not {' '.join(cells)!r}"
            + (f"; where these are decimal commas, it {_REMEDY}" if commas else "")
        )
    return [value for value in row if value is not None]


def _without_header(width: int, where: str) -> list[int]:
    if width > 3:
        raise InputError(
            f"{where} has {width} columns and no header, must have three, x, y and z, or a header "
            "with x, y, z: a fourth column needs a header that names it radius"
        )
    return [0, 1, 2]


def _columns(header: list[str], where: str) -> list[int]:
    """Columns of x, y, z and, if there is one, the radius."""
    names = [_name(cell, where) for cell in header]
    if any(name not in names for name in "xyz"):
        raise InputError(
            f"{where} has the columns {', '.join(names)}, must have x, y, z and may have radius"
        )
    radius = [names.index(name) for name in RADIUS_NAMES if name in names]
    return [names.index(name) for name in "xyz"] + radius[:1]


def _name(cell: str, where: str) -> str:
    """The name in a cell of the header, in small letters; a unit behind it must be mm."""
    found = re.fullmatch(r"(.*?)\s*[\[(]\s*(\S*?)\s*[\])]", cell.lower())
    name = found[1] if found else cell.lower()
    name = _COORDINATES.get(name, name)
    if found and found[2] != "mm" and name in (*"xyz", *RADIUS_NAMES):
        raise InputError(f"{where} has the column {cell!r}, must be in mm")
    return name


def _number(cell: str) -> float | None:
    try:
        return float(cell)
    except ValueError:
        return None
