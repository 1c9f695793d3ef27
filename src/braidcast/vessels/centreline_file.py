"""Centrelines from files: VMTK and SimVascular (.vtp, .vtk), 3D Slicer (.json), tables (.csv).

Coordinates are taken as they stand, in mm. 3D Slicer's markups are described at
https://slicer.readthedocs.io/en/latest/developer_guide/modules/markups.html.
"""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from braidcast.errors import InputError
from braidcast.vessels.centreline_branches import way_through
from braidcast.vessels.input_file import checked_ending
from braidcast.vessels.vtk_file import read_vtk_lines
from braidcast.vessels.wording import place

Array = NDArray[np.float64]
Line = tuple[Array, Array | None]
"""Points (n, 3) mm and radii (n,) mm if they are known."""

ENDINGS = (".vtp", ".vtk", ".json", ".csv")
RADIUS_NAMES = ("maximuminscribedsphereradius", "radius", "lumen_radius")
"""Names of the radius, in any case."""
_FARTHEST_END = 5.0
"""Of a given end from the centreline, mm."""


@dataclass(frozen=True, eq=False)
class CentrelineData:
    """A centreline as a file gives it."""

    points: Array
    """(n, 3) mm, in order."""
    radii: Array | None
    """(n,) mm, if the file gives them."""
    remarks: tuple[str, ...] = ()
    """One sentence for each thing that was noticed."""


def read_centreline(path: str | os.PathLike[str], ends: ArrayLike | None = None) -> CentrelineData:
    """The centreline in a .vtp, .vtk, .json or .csv file, from ends[0] to ends[1].

    ``ends`` (2, 3) mm choose the way through a file with branches, and its direction; of a single
    line they cut off what is beyond them. Without them the file must hold a single line.

    ``InputError`` for a file that cannot be read, holds no centreline, or several and no ends are
    given; for points that are not finite, radii that are not positive, ends farther than 5 mm
    from the lines or not joined by them, and fewer than four points.
    """
    where = f"centreline = {os.fspath(path)}"
    reader = _READERS[checked_ending(path, "centreline", ENDINGS)]
    lines, remarks = reader(Path(path), where)
    _refuse_bad_values(lines, where)
    if ends is not None:
        points, radii = _between(lines, np.asarray(ends, dtype=np.float64), where)
    elif len(lines) == 1:
        points, radii = lines[0]
    else:
        raise InputError(
            f"{where} holds {len(lines)} lines with ends at {_listed(lines)}: choose two of them "
            "by `vessel.ends`"
        )
    if len(np.unique(points, axis=0)) < 4:
        raise InputError(
            f"{where} has {len(np.unique(points, axis=0))} different points on the centreline, "
            "must have four or more"
        )
    return CentrelineData(points, radii, tuple(remarks))


def flipped_lps_ras(points: ArrayLike) -> Array:
    """Points (n, 3) of a file in the axes LPS (left, posterior, superior) in RAS, or back."""
    return np.asarray(points, dtype=np.float64) * np.array([-1.0, -1.0, 1.0])


def _between(lines: list[Line], ends: Array, where: str) -> Line:
    found = way_through([points for points, _ in lines], ends)
    points = np.concatenate([points for points, _ in lines])
    if found is None:
        raise InputError(f"{where} does not join the ends {place(ends[0])} and {place(ends[1])}")
    way, away = found
    for end, distance in zip(ends, away, strict=True):
        if distance > _FARTHEST_END:
            raise InputError(
                f"{where} is {distance:.3g} mm from the end {place(end)}, must be at most "
                f"{_FARTHEST_END:g} mm from it"
            )
    if any(radii is None for _, radii in lines):
        return points[way], None
    return points[way], np.concatenate([radii for _, radii in lines if radii is not None])[way]


def _vtk_lines(path: Path, where: str) -> tuple[list[Line], list[str]]:
    lines = []
    for points, arrays in read_vtk_lines(path):
        named = {name.lower(): values for name, values in arrays.items()}
        radii = next((named[name] for name in RADIUS_NAMES if name in named), None)
        if len(points) >= 2:
            lines.append((points, None if radii is None else np.ravel(radii).astype(np.float64)))
    if not lines:
        raise InputError(f"{where} holds no line")
    return lines, []


