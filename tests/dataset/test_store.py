"""A dataset as one Dataset: all planned cases, and nothing taken for data that is none."""

import csv
import subprocess
import sys
import textwrap
from dataclasses import replace
from pathlib import Path

import dask.array
import numpy as np
import pytest
import xarray

import braidcast
from braidcast import Case, Deployment, InputError, open_dataset
from braidcast.dataset import export
from braidcast.dataset.case_file import DamagedFile
from braidcast.dataset.collect import collect
from braidcast.dataset.fields import ARRAYS, CENTRE, COSTS, NUMBERS
from braidcast.dataset.folder import DatasetFolder
from braidcast.dataset.ledger import Ledger
from braidcast.dataset.merge import merge
from braidcast.dataset.plan import Plan
from braidcast.dataset.work import Deploy, Job, do_case

FINISHED, FAILED, WAITING, DAMAGED = [0, 2, 3], [1], [4], [5]


def do(folder: DatasetFolder, deploy: Deploy, *indices: int) -> None:
    folder.cases_folder.mkdir(exist_ok=True)
    for index in indices:
        do_case(Job(folder.path, folder.plan_id, deploy), index)


@pytest.fixture
def diverging(pretended: Deploy) -> Deploy:
    def deploy(case: Case, crimped: Path) -> Deployment:
        return replace(pretended(case, crimped), converged=False, reason="no equilibrium")

    return deploy


@pytest.fixture
def mixed(folder: DatasetFolder, pretended: Deploy, diverging: Deploy) -> DatasetFolder:
    """One case waiting, one failed, one damaged, three finished."""
    do(folder, pretended, *FINISHED, *DAMAGED)
    do(folder, diverging, *FAILED)
    path = folder.case_file(DAMAGED[0])
    path.write_bytes(path.read_bytes()[:-1])
    return folder


def test_all_cases_with_their_parameters(mixed: DatasetFolder) -> None:
    found = open_dataset(mixed.path)
    assert dict(found.sizes) == {"case": 6, "node": 252, "ring": 21, "xyz": 3}
    for column, parameter in enumerate(mixed.plan.ranges):
        values = found.coords[parameter.name]
        np.testing.assert_array_equal(values, mixed.values[:, column])
        assert values.dims == ("case",) and values.units == (parameter.unit or "1")
    assert found.test.values.tolist() == [True] + 5 * [False]
    assert found.subset.values.tolist() == 3 * [3] + 3 * [6]
    braid = mixed.case(0).braid
    np.testing.assert_array_equal(found.wire, braid.wire_of_node)
    np.testing.assert_array_equal(found.node_ring, braid.rings)
    assert found.xyz.values.tolist() == ["x", "y", "z"]
    assert found.attrs["plan"] == mixed.plan.text and found.attrs["plan_id"] == mixed.plan_id
    assert found.attrs["title"] == mixed.plan.title
    for name, variable in found.variables.items():
        if name != "xyz":
            assert variable.attrs["long_name"], name
            assert variable.dtype.kind in "U" or variable.attrs["units"], name


def test_finished_cases_are_data(mixed: DatasetFolder, pretended: Deploy) -> None:
    found = open_dataset(mixed.path)
    for index in FINISHED:
        one, expected = found.sel(case=index), pretended(mixed.case(index), mixed.crimped)
        assert (str(one.status.values), str(one.outcome.values)) == ("finished", expected.outcome)
        assert str(one.clinical_outcome.values) == expected.clinical_outcome
        assert len(str(one.checksum.values)) == 64 and "numpy" in str(one.versions.values)
        np.testing.assert_array_equal(one.positions, expected.positions.astype("f4"))
        np.testing.assert_array_equal(one.contact_force, expected.contact_force.astype("f4"))
        np.testing.assert_array_equal(one.positioned_centreline, expected.positioned_centreline)
        np.testing.assert_array_equal(one.aneurysm_centre, mixed.case(index).aneurysm_centre)
        assert float(one.deployed_length) == expected.deployed_length_mm
        assert float(one.residual) == expected.residual_N
        assert float(one.newton_iterations) == 70 and float(one.cpu_seconds) == 0.5


def test_no_other_case_is_taken_for_data(mixed: DatasetFolder) -> None:
    found = open_dataset(mixed.path)
    others = found.isel(case=[*FAILED, *WAITING, *DAMAGED])
    assert others.status.values.tolist() == ["failed", "waiting", "waiting"]
    reasons = others.reason.values.tolist()
    assert reasons[0] == "no equilibrium" and reasons[1] == ""
    assert "00005.nc is damaged: its content does not match its seal" in reasons[2]
    for name in ("outcome", "clinical_outcome", "checksum"):
        assert others[name].values.tolist() == 3 * [""]
    for known in (*ARRAYS, *NUMBERS, CENTRE):
        assert np.isnan(others[known.name].values).all(), known.name
    for known in COSTS:
        assert np.isnan(others[known.name].values).tolist() == [False, True, True]


