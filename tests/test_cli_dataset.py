"""braidcast dataset create: what it prints where, its exit codes, and what it leaves behind."""

import os
import signal
import subprocess
import sys
import textwrap
from collections.abc import Callable
from pathlib import Path

import pytest

from braidcast import cli
from braidcast.dataset import draw as drawing
from braidcast.dataset.folder import DatasetFolder

Run = Callable[..., int]

PLAN = """\
title = "Twelve vessels"
seed = 3
cases = 12
subsets = [4, 8]
tests = 2
[case.vessel]
P1 = [0.0, { min = 5.0, max = 30.0 }, 25.0]
diameter = { min = 2.0, max = 6.884 }
[case.site]
eta = { min = 0.0, max = 1.0 }
"""


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Run:
    """Run the command in ``tmp_path``, where there is a plan, and return its exit code."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(signal, "signal", lambda *_: signal.SIG_DFL)
    Path("mine.toml").write_text(PLAN, encoding="utf-8")

    def run(*arguments: str | Path) -> int:
        monkeypatch.setattr(sys, "argv", ["braidcast", "dataset", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        return ended.value.code if isinstance(ended.value.code, int) else 0

    return run


@pytest.mark.parametrize("arguments", [["--help"], ["create", "--help"]])
def test_help_imports_nothing_heavy(arguments: list[str]) -> None:
    code = textwrap.dedent(
        f"""
        import sys
        from braidcast.cli import main
        sys.argv = ["braidcast", "dataset", *{arguments!r}]
        try:
            main()
        except SystemExit as ended:
            assert not ended.code
        heavy = {{"numpy", "numba", "scipy", "xarray", "dask", "distributed"}}
        print(sorted(heavy.intersection(sys.modules)))
        """
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"
    assert "create" in done.stdout
    if "create" in arguments:
        assert "Example:  braidcast dataset create" in done.stdout


def test_create_says_what_the_plan_came_to(run: Run, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("create", "mine.toml", "-o", "my data") == 0
    out, err = capsys.readouterr()
    assert err == ""
    folder = DatasetFolder.open("my data")
    assert folder.replaced > 0
    for line in (
        "plan            Twelve vessels",
        "cases           12",
        "subsets         4 in 8 in 12",
        "tests           the first 2, in no training set",
        "seed            3",
        "parameters      vessel_P1_y             5 to 30 mm",
        "                vessel_diameter         2 to 6.884 mm",
        "                site_eta                0 to 1",
        f"replaced        {folder.replaced} samples that were infeasible",
        "folder          my data",
        "next            braidcast dataset run 'my data'",
    ):
        assert line in out.splitlines()
    (said,) = [line for line in out.splitlines() if line.startswith("discrepancy")]
    by_size = dict(part.split(": ") for part in said.removeprefix("discrepancy").split(", "))
    given = {int(size): float(value) for size, value in by_size.items()}
    assert given == pytest.approx(folder.discrepancies, rel=5e-3)


def test_create_without_a_folder_and_again(run: Run, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("create", "mine.toml") == 0
    before = {path: path.stat().st_mtime_ns for path in Path("mine").iterdir()}
    assert "kept" not in capsys.readouterr().out
    assert run("create", "mine.toml") == 0
    assert "mine, which held this plan already and is kept as it was" in capsys.readouterr().out
    assert {path: path.stat().st_mtime_ns for path in Path("mine").iterdir()} == before


def test_bad_input_is_one_sentence(run: Run, capsys: pytest.CaptureFixture[str]) -> None:
    Path("empty.toml").write_text("")
    Path("reversed.toml").write_text(PLAN.replace("min = 5.0", "min = 50.0"))
    Path("other.toml").write_text(PLAN.replace("seed = 3", "seed = 4"))
    Path("loose.toml").write_text(PLAN.replace("min = 2.0", "min = 5.3"))
    Path("taken").mkdir()
    Path("taken", "thesis.tex").write_text("")
    assert run("create", "mine.toml") == 0
    capsys.readouterr()
    for arguments, says in [
        (["none.toml"], "none.toml: there is no such plan file"),
        (["empty.toml"], "empty.toml: is empty, must have cases"),
        (["reversed.toml"], "[case] vessel.P1[1]: min = 50 must be below max = 30"),
        (["other.toml", "-o", "mine"], "output folder = mine holds another plan"),
        (["loose.toml"], "samples of the plan are infeasible, must be at most 90%"),
        (["mine.toml", "-o", "taken"], "output folder = taken holds thesis.tex"),
        (["mine.toml", "-o", "mine.toml"], "is a file"),
        (["mine.toml", "-o", "no/such"], "must be in a folder that exists"),
        (["mine.toml", "-o", ""], 'output folder = "" must be the name of a folder'),
    ]:
        assert run("create", *arguments) == 2, arguments
        out, err = capsys.readouterr()
        assert out == "" and says in err
        assert err.startswith("braidcast: ") and err.count("\n") == 1
    for arguments in ([], ["create"], ["create", "mine.toml", "--fast"], ["created"]):
        assert run(*arguments) == 2
    assert {p.name for p in Path().iterdir() if p.is_dir()} == {"mine", "taken"}
    assert os.listdir("taken") == ["thesis.tex"]


def test_a_full_disk_is_one_sentence(
    run: Run, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def full(descriptor: int) -> None:
        raise OSError(28, os.strerror(28))

    monkeypatch.setattr(os, "fsync", full)
    assert run("create", "mine.toml") == 1
    err = capsys.readouterr().err
    assert err == (
        "braidcast: the results could not be written: "
        f"{Path('mine', 'plan.toml')}: No space left on device\n"
    )
    assert not (Path("mine") / "dataset.json").exists()


def test_an_interrupt_leaves_nothing(
    run: Run, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(drawing, "nested_hypercube", interrupt)
    assert run("create", "mine.toml") == 130
    assert capsys.readouterr().err == "braidcast: interrupted\n"
    assert os.listdir() == ["mine.toml"]
