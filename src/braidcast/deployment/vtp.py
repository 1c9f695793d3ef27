"""Polylines as a VTK XML PolyData file, written without VTK.

The format: "VTK XML Formats", VTK documentation. Arrays are inline, base64 of a 64-bit byte count
followed by the little-endian values.
"""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import ArrayLike, NDArray


def write_polylines(
    path: Path,
    points: NDArray[np.float64],
    lines: NDArray[np.int64],
    point_arrays: Mapping[str, ArrayLike],
) -> None:
    """Write points (N, 3), lines (number of lines, nodes a line) and arrays (N,) or (N, k)."""
    count, each = lines.shape
    ends = np.arange(1, count + 1) * each
    data = [_array(name, np.asarray(values)) for name, values in point_arrays.items()]
    text = "\n".join(
        [
            '<?xml version="1.0"?>',
            '<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian"'
            ' header_type="UInt64">',
            "<PolyData>",
            f'<Piece NumberOfPoints="{len(points)}" NumberOfLines="{count}" NumberOfVerts="0"'
            ' NumberOfStrips="0" NumberOfPolys="0">',
            "<PointData>",
            *data,
            "</PointData>",
            "<Points>",
            _array("Points", points),
            "</Points>",
            "<Lines>",
            _array("connectivity", lines.ravel()),
            _array("offsets", ends),
            "</Lines>",
            "</Piece>",
            "</PolyData>",
            "</VTKFile>\n",
        ]
    )
    path.write_text(text, encoding="ascii")


def write_collection(path: Path, files: Sequence[tuple[str, str]]) -> None:
    """Write a ParaView collection: (stage, file relative to ``path``), one time step each."""
    sets = [
        f'<DataSet timestep="{step}" name={quoteattr(stage)} part="0" file={quoteattr(file)}/>'
        for step, (stage, file) in enumerate(files)
    ]
    text = "\n".join(
        [
            '<?xml version="1.0"?>',
            '<VTKFile type="Collection" version="1.0" byte_order="LittleEndian">',
            "<Collection>",
            *sets,
            "</Collection>",
            "</VTKFile>\n",
        ]
    )
    path.write_text(text, encoding="utf-8")


def _array(name: str, values: NDArray[Any]) -> str:
    """One DataArray element: whole numbers as Int64, all others as Float64."""
    whole = np.issubdtype(values.dtype, np.integer)
    raw = np.ascontiguousarray(values, dtype="<i8" if whole else "<f8").tobytes()
    content = base64.b64encode(np.array([len(raw)], dtype="<u8").tobytes() + raw).decode("ascii")
    components = values.shape[1] if values.ndim == 2 else 1
    return (
        f'<DataArray type="{"Int64" if whole else "Float64"}" Name={quoteattr(name)}'
        f' NumberOfComponents="{components}" format="binary">{content}</DataArray>'
    )
