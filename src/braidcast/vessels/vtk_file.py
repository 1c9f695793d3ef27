"""Surfaces and lines from VTK's files, .vtp and .vtk.

Needs ``braidcast[pictures]``, which brings VTK. A process of its own reads (``vtk_reader.py``),
because VTK can end the process at a damaged file instead of raising an error.
"""

from __future__ import annotations

import os
import subprocess
import sys
from importlib.util import find_spec
from io import BytesIO

import numpy as np
from numpy.typing import NDArray

from braidcast.errors import InputError
from braidcast.vessels import vtk_reader

Array = NDArray[np.float64]
Line = tuple[Array, dict[str, Array]]
"""Points (n, 3) and, by name, what the file gives at each of them, (n,) or (n, k)."""

ENDINGS = (".vtp", ".vtk")

_PATIENCE_SECONDS = 300.0


def read_vtk_polygons(
    path: str | os.PathLike[str], field: str = "surface"
) -> tuple[Array, NDArray[np.int64], int]:
    """Vertices (n, 3) and triangles (m, 3) as they stand in a file, and of how many polygons.

    ``InputError``, which names ``field``, if VTK is not installed or the file cannot be used.
    """
    arrays = _read(path, "surface", field)
    return arrays["points"], arrays["triangles"], int(arrays["polygons"])


def read_vtk_lines(path: str | os.PathLike[str], field: str = "centreline") -> list[Line]:
    """The polylines of a file, each with the arrays at its points; none if it holds no line.

    ``InputError``, which names ``field``, if VTK is not installed or the file cannot be used.
    """
    arrays = _read(path, "lines", field)
    count = sum(name.startswith("points/") for name in arrays)
    return [
        (
            arrays[f"points/{line}"],
            {
                str(name): arrays[f"values/{line}/{number}"]
                for number, name in enumerate(arrays[f"names/{line}"])
            },
        )
        for line in range(count)
    ]


def _read(path: str | os.PathLike[str], wanted: str, field: str) -> dict[str, NDArray]:
    where = f"{field} = {os.fspath(path)}"
    if find_spec("vtkmodules") is None:
        raise InputError(f"{where} needs VTK to be read: pip install 'braidcast[pictures]'")
    try:
        with open(path, "rb"):
            pass
    except OSError as error:
        raise InputError(f"{where} cannot be read: {error.strerror or error}") from None
    # As a script it waits for nothing but VTK and NumPy; -P: this folder's names hide no others.
    command = [sys.executable, "-P", vtk_reader.__file__, os.path.abspath(path), wanted]
    try:
        child = subprocess.run(command, capture_output=True, timeout=_PATIENCE_SECONDS)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise InputError(f"{where} cannot be read: the process that reads it: {error}") from None
    said = child.stderr.decode(errors="replace").strip().splitlines() or ["no reason given"]
    if child.returncode == vtk_reader.DAMAGED:
        raise InputError(f"{where} {said[-1]}")
    if child.returncode < 0:
        raise InputError(f"{where} is damaged: VTK crashed on it (signal {-child.returncode})")
    if child.returncode:
        raise InputError(f"{where} cannot be read by VTK: {said[-1]}")
    with np.load(BytesIO(child.stdout), allow_pickle=False) as archive:
        return dict(archive)
