"""braidcast train, evaluate and predict: what they write and say, and their exit codes."""

import csv
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import xarray

from braidcast import Case
from braidcast.dataset.folder import DatasetFolder
from braidcast.deployment import picture
from braidcast.surrogate.model import SurrogateModel
from braidcast.surrogate.model_file import save_model

Run = Callable[..., int]

COLUMNS = (
    *("vessel_P1_y_mm", "vessel_P1_z_mm", "vessel_diameter_mm"),
    *("aneurysm_diameter_mm", "site_eta"),
)
ROW = (15.0, 25.0, 3.0, 7.0, 0.5)


@pytest.fixture(autouse=True)
def _without_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(picture, "find_spec", lambda _: None)


@pytest.fixture
def files(model: SurrogateModel, tmp_path: Path) -> Path:
    """A folder with model.npz and case.toml."""
    save_model(model, tmp_path / "model.npz")
    (tmp_path / "case.toml").write_text(model.case.to_toml(), encoding="utf-8")
    return tmp_path


def table(path: Path, columns: tuple[str, ...] = COLUMNS, *rows: tuple[object, ...]) -> None:
    with path.open("w", newline="", encoding="utf-8") as stream:
        csv.writer(stream).writerows([columns, *rows])


def records(path: Path) -> list[dict[str, str]]:
    return list(csv.DictReader(path.read_text(encoding="utf-8").splitlines()))


