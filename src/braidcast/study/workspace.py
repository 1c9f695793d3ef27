"""The study's folder and its dataset, as the stages see them."""

from __future__ import annotations

import hashlib
import io
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from braidcast.atomic import write_atomically
from braidcast.case import Case
from braidcast.dataset.folder import DatasetFolder
from braidcast.dataset.ledger import Ledger
from braidcast.surrogate.training_set import Simulations


@dataclass(frozen=True)
class Study:
    """``home``: the folder of all that is written; ``dataset``: that of the simulations."""

    home: Path
    dataset: Path

    def simulations(self, cases: int) -> Simulations:
        """The finished ones of the first ``cases``."""
        return _simulations(self.dataset, cases)

    def data_ids(self, counts: Iterable[int]) -> dict[int, str]:
        """A name for the results of the first so many cases: other results have another one."""
        folder = DatasetFolder.open(self.dataset)
        results = [
            (index, f"{index} {record.checksum} {record.reason}\n")
            for index, record in sorted(Ledger.read(folder).records.items())
        ]

        def name(count: int) -> str:
            text = "".join(result for index, result in results if index < count)
            return hashlib.sha256((folder.plan_id + text).encode()).hexdigest()

        return {count: name(count) for count in counts}

    def table(self, name: str) -> pd.DataFrame:
        """The table ``tables/name.csv`` of an earlier stage."""
        return pd.read_csv(self.home / "tables" / f"{name}.csv")

    def write_table(self, name: str, frame: pd.DataFrame) -> str:
        """Write ``tables/name.csv``, numbers to seven digits; returns where."""
        text = frame.to_csv(index=False, float_format="%.7g", lineterminator="\n")
        return self.write(f"tables/{name}.csv", text.encode())

    def arrays(self, name: str) -> Mapping[str, NDArray[Any]]:
        """Arrays of the file ``data/name.npz``."""
        with np.load(self.home / "data" / f"{name}.npz") as stored:
            return dict(stored)

    def write_arrays(self, name: str, **arrays: Any) -> str:
        """Write ``data/name.npz``; returns where."""
        stream = io.BytesIO()
        np.savez(stream, **arrays)
        return self.write(f"data/{name}.npz", stream.getvalue())

    def write(self, name: str, content: bytes) -> str:
        """Write a file below the folder, whole or not at all; returns its name."""
        self.place(name)
        write_atomically(self.home / name, content)
        return name

    def place(self, name: str) -> Path:
        """Where the file of this name is, in a folder that is there."""
        path = self.home / name
        path.parent.mkdir(parents=True, exist_ok=True)
        return path


def case_of(text: Any) -> Case:
    """The case that an array of a data file holds as the text of its file."""
    import tomllib

    return Case.from_dict(tomllib.loads(str(text)))


@lru_cache(maxsize=4)
def _simulations(dataset: Path, cases: int) -> Simulations:
    return Simulations.of(DatasetFolder.open(dataset), finished_only=True, cases=cases)
