"""The folder of a dataset: its plan, the cases drawn from it, and where their results go.

``plan.toml`` (as it was given) and ``cases.csv`` are written first, ``dataset.json`` with their
checksums last: a folder without it is no dataset, and a plan that was edited is noticed.
"""

from __future__ import annotations

import json
from bisect import bisect_right
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from filelock import FileLock, Timeout
from numpy.typing import NDArray

from braidcast import __version__
from braidcast.atomic import TEMPORARY, write_atomically
from braidcast.case import Case
from braidcast.dataset.draw import DrawProgress, discrepancies, draw
from braidcast.dataset.plan import Plan
from braidcast.errors import InputError
from braidcast.results_folder import check_folder

#: What a dataset folder looks like; a folder of a higher number is not for this braidcast.
STORE_VERSION = 1

_PLAN, _CASES, _STAMP, _LOCK = "plan.toml", "cases.csv", "dataset.json", "run.lock"


@dataclass(frozen=True, eq=False)
class DatasetFolder:
    """A dataset folder, opened and verified. Build it with ``create`` or ``open``."""

    path: Path
    plan: Plan
    values: NDArray[np.float64] = field(repr=False)
    """Values of the plan's ranges in each case, (cases, ranges)."""
    plan_id: str
    """Names the plan and its cases: 16 hexadecimal digits, the same in every copy."""
    replaced: int
    """How many samples were infeasible and gave way to others."""
    is_new: bool = False
    """Whether ``create`` has just made it, rather than found it."""

    @classmethod
    def create(
        cls, plan: Plan, path: str | Path, progress: DrawProgress | None = None
    ) -> DatasetFolder:
        """Draw the cases of ``plan`` into the folder ``path``, made if missing, and open it.

        A folder that already holds this plan is opened as it is. ``InputError``, and nothing
        changed, if it holds anything else, cannot be written, or the plan has no feasible cases.
        """
        if path != "" and (Path(path) / _STAMP).is_file():
            folder = cls.open(path)
            if folder.plan.text != plan.text:
                raise InputError(
                    f"output folder = {path} holds another plan, must be empty or a new name"
                )
            return folder
        _check_free(path)
        path = Path(path)
        drawn = draw(plan, progress)
        text, table = plan.text.encode(), _table(plan, drawn.values)
        stamp = {
            "store_version": STORE_VERSION,
            "braidcast": __version__,
            "plan_sha256": sha256(text).hexdigest(),
            "cases_sha256": sha256(table).hexdigest(),
            "replaced": drawn.replaced,
        }
        files = {_PLAN: text, _CASES: table, _STAMP: (json.dumps(stamp, indent=2) + "\n").encode()}
        for name, content in files.items():
            _check_same(path / name, content)
        path.mkdir(exist_ok=True)
        for name, content in files.items():
            write_atomically(path / name, content)
        return replace(cls.open(path), is_new=True)

    @classmethod
    def open(cls, path: str | Path) -> DatasetFolder:
        """Open the dataset at ``path``; ``InputError`` if it is none, or no longer what it was."""
        path = Path(path)
        if not path.is_dir():
            what = "is a file" if path.exists() else "does not exist"
            raise InputError(f"dataset folder = {path} {what}, must be a folder of a dataset")
        stamp = _stamp(path)
        plan_text, table = _read(path / _PLAN), _read(path / _CASES)
        for name, content in ((_PLAN, plan_text), (_CASES, table)):
            key = f"{name.partition('.')[0]}_sha256"
            if sha256(content).hexdigest() != stamp.get(key):
                raise InputError(
                    f"{path / name} was changed after its cases were drawn, must be as "
                    "`braidcast dataset create` wrote it; create a new dataset for a new plan"
                )
        plan = Plan.from_toml(path / _PLAN)
        plan_id = sha256(plan_text + table).hexdigest()[:16]
        return cls(path, plan, _values(path, plan, table), plan_id, stamp["replaced"])

    def __len__(self) -> int:
        return self.plan.cases

    def case(self, index: int) -> Case:
        """Case ``index``, from 0."""
        return self.plan.case(self.values[self._checked(index)])

    def case_file(self, index: int) -> Path:
        """Where the results of case ``index`` are, once there are any."""
        return self.cases_folder / f"{self._checked(index):05d}.nc"

    def is_test(self, index: int) -> bool:
        """Whether case ``index`` is of the test set, and so of no training set."""
        return self._checked(index) < self.plan.tests

    def subset(self, index: int) -> int:
        """Size of the smallest subset that case ``index`` is in."""
        sizes = (*self.plan.subsets, self.plan.cases)
        return sizes[bisect_right(sizes, self._checked(index))]

    @property
    def discrepancies(self) -> dict[int, float]:
        """Centred discrepancy of each subset and of all cases, by their size."""
        return discrepancies(self.plan, self.values)

    @property
    def cases_folder(self) -> Path:
        """The folder of the case files; missing until there is one."""
        return self.path / "cases"

    @property
    def crimped(self) -> Path:
        """The folder of crimped devices, the ``cache`` of a simulation; may be missing."""
        return self.path / "crimped"

    @contextmanager
    def lock(self) -> Iterator[None]:
        """Keep other runs out of the folder; ``InputError`` if one is in it.

        The operating system lets go of the lock when its holder dies, however it dies.
        """
        lock = FileLock(self.path / _LOCK, timeout=0)
        try:
            lock.acquire()
        except Timeout:
            raise InputError(f"another run is working in {self.path}") from None
        try:
            yield
        finally:
            lock.release()

    def _checked(self, index: int) -> int:
        if not 0 <= index < len(self):
            raise IndexError(f"case {index} of {len(self)}")
        return index


