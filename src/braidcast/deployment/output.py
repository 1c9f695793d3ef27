"""The files of a deployment, each of them whole or not there.

Everything is written into a hidden folder inside the output folder and flushed to the disk, then
moved to its name; ``summary.json`` goes last. Whatever interrupts the writing - a full disk,
Ctrl-C - leaves the folder as it was.
"""

from __future__ import annotations

import json
import math
import os
import signal
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NamedTuple

from braidcast import __version__
from braidcast.deployment.picture import PictureError, picture_png
from braidcast.deployment.result import Deployment
from braidcast.deployment.vtp import write_collection, write_polylines
from braidcast.errors import InputError
from braidcast.vessels.surface import vessel_surface, write_stl

_FILES = ("deployed.vtp", "vessel.stl", "deployed.png", "frames.pvd", "summary.json")


class Written(NamedTuple):
    """What ``write_deployment`` wrote, and one sentence for each thing that it could not."""

    files: list[Path]
    notes: list[str]


def check_folder(folder: str | Path) -> None:
    """Raise ``InputError`` if results could not be written in ``folder``.

    The folder may be missing, its parent may not. Nothing stays behind.
    """
    if folder == "":
        raise InputError('output folder = "" must be the name of a folder, "." for this one')
    folder = Path(folder)
    try:
        if folder.exists() and not folder.is_dir():
            raise InputError(f"output folder = {folder} is a file, must be a folder or a new name")
        if not folder.exists() and not folder.parent.is_dir():
            raise InputError(
                f"output folder = {folder} must be in a folder that exists, "
                f"{folder.parent} does not"
            )
        for name in _FILES:
            if (folder / name).is_dir():
                raise InputError(
                    f"output folder = {folder} has a folder called {name}, must leave that name "
                    "free for a file"
                )
        # Only trying tells: permission bits say nothing of read-only disks or of root's rights.
        if folder.exists():
            tempfile.TemporaryDirectory(prefix=".braidcast-", dir=folder).cleanup()
        else:
            folder.mkdir()
            folder.rmdir()
    except InputError:
        raise
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"output folder = {folder} must be writable: {reason}") from None


def write_deployment(
    deployment: Deployment, folder: str | Path, *, frames: bool = False, picture: bool = True
) -> Written:
    """Write deployed.vtp, vessel.stl, summary.json and deployed.png into ``folder``.

    With ``frames`` also frames.pvd and frames/stage_0000.vtp …, one for each state the deployment
    kept. Results of an earlier run in the same folder are replaced, and removed where this run has
    none. The picture needs ``braidcast[pictures]``; without it a note says so. ``InputError`` if
    ``folder`` cannot be used, ``OSError`` if the disk is full.
    """
    check_folder(folder)
    folder = Path(folder)
    surface = vessel_surface(deployment.case.vessel_geometry)
    with _workplace(folder) as work:
        _write_wires(work / "deployed.vtp", deployment)
        write_stl(work / "vessel.stl", *surface)
        if frames:
            _write_frames(work, deployment)
        _write_summary(work / "summary.json", deployment)
        files = _publish(work, folder)
    if not picture:
        return Written(files, [])
    try:
        png = picture_png(deployment, surface)
        with _workplace(folder) as work:
            (work / "deployed.png").write_bytes(png)
            _flush(work / "deployed.png")
            _move(work, folder, [Path("deployed.png")])
    except PictureError as error:
        return Written(files, [f"no deployed.png: {error}"])
    except OSError as error:  # the results are there: a picture is not worth failing for
        return Written(files, [f"no deployed.png: {error.strerror or error}"])
    return Written([*files, folder / "deployed.png"], [])


