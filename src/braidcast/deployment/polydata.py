"""Wires as a PyVista object."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import pyvista


def polydata(
    positions: NDArray[np.float64],
    wires: NDArray[np.int64],
    point_arrays: Mapping[str, NDArray[Any]],
) -> pyvista.PolyData:
    """Polylines through nodes (N, 3), ``wires`` (wires, nodes of each), with copies of arrays.

    ``ImportError`` without ``braidcast[pictures]``.
    """
    try:
        import pyvista
    except ImportError as error:
        raise ImportError("to_polydata needs PyVista: pip install 'braidcast[pictures]'") from error
    lines = np.column_stack([np.full(len(wires), wires.shape[1]), wires])
    data = pyvista.PolyData(np.array(positions), lines=lines.ravel())
    for name, values in point_arrays.items():
        data.point_data[name] = np.array(values)
    return data
