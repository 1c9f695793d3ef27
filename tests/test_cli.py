"""The command line: what it prints where, its exit codes, and what it leaves behind."""

import json
import os
import signal
import subprocess
import sys
import textwrap
import time
from collections.abc import Callable
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from braidcast import Case, Deployment, __version__
from braidcast.deployment import output, picture

EXAMPLES = Path(__file__).parents[1] / "examples"
Run = Callable[..., int]


@pytest.fixture
def solver(monkeypatch: pytest.MonkeyPatch, deployment: Deployment) -> list[Case]:
    """A stand-in for the simulation; the cases it was given."""
    given: list[Case] = []

    def simulate(case: Case, *, progress: Any = None, keep_frames: bool = False) -> Deployment:
        given.append(case)
        for stage in ("crimp", "position", "release"):
            for fraction in (0.0, 0.5, 1.0):
                progress(stage, fraction)
        return deployment

    stand_in(monkeypatch, simulate)
    monkeypatch.setattr(picture, "find_spec", lambda name: None)
    return given


def stand_in(monkeypatch: pytest.MonkeyPatch, simulate: Callable[..., Any]) -> None:
    module = ModuleType("braidcast.deployment.simulate")
    module.simulate = simulate  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, module.__name__, module)


@pytest.fixture
def case_file(case: Case, tmp_path: Path) -> Path:
    path = tmp_path / "mine.toml"
    path.write_text(case.to_toml(), encoding="utf-8")
    return path


