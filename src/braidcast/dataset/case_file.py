"""One file a case, finished or failed: netCDF-3, whole or not there, and sealed.

The file is written to a temporary name, flushed to the disk and renamed. Its first attribute, the
seal, is the SHA-256 of the file as it is with sixty-four zeros in the seal's place: whatever
changes or is cut off later is found out on reading.
"""

from __future__ import annotations

import hashlib
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.io import netcdf_file

from braidcast.atomic import write_atomically
from braidcast.dataset.case_record import CaseRecord, Origin
from braidcast.dataset.fields import ARRAYS, CENTRE, COSTS, NUMBERS, RESULTS, Field
from braidcast.dataset.folder import STORE_VERSION
from braidcast.dataset.netcdf3 import read_header
from braidcast.errors import InputError

_NO_SEAL = b"0" * 64


class DamagedFile(ValueError):
    """A case file that is not what was written: cut off, changed, or never one."""


def write_case(path: Path, record: CaseRecord, origin: Origin) -> None:
    """Write the record to ``path``, whole or not at all; ``OSError`` if the disk does not take it.

    ``origin`` gives the parameters, which the file repeats for readers that have nothing else.
    """
    write_atomically(path, _sealed(_netcdf(record, origin)))


def read_case(path: Path, *, arrays: bool = True) -> CaseRecord:
    """Read a case file and check its seal; without ``arrays`` keep only what is small.

    Raises ``FileNotFoundError`` if there is none, ``DamagedFile`` if it is not what was written,
    ``InputError`` if it was written by a newer braidcast.
    """
    content = path.read_bytes()
    try:
        place = _seal_place(content)
        if _seal(content, place) != content[place]:
            raise ValueError("its content does not match its seal")
        header = read_header(content)
        texts, places = header.texts, header.variables
        if int(texts["store_version"]) > STORE_VERSION:
            raise InputError(
                f"{path}: store_version = {texts['store_version']} must be at most "
                f"{STORE_VERSION}; it was written by a newer braidcast, {texts['versions']}"
            )
        kept = (*RESULTS, *COSTS, CENTRE) if arrays else (*NUMBERS, *COSTS, CENTRE)
        values = {f.name: places[f.name].values(content) for f in kept if f.name in places}
        return CaseRecord(
            plan_id=texts["plan_id"],
            index=int(texts["case"]),
            status="finished" if texts["status"] == "finished" else "failed",
            reason=texts["reason"],
            outcome=texts.get("outcome", ""),
            clinical_outcome=texts.get("clinical_outcome", ""),
            # copies, because a view would keep the whole content in memory
            values=values if arrays else {name: v.copy() for name, v in values.items()},
            toml=texts["case_toml"],
            versions=texts["versions"],
            checksum=texts.get("checksum", ""),
            places=places,
        )
    except InputError:
        raise
    except (ValueError, KeyError) as error:
        raise DamagedFile(f"{path} is damaged: {error}") from None


def _netcdf(record: CaseRecord, origin: Origin) -> bytes:
    stream = BytesIO()
    file = netcdf_file(stream, "w", version=2)
    # Readers of the seal look for its first mention, so that it goes before anything a user wrote.
    file.seal = _NO_SEAL
    file.Conventions = "CF-1.11"
    file.store_version = str(STORE_VERSION)
    texts = {
        "plan_id": record.plan_id,
        "case": str(record.index),
        "status": record.status,
        "reason": record.reason,
        "outcome": record.outcome,
        "clinical_outcome": record.clinical_outcome,
        "checksum": record.checksum,
        "versions": record.versions,
        "case_toml": record.toml,
    }
    for name, text in texts.items():
        if text:  # netCDF-3 has no empty texts
            setattr(file, name, text.encode("utf-8", "replace"))
    sizes: dict[str, int] = {}
    for known in (*ARRAYS, *NUMBERS, *COSTS, CENTRE):
        if known.name in record.values:
            _add(file, known, record.values[known.name], sizes)
    for parameter, value in origin.parameters:
        meaning = "parameter of the case: " + parameter.name
        one = Field(parameter.name, (), "f8", parameter.unit or "1", meaning)
        _add(file, one, np.array(value), sizes)
    file.flush()
    return stream.getvalue()


def _add(file: netcdf_file, known: Field, values: NDArray[Any], sizes: dict[str, int]) -> None:
    for dimension, size in zip(known.dimensions, values.shape, strict=True):
        if sizes.setdefault(dimension, size) != size:
            raise ValueError(f"{known.name} has {size} values along {dimension}")
        if dimension not in file.dimensions:
            file.createDimension(dimension, size)
    variable = file.createVariable(known.name, f">{known.dtype}", known.dimensions)
    variable[...] = values
    variable.units = known.unit
    variable.long_name = known.meaning


def _sealed(content: bytes) -> bytes:
    place = _seal_place(content)
    return content[: place.start] + _seal(content, place) + content[place.stop :]


def _seal(content: bytes, place: slice) -> bytes:
    digest = hashlib.sha256(content[: place.start])
    digest.update(_NO_SEAL)
    digest.update(memoryview(content)[place.stop :])
    return digest.hexdigest().encode("ascii")


def _seal_place(content: bytes) -> slice:
    """Where the 64 characters of the seal are: after its name, its type and its length."""
    start = content.index(b"seal") + 12
    return slice(start, start + len(_NO_SEAL))
