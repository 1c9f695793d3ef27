"""What a simulation says it was made by."""

import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

import braidcast
from braidcast.deployment.sources import fingerprint


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A copy of the sources that fingerprint looks at."""
    copy = tmp_path / "braidcast"
    shutil.copytree(Path(braidcast.__file__).parent, copy)
    monkeypatch.setattr(braidcast, "__file__", str(copy / "__init__.py"))
    yield copy
    fingerprint.cache_clear()


def now() -> str:
    fingerprint.cache_clear()
    return fingerprint()


@pytest.mark.parametrize(
    "file", ["case.py", "mechanics/beams.py", "devices/braid.py", "deployment/release.py"]
)
def test_it_changes_with_the_sources_of_the_simulation(package: Path, file: str) -> None:
    before = now()
    assert re.fullmatch("[0-9a-f]{16}", before)
    with (package / file).open("a") as stream:
        stream.write("\n")
    assert now() != before


def test_it_does_not_change_with_anything_else(package: Path) -> None:
    before = now()
    with (package / "cli" / "dataset.py").open("a") as stream:
        stream.write("\n")
    assert now() == before