def test_version(run: Run, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("--version") == 0
    assert capsys.readouterr().out == f"braidcast {__version__}\n"


@pytest.mark.parametrize("arguments", [["--help"], ["simulate", "--help"]])
def test_help_imports_nothing_heavy(arguments: list[str]) -> None:
    code = textwrap.dedent(
        f"""
        import sys
        from braidcast.cli import main
        sys.argv = ["braidcast", *{arguments!r}]
        try:
            main()
        except SystemExit as ended:
            assert not ended.code
        heavy = {{"numpy", "numba", "scipy", "vtkmodules"}}
        print(sorted(heavy.intersection(sys.modules)))
        """
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"
    assert "simulate" in done.stdout
    if "simulate" in arguments:
        assert "Example:  braidcast simulate" in done.stdout


def test_results_on_stdout_progress_on_stderr(
    run: Run, solver: list[Case], case: Case, case_file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("simulate", case_file) == 0
    assert solver == [case]
    folder = case_file.parent / "mine_deployed"
    assert json.loads((folder / "summary.json").read_text())["outcome"] == "success"
    out, err = capsys.readouterr()
    assert "outcome               success" in out
    assert "deployed length" in out and " mm" in out and "summary.json" in out
    for stage in ("crimp", "position", "release"):
        assert stage in err and stage not in out.splitlines()[0]
    assert "pip install 'braidcast[pictures]'" in err


def test_folder_and_frames(run: Run, solver: list[Case], case_file: Path) -> None:
    folder = case_file.parent / "there"
    assert run("simulate", case_file, "-o", folder, "--frames") == 0
    assert (folder / "frames" / "stage_0001.vtp").exists()
    assert run("simulate", case_file, "--output", folder) == 0
    assert not (folder / "frames").exists()


def test_bad_input_ends_before_the_simulation(
    run: Run, solver: list[Case], case_file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = case_file.parent
    (folder / "empty.toml").write_text("")
    (folder / "garbage.toml").write_bytes(bytes(range(256)))
    (folder / "negative.toml").write_text(case_file.read_text().replace("3.0", "-3.0"))
    for arguments, says in [
        (["none.toml"], "none.toml: there is no such case file"),
        (["."], "is a folder"),
        (["empty.toml"], "is empty"),
        (["garbage.toml"], "is not text in UTF-8"),
        (["negative.toml"], "vessel.diameter = -3.0 must be"),
        ([case_file, "-o", case_file], "is a file"),
        ([case_file, "-o", "no/such/folder"], "must be in a folder that exists"),
        ([case_file, "-o", ""], 'output folder = "" must be the name of a folder'),
    ]:
        assert run("simulate", *arguments) == 2, arguments
        out, err = capsys.readouterr()
        assert out == "" and says in err
        assert err.startswith("braidcast: ") and err.count("\n") == 1
    for arguments in (["simulate"], ["simulate", case_file, "--fast"], ["simulated"]):
        assert run(*arguments) == 2
    assert solver == []
    assert {p.suffix for p in folder.iterdir()} == {".toml"}


def test_not_converged_is_written_and_said(
    run: Run,
    monkeypatch: pytest.MonkeyPatch,
    deployment: Deployment,
    case_file: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    diverged = replace(deployment, converged=False, reason="the step became too small")
    stand_in(monkeypatch, lambda case, **_: diverged)
    monkeypatch.setattr(picture, "find_spec", lambda name: None)
    assert run("simulate", case_file, "-o", "out") == 3
    out, err = capsys.readouterr()
    assert "outcome               success, so far: not at rest" in out
    assert "NOT reached: the step became too small" in out
    assert "braidcast: not converged: the step became too small" in err
    read = json.loads((case_file.parent / "out" / "summary.json").read_text())
    assert read["converged"] is False and read["reason"] == "the step became too small"
    assert (case_file.parent / "out" / "deployed.vtp").exists()


def test_a_full_disk_is_one_sentence(
    run: Run,
    solver: list[Case],
    monkeypatch: pytest.MonkeyPatch,
    case_file: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def full(descriptor: int) -> None:
        raise OSError(28, os.strerror(28))

    monkeypatch.setattr(os, "fsync", full)
    assert run("simulate", case_file, "-o", "out") == 1
    said = capsys.readouterr().err
    assert "the results could not be written: out: No space left on device" in said
    assert not (case_file.parent / "out").exists()


@pytest.mark.parametrize("where", ["simulate", "write"])
def test_an_interrupt_leaves_nothing(
    run: Run,
    solver: list[Case],
    monkeypatch: pytest.MonkeyPatch,
    case_file: Path,
    where: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def interrupt(*_: Any, **__: Any) -> Any:
        raise KeyboardInterrupt

    if where == "simulate":
        stand_in(monkeypatch, interrupt)
    else:
        monkeypatch.setattr(output, "write_summary", interrupt)
    assert run("simulate", case_file) == 130
    assert capsys.readouterr().err.endswith("braidcast: interrupted\n")
    assert list(case_file.parent.iterdir()) == [case_file]


@pytest.mark.skipif(os.name != "posix", reason="signals as POSIX has them")
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_signals_to_the_real_process(case_file: Path, number: signal.Signals, code: int) -> None:
    program = textwrap.dedent(
        """
        import sys, time, types
        module = types.ModuleType("braidcast.deployment.simulate")
        def simulate(case, *, progress, keep_frames):
            print("started", flush=True)
            time.sleep(60)
        module.simulate = simulate
        sys.modules[module.__name__] = module
        from braidcast.cli import main
        main()
        """
    )
    with subprocess.Popen(
        [sys.executable, "-c", program, "simulate", str(case_file)],
        cwd=case_file.parent,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None and process.stderr is not None
        assert process.stdout.readline() == "started\n"
        time.sleep(0.2)
        process.send_signal(number)
        assert process.wait(timeout=20) == code
        assert "Traceback" not in process.stderr.read()
    assert list(case_file.parent.iterdir()) == [case_file]


@pytest.mark.slow
@pytest.mark.skipif(find_spec("braidcast.deployment.simulate") is None, reason="not built yet")
def test_the_main_example_from_end_to_end(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", "from braidcast.cli import main; main()", "simulate"]
        + [str(EXAMPLES / "success.toml"), "-o", str(tmp_path / "out"), "--frames"],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    read = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert read["outcome"] == "success" and read["converged"] is True
    assert read["free_length_mm"] == 15.0 and 15.0 < read["deployed_length_mm"] < 27.0
    assert read["max_penetration_mm"] <= 0.014 / 4
    assert read["residual_relative"] <= 1e-4
    assert len(list((tmp_path / "out" / "frames").glob("stage_*.vtp"))) >= 3