@pytest.mark.slow
def test_train_then_evaluate(
    run: Run, store: DatasetFolder, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("train", store.path, "-o", "m.npz", "--cases", "30", "--recipe", "paper") == 0
    trained = capsys.readouterr().out
    assert "paper, 30 successes of" in trained and "95 % intervals" in trained
    assert run("evaluate", "m.npz", store.path, "-o", "tested") == 0
    shown = capsys.readouterr().out
    figures = json.loads((tmp_path / "tested" / "evaluation.json").read_text())
    mean = figures["shapes"]["prediction"]["AE_mm"]
    assert f"{mean:.4f} mm" in shown and f"{mean:.4f} mm" in trained
    rows = records(tmp_path / "tested" / "shapes.csv")
    assert np.mean([float(row["AE_mm"]) for row in rows]) == pytest.approx(mean, abs=1e-6)
    outcomes = records(tmp_path / "tested" / "outcomes.csv")
    assert len(outcomes) == figures["outcomes"]["cases"] == 24


def test_predict_writes_the_files_of_a_deployment(
    run: Run, files: Path, model: SurrogateModel, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("predict", "case.toml", "-m", "model.npz") == 0
    folder = files / "case_predicted"
    assert {path.name for path in folder.iterdir()} == {
        *("deployed.vtp", "vessel.stl", "summary.json")
    }
    summary = json.loads((folder / "summary.json").read_text())
    expected = model.predict(model.case)
    assert summary["success_probability"] == expected.success_probability
    assert summary["std_max_mm"] == pytest.approx(expected.std_norm.max())
    assert summary["in_range"] is True
    said = capsys.readouterr()
    assert "success probability" in said.out and "PyVista" in said.err


def test_outside_the_training_is_answered_with_a_warning(
    run: Run, files: Path, model: SurrogateModel, capsys: pytest.CaptureFixture[str]
) -> None:
    tables = model.case.to_dict()
    tables["vessel"]["diameter"] = 4.5
    (files / "wide.toml").write_text(Case.from_dict(tables).to_toml(), encoding="utf-8")
    assert run("predict", "wide.toml", "-m", "model.npz", "-o", "out") == 0
    assert json.loads((files / "out" / "summary.json").read_text())["in_range"] is False
    said = capsys.readouterr()
    phrase = "vessel_diameter = 4.5 mm, trained from 2.5 to 3.5 mm"
    assert phrase in said.err and f"NO: {phrase}" in said.out


def test_a_table_of_cases(run: Run, files: Path, model: SurrogateModel) -> None:
    table(files / "cases.csv", COLUMNS, ROW, (15.0, 25.0, 4.0, 7.0, 0.5))
    assert run("predict", "cases.csv", "-m", "model.npz", "-o", "out") == 0
    rows = records(files / "out" / "predictions.csv")
    assert [row["in_range"] for row in rows] == ["True", "False"]
    assert "vessel_diameter" in rows[1]["out_of_range"]
    tables = model.case.to_dict()
    tables["vessel"] |= {"P1": (0.0, 15.0, 25.0), "diameter": 3.0}
    tables["aneurysm"]["diameter"], tables["site"]["eta"] = 7.0, 0.5
    alone = model.predict(Case.from_dict(tables))
    assert float(rows[0]["success_probability"]) == alone.success_probability
    with xarray.open_dataset(files / "out" / "predictions.nc", engine="scipy") as nodes:
        assert nodes.positions.attrs["units"] == "mm"
        assert np.abs(nodes.positions.values[0] - alone.positions).max() < 1e-5
        assert np.abs(nodes["std"].values[0] - alone.std).max() < 1e-6


def test_the_cases_of_a_dataset_are_a_table(run: Run, files: Path, store: DatasetFolder) -> None:
    assert run("predict", store.path / "cases.csv", "-m", "model.npz", "-o", "out") == 0
    rows = records(files / "out" / "predictions.csv")
    assert len(rows) == len(store)
    assert [float(row["site_eta"]) for row in rows] == store.values[:, -1].tolist()
    assert {row["in_range"] for row in rows} == {"True"}


@pytest.mark.parametrize(
    ("columns", "row", "said"),
    [
        (("vessel_P1_y_cm", *COLUMNS[1:]), ROW, "column 'vessel_P1_y_cm' is not known, must be of"),
        (COLUMNS[1:], ROW[1:], "column 'vessel_P1_y_mm' is there 0 times, must be once"),
        ((*COLUMNS, "site_eta"), (*ROW, 0.5), "column 'site_eta' is there 2 times, must be once"),
        (COLUMNS, ROW[1:], "line 2 has 4 values, must have 5, one a column"),
        (COLUMNS, ("15 mm", *ROW[1:]), "line 2: vessel_P1_y_mm = '15 mm' must be a number"),
        (COLUMNS, (*ROW[:2], "nan", *ROW[3:]), "line 2: vessel.diameter = nan must be"),
        (COLUMNS, (*ROW[:2], 0.5, *ROW[3:]), "line 2: vessel.diameter = 0.5 mm must be above"),
        (COLUMNS, None, "has no cases, must have a line for each below its header"),
    ],
)
def test_bad_tables(
    run: Run,
    files: Path,
    capsys: pytest.CaptureFixture[str],
    columns: tuple[str, ...],
    row: tuple[object, ...] | None,
    said: str,
) -> None:
    table(files / "cases.csv", columns, *([] if row is None else [row]))
    assert run("predict", "cases.csv", "-m", "model.npz", "-o", "out") == 2
    error = capsys.readouterr().err
    assert said in error and len(error.strip().splitlines()) == 1
    assert not (files / "out").exists()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("predict", "case.toml", "-m", "none.npz"), "none.npz cannot be read"),
        (("predict", "case.toml", "-m", "case.toml"), "is not a model file"),
        (("predict", "none.toml", "-m", "model.npz"), "none.toml"),
        (("predict", "case.toml", "-m", "model.npz", "-o", "no/folder"), "no does not"),
        (("train", "none", "-o", "m.npz"), "dataset folder = none does not exist"),
        (("train", "STORE", "-o", "no/m.npz"), "output file = no/m.npz must be in a folder"),
        (("train", "STORE", "-o", "."), "is a folder, must be a file"),
        (("train", "STORE", "-o", "m.npz", "--recipe", "x"), "'x' must be one of: ours, paper"),
        (("train", "STORE", "-o", "m.npz", "--cases", "7"), "cases = 7 must be from 20 to"),
        (("evaluate", "model.npz", "none"), "dataset folder = none does not exist"),
        (("evaluate", "case.toml", "STORE"), "is not a model file"),
    ],
)
def test_bad_input_is_one_sentence(
    run: Run,
    files: Path,
    store: DatasetFolder,
    capsys: pytest.CaptureFixture[str],
    arguments: tuple[str, ...],
    said: str,
) -> None:
    given = [str(store.path) if word == "STORE" else word for word in arguments]
    assert run(*given) == 2
    error = [line for line in capsys.readouterr().err.splitlines() if line.startswith("braidcast:")]
    assert len(error) == 1 and said in error[0]


def test_another_device_is_refused(
    run: Run, files: Path, model: SurrogateModel, capsys: pytest.CaptureFixture[str]
) -> None:
    tables = model.case.to_dict()
    tables["device"]["wires"] = 16
    (files / "other.toml").write_text(Case.from_dict(tables).to_toml(), encoding="utf-8")
    assert run("predict", "other.toml", "-m", "model.npz") == 2
    assert "device.wires = 16 must be 12" in capsys.readouterr().err


def test_a_full_disk_is_one_sentence(
    run: Run, files: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    assert run("predict", "case.toml", "-m", "model.npz", "-o", "out") == 1
    assert "could not be written: out: No space left on device" in capsys.readouterr().err
    assert not (files / "out").exists()
