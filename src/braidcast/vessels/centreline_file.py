"""Centrelines from files: VMTK and SimVascular (.vtp, .vtk), 3D Slicer (.json), tables (.csv).

Coordinates are in mm, unless a file of 3D Slicer says other coordinateUnits, and taken as they
stand, unless both it and the surface say their axes and these are not the same. 3D Slicer's markups
are described at https://slicer.readthedocs.io/en/latest/developer_guide/modules/markups.html.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from braidcast.errors import InputError
from braidcast.vessels.centreline_branches import way_through
from braidcast.vessels.centreline_chain import Line, joined_chain
from braidcast.vessels.centreline_table import RADIUS_NAMES, read_table
from braidcast.vessels.input_file import checked_ending
from braidcast.vessels.surface_file import declared_axes
from braidcast.vessels.units import check_centreline_extent
from braidcast.vessels.vtk_file import read_vtk_lines
from braidcast.vessels.wording import about, place

Array = NDArray[np.float64]
T = TypeVar("T")

ENDINGS = (".vtp", ".vtk", ".json", ".csv")
_AXES = {"LPS": "LPS", "RAS": "RAS", "0": "RAS", "1": "LPS"}
"""What a file of 3D Slicer may say of its axes, the numbers being its own of an earlier time."""
_UNITS = {"um": 1e-3, "µm": 1e-3, "mm": 1.0, "cm": 10.0, "m": 1000.0, "inch": 25.4, "[in_i]": 25.4}
"""mm in the units that a file of 3D Slicer may name, in words or in the code UCUM."""
_FARTHEST_END = 5.0
"""Of a given end from the centreline, mm."""


@dataclass(frozen=True, eq=False)
class Found:
    """The lines of a file."""

    lines: list[Line]
    axes: str | None = None
    """ "LPS" or "RAS", if the file says so."""
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class CentrelineData:
    """A centreline as a file gives it."""

    points: Array
    """(n, 3) mm, in order."""
    radii: Array | None
    """(n,) mm, if the file gives them."""
    remarks: tuple[str, ...] = ()
    """One sentence for each thing that was noticed."""


def read_centreline(
    path: str | os.PathLike[str],
    ends: ArrayLike | None = None,
    surface: str | os.PathLike[str] | None = None,
) -> CentrelineData:
    """The centreline in a .vtp, .vtk, .json or .csv file, from ends[0] to ends[1].

    ``ends`` (2, 3) mm choose the way through a file with branches, and its direction; of a single
    line they cut off what is beyond them. Without them the file must hold a single line, or the
    pieces of one. ``surface``: the file of the vessel's wall, whose axes the centreline is turned
    into if both files say their axes, LPS or RAS.

    ``InputError`` for a file that cannot be read, holds no centreline, or several and no ends are
    given; for points that are not finite, radii that are not positive, ends farther than 5 mm
    from the lines or not joined by them, fewer than four points, and an extent that no vessel has
    in mm.
    """
    where = f"centreline = {os.fspath(path)}"
    reader = _READERS[checked_ending(path, "centreline", ENDINGS)]
    found = _in_axes_of(surface, reader(Path(path), where))
    lines = found.lines
    _refuse_bad_values(lines, where)
    points, radii = _chosen(lines, ends, where)
    if (different := len(np.unique(points, axis=0))) < 4:
        raise InputError(
            f"{where} has {different} different points on the centreline, must have four or more"
        )
    return CentrelineData(points, radii, found.remarks)


def _in_axes_of(surface: str | os.PathLike[str] | None, found: Found) -> Found:
    """The lines in the axes that the file of the surface says it has."""
    axes = None if surface is None or found.axes is None else declared_axes(surface)
    if axes in (None, found.axes):
        return found
    return replace(
        found,
        lines=[(flipped_lps_ras(points), radii) for points, radii in found.lines],
        remarks=(
            *found.remarks,
            f"the centreline was turned from {found.axes} to {axes} coordinates, the surface's",
        ),
    )


def _chosen(lines: list[Line], ends: ArrayLike | None, where: str) -> Line:
    """The line, or the way through the lines, from one end to the other."""
    every = np.concatenate([points for points, _ in lines])
    if len(np.unique(every, axis=0)) >= 4:
        with about(where):
            check_centreline_extent(every)
    if ends is not None:
        return _between(lines, np.asarray(ends, dtype=np.float64), where)
    if len(lines) == 1:
        return lines[0]
    if (chain := joined_chain(lines)) is not None:
        return chain
    raise InputError(
        f"{where} holds {len(lines)} lines with ends at {_listed(lines)}: choose two of them "
        "by `vessel.ends`"
    )


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


def _vtk_lines(path: Path, where: str) -> Found:
    lines = []
    for points, arrays in read_vtk_lines(path):
        named = {name.lower(): values for name, values in arrays.items()}
        radii = next((named[name] for name in RADIUS_NAMES if name in named), None)
        if len(points) >= 2:
            lines.append((points, None if radii is None else np.ravel(radii).astype(np.float64)))
    if not lines:
        raise InputError(f"{where} holds no line")
    return Found(lines, declared_axes(path))


def _slicer_lines(path: Path, where: str) -> Found:
    text = _text(path, where)
    try:
        markups = json.loads(text)["markups"]
        curves = [m for m in markups if m.get("type", "Curve") in ("Curve", "ClosedCurve", "Line")]
        lines = [line for m in curves if (line := _slicer_line(m, where)) is not None]
        axes = {_axes(m, where) for m in curves}
    except InputError:
        raise
    except json.JSONDecodeError as error:
        raise InputError(f"{where} is not JSON: {error.msg} in line {error.lineno}") from None
    except (AttributeError, IndexError, KeyError, RecursionError, TypeError, ValueError):
        raise InputError(f"{where} is not a markups file of 3D Slicer") from None
    if not lines:
        raise InputError(f"{where} holds no curve with points")
    if len(axes) > 1:
        raise InputError(f"{where} holds curves of more than one coordinateSystem, must have one")
    return Found(lines, axes.pop())


def _slicer_line(markup: dict[str, Any], where: str) -> Line | None:
    """Points of a curve; None if it has none."""
    controls = markup["controlPoints"]
    defined = [c.get("positionStatus", "defined") != "undefined" for c in controls]
    places = [c["position"] for c, known in zip(controls, defined, strict=True) if known]
    if len(places) < 2:
        return None
    unit = markup.get("coordinateUnits") or "mm"
    points = np.array(places, dtype=np.float64).reshape(len(places), 3)
    points = _millimetres(unit, "coordinateUnits", where) * points
    for measurement in markup.get("measurements", []):
        values = measurement.get("controlPointValues")
        if str(measurement.get("name", "")).lower() in RADIUS_NAMES and values is not None:
            radii = np.ravel(np.array(values, dtype=np.float64))
            if len(radii) == len(controls):
                factor = _millimetres(measurement.get("units") or unit, "units of radius", where)
                return points, factor * radii[np.array(defined)]
    return points, None


def _axes(markup: dict[str, Any], where: str) -> str | None:
    said = markup.get("coordinateSystem")
    return None if said is None else _one_of(_AXES, said, "coordinateSystem", where)


def _millimetres(unit: str | list[str], name: str, where: str) -> float:
    """mm in a unit as 3D Slicer writes it: a word, or a code with its scheme and meaning."""
    return _one_of(_UNITS, unit[0] if isinstance(unit, list) else unit, name, where)


def _one_of(known: dict[str, T], value: object, name: str, where: str) -> T:
    if str(value) not in known:
        raise InputError(f"{where} has {name} {value!r}, must be one of {', '.join(known)}")
    return known[str(value)]


def _table_lines(path: Path, where: str) -> Found:
    return Found([read_table(_text(path, where), where)])


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


_READERS: dict[str, Callable[[Path, str], Found]] = {
    ".vtp": _vtk_lines,
    ".vtk": _vtk_lines,
    ".json": _slicer_lines,
    ".csv": _table_lines,
}