def summary(deployment: Deployment) -> dict[str, Any]:
    """The keys and values of summary.json; each number in the unit its key ends with."""
    return {
        "title": deployment.case.title,
        "outcome": deployment.outcome,
        "clinical_outcome": deployment.clinical_outcome,
        "converged": bool(deployment.converged),
        "reason": deployment.reason,
        "deployed_length_mm": _number(deployment.deployed_length_mm),
        "free_length_mm": _number(deployment.free_length_mm),
        "crimped_length_mm": _number(deployment.crimped_length_mm),
        "foreshortening_percent": _number(deployment.foreshortening_percent),
        "end_nodes_in_sac": int(deployment.end_nodes_in_sac),
        "max_penetration_mm": _number(deployment.max_penetration_mm),
        "strain_energy_mJ": _number(deployment.strain_energy_mJ),
        "residual_N": _number(deployment.residual_N),
        "residual_relative": _number(deployment.residual_relative),
        "newton_iterations": int(deployment.newton_iterations),
        "wall_seconds": _number(deployment.wall_seconds),
        "cpu_seconds": _number(deployment.cpu_seconds),
        "version": __version__,
    }


def _number(value: float) -> float | None:
    # JSON has no NaN; a diverged run may.
    return float(value) if math.isfinite(value) else None


def _write_summary(path: Path, deployment: Deployment) -> None:
    text = json.dumps(summary(deployment), indent=2, ensure_ascii=False, allow_nan=False)
    path.write_text(text + "\n", encoding="utf-8")


def _write_wires(path: Path, deployment: Deployment) -> None:
    write_polylines(path, deployment.positions, deployment.wires, deployment.point_arrays)


def _write_frames(work: Path, deployment: Deployment) -> None:
    braid = deployment.case.braid
    (work / "frames").mkdir()
    listed = []
    for index, (stage, positions) in enumerate(deployment.frames):
        name = f"frames/stage_{index:04d}.vtp"
        arrays = {
            "displacement_mm": positions - braid.positions,
            "wire": braid.wire_of_node,
            "ring": braid.rings,
        }
        write_polylines(work / name, positions, deployment.wires, arrays)
        listed.append((stage, name))
    write_collection(work / "frames.pvd", listed)


@contextmanager
def _workplace(folder: Path) -> Iterator[Path]:
    """A hidden folder inside ``folder``, on the same disk so that a move is atomic."""
    made = not folder.exists()
    folder.mkdir(exist_ok=True)
    try:
        with tempfile.TemporaryDirectory(prefix=".braidcast-", dir=folder) as work:
            yield Path(work)
    except BaseException:
        if made:
            with suppress(OSError):  # not empty: then it is no longer only ours
                folder.rmdir()
        raise


def _publish(work: Path, folder: Path) -> list[Path]:
    """Move everything of ``work`` to ``folder``, and remove what an earlier run left there."""
    new = sorted(path.relative_to(work) for path in work.rglob("*") if path.is_file())
    new.sort(key=lambda path: path.name == "summary.json")
    for path in new:
        _flush(work / path)
    old = [Path(name) for name in _FILES if (folder / name).is_file()]
    old += [p.relative_to(folder) for p in folder.glob("frames/stage_[0-9][0-9][0-9][0-9].vtp")]
    with _interrupts_held():
        for path in set(old) - set(new):
            (folder / path).unlink()
        files = _move(work, folder, new)
        with suppress(OSError):  # missing, or the user keeps something else there
            (folder / "frames").rmdir()
    return files


def _move(work: Path, folder: Path, names: list[Path]) -> list[Path]:
    for name in names:
        (folder / name).parent.mkdir(exist_ok=True)
        os.replace(work / name, folder / name)
    return [folder / name for name in names]


def _flush(path: Path) -> None:
    with path.open("rb+") as stream:
        os.fsync(stream.fileno())


@contextmanager
def _interrupts_held() -> Iterator[None]:
    """Let Ctrl-C wait for the few milliseconds in which old files give way to new ones."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    waiting: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, frame: waiting.append(number))
    try:
        yield
    finally:
        # None: a handler that was not set from Python, and cannot be put back from it.
        signal.signal(signal.SIGINT, signal.default_int_handler if before is None else before)
    if waiting:
        signal.raise_signal(signal.SIGINT)
