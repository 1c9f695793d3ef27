"""The case that a planner is opened with, and what the page may make of it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from braidcast.case import Case, Progress
from braidcast.case_tables import FILE_KEYS, VesselFile
from braidcast.errors import InputError
from braidcast.toml_file import parse, read_text

#: examples/success.toml, which an installed braidcast does not bring along.
DEFAULT = {
    "title": "Success in a gently curved vessel",
    "vessel": {"P1": [0.0, 15.0, 25.0], "diameter": 3.0},
    "aneurysm": {"diameter": 7.0, "protrusion": 0.5},
    "site": {"eta": 0.5},
    "wall": {"friction": 0.1},
}

#: A simulation of more nodes than this takes hours: not what a page should start.
MOST_NODES = 20_000

_OWN = ("vessel", "aneurysm", "device")


@dataclass(frozen=True)
class OpenedCase:
    """``case`` with its files found, and its ``tables`` as the page sees them.

    In the tables every default is filled in, files are named as in the case file, and the site of
    a vessel about a Bézier curve is given by η.
    """

    case: Case
    tables: Mapping[str, Any]

    @classmethod
    def default(cls) -> OpenedCase:
        return cls._of(Case.from_dict(DEFAULT), {})

    @classmethod
    def from_toml(cls, path: Path, progress: Progress | None = None) -> OpenedCase:
        """That of the case file at ``path``; ``InputError`` says what is wrong in it."""
        case = Case.from_toml(path, progress)
        return cls._of(case, parse(read_text(path, "case file", "tables"), "case file"))

    @classmethod
    def _of(cls, case: Case, written: Mapping[str, Any]) -> OpenedCase:
        tables = json.loads(json.dumps(case.to_dict()))
        for table, key in FILE_KEYS:
            if key in written.get(table, {}):
                tables[table][key] = written[table][key]
        if not isinstance(case.vessel, VesselFile):
            tables["site"] = {"eta": case.eta, "crimped_radius": case.crimped_radius}
        return cls(case, tables)

    @property
    def has_surface(self) -> bool:
        """Whether the vessel is that of a surface's file."""
        return isinstance(self.case.vessel, VesselFile)

    def posted(self, tables: Mapping[str, Any]) -> Case:
        """The case of tables that somebody sent; ``InputError`` says what is wrong in them.

        They name no files but those of the opened case, whose vessel, aneurysm and device they
        then must have: no other file is read, and none is written.
        """
        found = dict(tables)
        if self.has_surface:
            for name in _OWN:
                if found.get(name) != self.tables.get(name):
                    raise InputError(
                        f"{name} must be that of the case the planner was opened with: in a vessel "
                        "from a surface only the site, the wall and the title may be others"
                    )
                found[name] = self.case.to_dict().get(name)
        for table, key in FILE_KEYS if not self.has_surface else ():
            values = found.get(table)
            if isinstance(values, Mapping) and values.get(key) is not None:
                raise InputError(
                    f"{table}.{key} must not be given here: the planner reads no file but those "
                    "of the case it was opened with"
                )
        case = Case.from_dict({name: value for name, value in found.items() if value is not None})
        nodes = case.braid.node_count
        if nodes > MOST_NODES:
            raise InputError(
                f"device.wires and device.segments give {nodes} nodes, must give at most "
                f"{MOST_NODES} in the planner; braidcast simulate takes any"
            )
        return case