def test_a_plan_with_no_case_done(folder: DatasetFolder) -> None:
    found = open_dataset(folder.path)
    assert set(found.status.values) == {"waiting"}
    assert found.positions.shape == (6, 252, 3) and np.isnan(found.positions.values).all()


def test_arrays_are_read_when_asked_for(mixed: DatasetFolder, pretended: Deploy) -> None:
    found = open_dataset(mixed.path)
    assert isinstance(found.positions.data, dask.array.Array)
    whole = found.positions.values
    assert whole.dtype == np.float32
    for key in (2, -3, slice(1, 4), [3, 0], np.array([True, False, True, True, False, False])):
        np.testing.assert_array_equal(found.positions[key].values, whole[key])
    np.testing.assert_array_equal(found.positions[2, 5:9, 1].values, whole[2, 5:9, 1])
    np.testing.assert_array_equal(found.positions[[3, 0], :, 2].values, whole[[3, 0], :, 2])
    mixed.case_file(2).unlink()
    np.testing.assert_array_equal(found.positions[0].values, whole[0])
    with pytest.raises(FileNotFoundError):
        found.positions[2].compute()
    mixed.case_file(2).write_bytes(b"CDF\x02")
    with pytest.raises(DamagedFile, match="00002.nc was cut off since"):
        found.positions[2].compute()


def test_cases_that_are_added_are_seen_when_opened_again(
    folder: DatasetFolder, pretended: Deploy
) -> None:
    do(folder, pretended, 0)
    first = open_dataset(folder.path)
    do(folder, pretended, 1)
    second = open_dataset(folder.path)
    together = xarray.concat([first.positions, second.positions], "opened").isnull()
    assert together.any(["node", "xyz"]).values[:, :2].tolist() == [[False, True], [False, False]]


def test_collected_it_is_the_same(mixed: DatasetFolder, tmp_path: Path) -> None:
    path = tmp_path / "all.nc"
    path.write_bytes(b"an older one")
    ledger = collect(mixed, path)
    assert (len(ledger.finished), len(ledger.failed), ledger.waiting) == (3, 1, 2)
    with open_dataset(path) as collected:
        assert isinstance(collected.positions.data, dask.array.Array)
        assert not isinstance(collected.status.data, dask.array.Array)
        xarray.testing.assert_identical(collected, open_dataset(mixed.path))