def _table(plan: Plan, values: NDArray[np.float64]) -> bytes:
    """cases.csv: one row a case; the numbers are exact."""
    sizes = (*plan.subsets, plan.cases)
    lines = [",".join(["case", "test", "subset", *(p.column for p in plan.ranges)])]
    for case, row in enumerate(values.tolist()):
        subset = sizes[bisect_right(sizes, case)]
        lines.append(",".join([f"{case},{int(case < plan.tests)},{subset}", *map(repr, row)]))
    return ("\n".join(lines) + "\n").encode()


def _values(path: Path, plan: Plan, table: bytes) -> NDArray[np.float64]:
    try:
        rows = [line.split(",")[3:] for line in table.decode().splitlines()[1:]]
        return np.array(rows, dtype=float).reshape(plan.cases, len(plan.ranges))
    except ValueError:
        raise InputError(
            f"{path / _CASES} must have a number for each of the {plan.cases} cases and "
            f"{len(plan.ranges)} ranges of its plan"
        ) from None


def _stamp(path: Path) -> dict[str, Any]:
    if not (path / _STAMP).is_file():
        raise InputError(
            f"dataset folder = {path} is not a dataset, must have a {_STAMP} as "
            "`braidcast dataset create` writes it"
        )
    try:
        stamp = json.loads(_read(path / _STAMP))
        version, replaced = stamp["store_version"], stamp.get("replaced")
    except (ValueError, KeyError, TypeError, RecursionError):
        version = replaced = None
    if isinstance(version, int) and version > STORE_VERSION:
        raise InputError(
            f"{path / _STAMP}: store_version = {version} must be at most {STORE_VERSION}: "
            "the dataset was written by a newer braidcast"
        )
    if version != STORE_VERSION or not isinstance(replaced, int):
        raise InputError(
            f"{path / _STAMP} is damaged, must be as `braidcast dataset create` wrote it"
        )
    return stamp


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror or error}") from None


def _check_free(path: str | Path) -> None:
    """Raise ``InputError`` if the dataset could not be put at ``path``."""
    check_folder(path)
    # A creation that was cut short leaves nothing but these.
    ours = (_PLAN, _CASES)
    inside = sorted(p.name for p in Path(path).iterdir()) if Path(path).exists() else []
    foreign = [n for n in inside if n not in ours and not n.startswith(TEMPORARY)]
    if foreign:
        raise InputError(f"output folder = {path} holds {foreign[0]}, must be empty or a new name")


def _check_same(path: Path, content: bytes) -> None:
    """A file of a creation that was cut short is written again; any other is not ours."""
    if path.exists() and _read(path) != content:
        raise InputError(f"{path} is there already with other contents, must be out of the way")
