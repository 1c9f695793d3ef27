"""What a dataset folder holds: the case files are the ledger."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

from braidcast.dataset.case_file import DamagedFile, read_case
from braidcast.dataset.case_record import CaseRecord
from braidcast.dataset.folder import DatasetFolder
from braidcast.errors import InputError


@dataclass(frozen=True)
class Ledger:
    """The cases of a folder that have a file, by their index; all others are waiting."""

    cases: int
    records: dict[int, CaseRecord]
    """Finished and failed cases, without their arrays."""
    damaged: dict[int, str]
    """Cases whose file is not what was written, and why: they are waiting too."""

    @classmethod
    def read(cls, folder: DatasetFolder) -> Ledger:
        """Read all case files.

        ``InputError`` if one of them belongs to another plan or to a newer braidcast.
        """
        records, damaged = {}, {}
        for index in _present(folder):
            try:
                record = read_result(folder, index, arrays=False)
            except FileNotFoundError:
                continue
            except DamagedFile as error:
                damaged[index] = str(error)
            except OSError as error:
                damaged[index] = f"{error.filename} cannot be read: {error.strerror}"
            else:
                records[index] = record
        return cls(len(folder), records, damaged)

    def first(self, cases: int | None) -> Ledger:
        """Of the first ``cases`` alone; of all if None."""
        if cases is None:
            return self
        count = min(cases, self.cases)
        records = {index: record for index, record in self.records.items() if index < count}
        damaged = {index: why for index, why in self.damaged.items() if index < count}
        return Ledger(count, records, damaged)

    @property
    def finished(self) -> list[CaseRecord]:
        return [record for record in self.records.values() if record.finished]

    @property
    def failed(self) -> list[CaseRecord]:
        return [record for record in self.records.values() if not record.finished]

    @property
    def waiting(self) -> int:
        """How many cases have neither result nor failure."""
        return self.cases - len(self.records)

    @property
    def reasons(self) -> list[tuple[str, int]]:
        """Why cases failed, and how many did so, the most frequent first."""
        return Counter(record.reason for record in self.failed).most_common()


def read_result(folder: DatasetFolder, index: int, *, arrays: bool = True) -> CaseRecord:
    """The file of case ``index``, as ``read_case`` reads it, checked to be of this case.

    Raises ``InputError`` if it is of another plan, ``DamagedFile`` if of another case.
    """
    path = folder.case_file(index)
    record = read_case(path, arrays=arrays)
    if record.plan_id != folder.plan_id:
        raise InputError(
            f"{path} belongs to another plan: its plan id = {record.plan_id} must be "
            f"{folder.plan_id}, that of {folder.path}"
        )
    if record.index != index:
        raise DamagedFile(f"{path} is case {record.index} under the name of another")
    return record


def _present(folder: DatasetFolder) -> Iterator[int]:
    """Cases that have a file; one look at the folder, for each costs a round trip on a cluster."""
    try:
        names = {path.name for path in folder.cases_folder.iterdir()}
    except FileNotFoundError:
        return
    for index in range(len(folder)):
        if folder.case_file(index).name in names:
            yield index
