"""braidcast study and card: what they say, what they refuse, and their exit codes."""

import shutil
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from braidcast.dataset.folder import DatasetFolder
from braidcast.dataset.plan import Plan
from braidcast.study import deployments, pipeline
from braidcast.study import sizes as dataset
from braidcast.study.stages import Stage
from braidcast.study.workspace import Study

Run = Callable[..., int]

PLAN = """\
cases = 3
tests = 1
[case.vessel]
P1 = [0.0, 15.0, 25.0]
diameter = { min = 2.5, max = 3.5 }
[case.aneurysm]
diameter = 7.0
protrusion = 0.5
[case.site]
eta = 0.5
"""


def two_stages(study: Study, samples: int) -> list[Stage]:
    """The first stage of the study, and one that fails for want of a model."""
    cases = Stage("cases", dataset.cases_table, {"samples": samples}, cases=samples)
    if samples == 90:
        return [cases]
    return [cases, Stage("sites", deployments.sites, {"samples": samples}, ("cases",))]


@pytest.mark.slow
def test_goes_on_where_it_stopped(
    run: Run,
    store: DatasetFolder,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(pipeline, "pipeline", two_stages)
    given = ("study", "--dataset", store.path, "-o", "out", "--workers", "1")
    assert run(*given, "--samples", "90") == 0
    said = capsys.readouterr()
    assert "1, of which 1 done now" in said.out and "report.html" in said.out
    assert (tmp_path / "out/tables/cases.csv").is_file()
    assert run(*given, "--samples", "90") == 0
    assert "1, of which 0 done now" in capsys.readouterr().out
    assert run(*given, "--samples", "40") == 1
    said = capsys.readouterr()
    assert said.err.count("Traceback") == 0
    assert "braidcast: stage sites failed: InputError: " in said.err.splitlines()[-1]
    assert "models/braidcast.npz" in said.err.splitlines()[-1]


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("--samples", "100"), "samples = 100 must be one of: 150, 300, 600, 900"),
        (("--samples", "40", "--dataset", "nowhere"), "dataset folder = nowhere"),
        (("-o", "file.txt"), "file.txt"),
        (("--workers", "0"), "workers = 0 must be"),
        (("--samples", "3", "--dataset", "few"), "few has tests = 1, must have 2 or more"),
    ],
)
def test_refuses_in_a_sentence(
    run: Run,
    store: DatasetFolder,
    tmp_path: Path,
    arguments: tuple[str, ...],
    sentence: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    (tmp_path / "file.txt").write_text("")
    DatasetFolder.create(Plan.from_text(PLAN), tmp_path / "few")
    shown = ("-o", "out") if "-o" not in arguments else ()
    whole = () if "--samples" in arguments else ("--samples", "90", "--dataset", str(store.path))
    assert run("study", *arguments, *shown, *whole) == 2
    said = capsys.readouterr().err
    assert sentence in said and said.count("\n") == 1
    assert not (tmp_path / "out/report.html").exists()


def test_refuses_what_it_cannot_learn_from(
    run: Run, store: DatasetFolder, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of 40 cases 24 are tests, and of the other 16 but a few fail."""
    assert run("study", "--samples", "40", "--dataset", store.path, "-o", "out") == 2
    said = capsys.readouterr().err
    assert "among 16 cases to train with, must be at least 10" in said


def test_says_what_to_install(
    run: Run, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    absent = {"jinja2", "matplotlib"}
    # In the package the function has taken the name of its module.
    command = sys.modules["braidcast.cli.study"]
    monkeypatch.setattr(command, "find_spec", lambda name: None if name in absent else name)
    assert run("study", "-o", "out") == 2
    said = capsys.readouterr().err
    assert "jinja2 and matplotlib must be installed for the report" in said
    assert "pip install 'braidcast[study]'" in said


def test_card_of_the_shipped_model(run: Run, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("card") == 0
    said = capsys.readouterr().out
    for heading in ("Data", "Errors on simulations", "Intended use", "Limits"):
        assert f"## {heading}" in said
    assert "Not a medical device" in said
    assert "| `vessel_diameter` | 2 to 4 mm |" in said


def test_card_of_no_model(run: Run, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shutil.copy(Path(__file__), tmp_path / "m.npz")
    assert run("card", "m.npz") == 2
    assert capsys.readouterr().err.count("\n") == 1
