"""A case file: what was written is read, in all readers; what was spoilt is found out."""

import errno
import os
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import xarray
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import netcdf_file
from scipy.spatial.transform import Rotation

from braidcast import Case, Deployment, InputError
from braidcast.dataset import case_file
from braidcast.dataset.case_file import DamagedFile, read_case, write_case
from braidcast.dataset.case_record import CaseRecord, Origin, failure, record
from braidcast.dataset.fields import ARRAYS, CENTRE, COSTS, RESULTS
from braidcast.dataset.plan import Range


@pytest.fixture
def origin(deployment: Deployment) -> Origin:
    parameters = ((Range(("vessel", "P1", 1), 5.0, 30.0, "mm"), 15.0),)
    return Origin("0123456789abcdef", 3, deployment.case.to_toml() + "# é", parameters)


@pytest.fixture
def written(tmp_path: Path, deployment: Deployment, origin: Origin) -> Path:
    path = tmp_path / "00003.nc"
    write_case(path, record(deployment, origin), origin)
    return path


def test_what_is_written_is_read(written: Path, deployment: Deployment, origin: Origin) -> None:
    found = read_case(written)
    assert (found.plan_id, found.index, found.toml) == (origin.plan_id, 3, origin.toml)
    assert found.finished and found.status == "finished" and found.reason == "equilibrium"
    assert (found.outcome, found.clinical_outcome) == ("success", "success")
    assert found.versions.startswith("braidcast 0.1.0 (sources ")
    assert ", numpy " in found.versions and ", python 3." in found.versions
    assert set(found.values) == {f.name for f in (*RESULTS, *COSTS, CENTRE)}
    for name, value in {
        "positions": deployment.positions,
        "contact_force": deployment.contact_force,
        "positioned_centreline": deployment.positioned_centreline,
        "aneurysm_centre": deployment.case.aneurysm_centre,
        "newton_iterations": 70,
        "residual": 1e-6,
        "deployed_length": deployment.deployed_length_mm,
        "cpu_seconds": 5.9,
    }.items():
        expected = np.asarray(value, dtype=found.values[name].dtype)
        np.testing.assert_array_equal(found.values[name], expected, name)


def test_rotation_vectors_turn_as_the_rotations_do(
    tmp_path: Path, deployment: Deployment, origin: Origin
) -> None:
    turns = Rotation.random(len(deployment.positions), rng=1)
    write_case(
        tmp_path / "a.nc",
        record(replace(deployment, rotations=turns.as_matrix()), origin),
        origin,
    )
    vectors = read_case(tmp_path / "a.nc").values["rotation_vector"]
    np.testing.assert_allclose(
        Rotation.from_rotvec(vectors.astype(float)).as_matrix(), turns.as_matrix(), atol=1e-6
    )


def test_any_netcdf_reader_opens_it(written: Path) -> None:
    ours = read_case(written)
    with xarray.open_dataset(written, engine="scipy") as theirs:
        assert theirs.attrs["status"] == "finished" and theirs.attrs["case_toml"] == ours.toml
        assert theirs.positions.dims == ("node", "xyz") and theirs.positions.units == "mm"
        assert float(theirs.vessel_P1_y) == 15.0 and theirs.vessel_P1_y.units == "mm"
        for name, value in ours.values.items():
            np.testing.assert_array_equal(theirs[name].values, value, name)
            assert theirs[name].attrs["units"] and theirs[name].attrs["long_name"]
    with netcdf_file(written, mmap=False) as theirs:
        assert theirs.version_byte == 2


def test_places_are_where_the_values_are(written: Path) -> None:
    content, found = written.read_bytes(), read_case(written)
    assert set(found.places) >= {known.name for known in ARRAYS}
    for known in ARRAYS:
        place = found.places[known.name]
        raw = np.frombuffer(content[place.offset : place.offset + place.size], place.dtype)
        np.testing.assert_array_equal(raw.reshape(place.shape), found.values[known.name])


def test_without_arrays_no_content_is_kept(written: Path) -> None:
    found = read_case(written, arrays=False)
    assert not {known.name for known in ARRAYS} & set(found.values)
    assert all(value.base is None for value in found.values.values())
    assert float(found.values["strain_energy"]) == 1.5


