"""Many predictions in two files: a table of numbers, and the nodes of all for xarray."""

import csv
import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import xarray

from braidcast.atomic import write_atomically
from braidcast.surrogate.applicability import column, fields
from braidcast.surrogate.output import summary
from braidcast.surrogate.prediction import Prediction

_LEFT_OUT = ("title", "free_length_mm", "crimped_length_mm", "model", "version")


def write_predictions(predictions: Sequence[Prediction], folder: str | Path) -> list[Path]:
    """Write predictions.csv and predictions.nc, each whole or not at all.

    The table has the numbers of each case and of its summary; the netCDF file ``positions`` and
    ``std`` (case, node, xyz), mm. ``OSError`` if the disk is full.
    """
    folder = Path(folder)
    folder.mkdir(exist_ok=True)
    contents = {"predictions.csv": _table(predictions), "predictions.nc": _nodes(predictions)}
    for name, content in contents.items():
        write_atomically(folder / name, content)
    return [folder / name for name in contents]


def _table(predictions: Sequence[Prediction]) -> bytes:
    rows = []
    for number, prediction in enumerate(predictions):
        numbers = {column(name): value for name, value in fields(prediction.case).items()}
        found = {k: v for k, v in summary(prediction).items() if k not in _LEFT_OUT}
        found["out_of_range"] = "; ".join(found["out_of_range"])
        rows.append({"case": number, **numbers, **found})
    stream = io.StringIO(newline="")
    writer = csv.DictWriter(stream, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return stream.getvalue().encode()


def _nodes(predictions: Sequence[Prediction]) -> bytes:
    dimensions = ("case", "node", "xyz")
    arrays = {
        "positions": (np.stack([p.positions for p in predictions]), "nodes of the deployed stent"),
        "std": (np.stack([p.std for p in predictions]), "standard deviation of the positions"),
    }
    variables = {
        name: (dimensions, values.astype("f4"), {"units": "mm", "long_name": meaning})
        for name, (values, meaning) in arrays.items()
    }
    probability = np.array([p.success_probability for p in predictions])
    meaning = {"units": "1", "long_name": "probability of a successful deployment"}
    data = xarray.Dataset(
        {**variables, "success_probability": ("case", probability, meaning)},
        {"xyz": ["x", "y", "z"]},
        {"Conventions": "CF-1.11", "model": predictions[0].model},
    )
    return bytes(data.to_netcdf(engine="scipy"))
