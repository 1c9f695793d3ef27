"""braidcast dataset run, status, collect, export and merge: what they print, their exit codes."""

import signal
import subprocess
import sys
import textwrap
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from braidcast import Case, Deployment, InputError, cli, open_dataset
from braidcast.cli import run_display
from braidcast.dataset import run as running
from braidcast.dataset.cluster import RunStopped
from braidcast.dataset.folder import DatasetFolder
from braidcast.dataset.plan import Plan
from braidcast.dataset.progress import Count, RunReport
from braidcast.dataset.work import Deploy, Job, do_case

Run = Callable[..., int]

PLAN = """\
seed = 3
cases = 4
[case.vessel]
P1 = [0.0, { min = 5.0, max = 20.0 }, 25.0]
diameter = 3.0
[case.device]
wires = 12
segments = 24
[case.site]
eta = { min = 0.0, max = 1.0 }
"""


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Run:
    """Run the command in ``tmp_path`` and return its exit code."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(signal, "signal", lambda *_: signal.SIG_DFL)

    def run(*arguments: str | Path) -> int:
        monkeypatch.setattr(sys, "argv", ["braidcast", "dataset", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        return ended.value.code if isinstance(ended.value.code, int) else 0

    return run


@pytest.fixture
def folder(tmp_path: Path) -> DatasetFolder:
    return DatasetFolder.create(Plan.from_text(PLAN), tmp_path / "data")


@pytest.fixture
def deploy(deployment: Deployment) -> Deploy:
    """A simulation whose labels and CPU times differ from case to case; case 1 fails."""

    def deploy(case: Case, crimped: Path) -> Deployment:
        index = len(list((crimped.parent / "cases").iterdir()))
        return replace(
            deployment,
            case=case,
            outcome="failure" if index == 2 else "success",
            converged=index != 1,
            reason="equilibrium" if index != 1 else "the step became too small",
            cpu_seconds=float(index + 1),
        )

    return deploy


def do(folder: DatasetFolder, deploy: Deploy, count: int) -> Count:
    folder.cases_folder.mkdir(exist_ok=True)
    counted = Count(len(folder), 0, 0, count)
    for index in range(count):
        counted.add(do_case(Job(folder.path, folder.plan_id, deploy), index))
    return counted


@pytest.mark.parametrize("command", ["run", "status", "collect", "export", "merge"])
def test_help_imports_nothing_heavy(command: str) -> None:
    code = textwrap.dedent(
        f"""
        import sys
        from braidcast.cli import main
        sys.argv = ["braidcast", "dataset", "{command}", "--help"]
        try:
            main()
        except SystemExit as ended:
            assert not ended.code
        heavy = {{"numpy", "numba", "scipy", "xarray", "dask", "distributed", "rich"}}
        print(sorted(heavy.intersection(sys.modules)))
        """
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"
    assert f"Example:  braidcast dataset {command} " in done.stdout


def test_status(
    run: Run, folder: DatasetFolder, deploy: Deploy, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("status", "data") == 0
    assert capsys.readouterr().out.split() == "cases 4 finished 0 failed 0 waiting 4".split()
    do(folder, deploy, 3)
    folder.case_file(3).write_bytes(b"CDF")
    assert run("status", "data") == 0
    out, err = capsys.readouterr()
    lines = [" ".join(line.split()) for line in out.splitlines()]
    assert lines == [
        "cases 4",
        "finished 2",
        "failed 1",
        "1: the step became too small",
        "waiting 1",
        "labelled failure 1, 50.0% of the finished",
        "CPU time of a case median 2.00 s, 95 % below 2.90 s",
    ]
    assert err.startswith("braidcast: data/cases/00003.nc is damaged: ")
    assert err.endswith("; the next run does it again\n") and err.count("\n") == 1


def test_run_shows_how_far_it_is_and_what_came_out(
    run: Run,
    folder: DatasetFolder,
    deploy: Deploy,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    given: dict[str, Any] = {}

    def work(opened: DatasetFolder, *, progress: Any, say: Any, **options: Any) -> RunReport:
        given.update(options)
        say("dashboard: http://127.0.0.1:1234/status")
        count = do(opened, deploy, 4)
        progress(replace(count.progress(workers=2), done=0, finished=0, failed=0))
        for done in (1, 2, 3):
            progress(replace(count.progress(workers=2), done=done, seconds=36.0))
        progress(replace(count.progress(workers=2), seconds=36.0))
        return RunReport(tuple(count.done), 6.0, 2)

    monkeypatch.setattr(running, "run", work)
    assert run("run", "data", "--workers", "2", "--retry-failed", "--cases", "4") == 0
    assert given == {"workers": 2, "scheduler": None, "retry_failed": True, "cases": 4}
    out, err = capsys.readouterr()
    lines = [" ".join(line.split()) for line in out.splitlines()]
    assert lines[0] == "cases 4" and "waiting 0" in lines
    assert lines[-3:] == [
        "this run 4 cases in 6.0 s",
        "workers 2",
        "overhead 1.200, wall time x workers / CPU time of the cases",
    ]
    said = err.splitlines()
    assert said[0] == "braidcast: dashboard: http://127.0.0.1:1234/status"
    assert said[1] == "braidcast: 0/4, 0 failed, 2 workers"
    assert said[2].startswith("braidcast: 4/4, 1 failed, 2 workers, 400 cases/h, ends ")
    assert len(said) == 3  # the others came too soon after the first


def test_a_terminal_has_a_bar(
    folder: DatasetFolder, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    count = Count(4, 2, 1, 1)
    with run_display.run_display() as display:
        display(count.progress(workers=2))
        display.say("something [worth] reading")
        (task,) = display.bars.tasks
        assert (task.completed, task.total) == (3, 4)
        assert task.description == "1 failed, 2 workers"
    assert "braidcast: something [worth] reading\n" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("raised", "code", "says"),
    [
        (InputError("another run is working in data"), 2, "another run is working in data"),
        (RunStopped("the scheduler is gone"), 1, "the scheduler is gone"),
        (
            OSError(28, "No space left on device", "data/cases/00001.nc"),
            1,
            "the results could not be written: data/cases/00001.nc: No space left on device",
        ),
        (KeyboardInterrupt(), 130, "interrupted"),
    ],
)
def test_a_run_that_ends_early(
    run: Run,
    folder: DatasetFolder,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    raised: BaseException,
    code: int,
    says: str,
) -> None:
    def work(opened: DatasetFolder, **_: Any) -> RunReport:
        raise raised

    monkeypatch.setattr(running, "run", work)
    assert run("run", "data") == code
    assert capsys.readouterr() == ("", f"braidcast: {says}\n")


def test_a_run_with_nothing_to_do(
    run: Run, folder: DatasetFolder, deploy: Deploy, capsys: pytest.CaptureFixture[str]
) -> None:
    do(folder, deploy, 4)
    assert run("run", "data") == 0
    assert capsys.readouterr().out.splitlines()[-1].split() == "this run nothing to do".split()


@pytest.mark.parametrize(
    "command",
    [["run"], ["status"], ["collect", "-o", "a.nc"], ["export", "-o", "a"], ["merge", "-o", "a"]],
)
def test_what_is_no_dataset(
    run: Run, tmp_path: Path, command: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    name, *options = command
    folders = ["none", "none"] if name == "merge" else ["none"]
    assert run(name, *folders, *options) == 2
    out, err = capsys.readouterr()
    assert out == "" and err == (
        "braidcast: dataset folder = none does not exist, must be a folder of a dataset\n"
    )
    assert list(tmp_path.iterdir()) == []


def test_collect(
    run: Run, folder: DatasetFolder, deploy: Deploy, capsys: pytest.CaptureFixture[str]
) -> None:
    do(folder, deploy, 3)
    assert run("collect", "data", "-o", "all.nc") == 0
    assert "all.nc, 0." in capsys.readouterr().out.splitlines()[-1]
    with open_dataset("all.nc") as found:
        assert found.status.values.tolist() == ["finished", "failed", "finished", "waiting"]
    assert run("collect", "data", "-o", "data") == 2
    assert "output = data is a folder, must be a file" in capsys.readouterr().err


def test_export(
    run: Run,
    folder: DatasetFolder,
    deploy: Deploy,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    do(folder, deploy, 3)
    assert run("export", "data", "-o", "out", "--case", "1") == 2
    assert "case = 1 failed (the step became too small)" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
    assert run("export", "data", "-o", "out") == 0
    assert run("export", "data", "-o", "out", "--case", "2") == 0
    assert capsys.readouterr().out.split() == ["out/parameters.csv", "out/case_00002.vtp"]
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        "parameters.csv",
        "case_00002.vtp",
    }
    assert (tmp_path / "out" / "parameters.csv").read_text().count("\n") == 5


def test_merge(
    run: Run,
    folder: DatasetFolder,
    deploy: Deploy,
    deployment: Deployment,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    do(folder, deploy, 3)
    other = DatasetFolder.create(folder.plan, tmp_path / "other")
    do(other, lambda case, crimped: replace(deployment, case=case, strain_energy_mJ=2.0), 4)
    assert run("merge", "data", "other", "-o", "both") == 0
    out, err = capsys.readouterr()
    assert "finished              4" in out and out.endswith("both\n")
    assert err == (
        "braidcast: data and other have different results of the same cases; data's are taken: "
        "0, 2\n"
    )
    assert open_dataset("both").strain_energy.values.tolist() == [1.5, 2.0, 1.5, 2.0]
    assert run("merge", "data", "other", "-o", "both") == 2
    assert "output = both exists already" in capsys.readouterr().err