def test_a_case_without_equilibrium_is_a_failed_one(
    tmp_path: Path, deployment: Deployment, origin: Origin
) -> None:
    diverged = replace(deployment, converged=False, reason="the step became too small")
    write_case(tmp_path / "a.nc", record(diverged, origin), origin)
    found = read_case(tmp_path / "a.nc")
    assert found.status == "failed" and not found.finished
    assert found.reason == "the step became too small"
    assert (found.outcome, found.clinical_outcome, found.checksum) == ("", "", "")
    assert set(found.values) == {"cpu_seconds", "wall_seconds"}
    write_case(tmp_path / "b.nc", failure(origin, "odd \udcff"), origin)
    other = read_case(tmp_path / "b.nc")
    assert other.reason == "odd ?" and other.values == {}


def test_without_aneurysm_there_is_no_centre(deployment: Deployment, origin: Origin) -> None:
    tables = deployment.case.to_dict()
    del tables["aneurysm"]
    plain = Case.from_dict(tables)
    kept = record(replace(deployment, case=plain), origin)
    assert np.isnan(kept.values["aneurysm_centre"]).all()


def test_the_checksum_is_of_results_alone(deployment: Deployment, origin: Origin) -> None:
    def checksum(**changes: object) -> str:
        return record(replace(deployment, **changes), origin).checksum  # type: ignore[arg-type]

    same = checksum()
    assert len(same) == 64
    assert checksum(cpu_seconds=1.0, wall_seconds=2.0) == same
    assert record(deployment, replace(origin, index=4)).checksum == same
    nudged = deployment.positions.copy()
    nudged[7, 1] = np.nextafter(np.float32(nudged[7, 1]), np.float32(1e9))
    for changes in (
        {"positions": nudged},
        {"strain_energy_mJ": np.nextafter(1.5, 2.0)},
        {"outcome": "failure"},
        {"clinical_outcome": "failure"},
        {"newton_iterations": 71},
    ):
        assert checksum(**changes) != same, changes


@settings(max_examples=200, deadline=None)
@given(data=st.data())
def test_whatever_is_spoilt_is_found_out(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    path = tmp_path_factory.getbasetemp() / "spoilt.nc"
    content = _small()
    place = data.draw(st.integers(0, len(content) - 1))
    kind = data.draw(st.sampled_from(["cut", "changed", "longer", "zeros"]))
    if kind == "cut":
        spoilt = content[:place]
    elif kind == "changed":
        flipped = content[place] ^ data.draw(st.integers(1, 255))
        spoilt = content[:place] + bytes([flipped]) + content[place + 1 :]
    elif kind == "longer":
        spoilt = content + bytes(place % 7 + 1)
    else:  # what a file system leaves after the power failed
        spoilt = content[:place] + bytes(len(content) - place)
    if spoilt == content:
        return
    path.write_bytes(spoilt)
    with pytest.raises(DamagedFile, match="spoilt.nc is damaged"):
        read_case(path)


@cache
def _small() -> bytes:
    origin = Origin("0123456789abcdef", 0, "title = ''", ())
    return case_file._sealed(case_file._netcdf(failure(origin, "because"), origin))


@pytest.mark.parametrize("content", [b"", b"CDF\x02", b"seal", b"seal" * 100, bytes(1000)])
def test_what_never_was_a_case_file(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "a.nc").write_bytes(content)
    with pytest.raises(DamagedFile):
        read_case(tmp_path / "a.nc")


def test_no_file_is_no_damage(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        read_case(tmp_path / "none.nc")


def test_a_newer_store_is_refused(
    tmp_path: Path, origin: Origin, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.nc"
    with monkeypatch.context() as later:
        later.setattr(case_file, "STORE_VERSION", 2)
        write_case(path, failure(origin, "because"), origin)
    with pytest.raises(
        InputError, match=r"store_version = 2 must be at most 1; .* newer braidcast"
    ):
        read_case(path)


@pytest.mark.parametrize("when", ["fsync", "replace"])
def test_a_disk_that_fills_leaves_the_old_file(
    written: Path,
    deployment: Deployment,
    origin: Origin,
    monkeypatch: pytest.MonkeyPatch,
    when: str,
) -> None:
    before = written.read_bytes()

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, when, full)
    with pytest.raises(OSError, match="No space left") as caught:
        write_case(written, failure(origin, "because"), origin)
    assert caught.value.filename == str(written)
    assert list(written.parent.iterdir()) == [written] and written.read_bytes() == before


def test_arrays_that_do_not_fit_each_other_are_not_written(
    tmp_path: Path, deployment: Deployment, origin: Origin
) -> None:
    kept: CaseRecord = record(deployment, origin)
    values = {**kept.values, "contact_force": kept.values["contact_force"][:-1]}
    with pytest.raises(ValueError, match="along node"):
        write_case(tmp_path / "a.nc", replace(kept, values=values), origin)
