"""The dataset folder: made once, verified whenever it is opened, one run at a time."""

import csv
import errno
import json
import os
import subprocess
import sys
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from braidcast import InputError, __version__, atomic
from braidcast.dataset import folder
from braidcast.dataset.folder import STORE_VERSION, DatasetFolder
from braidcast.dataset.plan import Plan

PLAN = """\
# kept with its comments: é
seed = 3
cases = 12
subsets = [4, 8]
tests = 2
[case.vessel]
P1 = [0.0, { min = 5.0, max = 30.0 }, 25.0]
diameter = 3.0
[case.site]
eta = { min = 0.0, max = 1.0 }
"""


@pytest.fixture
def dataset(tmp_path: Path) -> DatasetFolder:
    return DatasetFolder.create(Plan.from_text(PLAN), tmp_path / "data")


def refused(path: Path) -> str:
    with pytest.raises(InputError) as caught:
        DatasetFolder.open(path)
    assert str(path) in str(caught.value) and "\n" not in str(caught.value)
    return str(caught.value)


def edit_stamp(path: Path, **values: Any) -> None:
    stamp = json.loads((path / "dataset.json").read_text())
    (path / "dataset.json").write_text(json.dumps(stamp | values))


def test_what_is_created_is_what_is_opened(dataset: DatasetFolder) -> None:
    again = DatasetFolder.open(dataset.path)
    assert dataset.is_new and not again.is_new
    assert again.plan == dataset.plan == Plan.from_text(PLAN)
    np.testing.assert_array_equal(again.values, dataset.values)
    assert again.values.shape == (12, 2) and len(again) == 12
    assert again.plan_id == dataset.plan_id and len(again.plan_id) == 16
    assert again.replaced == 0
    assert again.case(5) == again.plan.case(again.values[5])
    assert {p.name for p in dataset.path.iterdir()} == {"plan.toml", "cases.csv", "dataset.json"}


