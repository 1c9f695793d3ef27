"""Two runs of the same plan, put together."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

from braidcast.atomic import TEMPORARY, write_atomically
from braidcast.dataset.folder import DatasetFolder
from braidcast.dataset.ledger import Ledger
from braidcast.errors import InputError


@dataclass(frozen=True)
class Merged:
    """The new folder, and the cases of which the two runs have different results."""

    folder: DatasetFolder
    ledger: Ledger
    different: tuple[int, ...]


def merge(first: DatasetFolder, second: DatasetFolder, path: str | Path) -> Merged:
    """Put the cases of two runs of one plan into the new folder ``path``, whole or not at all.

    Of a case that both have, a finished one goes before a failed one, and the first run's before
    the second's. ``InputError`` if the plans differ or if ``path`` exists.
    """
    if first.plan_id != second.plan_id:
        raise InputError(
            f"{second.path} is of another plan: its plan id = {second.plan_id} must be "
            f"{first.plan_id}, that of {first.path}"
        )
    path = Path(path)
    if path.exists():
        raise InputError(f"output = {path} exists already, must be a new name")
    if not path.parent.is_dir():
        raise InputError(f"output = {path} must be in a folder that exists, {path.parent} does not")
    ledgers = Ledger.read(first), Ledger.read(second)
    different = tuple(index for index in range(len(first)) if _differ(*ledgers, index))
    with tempfile.TemporaryDirectory(prefix=TEMPORARY, dir=path.parent) as work:
        made = Path(work) / path.name
        made.mkdir()
        for name in ("plan.toml", "cases.csv", "dataset.json"):
            write_atomically(made / name, (first.path / name).read_bytes())
        copy = DatasetFolder.open(made)
        copy.cases_folder.mkdir()
        for index in range(len(first)):
            source = _better(first, second, *ledgers, index)
            if source is not None:
                content = source.case_file(index).read_bytes()
                write_atomically(copy.case_file(index), content)
        made.rename(path)
    merged = DatasetFolder.open(path)
    return Merged(merged, Ledger.read(merged), different)


def _differ(first: Ledger, second: Ledger, index: int) -> bool:
    one, other = first.records.get(index), second.records.get(index)
    if one is None or other is None or not (one.finished and other.finished):
        return False
    return one.checksum != other.checksum


def _better(
    first: DatasetFolder, second: DatasetFolder, a: Ledger, b: Ledger, index: int
) -> DatasetFolder | None:
    """The folder whose file of the case is to be taken, if any has one."""
    one, other = a.records.get(index), b.records.get(index)
    if one is None or (other is not None and other.finished and not one.finished):
        return None if other is None else second
    return first
