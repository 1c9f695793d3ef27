"""Running a dataset: exactly the cases without a result, each once, each the same anywhere."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from braidcast import Case, Deployment, InputError
from braidcast.dataset import cluster
from braidcast.dataset.case_file import read_case
from braidcast.dataset.folder import DatasetFolder
from braidcast.dataset.ledger import Ledger
from braidcast.dataset.progress import Count, Progress, RunReport
from braidcast.dataset.run import run
from braidcast.dataset.work import Deploy, Done, Job, by_finite_elements, do_case


def checksums(folder: DatasetFolder) -> dict[int, str]:
    return {i: r.checksum for i, r in Ledger.read(folder).records.items() if r.finished}


def do_here(folder: DatasetFolder, deploy: Deploy, *indices: int) -> list[Done]:
    """Cases done by this process, without workers."""
    folder.cases_folder.mkdir(exist_ok=True)
    return [do_case(Job(folder.path, folder.plan_id, deploy), index) for index in indices]


@pytest.mark.slow
def test_processes_of_its_own(folder: DatasetFolder, pretended: Deploy, tmp_path: Path) -> None:
    said: list[str] = []
    seen: list[Progress] = []
    report = run(folder, workers=2, deploy=pretended, progress=seen.append, say=said.append)
    assert sorted(done.index for done in report.done) == list(range(6))
    assert all(done.finished and done.cpu_seconds == 0.5 for done in report.done)
    assert report.workers == 2
    assert report.overhead == pytest.approx(report.wall_seconds * 2 / 3.0)
    assert [p.done for p in seen] == list(range(7)) and seen[-1].finished == 6
    assert {p.cases for p in seen} == {6} and seen[-1].failed == 0 and seen[-1].seconds_left == 0.0

    elsewhere = DatasetFolder.create(folder.plan, tmp_path / "elsewhere")
    do_here(elsewhere, pretended, *reversed(range(6)))
    assert checksums(folder) == checksums(elsewhere)
    assert len(set(checksums(folder).values())) == 6
    for index in range(6):
        found = read_case(folder.case_file(index))
        assert found.index == index and found.toml == folder.case(index).to_toml()
        expected = pretended(folder.case(index), folder.crimped)
        np.testing.assert_array_equal(
            found.values["positions"], expected.positions.astype("f4"), str(index)
        )
    assert {path.name for path in folder.cases_folder.iterdir()} == {
        f"{index:05d}.nc" for index in range(6)
    }


def test_only_what_has_no_result(folder: DatasetFolder, pretended: Deploy, scheduler: str) -> None:
    def never(case: Case, crimped: Path) -> Deployment:
        raise AssertionError("was done before")

    do_here(folder, pretended, 0, 2, 3)
    kept = [folder.case_file(index).stat().st_mtime_ns for index in (0, 2, 3)]
    seen: list[Progress] = []
    report = run(folder, scheduler=scheduler, deploy=pretended, progress=seen.append)
    assert sorted(done.index for done in report.done) == [1, 4, 5]
    assert [folder.case_file(index).stat().st_mtime_ns for index in (0, 2, 3)] == kept
    assert (seen[0].finished, seen[0].done, seen[0].to_do) == (3, 0, 3)
    assert (seen[-1].finished, seen[-1].done, seen[-1].to_do) == (6, 3, 3)
    again = run(folder, scheduler=scheduler, deploy=never)
    assert again.done == () and again.workers == 0 and math.isnan(again.overhead)


def test_failures_stay_until_they_are_retried(
    folder: DatasetFolder, pretended: Deploy, scheduler: str
) -> None:
    def fails(case: Case, crimped: Path) -> Deployment:
        if case.site.eta < 0.4:
            raise ZeroDivisionError("division\nby zero")
        deployment = pretended(case, crimped)
        if case.site.eta > 0.6:
            return replace(deployment, converged=False, reason="the step became too small")
        return deployment

    eta = folder.values[:, [p.name for p in folder.plan.ranges].index("site_eta")]
    report = run(folder, scheduler=scheduler, deploy=fails)
    assert len(report.done) == 6
    ledger = Ledger.read(folder)
    assert len(ledger.finished) == ((eta >= 0.4) & (eta <= 0.6)).sum() > 0
    assert dict(ledger.reasons) == {
        "ZeroDivisionError: division by zero": (eta < 0.4).sum(),
        "the step became too small": (eta > 0.6).sum(),
    }
    assert ledger.waiting == 0
    assert run(folder, scheduler=scheduler, deploy=pretended).done == ()
    retried = run(folder, scheduler=scheduler, deploy=pretended, retry_failed=True)
    assert {done.index for done in retried.done} == {r.index for r in ledger.failed}
    assert len(Ledger.read(folder).finished) == 6


def test_a_worker_that_comes_late_finds_the_case_done(
    folder: DatasetFolder, pretended: Deploy
) -> None:
    def never(case: Case, crimped: Path) -> Deployment:
        raise AssertionError("was done before")

    first = do_here(folder, pretended, 1)
    assert do_here(folder, never, 1) == first


def test_by_finite_elements_the_crimped_device_is_shared(folder: DatasetFolder) -> None:
    first, second = do_here(folder, by_finite_elements, 0, 1)
    assert first.cpu_seconds > 0.0
    assert len(list(folder.crimped.glob("crimped_*.npz"))) == 1
    results = checksums(folder)
    for index in (1, 0):
        folder.case_file(index).unlink()
        do_here(folder, by_finite_elements, index)
    assert checksums(folder) == results and (first.finished or second.finished)


@pytest.mark.parametrize(
    ("workers", "scheduler", "says"),
    [
        (0, None, "workers = 0 must be a whole number above 0"),
        (2, "tcp://127.0.0.1:1", "must be at most one of the two"),
        (None, "nonsense", "scheduler = nonsense must be the address of a running Dask scheduler"),
        (None, "tcp://127.0.0.1:1", "Timed out"),
    ],
)
def test_workers_that_cannot_be(
    folder: DatasetFolder,
    pretended: Deploy,
    monkeypatch: pytest.MonkeyPatch,
    workers: int | None,
    scheduler: str | None,
    says: str,
) -> None:
    monkeypatch.setattr(cluster, "_PATIENCE", 0.5)
    with pytest.raises(InputError, match=says):
        run(folder, workers=workers, scheduler=scheduler, deploy=pretended)
    with folder.lock():
        pass


def test_rate_and_expected_end(monkeypatch: pytest.MonkeyPatch) -> None:
    count = Count(cases=10, finished=2, failed=1, to_do=7)
    start = count.progress(workers=0)
    assert start.rate == 0.0 and start.seconds_left is None
    count.add(Done(3, True, "", 4.0))
    count.add(Done(4, False, "", 2.0))
    half = replace(count.progress(workers=2), seconds=6.0)
    assert (half.finished, half.failed, half.done) == (3, 2, 2)
    assert half.rate == 1200.0 and half.seconds_left == 15.0
    count.progress(workers=1)
    assert count.workers == 2
    assert RunReport(tuple(count.done), 9.0, 2).overhead == 3.0
