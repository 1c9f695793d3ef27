"""What a worker does with one case: simulate it and write its file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from braidcast.case import Case
from braidcast.dataset.case_file import DamagedFile, write_case
from braidcast.dataset.case_record import CaseRecord, Origin, failure, record
from braidcast.dataset.folder import DatasetFolder
from braidcast.dataset.ledger import read_result
from braidcast.deployment.result import Deployment
from braidcast.deployment.simulate import simulate
from braidcast.errors import InputError

Deploy = Callable[[Case, Path], Deployment]
"""From a case and the folder that keeps crimped devices to a deployment."""

_LONGEST_REASON = 300


@dataclass(frozen=True)
class Job:
    """The dataset that workers work on, and how: all that they are sent."""

    folder: Path
    plan_id: str
    deploy: Deploy


@dataclass(frozen=True)
class Done:
    """What a worker says of a case whose file is written."""

    index: int
    finished: bool
    reason: str
    cpu_seconds: float


def by_finite_elements(case: Case, crimped: Path) -> Deployment:
    """The deployment that datasets are made of."""
    return simulate(case, cache=crimped)


def do_case(job: Job, index: int) -> Done:
    """Simulate case ``index`` and write its file; a case that fails gets a file that says so.

    Raises ``OSError`` if the file cannot be written.
    """
    folder = _opened(job.folder, job.plan_id)
    already = _already_finished(folder, index)
    if already is not None:
        return _done(already)
    origin = origin_of(folder, index)
    try:
        result = record(job.deploy(folder.case(index), folder.crimped), origin)
    except Exception as error:  # whatever goes wrong in a case is that case's failure
        result = failure(origin, reason_of(error))
    write_case(folder.case_file(index), result, origin)
    return _done(result)


def give_up(folder: DatasetFolder, index: int, reason: str) -> Done:
    """Record that a case failed without a word of its own."""
    already = _already_finished(folder, index)
    if already is not None:
        return _done(already)
    origin = origin_of(folder, index)
    result = failure(origin, reason)
    write_case(folder.case_file(index), result, origin)
    return _done(result)


def origin_of(folder: DatasetFolder, index: int) -> Origin:
    """What case ``index`` of the folder is."""
    parameters = tuple(zip(folder.plan.ranges, folder.values[index].tolist(), strict=True))
    return Origin(folder.plan_id, index, folder.case(index).to_toml(), parameters)


def reason_of(error: BaseException) -> str:
    """What went wrong, in one line that is not too long."""
    text = " ".join(f"{type(error).__name__}: {error}".split())
    return text if len(text) <= _LONGEST_REASON else text[: _LONGEST_REASON - 3] + "..."


@lru_cache(maxsize=4)
def _opened(path: Path, plan_id: str) -> DatasetFolder:
    folder = DatasetFolder.open(path)
    if folder.plan_id != plan_id:
        raise InputError(f"{path} holds another plan than when the run began")
    return folder


def _already_finished(folder: DatasetFolder, index: int) -> CaseRecord | None:
    """The file of a worker that died, or was lost from sight, once it had written it."""
    try:
        found = read_result(folder, index, arrays=False)
    except (OSError, DamagedFile):
        return None
    return found if found.finished else None


def _done(result: CaseRecord) -> Done:
    cpu_seconds = float(result.values.get("cpu_seconds", 0.0))
    return Done(result.index, result.finished, result.reason, cpu_seconds)
