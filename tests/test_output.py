"""Result files: read back, complete or absent, whatever happens while they are written."""

import json
import os
import resource
import signal
import subprocess
import sys
import threading
import xml.etree.ElementTree as ET
from base64 import b64decode
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from braidcast import Deployment, InputError, __version__, results_folder, write_deployment
from braidcast.deployment import drawing, output, picture
from braidcast.results_folder import check_file, check_folder

SUMMARY_KEYS = {
    *("outcome", "deployed_length_mm", "free_length_mm", "foreshortening_percent"),
    *("wall_seconds", "cpu_seconds", "version", "converged", "newton_iterations", "residual_N"),
    *("strain_energy_mJ", "max_penetration_mm", "crimped_length_mm", "end_nodes_in_sac"),
    *("title", "reason", "clinical_outcome", "residual_relative"),
}
FILES = {"deployed.vtp", "vessel.stl", "summary.json"}


def names(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}


def arrays_of(path: Path) -> dict[str, np.ndarray]:
    """The arrays of a VTP file, read by the standard library alone."""
    arrays = {}
    for element in ET.parse(path).iter("DataArray"):
        raw = b64decode(element.text or "")
        assert int.from_bytes(raw[:8], "little") == len(raw) - 8
        kind = {"Float64": "<f8", "Int64": "<i8"}[element.attrib["type"]]
        shape = (-1, int(element.attrib["NumberOfComponents"]))
        arrays[element.attrib["Name"]] = np.frombuffer(raw[8:], kind).reshape(shape).squeeze()
    return arrays


def test_wires_are_read_back_as_they_were(deployment: Deployment, tmp_path: Path) -> None:
    written = write_deployment(deployment, tmp_path / "out", picture=False)
    assert {path.name for path in written.files} == names(tmp_path / "out") == FILES
    assert written.notes == []
    arrays = arrays_of(tmp_path / "out" / "deployed.vtp")
    np.testing.assert_array_equal(arrays["Points"], deployment.positions)
    braid = deployment.case.braid
    free = arrays["Points"] - arrays["displacement_mm"]
    np.testing.assert_allclose(free, braid.positions, atol=1e-12)
    np.testing.assert_array_equal(arrays["ring"], braid.rings)
    np.testing.assert_array_equal(arrays["connectivity"], np.arange(braid.node_count))
    np.testing.assert_array_equal(np.diff(arrays["offsets"]), braid.segments + 1)


def test_pyvista_reads_what_to_polydata_makes(deployment: Deployment, tmp_path: Path) -> None:
    pyvista = pytest.importorskip("pyvista")
    write_deployment(deployment, tmp_path, frames=True, picture=False)
    read, made = pyvista.read(tmp_path / "deployed.vtp"), deployment.to_polydata()
    assert read.n_cells == made.n_cells == deployment.case.braid.wires
    np.testing.assert_array_equal(read.points, made.points)
    np.testing.assert_array_equal(read.lines, made.lines)
    assert set(read.point_data.keys()) == set(made.point_data.keys())
    for name in ("gap_mm", "contact_force_N", "displacement_mm", "rotation", "wire", "ring"):
        np.testing.assert_array_equal(read.point_data[name], made.point_data[name])
    reader = pyvista.get_reader(tmp_path / "frames.pvd")
    assert reader.time_values == [0.0, 1.0]
    reader.set_active_time_value(1.0)
    np.testing.assert_array_equal(reader.read()[0].points, deployment.positions)
    vessel = pyvista.read(tmp_path / "vessel.stl")
    assert vessel.n_open_edges == 0


def test_the_summary_has_the_agreed_keys(deployment: Deployment, tmp_path: Path) -> None:
    diverged = replace(deployment, converged=False, reason="cut", residual_relative=float("nan"))
    write_deployment(diverged, tmp_path, picture=False)
    read = json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))
    assert set(read) == SUMMARY_KEYS
    assert read["residual_relative"] is None  # JSON has no NaN
    assert read["converged"] is False and read["reason"] == "cut"
    assert read["version"] == __version__
    lengths = read["deployed_length_mm"], read["crimped_length_mm"]
    assert read["foreshortening_percent"] == pytest.approx(100 * (1 - lengths[0] / lengths[1]))


