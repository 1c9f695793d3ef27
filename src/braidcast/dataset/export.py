"""Parts of a dataset for other programs: a table of all cases, the wires of one."""

from __future__ import annotations

import csv
import tempfile
from io import StringIO
from pathlib import Path

from braidcast.dataset.case_file import DamagedFile
from braidcast.dataset.fields import COSTS, NUMBERS
from braidcast.dataset.folder import DatasetFolder
from braidcast.dataset.ledger import Ledger, read_result
from braidcast.deployment.shape import nodes_of_wires, wire_distance
from braidcast.deployment.vtp import write_polylines
from braidcast.errors import InputError

_TEXTS = ("status", "outcome", "clinical_outcome", "reason")


def table(folder: DatasetFolder) -> bytes:
    """Content of a CSV file with a row for each planned case.

    Its columns: those of cases.csv, how the case went, its numbers with their units, and the
    checksum of its results; empty where a case has none. Numbers are exact.
    """
    ledger = Ledger.read(folder)
    numbers = (*NUMBERS, *COSTS)
    units = {known.name: f"_{known.unit}" for known in NUMBERS if known.unit != "1"}
    columns = [
        *("case", "test", "subset"),
        *(parameter.column for parameter in folder.plan.ranges),
        *_TEXTS,
        *(known.name + units.get(known.name, "") for known in numbers),
        "checksum",
    ]
    stream = StringIO()
    rows = csv.writer(stream, lineterminator="\n")
    rows.writerow(columns)
    for index in range(len(folder)):
        planned = [index, int(folder.is_test(index)), folder.subset(index)]
        row: list[object] = [*planned, *map(repr, folder.values[index].tolist())]
        record = ledger.records.get(index)
        if record is None:
            row += ["waiting", *[""] * (len(columns) - len(row) - 1)]
        else:
            row += [getattr(record, name) for name in _TEXTS]
            values = [record.values.get(known.name) for known in numbers]
            row += ["" if value is None else repr(float(value)) for value in values]
            row.append(record.checksum)
        rows.writerow(row)
    return stream.getvalue().encode("utf-8")


def wires(folder: DatasetFolder, index: int) -> bytes:
    """Content of a VTP file: the released wires of case ``index`` with values at the nodes.

    ``InputError`` if the dataset has no such case, or no result of it.
    """
    if not 0 <= index < len(folder):
        raise InputError(f"case = {index} must be a whole number from 0 to {len(folder) - 1}")
    try:
        record = read_result(folder, index)
    except FileNotFoundError:
        raise InputError(f"case = {index} is still waiting, must be a finished case") from None
    except DamagedFile as error:
        raise InputError(str(error)) from None
    if not record.finished:
        raise InputError(f"case = {index} failed ({record.reason}), must be a finished case")
    case = folder.case(index)
    braid = case.braid
    positions = record.values["positions"].astype(float)
    arrays = {
        "gap_mm": wire_distance(case, positions),
        "contact_force_N": record.values["contact_force"],
        "displacement_mm": positions - braid.positions,
        "rotation_vector_rad": record.values["rotation_vector"],
        "wire": braid.wire_of_node,
        "ring": braid.rings,
    }
    with tempfile.TemporaryDirectory() as work:
        file = Path(work) / "wires.vtp"
        write_polylines(file, positions, nodes_of_wires(braid), arrays)
        return file.read_bytes()