def test_a_collected_file_needs_no_braidcast(mixed: DatasetFolder, tmp_path: Path) -> None:
    collect(mixed, tmp_path / "all.nc")
    code = textwrap.dedent(
        f"""
        import sys, xarray
        with xarray.open_dataset({str(tmp_path / "all.nc")!r}) as found:
            good = found.isel(case=(found.status == "finished").values)
            print(good.case.values.tolist(), good.positions.shape, found.positions.units)
            print(sorted(set(found.status.values)), found.positions.isnull().all().item())
        print([name for name in sys.modules if name.startswith("braidcast")])
        """
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == [
        "[0, 2, 3] (3, 252, 3) mm",
        "['failed', 'finished', 'waiting'] False",
        "[]",
    ]


def test_what_is_no_dataset(mixed: DatasetFolder, tmp_path: Path) -> None:
    (tmp_path / "a.nc").write_bytes(b"CDF\x02 and then nothing")
    (tmp_path / "empty.nc").write_bytes(b"")
    collect(mixed, tmp_path / "newer.nc")
    content = (tmp_path / "newer.nc").read_bytes()
    at = content.index(b"store_version") + 16
    assert content[at : at + 12] == bytes([0, 0, 0, 4, 0, 0, 0, 1, 0, 0, 0, 1])
    (tmp_path / "newer.nc").write_bytes(content[: at + 11] + b"\x02" + content[at + 12 :])
    for path, says in [
        (tmp_path / "none", "does not exist, must be a folder of a dataset"),
        (tmp_path, "is not a dataset"),
        (tmp_path / "a.nc", "is not a collected dataset"),
        (tmp_path / "empty.nc", "is not a collected dataset"),
        (mixed.case_file(0), "is not a collected dataset"),
        (tmp_path / "newer.nc", "store_version = 2 must be at most 1"),
    ]:
        with pytest.raises(InputError, match=says) as caught:
            open_dataset(path)
        assert str(path) in str(caught.value) and "\n" not in str(caught.value)


def test_outputs_that_cannot_be(mixed: DatasetFolder, tmp_path: Path) -> None:
    for path, says in [(tmp_path, "is a folder"), (tmp_path / "no" / "a.nc", "does not")]:
        with pytest.raises(InputError, match=says):
            collect(mixed, path)


def test_the_table_of_all_cases(mixed: DatasetFolder) -> None:
    rows = list(csv.DictReader(export.table(mixed).decode().splitlines()))
    planned = list(csv.DictReader((mixed.path / "cases.csv").read_text().splitlines()))
    assert len(rows) == 6
    records = Ledger.read(mixed).records
    for index, (row, plan) in enumerate(zip(rows, planned, strict=True)):
        assert {name: row[name] for name in plan} == plan
        record = records.get(index)
        if record is None:
            assert row["status"] == "waiting"
            assert not any(list(row.values())[len(plan) + 1 :])
        else:
            assert (row["status"], row["reason"]) == (record.status, record.reason)
            assert (row["outcome"], row["checksum"]) == (record.outcome, record.checksum)
            assert float(row["cpu_seconds"]) == 0.5
            assert bool(row["deployed_length_mm"]) == record.finished
    assert float(rows[2]["strain_energy_mJ"]) == 1.5 and rows[1]["residual_N"] == ""


def test_the_wires_of_a_case(mixed: DatasetFolder, tmp_path: Path) -> None:
    pyvista = pytest.importorskip("pyvista")
    (tmp_path / "a.vtp").write_bytes(export.wires(mixed, 3))
    data, kept = pyvista.read(tmp_path / "a.vtp"), open_dataset(mixed.path).sel(case=3)
    np.testing.assert_array_equal(data.points, kept.positions)
    assert data.n_lines == 12
    assert set(data.point_data) == {
        *("gap_mm", "contact_force_N", "displacement_mm", "rotation_vector_rad", "wire", "ring")
    }
    np.testing.assert_array_equal(data["contact_force_N"], kept.contact_force)


@pytest.mark.parametrize(
    ("index", "says"),
    [
        (1, r"case = 1 failed \(no equilibrium\), must be a finished case"),
        (4, "case = 4 is still waiting"),
        (5, "00005.nc is damaged"),
        (6, "case = 6 must be a whole number from 0 to 5"),
        (-1, "case = -1 must be"),
    ],
)
def test_no_wires_without_a_result(mixed: DatasetFolder, index: int, says: str) -> None:
    with pytest.raises(InputError, match=says):
        export.wires(mixed, index)


def test_two_runs_together(
    folder: DatasetFolder, pretended: Deploy, diverging: Deploy, tmp_path: Path
) -> None:
    def otherwise(case: Case, crimped: Path) -> Deployment:
        return replace(pretended(case, crimped), strain_energy_mJ=2.0)

    other = DatasetFolder.create(folder.plan, tmp_path / "other")
    do(folder, pretended, 0, 1, 3)
    do(folder, diverging, 2, 4)
    do(other, pretended, 1, 2)
    do(other, otherwise, 3)
    do(other, diverging, 0, 4)
    merged = merge(folder, other, tmp_path / "both")
    assert merged.different == (3,)
    found = open_dataset(tmp_path / "both")
    assert found.status.values.tolist() == [*4 * ["finished"], "failed", "waiting"]
    assert found.strain_energy.values[:4].tolist() == 4 * [1.5]
    assert found.attrs["plan_id"] == folder.plan_id
    assert (tmp_path / "both" / "cases.csv").read_bytes() == (
        folder.path / "cases.csv"
    ).read_bytes()
    assert {path.name for path in tmp_path.iterdir()} == {"data", "other", "both"}
    assert merge(other, folder, tmp_path / "again").different == (3,)
    assert float(open_dataset(tmp_path / "again").strain_energy[3]) == 2.0


def test_runs_that_cannot_be_merged(folder: DatasetFolder, tmp_path: Path) -> None:
    plan = Plan.from_text(folder.plan.text.replace("seed = 3", "seed = 4"))
    other = DatasetFolder.create(plan, tmp_path / "other")
    with pytest.raises(InputError, match=f"other plan: its plan id = {other.plan_id} must be"):
        merge(folder, other, tmp_path / "both")
    with pytest.raises(InputError, match="exists already"):
        merge(folder, folder, tmp_path / "other")
    with pytest.raises(InputError, match="must be in a folder that exists"):
        merge(folder, folder, tmp_path / "no" / "both")
    assert not (tmp_path / "both").exists()


def test_public_name() -> None:
    assert "open_dataset" in dir(braidcast)
