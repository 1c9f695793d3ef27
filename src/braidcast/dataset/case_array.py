"""One field of all cases, read from the case files as it is indexed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from braidcast.dataset.case_file import DamagedFile
from braidcast.dataset.case_record import CaseRecord
from braidcast.dataset.fields import Field
from braidcast.dataset.folder import DatasetFolder
from braidcast.dataset.netcdf3 import Place


class CaseArray:
    """Values of ``known`` by case and then by its own dimensions; NaN where a case has none.

    Indexed as numpy's arrays are. ``shape`` is that of the field in one case. Raises
    ``DamagedFile`` if a case file is no longer what it was when ``records`` were read.
    """

    def __init__(
        self,
        folder: DatasetFolder,
        records: dict[int, CaseRecord],
        known: Field,
        shape: tuple[int, ...],
    ) -> None:
        self.shape = (len(folder), *shape)
        self.dtype = np.dtype(known.dtype)
        self.ndim = len(self.shape)
        self._folder = folder
        self._places: dict[int, Place] = {}
        for index, record in records.items():
            place = record.places.get(known.name)
            if record.finished and place is not None:
                if place.shape != shape:
                    path = folder.case_file(index)
                    raise DamagedFile(f"{path}: {known.name} is {place.shape}, must be {shape}")
                self._places[index] = place

    def __getitem__(self, key: Any) -> NDArray[Any]:
        first, *others = key if isinstance(key, tuple) else (key,)
        cases = np.arange(self.shape[0])[first]
        values = np.full((cases.size, *self.shape[1:]), np.nan, dtype=self.dtype)
        for row, index in enumerate(np.atleast_1d(cases).tolist()):
            if index in self._places:
                values[row] = _read(self._folder.case_file(index), self._places[index])
        inside = (slice(None), *others) if cases.ndim else (0, *others)
        return values[inside]


def _read(path: Path, place: Place) -> NDArray[Any]:
    with path.open("rb") as stream:
        stream.seek(place.offset)
        content = stream.read(place.size)
    if len(content) != place.size:
        raise DamagedFile(f"{path} was cut off since the dataset was opened")
    return np.frombuffer(content, place.dtype).reshape(place.shape)