def test_frames_are_kept_on_demand_and_old_ones_removed(
    deployment: Deployment, tmp_path: Path
) -> None:
    stages = {"frames.pvd", "frames/stage_0000.vtp", "frames/stage_0001.vtp"}
    write_deployment(deployment, tmp_path, frames=True, picture=False)
    assert names(tmp_path) == FILES | stages
    (tmp_path / "deployed.png").write_bytes(b"of an earlier run")
    (tmp_path / "frames" / "mine.txt").write_text("keep")
    (tmp_path / "notes.txt").write_text("keep")
    write_deployment(deployment, tmp_path, picture=False)
    assert names(tmp_path) == FILES | {"notes.txt", "frames/mine.txt"}
    (tmp_path / "frames" / "mine.txt").unlink()
    write_deployment(deployment, tmp_path, frames=True, picture=False)
    write_deployment(deployment, tmp_path, picture=False)
    assert not (tmp_path / "frames").exists()


def test_the_picture_shows_something(deployment: Deployment, tmp_path: Path) -> None:
    pytest.importorskip("pyvista")
    from PIL import Image

    written = write_deployment(deployment, tmp_path)
    if written.notes:
        assert "OpenGL" in written.notes[0]
        pytest.skip(written.notes[0])
    with Image.open(tmp_path / "deployed.png") as image:
        assert image.size == drawing.SIZE
        pixels = np.asarray(image.convert("RGB"), dtype=int)
    assert 0.02 < np.mean(pixels.min(axis=-1) < 120) < 0.6, "wires"
    assert 0.1 < np.mean(np.abs(pixels - 255).sum(axis=-1) > 30) < 0.9, "vessel and wires"


@pytest.mark.parametrize(
    ("outcome", "says"),
    [
        (subprocess.CompletedProcess([], -signal.SIGSEGV, b"", b""), "OpenGL"),
        (subprocess.CompletedProcess([], 1, b"", b"Traceback\nOSError: no"), "OSError: no"),
        (subprocess.CompletedProcess([], 0, b"", b""), "no reason given"),
        (subprocess.TimeoutExpired("python", 120), "120"),
    ],
)
def test_the_results_survive_a_picture_that_fails(
    deployment: Deployment, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, outcome: Any, says: str
) -> None:
    class Process:
        returncode = getattr(outcome, "returncode", None)

        def __init__(self, *_: Any, **__: Any) -> None:
            pass

        def communicate(self, *_: Any) -> Any:
            if isinstance(outcome, Exception):
                raise outcome
            return outcome.stdout, outcome.stderr

        def poll(self) -> int:
            return 0

    monkeypatch.setattr(picture, "find_spec", lambda name: True)
    monkeypatch.setattr(subprocess, "Popen", Process)
    written = write_deployment(deployment, tmp_path)
    assert names(tmp_path) == FILES
    assert len(written.notes) == 1 and says in written.notes[0]


