"""Whatever dies, fills up or is spoilt: a clear sentence, an intact store, and the next run ends
as if nothing had been."""

import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import cloudpickle
import pytest
from distributed import LocalCluster

from braidcast import Case, Deployment, InputError
from braidcast.dataset import case_file
from braidcast.dataset.case_file import write_case
from braidcast.dataset.case_record import failure
from braidcast.dataset.cluster import RunStopped
from braidcast.dataset.folder import DatasetFolder
from braidcast.dataset.ledger import Ledger
from braidcast.dataset.plan import Plan
from braidcast.dataset.progress import Progress
from braidcast.dataset.run import run
from braidcast.dataset.work import Deploy, Job, by_finite_elements, do_case, origin_of

# Workers cannot import test modules.
cloudpickle.register_pickle_by_value(sys.modules[__name__])

posix = pytest.mark.skipif(os.name != "posix", reason="signals and limits as POSIX has them")


def files(folder: DatasetFolder) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.cases_folder.iterdir()}


def results(folder: DatasetFolder) -> dict[int, tuple[str, str, str]]:
    """Status, reason and checksum of every case that is done."""
    records = Ledger.read(folder).records
    return {index: (r.status, r.reason, r.checksum) for index, r in records.items()}


def do_all(folder: DatasetFolder, deploy: Deploy) -> None:
    folder.cases_folder.mkdir(exist_ok=True)
    for index in range(len(folder)):
        do_case(Job(folder.path, folder.plan_id, deploy), index)


def deadly(pretended: Deploy, always: float, once: float, case: Case, crimped: Path) -> Deployment:
    """Kills its worker in the case of one eta always, in that of another only the first time."""
    trace = crimped.parent / f"simulated_{case.site.eta}"
    first = not trace.exists()
    with trace.open("a") as stream:
        stream.write("x")
    if case.site.eta == always or (case.site.eta == once and first):
        os.kill(os.getpid(), signal.SIGKILL)
    return pretended(case, crimped)


@posix
@pytest.mark.slow
def test_a_worker_killed_by_its_case(folder: DatasetFolder, pretended: Deploy) -> None:
    etas = [folder.case(index).site.eta for index in range(6)]
    deploy = partial(deadly, pretended, etas[1], etas[4])
    report = run(folder, workers=2, deploy=deploy)
    assert sorted(done.index for done in report.done) == list(range(6))
    ledger = Ledger.read(folder)
    assert [record.index for record in ledger.failed] == [1]
    assert ledger.failed[0].reason == "its worker died twice while simulating it"
    assert len(ledger.finished) == 5
    times = [len((folder.path / f"simulated_{eta}").read_text()) for eta in etas]
    assert times == [1, 2, 1, 1, 2, 1]


def over_the_limit(pretended: Deploy, full: float, case: Case, crimped: Path) -> Deployment:
    """From the case of one eta on, its worker may write no file of more than a thousand bytes."""
    import resource

    if case.site.eta == full:
        resource.setrlimit(resource.RLIMIT_FSIZE, (1000, resource.RLIM_INFINITY))
    return pretended(case, crimped)


@posix
def test_a_disk_that_takes_no_more(folder: DatasetFolder, pretended: Deploy) -> None:
    deploy = partial(over_the_limit, pretended, folder.case(3).site.eta)
    with pytest.raises(OSError, match="File too large") as caught:
        run(folder, workers=1, deploy=deploy)
    assert caught.value.filename == str(folder.case_file(3))
    assert set(files(folder)) == {"00000.nc", "00001.nc", "00002.nc"}
    assert len(Ledger.read(folder).finished) == 3


def test_a_crimped_device_that_cannot_be_kept(folder: DatasetFolder, scheduler: str) -> None:
    folder.crimped.write_text("in the way")
    with pytest.raises(OSError, match="could not be kept") as caught:
        run(folder, scheduler=scheduler)
    assert caught.value.filename == str(folder.crimped)
    assert files(folder) == {}


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:5000])


def garble(path: Path) -> None:
    path.write_bytes(path.read_bytes()[::-1])