def _slicer_lines(path: Path, where: str) -> tuple[list[Line], list[str]]:
    text = _text(path, where)
    try:
        markups = json.loads(text)["markups"]
        curves = [m for m in markups if m.get("type", "Curve") in ("Curve", "ClosedCurve", "Line")]
        lines = [line for m in curves if (line := _slicer_line(m)) is not None]
    except json.JSONDecodeError as error:
        raise InputError(f"{where} is not JSON: {error.msg} in line {error.lineno}") from None
    except (AttributeError, IndexError, KeyError, RecursionError, TypeError, ValueError):
        raise InputError(f"{where} is not a markups file of 3D Slicer") from None
    if not lines:
        raise InputError(f"{where} holds no curve with points")
    return lines, []


def _slicer_line(markup: dict[str, Any]) -> Line | None:
    """Points of a curve; None if it has none."""
    controls = markup["controlPoints"]
    defined = [c.get("positionStatus", "defined") != "undefined" for c in controls]
    places = [c["position"] for c, known in zip(controls, defined, strict=True) if known]
    if len(places) < 2:
        return None
    points = np.array(places, dtype=np.float64).reshape(len(places), 3)
    for measurement in markup.get("measurements", []):
        values = measurement.get("controlPointValues")
        if str(measurement.get("name", "")).lower() in RADIUS_NAMES and values is not None:
            radii = np.ravel(np.array(values, dtype=np.float64))
            if len(radii) == len(controls):
                return points, radii[np.array(defined)]
    return points, None


def _table_lines(path: Path, where: str) -> tuple[list[Line], list[str]]:
    rows = [
        (number, [cell.strip().strip("\"'") for cell in re.split(r"\s*[,;]\s*|\s+", line.strip())])
        for number, line in enumerate(_text(path, where).splitlines(), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not rows:
        raise InputError(f"{where} is empty")
    names = [name.lower() for name in rows[0][1]]
    if any(_number(name) is not None for name in names):
        columns = [0, 1, 2] + ([3] if len(names) > 3 else [])
    else:
        rows = rows[1:]
        columns = _columns(names, where)
    if not rows:
        raise InputError(f"{where} holds no points")
    values = []
    for number, cells in rows:
        row = [_number(cells[c]) if c < len(cells) else None for c in columns]
        if any(value is None for value in row) or len(columns) < 3:
            raise InputError(
                f"{where} line {number} must hold {len(columns)} numbers, not {' '.join(cells)!r}"
            )
        values.append(row)
    table = np.array(values, dtype=np.float64)
    return [(table[:, :3], table[:, 3] if len(columns) > 3 else None)], []


def _columns(names: list[str], where: str) -> list[int]:
    """Columns of x, y, z and, if there is one, the radius."""
    missing = [name for name in "xyz" if name not in names]
    if missing:
        raise InputError(
            f"{where} has the columns {', '.join(names)}, must have x, y, z and may have radius"
        )
    radius = [names.index(name) for name in RADIUS_NAMES if name in names]
    return [names.index(name) for name in "xyz"] + radius[:1]


def _number(cell: str) -> float | None:
    try:
        return float(cell)
    except ValueError:
        return None


def _text(path: Path, where: str) -> str:
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise InputError(f"{where} cannot be read: {error.strerror or error}") from None
    except UnicodeDecodeError:
        raise InputError(f"{where} is not a text file") from None
    if not text.strip():
        raise InputError(f"{where} is empty")
    return text


def _refuse_bad_values(lines: list[Line], where: str) -> None:
    for points, radii in lines:
        for row, point in enumerate(points):
            if not np.isfinite(point).all():
                raise InputError(
                    f"{where} point {row + 1}, {point.tolist()}, must be three finite numbers"
                )
        for row, radius in enumerate([] if radii is None else radii):
            if not (math.isfinite(radius) and radius > 0.0):
                raise InputError(f"{where} radius {radius} of point {row + 1} must be positive")


def _listed(lines: list[Line]) -> str:
    """The lines' different ends, the first six."""
    ends = np.array([end for points, _ in lines for end in (points[0], points[-1])])
    _, first = np.unique(np.round(ends, 1), axis=0, return_index=True)
    places = [place(ends[i]) for i in np.sort(first)]
    return ", ".join(places[:6]) + (f" and {len(places) - 6} more" if len(places) > 6 else "")


_READERS: dict[str, Callable[[Path, str], tuple[list[Line], list[str]]]] = {
    ".vtp": _vtk_lines,
    ".vtk": _vtk_lines,
    ".json": _slicer_lines,
    ".csv": _table_lines,
}