def test_the_files_are_for_people_too(dataset: DatasetFolder) -> None:
    assert (dataset.path / "plan.toml").read_bytes() == PLAN.encode()
    with (dataset.path / "cases.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert list(rows[0]) == ["case", "test", "subset", "vessel_P1_y_mm", "site_eta"]
    assert [row["case"] for row in rows] == [str(n) for n in range(12)]
    assert [row["test"] for row in rows] == ["1"] * 2 + ["0"] * 10
    assert [row["subset"] for row in rows] == ["4"] * 4 + ["8"] * 4 + ["12"] * 4
    values = [[float(row["vessel_P1_y_mm"]), float(row["site_eta"])] for row in rows]
    np.testing.assert_array_equal(values, dataset.values)
    table, plan = ((dataset.path / name).read_bytes() for name in ("cases.csv", "plan.toml"))
    assert json.loads((dataset.path / "dataset.json").read_text()) == {
        "store_version": STORE_VERSION,
        "braidcast": __version__,
        "plan_sha256": sha256(plan).hexdigest(),
        "cases_sha256": sha256(table).hexdigest(),
        "replaced": 0,
    }


def test_places_of_cases(dataset: DatasetFolder) -> None:
    assert dataset.case_file(7) == dataset.path / "cases" / "00007.nc"
    assert dataset.crimped == dataset.path / "crimped"
    assert [dataset.is_test(n) for n in range(4)] == [True, True, False, False]
    assert [dataset.subset(n) for n in (0, 3, 4, 7, 8, 11)] == [4, 4, 8, 8, 12, 12]
    for index in (-1, 12):
        for ask in (dataset.case, dataset.case_file, dataset.is_test, dataset.subset):
            with pytest.raises(IndexError):
                ask(index)


def test_the_plan_names_the_dataset(dataset: DatasetFolder, tmp_path: Path) -> None:
    twin = DatasetFolder.create(Plan.from_text(PLAN), tmp_path / "twin")
    assert twin.plan_id == dataset.plan_id
    other = DatasetFolder.create(Plan.from_text(PLAN + "\n"), tmp_path / "other")
    assert other.plan_id != dataset.plan_id


def test_the_same_plan_again_keeps_the_folder(
    dataset: DatasetFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    dataset.cases_folder.mkdir()
    dataset.case_file(0).write_bytes(b"a result")
    monkeypatch.setattr(folder, "draw", lambda *_: pytest.fail("drawn again"))
    kept = DatasetFolder.create(Plan.from_text(PLAN), dataset.path)
    assert not kept.is_new and kept.plan_id == dataset.plan_id
    assert dataset.case_file(0).read_bytes() == b"a result"
    with pytest.raises(InputError, match="holds another plan, must be empty or a new name"):
        DatasetFolder.create(Plan.from_text(PLAN.replace("3", "4", 1)), dataset.path)
    assert (dataset.path / "plan.toml").read_text(encoding="utf-8") == PLAN


def test_an_existing_empty_folder_is_as_good_as_a_new_one(tmp_path: Path) -> None:
    assert DatasetFolder.create(Plan.from_text(PLAN), tmp_path).is_new


@pytest.mark.parametrize("name", ["notes.txt", "cases", ".hidden", "run.lock"])
def test_a_folder_with_something_else_is_refused(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text("mine")
    with pytest.raises(InputError, match=f"holds {name}, must be empty or a new name"):
        DatasetFolder.create(Plan.from_text(PLAN), tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize("name", ["plan.toml", "cases.csv"])
def test_somebody_elses_plan_or_table_is_not_overwritten(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text("mine")
    with pytest.raises(InputError, match=f"{name} is there already with other contents"):
        DatasetFolder.create(Plan.from_text(PLAN), tmp_path)
    assert (tmp_path / name).read_text() == "mine"
    assert [p.name for p in tmp_path.iterdir()] == [name]


def test_places_that_cannot_be_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plan = Plan.from_text(PLAN)
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="is a file, must be a folder or a new name"):
        DatasetFolder.create(plan, tmp_path / "file")
    with pytest.raises(InputError, match="must be in a folder that exists"):
        DatasetFolder.create(plan, tmp_path / "no" / "such")
    with pytest.raises(InputError, match='output folder = "" must be the name of a folder'):
        DatasetFolder.create(plan, "")

    # The user root may write everything, so that permission is refused here by hand.
    def refuse(*_: Any, **__: Any) -> None:
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))

    monkeypatch.setattr(Path, "mkdir", refuse)
    with pytest.raises(InputError, match="must be writable: Permission denied"):
        DatasetFolder.create(plan, tmp_path / "new")
    assert [p.name for p in tmp_path.iterdir()] == ["file"]


@pytest.mark.parametrize("successes", [0, 1, 2])
def test_a_creation_cut_short_is_no_dataset_and_can_be_done_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, successes: int
) -> None:
    path, flushed, real = tmp_path / "data", [], os.fsync

    def full(descriptor: int) -> None:
        if len(flushed) == successes:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        flushed.append(real(descriptor))

    monkeypatch.setattr(atomic.os, "fsync", full)
    with pytest.raises(OSError, match="No space left") as caught:
        DatasetFolder.create(Plan.from_text(PLAN), path)
    assert Path(caught.value.filename).parent == path
    assert "is not a dataset" in refused(path)
    assert len(list(path.iterdir())) == successes
    monkeypatch.setattr(atomic.os, "fsync", real)
    # What a killed process leaves behind is no hindrance.
    (path / f"{atomic.TEMPORARY}cases.csv-0").write_text("half a tab")
    assert DatasetFolder.create(Plan.from_text(PLAN), path).is_new
    assert len(DatasetFolder.open(path)) == 12


def test_folders_that_are_no_dataset(tmp_path: Path) -> None:
    assert "does not exist, must be a folder of a dataset" in refused(tmp_path / "none")
    assert "is not a dataset, must have a dataset.json" in refused(tmp_path)
    (tmp_path / "file").write_text("")
    assert "is a file" in refused(tmp_path / "file")


@pytest.mark.parametrize("name", ["plan.toml", "cases.csv"])
@pytest.mark.parametrize("change", ["edited", "truncated", "garbled", "removed"])
def test_a_plan_or_table_that_changed_is_noticed(
    dataset: DatasetFolder, name: str, change: str
) -> None:
    path = dataset.path / name
    before = path.read_bytes()
    if change == "removed":
        path.unlink()
        assert f"{name} cannot be read: No such file" in refused(dataset.path)
        return
    path.write_bytes(
        {
            "edited": before.replace(b"3", b"4", 1),
            "truncated": before[:-5],
            "garbled": b"\xff\x00" + before[2:],
        }[change]
    )
    assert f"{name} was changed after its cases were drawn, must be as" in refused(dataset.path)


def test_a_store_of_a_newer_version_is_refused(dataset: DatasetFolder) -> None:
    edit_stamp(dataset.path, store_version=STORE_VERSION + 1)
    says = refused(dataset.path)
    assert f"store_version = {STORE_VERSION + 1} must be at most {STORE_VERSION}" in says
    assert "written by a newer braidcast" in says


@pytest.mark.parametrize(
    "content",
    [
        *("", "{", "[]", "3", "{}", "\0", "[" * 99999, '{"store_version": 1}'),
        *('{"store_version": "1", "replaced": 0}', '{"store_version": 0, "replaced": 0}'),
    ],
    ids=lambda content: content[:25],
)
def test_a_damaged_stamp_is_refused(dataset: DatasetFolder, content: str) -> None:
    (dataset.path / "dataset.json").write_text(content)
    assert "dataset.json is damaged" in refused(dataset.path)
    (dataset.path / "dataset.json").write_bytes(b"\xff\xfe\x00")
    assert "dataset.json is damaged" in refused(dataset.path)


@pytest.mark.parametrize("table", ["", "case,test,subset\n", "x\n" + "0,0,4,a,b\n" * 12])
def test_a_table_that_does_not_fit_its_plan_is_refused(dataset: DatasetFolder, table: str) -> None:
    """… even if its checksum was put right by hand."""
    (dataset.path / "cases.csv").write_text(table)
    edit_stamp(dataset.path, cases_sha256=sha256(table.encode()).hexdigest())
    assert "must have a number for each of the 12 cases and 2 ranges" in refused(dataset.path)


def test_one_run_at_a_time(dataset: DatasetFolder) -> None:
    other = DatasetFolder.open(dataset.path)
    with dataset.lock():
        with pytest.raises(InputError, match="another run is working in .*data"), other.lock():
            pytest.fail("two runs in one folder")
    with pytest.raises(RuntimeError, match="mine"), other.lock():
        raise RuntimeError("mine")
    with dataset.lock():
        pass
    assert DatasetFolder.open(dataset.path).plan_id == dataset.plan_id


def test_a_killed_run_lets_go(dataset: DatasetFolder) -> None:
    program = (
        "import sys, time\n"
        "from braidcast.dataset.folder import DatasetFolder\n"
        "with DatasetFolder.open(sys.argv[1]).lock():\n"
        "    print('locked', flush=True)\n"
        "    time.sleep(60)\n"
    )
    with subprocess.Popen(
        [sys.executable, "-c", program, str(dataset.path)], stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None and process.stdout.readline() == "locked\n"
        with pytest.raises(InputError, match="another run is working"), dataset.lock():
            pytest.fail("two runs in one folder")
        process.kill()
        process.wait()
    with dataset.lock():
        pass
