"""The process that reads a VTK file: a path in, arrays out as an npz archive on standard output.

Run as a script with PATH and ``surface`` or ``lines``. It writes, for ``surface``, ``points``
(n, 3), ``triangles`` (m, 3) and ``polygons``: how many cells the triangles were made of; for
``lines``, for polyline i, ``points/i`` (n, 3), ``names/i`` and one ``values/i/j`` for each name.
A file that cannot be used ends it with exit code ``DAMAGED`` and a reason on standard error.
"""

from __future__ import annotations

import sys
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

DAMAGED = 3


def main(path: str, wanted: str) -> None:
    data = _polydata(path)
    arrays: dict[str, Any] = _surface(data) if wanted == "surface" else _lines(data)
    archive = BytesIO()
    np.savez(archive, **arrays)
    sys.stdout.buffer.write(archive.getvalue())


def _polydata(path: str) -> Any:
    from vtkmodules.vtkCommonCore import vtkOutputWindow, vtkStringOutputWindow
    from vtkmodules.vtkIOLegacy import vtkGenericDataObjectReader
    from vtkmodules.vtkIOXML import vtkXMLPolyDataReader

    messages = vtkStringOutputWindow()  # VTK prints its errors instead of raising them
    vtkOutputWindow.SetInstance(messages)
    if Path(path).suffix.lower() == ".vtp":
        reader = vtkXMLPolyDataReader()
    else:
        reader = vtkGenericDataObjectReader()
    reader.SetFileName(path)
    reader.Update()
    data = reader.GetOutput()
    if data is None or reader.GetErrorCode() or "error" in messages.GetOutput().lower():
        _refuse("is damaged or no VTK file")
    if not data.IsA("vtkPolyData"):
        _refuse(f"holds a {data.GetClassName()} where polygonal data (vtkPolyData) are needed")
    return data


def _surface(data: Any) -> dict[str, np.ndarray]:
    from vtkmodules.vtkFiltersCore import vtkTriangleFilter

    triangulate = vtkTriangleFilter()
    triangulate.SetInputData(data)
    triangulate.PassLinesOff()
    triangulate.PassVertsOff()
    triangulate.Update()
    triangles = triangulate.GetOutput()
    return {
        "points": _points(triangles),
        "triangles": _connectivity(triangles.GetPolys()).reshape(-1, 3),
        "polygons": np.array(data.GetNumberOfPolys() + data.GetNumberOfStrips()),
    }


def _lines(data: Any) -> dict[str, np.ndarray]:
    from vtkmodules.util.numpy_support import vtk_to_numpy

    points, values = _points(data), data.GetPointData()
    fields = {}
    for field in range(values.GetNumberOfArrays()):
        if (array := values.GetArray(field)) is not None:  # None for text
            fields[array.GetName() or f"array {field}"] = vtk_to_numpy(array)
    offsets = vtk_to_numpy(data.GetLines().GetOffsetsArray())
    cells = np.split(_connectivity(data.GetLines()), offsets[1:-1])
    found: dict[str, np.ndarray] = {}
    for line, cell in enumerate(cells if data.GetNumberOfLines() else []):
        found[f"points/{line}"] = points[cell]
        found[f"names/{line}"] = np.array(list(fields), dtype=np.str_)
        for number, array in enumerate(fields.values()):
            found[f"values/{line}/{number}"] = array[cell]
    return found


def _points(data: Any) -> np.ndarray:
    from vtkmodules.util.numpy_support import vtk_to_numpy

    if not data.GetNumberOfPoints():
        return np.empty((0, 3))
    return vtk_to_numpy(data.GetPoints().GetData()).astype(np.float64)


def _connectivity(cells: Any) -> np.ndarray:
    from vtkmodules.util.numpy_support import vtk_to_numpy

    if not cells.GetNumberOfCells():
        return np.empty(0, dtype=np.int64)
    return vtk_to_numpy(cells.GetConnectivityArray()).astype(np.int64)


def _refuse(reason: str) -> None:
    sys.stderr.write(reason + "\n")
    sys.exit(DAMAGED)


if __name__ == "__main__":
    main(*sys.argv[1:])
