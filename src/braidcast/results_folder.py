"""The folder of one result: all of its files whole, or as they were before.

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
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NamedTuple

from braidcast.atomic import TEMPORARY
from braidcast.errors import InputError

#: The files of simulations and of predictions: a result of either kind replaces one of the other.
FILES = (
    *("deployed.vtp", "vessel.stl", "deployed.png", "deployed_std.png"),
    *("frames.pvd", "summary.json"),
)
_FRAMES = "frames/stage_[0-9][0-9][0-9][0-9].vtp"


class Written(NamedTuple):
    """What was written, and one sentence for each thing that could not be."""

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
        for name in FILES:
            if (folder / name).is_dir():
                raise InputError(
                    f"output folder = {folder} has a folder called {name}, must leave that name "
                    "free for a file"
                )
        # Only trying tells: permission bits say nothing of read-only disks or of root's rights.
        if folder.exists():
            tempfile.TemporaryDirectory(prefix=TEMPORARY, dir=folder).cleanup()
        else:
            folder.mkdir()
            folder.rmdir()
    except InputError:
        raise
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"output folder = {folder} must be writable: {reason}") from None


def check_file(path: str | Path) -> None:
    """Raise ``InputError`` if a file could not be written at ``path``; nothing stays behind."""
    path = Path(path)
    if path.is_dir() or not path.name:
        raise InputError(f"output file = {path} is a folder, must be a file or a new name")
    if path.exists() and not path.is_file():
        raise InputError(f"output file = {path} is no ordinary file, must be one or a new name")
    if not path.parent.is_dir():
        raise InputError(
            f"output file = {path} must be in a folder that exists, {path.parent} does not"
        )
    check_folder(path.parent)


@contextmanager
def workplace(folder: Path) -> Iterator[Path]:
    """A hidden folder inside ``folder``, on the same disk so that a move is atomic."""
    made = not folder.exists()
    folder.mkdir(exist_ok=True)
    try:
        with tempfile.TemporaryDirectory(prefix=TEMPORARY, dir=folder) as work:
            yield Path(work)
    except BaseException:
        if made:
            with suppress(OSError):  # not empty: then it is no longer only ours
                folder.rmdir()
        raise


def publish(work: Path, folder: Path) -> list[Path]:
    """Move everything of ``work`` to ``folder``, and remove what an earlier run left there."""
    new = _flushed(work)
    old = [Path(name) for name in FILES if (folder / name).is_file()]
    old += [path.relative_to(folder) for path in folder.glob(_FRAMES)]
    with _interrupts_held():
        for path in set(old) - set(new):
            (folder / path).unlink()
        files = _move(work, folder, new)
        with suppress(OSError):  # missing, or the user keeps something else there
            (folder / "frames").rmdir()
    return files


def add(work: Path, folder: Path) -> list[Path]:
    """Move everything of ``work`` to ``folder``, beside what is there."""
    new = _flushed(work)
    with _interrupts_held():
        return _move(work, folder, new)


def write_summary(path: Path, summary: Mapping[str, Any]) -> None:
    """Write a result's values as JSON."""
    text = json.dumps(summary, indent=2, ensure_ascii=False, allow_nan=False)
    path.write_text(text + "\n", encoding="utf-8")


def number(value: float) -> float | None:
    """A number that JSON has: it knows no NaN, and no infinity."""
    return float(value) if math.isfinite(value) else None


def _flushed(work: Path) -> list[Path]:
    """The files of ``work``, safe on the disk; the summary last."""
    files = sorted(path.relative_to(work) for path in work.rglob("*") if path.is_file())
    files.sort(key=lambda path: path.name == "summary.json")
    for path in files:
        _flush(work / path)
    return files


def _flush(path: Path) -> None:
    with path.open("rb+") as stream:
        os.fsync(stream.fileno())


def _move(work: Path, folder: Path, names: list[Path]) -> list[Path]:
    for name in names:
        (folder / name).parent.mkdir(exist_ok=True)
        os.replace(work / name, folder / name)
    return [folder / name for name in names]


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
