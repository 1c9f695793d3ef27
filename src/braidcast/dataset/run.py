"""Run the cases of a dataset that have no result yet, on as many workers as there are."""

from __future__ import annotations

import secrets
import tempfile
import time
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError
from functools import partial
from pathlib import Path

from distributed import Client, Future, KilledWorker, as_completed
from threadpoolctl import threadpool_limits

from braidcast.atomic import TEMPORARY
from braidcast.case import Case
from braidcast.dataset.case_record import code_versions
from braidcast.dataset.cluster import RunStopped, connected
from braidcast.dataset.folder import DatasetFolder
from braidcast.dataset.ledger import Ledger
from braidcast.dataset.progress import Count, Progress, RunReport
from braidcast.dataset.work import (
    Deploy,
    Done,
    Job,
    by_finite_elements,
    do_case,
    give_up,
    reason_of,
)
from braidcast.deployment.crimp import CrimpingFailed, crimped_state
from braidcast.errors import InputError

#: Small, and yet it goes through all that is compiled.
_TINY = {
    "vessel": {"P1": [0.0, 15.0, 25.0], "diameter": 3.0},
    "aneurysm": {"diameter": 7.0, "protrusion": 0.5},
    "device": {"wires": 8, "segments": 12, "length": 6.0},
    "site": {"eta": 0.5},
}


def run(
    folder: DatasetFolder,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    retry_failed: bool = False,
    cases: int | None = None,
    deploy: Deploy = by_finite_elements,
    progress: Callable[[Progress], None] = lambda progress: None,
    say: Callable[[str], None] = lambda sentence: None,
) -> RunReport:
    """Simulate every case without a result; the results are the case files of the folder.

    ``cases``: only the first so many; a later run goes on from there.

    ``workers`` new processes of one thread each, by default one a core; or the Dask cluster whose
    ``scheduler`` is at this address. Failed cases stay failed unless ``retry_failed``. ``say`` is
    given sentences worth reading, ``progress`` how far the run is after every case.

    Raises ``InputError`` if another run works in the folder, if it holds files that are not its
    own, or if there is no such scheduler; ``OSError`` if a result cannot be written;
    ``RunStopped`` if the workers are gone. Whatever is raised, what was finished stays.
    """
    begin = time.perf_counter()
    with folder.lock():
        _remove_leftovers(folder)
        ledger = Ledger.read(folder).first(cases)
        for sentence in ledger.damaged.values():
            say(f"{sentence}; it is done again")
        others = sum(record.versions != code_versions() for record in ledger.finished)
        if others:
            say(f"{others} cases were finished by other versions than {code_versions()}")
        kept = {i: r for i, r in ledger.records.items() if r.finished or not retry_failed}
        waiting = [index for index in range(ledger.cases) if index not in kept]
        if not waiting:
            return RunReport((), 0.0, 0)
        folder.cases_folder.mkdir(exist_ok=True)
        job = Job(folder.path.resolve(), folder.plan_id, deploy)
        good = len(ledger.finished)
        try:
            with connected(workers, scheduler) as (client, dashboard):
                if dashboard:
                    say(f"dashboard: {dashboard}")
                if deploy is by_finite_elements:
                    say("compiling and crimping, once for all workers")
                    _prepare(folder, waiting[0])
                count = Count(ledger.cases, good, len(kept) - good, len(waiting))
                progress(count.progress(_threads(client)))
                for done in _work_off(client, folder, job, waiting):
                    count.add(done)
                    progress(count.progress(_threads(client)))
        finally:
            if scheduler is None:  # workers elsewhere may still be writing
                _remove_leftovers(folder)
    return RunReport(tuple(count.done), time.perf_counter() - begin, count.workers)


def _prepare(folder: DatasetFolder, index: int) -> None:
    """What is better done once than by all workers at the same time.

    Compiled functions are kept in numba's cache, which processes that compile at the same time
    can spoil; the crimped device in that of the dataset, if all cases have the same.
    """
    with tempfile.TemporaryDirectory() as cache:
        by_finite_elements(Case.from_dict(_TINY), Path(cache))
    crimps = [("site", "crimped_radius"), ("device",)]
    if any(p.path[: len(c)] == c for p in folder.plan.ranges for c in crimps):
        return
    case = folder.case(index)
    try:
        with threadpool_limits(1, "blas"):  # as in the simulation, for the same last digit
            crimped_state(case.braid, case.crimped_radius, cache=folder.crimped)
    except CrimpingFailed:
        return  # the workers will say so of every case
    if not any(folder.crimped.glob("crimped_*.npz")):
        raise OSError(None, "the crimped device could not be kept there", str(folder.crimped))


def _work_off(
    client: Client, folder: DatasetFolder, job: Job, waiting: list[int]
) -> Iterator[Done]:
    """Hand out cases; yields each when its file is written.

    A case whose worker died is tried once more after all others, alone, so that only a case that
    itself kills its worker is given up.
    """
    orphans = []
    for index, done in _handed_out(client, job, waiting):
        if done is None:
            orphans.append(index)
        else:
            yield done
    for orphan in orphans:
        for index, done in _handed_out(client, job, [orphan]):
            yield done or give_up(folder, index, "its worker died twice while simulating it")


def _handed_out(client: Client, job: Job, indices: list[int]) -> Iterator[tuple[int, Done | None]]:
    """Cases as they are done, in any order; None for one whose worker died."""
    token = secrets.token_hex(4)
    keys = {f"case-{index:06d}-{token}": index for index in indices}
    # No reference but this iterator's: Dask does again what is still asked for if a worker dies.
    completed = as_completed(
        client.map(partial(do_case, job), indices, key=list(keys), pure=False), loop=client.loop
    )
    for future in completed:
        yield keys[future.key], _result(future, keys[future.key])


def _result(future: Future, index: int) -> Done | None:
    try:
        return future.result()
    except KilledWorker:
        return None
    except (OSError, InputError, CancelledError):
        raise
    except Exception as error:
        reason = reason_of(error.__cause__ or error)  # Dask's own says only where it was
        raise RunStopped(f"a worker cannot do case {index}: {reason}") from None


def _threads(client: Client) -> int:
    return sum(client.nthreads().values())


def _remove_leftovers(folder: DatasetFolder) -> None:
    """Remove the temporary files of writers that were killed."""
    for leftover in [
        *folder.cases_folder.glob(f"{TEMPORARY}*"),
        *folder.crimped.glob("crimped_*.tmp"),
    ]:
        leftover.unlink(missing_ok=True)