def swap(path: Path) -> None:
    shutil.copy(path.with_name("00005.nc"), path)


@pytest.mark.parametrize("spoil", [cut, garble, swap])
def test_a_spoilt_case_file_is_done_again(
    folder: DatasetFolder, pretended: Deploy, scheduler: str, spoil: Callable[[Path], None]
) -> None:
    do_all(folder, pretended)
    before = results(folder)
    spoil(folder.case_file(2))
    assert 2 not in results(folder) and Ledger.read(folder).waiting == 1
    said: list[str] = []
    report = run(folder, scheduler=scheduler, deploy=pretended, say=said.append)
    assert [done.index for done in report.done] == [2]
    assert said[0].startswith(str(folder.case_file(2))) and said[0].endswith("it is done again")
    assert results(folder) == before


def test_leftovers_of_killed_writers_are_removed(
    folder: DatasetFolder, pretended: Deploy, scheduler: str
) -> None:
    folder.cases_folder.mkdir()
    folder.crimped.mkdir()
    (folder.cases_folder / ".braidcast-00000.nc-0123456789ab").write_bytes(b"CDF")
    (folder.crimped / "crimped_0.npz.77.tmp").write_bytes(b"PK")
    run(folder, scheduler=scheduler, deploy=pretended)
    assert len(files(folder)) == 6 and list(folder.crimped.iterdir()) == []


def test_files_of_another_plan_are_not_touched(
    folder: DatasetFolder, pretended: Deploy, scheduler: str, tmp_path: Path
) -> None:
    other = DatasetFolder.create(
        Plan.from_text(folder.plan.text.replace("seed = 3", "seed = 4")), tmp_path / "other"
    )
    do_all(other, pretended)
    folder.cases_folder.mkdir()
    shutil.copy(other.case_file(2), folder.case_file(2))
    before = files(folder)
    with pytest.raises(InputError, match=f"belongs to another plan: .* {other.plan_id} must be"):
        run(folder, scheduler=scheduler, deploy=pretended)
    assert files(folder) == before


