"""All cases of a dataset as one xarray Dataset, read when asked for."""

from __future__ import annotations

import secrets
from pathlib import Path
from typing import Any

import dask.array
import numpy as np
import xarray
from numpy.typing import NDArray

from braidcast.dataset.case_array import CaseArray
from braidcast.dataset.fields import ARRAYS, CENTRE, COSTS, LABELS, NUMBERS, Field
from braidcast.dataset.folder import STORE_VERSION, DatasetFolder
from braidcast.dataset.ledger import Ledger
from braidcast.devices import Braid
from braidcast.errors import InputError

_CHUNK = 16_000_000  # bytes

_TEXTS = {
    "status": "finished, failed, or waiting to be simulated",
    "reason": "why the solver stopped, or why there is no result",
    **LABELS,
    "checksum": "SHA-256 over the results of the case",
    "versions": "of the programs that simulated the case",
}


def open_dataset(path: str | Path) -> xarray.Dataset:
    """A dataset folder, or the file it was collected into, as one Dataset over all planned cases.

    The parameters of the cases are coordinates; every variable has ``units`` and ``long_name``.
    Arrays are read from the case files when their values are asked for. Where ``status`` is not
    "finished" numbers are NaN and labels "".

    Raises ``InputError`` if there is no dataset, or one that this braidcast cannot read.
    """
    path = Path(path)
    if path.is_file():
        return _collected(path)
    folder = DatasetFolder.open(path)
    return dataset(folder, Ledger.read(folder))


def dataset(folder: DatasetFolder, ledger: Ledger) -> xarray.Dataset:
    """The Dataset of a folder whose case files were read."""
    braid = folder.case(0).braid
    sizes = {"case": len(folder), "node": braid.node_count, "ring": braid.segments + 1, "xyz": 3}
    variables: dict[str, Any] = {name: _text(ledger, name) for name in _TEXTS}
    variables |= {known.name: _numbers(ledger, known) for known in (*NUMBERS, *COSTS, CENTRE)}
    variables |= {known.name: _array(folder, ledger, known, sizes) for known in ARRAYS}
    return xarray.Dataset(variables, _coordinates(folder, braid), _attributes(folder))


def _collected(path: Path) -> xarray.Dataset:
    try:
        found = xarray.open_dataset(path, engine="scipy", chunks={})
    except (OSError, ValueError, TypeError, KeyError, IndexError) as error:
        raise InputError(f"{path} is not a collected dataset: {error}") from None
    version = found.attrs.get("store_version")
    if version is None or "status" not in found:
        found.close()
        raise InputError(f"{path} is not a collected dataset, must be written by collect")
    if int(version) > STORE_VERSION:
        found.close()
        raise InputError(
            f"{path}: store_version = {version} must be at most {STORE_VERSION}: "
            "the dataset was written by a newer braidcast"
        )
    arrays = {known.name for known in ARRAYS}
    for name, variable in found.variables.items():
        if name not in arrays:
            variable.load()
    return found


def _attributes(folder: DatasetFolder) -> dict[str, Any]:
    return {
        "Conventions": "CF-1.11",
        "title": folder.plan.title,
        "store_version": STORE_VERSION,
        "plan_id": folder.plan_id,
        "plan": folder.plan.text,
    }


def _coordinates(folder: DatasetFolder, braid: Braid) -> dict[str, Any]:
    cases = range(len(folder))
    parameters = {
        parameter.name: _on(
            "case",
            folder.values[:, column],
            parameter.unit or "1",
            f"parameter {parameter.name.replace('_', ' ')}",
        )
        for column, parameter in enumerate(folder.plan.ranges)
    }
    tests = np.array([folder.is_test(index) for index in cases])
    subsets = np.array([folder.subset(index) for index in cases])
    return {
        "case": _on("case", np.arange(len(folder)), "1", "number of the case"),
        "test": _on("case", tests, "1", "whether of the test set, in no training set"),
        "subset": _on("case", subsets, "1", "size of the smallest subset that has the case"),
        **parameters,
        "xyz": ("xyz", ["x", "y", "z"]),
        "wire": _on("node", np.array(braid.wire_of_node), "1", "wire of the node"),
        "node_ring": _on("node", np.array(braid.rings), "1", "ring of the node"),
    }


def _on(dimension: str, values: NDArray[Any], unit: str, meaning: str) -> xarray.Variable:
    return xarray.Variable(dimension, values, {"units": unit, "long_name": meaning})


def _text(ledger: Ledger, name: str) -> xarray.Variable:
    texts = ["waiting" if name == "status" else ""] * ledger.cases
    for index, record in ledger.records.items():
        texts[index] = getattr(record, name)
    if name == "reason":
        for index, sentence in ledger.damaged.items():
            texts[index] = sentence
    return xarray.Variable("case", np.array(texts), {"long_name": _TEXTS[name]})


def _numbers(ledger: Ledger, known: Field) -> xarray.Variable:
    shape = (ledger.cases, *(3 for _ in known.dimensions))
    values = np.full(shape, np.nan)
    for index, record in ledger.records.items():
        if known.name in record.values:
            values[index] = record.values[known.name]
    return _described(known, values)


def _array(
    folder: DatasetFolder, ledger: Ledger, known: Field, sizes: dict[str, int]
) -> xarray.Variable:
    shape = tuple(sizes[dimension] for dimension in known.dimensions)
    source = CaseArray(folder, ledger.records, known, shape)
    each = int(np.prod(shape)) * source.dtype.itemsize
    # A name of its own: Dask takes arrays of the same name for the same, but cases are added.
    name = f"{known.name}-{folder.plan_id}-{secrets.token_hex(8)}"
    chunks = (max(1, _CHUNK // each), *shape)
    return _described(known, dask.array.from_array(source, chunks, name=name, asarray=False))


def _described(known: Field, values: Any) -> xarray.Variable:
    attributes = {"units": known.unit, "long_name": known.meaning}
    return xarray.Variable(("case", *known.dimensions), values, attributes)