def test_without_the_extra_one_line_says_how_to_get_it(
    deployment: Deployment, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(picture, "find_spec", lambda name: None)
    monkeypatch.setitem(sys.modules, "pyvista", None)
    written = write_deployment(deployment, tmp_path)
    assert names(tmp_path) == FILES
    (note,) = written.notes
    assert "pip install 'braidcast[pictures]'" in note and "\n" not in note
    with pytest.raises(ImportError, match="pip install"):
        deployment.to_polydata()


def test_folders_that_cannot_take_results(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    (tmp_path / "blocked" / "deployed.vtp").mkdir(parents=True)
    for folder, says in [
        (tmp_path / "file", "is a file"),
        (tmp_path / "file" / "inside", "must be"),
        (tmp_path / "none" / "inside", "must be in a folder that exists"),
        (tmp_path / "blocked", "has a folder called deployed.vtp"),
        (tmp_path / ("x" * 300), "must be writable"),
        ("nul\0byte", "must be"),
    ]:
        with pytest.raises(InputError, match=says) as caught:
            check_folder(folder)
        assert str(caught.value).startswith("output folder = ")
        assert "\n" not in str(caught.value)
    check_folder(tmp_path / "new")
    check_folder(tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {"file", "blocked"}


def test_a_read_only_folder_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # Root may write to folders whose permissions say no: the system's answer is made up here.
    def refuse(*_: Any, **__: Any) -> None:
        raise OSError(30, os.strerror(30))

    monkeypatch.setattr(os, "mkdir", refuse)
    with pytest.raises(InputError, match=r"must be writable: Read-only file system"):
        check_folder(tmp_path)


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="needs a folder nobody can write to")
def test_a_folder_nobody_can_write_to_is_refused() -> None:
    with pytest.raises(InputError, match="must be writable"):
        check_folder("/proc/self")


@pytest.mark.parametrize("earlier", [False, True])
def test_a_full_disk_leaves_the_folder_as_it_was(
    deployment: Deployment, tmp_path: Path, earlier: bool
) -> None:
    folder = tmp_path / "out"
    if earlier:
        write_deployment(deployment, folder, picture=False)
        before = {name: (folder / name).read_bytes() for name in names(folder)}
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, limits[1]))
    try:
        with pytest.raises(OSError, match="File too large"):
            write_deployment(deployment, folder, picture=False)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    if earlier:
        assert before == {name: (folder / name).read_bytes() for name in names(folder)}
        assert not list(folder.glob(".braidcast-*"))
    else:
        assert not folder.exists()


@pytest.mark.parametrize(
    ("module", "step"),
    [
        *((output, f"write_{name}") for name in ("polylines", "stl", "collection", "summary")),
        (results_folder, "_flush"),
    ],
)
def test_an_interrupt_while_writing_leaves_nothing(
    deployment: Deployment,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    module: ModuleType,
    step: str,
) -> None:
    def interrupt(*_: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(module, step, interrupt)
    with pytest.raises(KeyboardInterrupt):
        write_deployment(deployment, tmp_path / "out", frames=True, picture=False)
    assert list(tmp_path.iterdir()) == []


def test_an_interrupt_while_moving_waits_for_the_last_file(
    deployment: Deployment, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    move = os.replace

    def interrupted(*arguments: Any) -> None:
        signal.raise_signal(signal.SIGINT)
        move(*arguments)

    monkeypatch.setattr(os, "replace", interrupted)
    monkeypatch.setattr(output, "write_stl", lambda path, *_: path.write_bytes(b"solid"))
    handler = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt):
        write_deployment(deployment, tmp_path / "out", picture=False)
    assert signal.getsignal(signal.SIGINT) is handler
    assert names(tmp_path / "out") == FILES


def test_results_can_be_written_from_a_thread(deployment: Deployment, tmp_path: Path) -> None:
    thread = threading.Thread(
        target=write_deployment, args=(deployment, tmp_path / "out"), kwargs={"picture": False}
    )
    thread.start()
    thread.join()
    assert names(tmp_path / "out") == FILES


def test_a_disk_too_full_for_the_picture_costs_only_the_picture(
    deployment: Deployment, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(picture.Drawer, "draw", lambda *_: [b"x" * 5_000_000])
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4_500_000, limits[1]))
    try:
        written = write_deployment(deployment, tmp_path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert written.notes == ["no deployed.png: File too large"]
    assert names(tmp_path) == FILES


def test_what_is_no_ordinary_file_is_not_replaced(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(InputError, match="pipe is no ordinary file"):
        check_file(pipe)
    check_file(tmp_path / "new.html")
