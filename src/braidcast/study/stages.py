"""Stages: what each reads and writes is files; one is done again only if what it reads changed.

A stage is a function of a ``Study`` that writes files below the study's folder and returns their
names. When it is done, a stamp in ``stages/`` keeps a key of all that went in (its options, the
cases it reads, the files of the stages it needs, the sources) and a checksum of every file that
came out. A stage whose stamp has the same key, and whose files are what they were, is not done
again.
"""

from __future__ import annotations

import dis
import hashlib
import json
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib.metadata import version
from pathlib import Path
from types import CodeType
from typing import Any

from distributed import Client, KilledWorker, as_completed
from threadpoolctl import threadpool_limits

import braidcast
from braidcast.atomic import TEMPORARY, write_atomically
from braidcast.study.workspace import Study

STAMPS = "stages"

_LIBRARIES = ("numpy", "scipy", "scikit-learn", "pandas")


class StageFailed(Exception):
    """A stage that raised: its name, and why, in one sentence."""


@dataclass(frozen=True)
class Stage:
    """``work(study, **options)`` writes files and returns their names below the study's folder."""

    name: str
    work: Callable[..., Sequence[str]]
    options: Mapping[str, Any] = field(default_factory=dict)
    needs: tuple[str, ...] = ()
    """Names of the stages whose files it reads."""
    cases: int = 0
    """It reads the first so many cases of the dataset."""


@dataclass(frozen=True)
class Done:
    """A stage that is done: ``seconds`` 0 if it was before."""

    name: str
    files: Mapping[str, str]
    """Names below the study's folder, and SHA-256 of each."""
    wall_seconds: float
    cpu_seconds: float
    again: bool


def run_stages(
    study: Study,
    stages: Sequence[Stage],
    client: Client,
    report: Callable[[Done, int], None] = lambda done, left: None,
) -> list[Done]:
    """Do all stages, those that are ready at the same time on the client's workers.

    ``report`` is given each that is done and how many are left. What stages of earlier runs wrote,
    and no stage writes any more, is removed. ``StageFailed`` if one raises; those that were done
    stay.
    """
    finished: dict[str, Done] = {}
    waiting = {stage.name: stage for stage in stages}
    running: dict[Any, tuple[Stage, str]] = {}
    completed = as_completed(loop=client.loop)
    data = study.data_ids({stage.cases for stage in stages})

    def finish(done: Done) -> None:
        finished[done.name] = done
        report(done, len(stages) - len(finished))

    def start_ready() -> None:
        begun = True
        while begun:
            begun = False
            for stage in list(waiting.values()):
                if not all(name in finished for name in stage.needs):
                    continue
                del waiting[stage.name]
                key = _key(stage, data[stage.cases], [finished[name] for name in stage.needs])
                kept = _kept(study.home, stage, key)
                if kept is not None:
                    finish(kept)
                    begun = True
                    continue
                # A stage that raises is not tried again, so that its reason is the first one.
                future = client.submit(_work, study, stage, pure=False, retries=0)
                running[future.key] = stage, key
                completed.add(future)

    start_ready()
    for future in completed:
        stage, key = running.pop(future.key)
        try:
            result = future.result()
        except KilledWorker:
            raise StageFailed(
                f"stage {stage.name} failed: its worker died, perhaps for want of memory; "
                "started again with fewer workers the study goes on from here"
            ) from None
        if isinstance(result, Exception):
            raise result
        files, wall, cpu = result
        _stamp(study.home, stage, key, files, wall, cpu)
        finish(Done(stage.name, files, wall, cpu, again=True))
        start_ready()
    _remove_what_is_no_longer_written(study.home, finished)
    return [finished[stage.name] for stage in stages]


def _work(study: Study, stage: Stage) -> tuple[dict[str, str], float, float] | Exception:
    """In a worker: files with checksums, wall and CPU seconds; or what to raise in their place."""
    wall, cpu = time.perf_counter(), time.process_time()
    try:
        with threadpool_limits(1):  # the same last digit whatever the machine, no worker in the way
            names = stage.work(study, **stage.options)
        files = {name: _checksum(study.home / name) for name in names}
    except OSError as error:
        return OSError(error.errno, error.strerror, error.filename)
    except Exception as error:
        reason = f"{type(error).__name__}: {error}".splitlines()[0]
        return StageFailed(f"stage {stage.name} failed: {reason}")
    return files, time.perf_counter() - wall, time.process_time() - cpu