def test_files_of_a_newer_store_are_not_touched(
    folder: DatasetFolder, pretended: Deploy, scheduler: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder.cases_folder.mkdir()
    with monkeypatch.context() as later:
        later.setattr(case_file, "STORE_VERSION", 2)
        origin = origin_of(folder, 2)
        write_case(folder.case_file(2), failure(origin, "because"), origin)
    before = files(folder)
    with pytest.raises(InputError, match="00002.nc: store_version = 2 must be at most 1"):
        run(folder, scheduler=scheduler, deploy=pretended)
    assert files(folder) == before


def test_a_plan_edited_while_the_run_begins(
    folder: DatasetFolder, pretended: Deploy, scheduler: str
) -> None:
    with (folder.path / "plan.toml").open("a") as stream:
        stream.write("# and one more thing\n")
    with pytest.raises(InputError, match="plan.toml was changed after its cases were drawn"):
        run(folder, scheduler=scheduler, deploy=pretended)
    assert files(folder) == {}


def test_the_second_run_refuses(folder: DatasetFolder, pretended: Deploy, scheduler: str) -> None:
    refused: list[str] = []

    def another(progress: Progress) -> None:
        again = DatasetFolder.open(folder.path)
        with pytest.raises(InputError, match="another run is working in") as caught:
            run(again, scheduler=scheduler, deploy=pretended)
        refused.append(str(caught.value))

    run(folder, scheduler=scheduler, deploy=pretended, progress=another)
    assert len(refused) == 7 and len(Ledger.read(folder).finished) == 6


def test_a_scheduler_that_goes_away(folder: DatasetFolder, pretended: Deploy) -> None:
    with LocalCluster(
        n_workers=1,
        threads_per_worker=1,
        processes=False,
        protocol="tcp://",
        dashboard_address="127.0.0.1:0",
        memory_limit=None,
        silence_logs=50,
    ) as cluster:

        def leave(progress: Progress) -> None:
            if progress.done == 2:
                cluster.close()

        with pytest.raises(RunStopped, match="is gone; run again"):
            run(folder, scheduler=cluster.scheduler_address, deploy=pretended, progress=leave)
    done = Ledger.read(folder)
    assert 2 <= len(done.finished) <= 6 and not done.failed and not done.damaged


class Unknown:
    """What a worker cannot unpickle, as if braidcast were missing there."""

    def __reduce__(self) -> Any:
        return (eval, ("__import__('no_such_module')",))

    def __call__(self, case: Case, crimped: Path) -> Deployment:
        raise NotImplementedError


def test_workers_that_lack_something(folder: DatasetFolder, scheduler: str) -> None:
    with pytest.raises(RunStopped, match=r"a worker cannot do case \d: ModuleNotFoundError"):
        run(folder, scheduler=scheduler, deploy=Unknown())
    assert files(folder) == {}


@posix
def test_an_interrupt_ends_the_workers(folder: DatasetFolder, pretended: Deploy) -> None:
    def sleeps(case: Case, crimped: Path) -> Deployment:
        (crimped.parent / f"pid_{os.getpid()}").touch()
        time.sleep(600.0)
        raise NotImplementedError

    def interrupt() -> None:
        while not list(folder.path.glob("pid_*")):
            time.sleep(0.01)
        os.kill(os.getpid(), signal.SIGINT)

    thread = threading.Thread(target=interrupt)
    thread.start()
    with pytest.raises(KeyboardInterrupt):
        run(folder, workers=1, deploy=sleeps)
    thread.join()
    (worker,) = folder.path.glob("pid_*")
    with pytest.raises(ProcessLookupError):
        os.kill(int(worker.name.removeprefix("pid_")), 0)
    assert files(folder) == {}
    with folder.lock():
        pass


def start(folder: DatasetFolder) -> subprocess.Popen[str]:
    """The command in a session of its own, as a shell starts it."""
    return subprocess.Popen(
        [sys.executable, "-c", "from braidcast.cli import main; main()", "dataset", "run"]
        + [str(folder.path), "--workers", "2"],
        start_new_session=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def wait_for_cases(folder: DatasetFolder, count: int) -> None:
    until = time.monotonic() + 120.0
    while len(list(folder.cases_folder.glob("[0-9]*.nc"))) < count:
        assert time.monotonic() < until
        time.sleep(0.01)


def nobody_in(session: int) -> bool:
    """Whether all processes of the session have ended."""
    until = time.monotonic() + 20.0
    while time.monotonic() < until:
        try:
            os.killpg(session, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.05)
    return False


@posix
@pytest.mark.slow
def test_killed_in_every_way_and_then_finished(folder: DatasetFolder, tmp_path: Path) -> None:
    undisturbed = DatasetFolder.create(folder.plan, tmp_path / "undisturbed")
    do_all(undisturbed, by_finite_elements)
    expected = results(undisturbed)
    assert len(expected) == 6 and sum(bool(r[2]) for r in expected.values()) >= 3

    for done, number, everybody, code in [
        (1, signal.SIGINT, True, 130),
        (2, signal.SIGKILL, True, -signal.SIGKILL),
        (3, signal.SIGKILL, False, -signal.SIGKILL),
    ]:
        with start(folder) as process:
            wait_for_cases(folder, done)
            before = files(folder)
            if everybody:
                os.killpg(process.pid, number)
            else:
                process.send_signal(number)
            out, err = process.communicate(timeout=60)
        assert process.returncode == code, err
        assert "Traceback" not in err and "distributed" not in err
        assert out == "" and (number != signal.SIGINT or err.endswith("braidcast: interrupted\n"))
        assert nobody_in(process.pid)
        for name, content in before.items():
            if not name.startswith("."):
                assert (folder.cases_folder / name).read_bytes() == content
    with start(folder) as process:
        out, err = process.communicate(timeout=120)
    assert process.returncode == 0, err
    assert results(folder) == expected
    assert set(files(folder)) == {f"{index:05d}.nc" for index in range(6)}
    assert "waiting               0" in out