def _key(stage: Stage, data: str, needed: Sequence[Done]) -> str:
    parts = [
        stage.name,
        dict(stage.options),
        data,
        sorted((name, digest) for done in needed for name, digest in done.files.items()),
        _sources(),
        {name: version(name) for name in _LIBRARIES},
    ]
    text = json.dumps(parts, sort_keys=True, default=str) + _own_sources(stage.work.__module__)
    return hashlib.sha256(text.encode()).hexdigest()


@cache
def _sources() -> str:
    """Of braidcast and its model, less commands and stages: their own sources are in their keys."""
    package = Path(braidcast.__file__).parent
    digest = hashlib.sha256()
    for path in sorted([*package.rglob("*.py"), *package.rglob("*.npz")]):
        if path.relative_to(package).parts[0] not in ("cli", "study"):
            digest.update(path.read_bytes())
    return digest.hexdigest()


@cache
def _own_sources(module: str) -> str:
    """Of a module of the study and all of the study that it imports, and those import."""
    digest, waiting, seen = hashlib.sha256(), [module], set[str]()
    while waiting:
        name = waiting.pop()
        below = name.removeprefix(f"{__package__}.").split(".")
        path = Path(__file__).parent.joinpath(*below).with_suffix(".py")
        if name in seen or not name.startswith(f"{__package__}.") or not path.is_file():
            continue
        seen.add(name)
        source = path.read_bytes()
        digest.update(source)
        waiting += _imported(compile(source, path, "exec"))
    return digest.hexdigest()


def _imported(code: CodeType) -> Iterator[str]:
    """Modules that code imports, and names it imports from them, that may be modules too.

    Read from the instructions: Python 3.11's ``ast.parse`` fails now and then if a thread of a
    worker parses too (CPython issue 106905).
    """
    module = ""
    for instruction in dis.get_instructions(code):
        if instruction.opname == "IMPORT_NAME":
            module = instruction.argval
            yield module
        elif instruction.opname == "IMPORT_FROM":
            yield f"{module}.{instruction.argval}"
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _imported(constant)


def _stamp(
    home: Path, stage: Stage, key: str, files: Mapping[str, str], wall: float, cpu: float
) -> None:
    stamp = {"key": key, "files": files, "wall_seconds": wall, "cpu_seconds": cpu}
    path = _stamp_file(home, stage.name)
    path.parent.mkdir(exist_ok=True)
    write_atomically(path, (json.dumps(stamp, indent=1) + "\n").encode())


def _stamp_file(home: Path, name: str) -> Path:
    return home / STAMPS / f"{name.replace(' ', '_').replace('/', '_')}.json"


def _kept(home: Path, stage: Stage, key: str) -> Done | None:
    """The stage as it was done before, if that still stands."""
    stamp = _read(_stamp_file(home, stage.name))
    if stamp.get("key") != key:
        return None
    for name, digest in stamp["files"].items():
        path = home / name
        if not path.is_file() or _checksum(path) != digest:
            return None
    return Done(
        stage.name, stamp["files"], stamp["wall_seconds"], stamp["cpu_seconds"], again=False
    )


def _read(stamp: Path) -> dict[str, Any]:
    try:
        found = json.loads(stamp.read_bytes())
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}


def _remove_what_is_no_longer_written(home: Path, finished: Mapping[str, Done]) -> None:
    written = {name for done in finished.values() for name in done.files}
    current = {_stamp_file(home, name) for name in finished}
    for stamp in sorted((home / STAMPS).glob("*.json")):
        if stamp not in current:
            for name in set(_read(stamp).get("files", {})) - written:
                (home / name).unlink(missing_ok=True)
            stamp.unlink()
    for leftover in home.rglob(f"{TEMPORARY}*"):
        if leftover.is_file():
            leftover.unlink(missing_ok=True)


def _checksum(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
