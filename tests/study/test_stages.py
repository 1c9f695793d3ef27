"""Stages: done once, done again if what they read changed, and whole whatever ends a run."""

import json
from pathlib import Path

import pytest
from distributed import Client

from braidcast.dataset.folder import DatasetFolder
from braidcast.study import stages
from braidcast.study.stages import Stage, StageFailed, run_stages
from braidcast.study.workspace import Study


def first(study: Study, text: str = "a") -> list[str]:
    return [study.write("tables/first.csv", text.encode())]


def second(study: Study) -> list[str]:
    text = (study.home / "tables/first.csv").read_text()
    return [study.write("tables/second.csv", (text + "b").encode())]


def broken(study: Study) -> list[str]:
    study.write("tables/half.csv", b"")
    raise ValueError("no such luck\nand more")


def full(study: Study) -> list[str]:
    raise OSError(28, "No space left on device", "tables/big.csv")


FIRST = Stage("first", first)
SECOND = Stage("second", second, needs=("first",))


@pytest.fixture
def empty(tmp_path: Path, store: DatasetFolder) -> Study:
    return Study(tmp_path, store.path)


def done_again(empty: Study, client: Client, *given: Stage) -> list[str]:
    return [done.name for done in run_stages(empty, given, client) if done.again]


def test_nothing_is_done_twice(empty: Study, client: Client) -> None:
    assert done_again(empty, client, FIRST, SECOND) == ["first", "second"]
    assert (empty.home / "tables/second.csv").read_text() == "ab"
    before = (empty.home / "tables/second.csv").stat().st_mtime_ns
    assert done_again(empty, client, FIRST, SECOND) == []
    assert (empty.home / "tables/second.csv").stat().st_mtime_ns == before


def test_what_changed_is_done_again_and_what_needs_it(empty: Study, client: Client) -> None:
    done_again(empty, client, FIRST, SECOND)
    assert done_again(empty, client, Stage("first", first, {"text": "c"}), SECOND) == [
        *("first", "second")
    ]
    assert (empty.home / "tables/second.csv").read_text() == "cb"
    # The same file comes out: what needs it is not done again.
    other = Stage("first", first, {"text": "c"}, cases=5)
    assert done_again(empty, client, other, SECOND) == ["first"]


@pytest.mark.parametrize("spoil", [Path.unlink, lambda path: path.write_text("edited")])
def test_a_lost_or_edited_file_is_made_again(empty: Study, client: Client, spoil: object) -> None:
    done_again(empty, client, FIRST, SECOND)
    assert callable(spoil)
    spoil(empty.home / "tables/second.csv")
    assert done_again(empty, client, FIRST, SECOND) == ["second"]
    assert (empty.home / "tables/second.csv").read_text() == "ab"


def test_a_damaged_stamp_is_no_stamp(empty: Study, client: Client) -> None:
    done_again(empty, client, FIRST)
    (empty.home / "stages/first.json").write_text("{")
    assert done_again(empty, client, FIRST) == ["first"]


def test_a_stage_that_fails_says_why_and_loses_nothing(empty: Study, client: Client) -> None:
    with pytest.raises(StageFailed, match="^stage third failed: ValueError: no such luck$"):
        run_stages(empty, [FIRST, Stage("third", broken, needs=("first",))], client)
    assert done_again(empty, client, FIRST) == []


def test_a_full_disk_is_named(empty: Study, client: Client) -> None:
    with pytest.raises(OSError, match="No space left") as caught:
        run_stages(empty, [Stage("full", full)], client)
    assert caught.value.filename == "tables/big.csv"


def test_what_no_stage_writes_any_more_goes(empty: Study, client: Client) -> None:
    done_again(empty, client, FIRST, SECOND)
    (empty.home / "mine.txt").write_text("kept")
    done_again(empty, client, FIRST)
    left = {path.relative_to(empty.home).as_posix() for path in empty.home.rglob("*.*")}
    assert left == {"tables/first.csv", "stages/first.json", "mine.txt"}


def test_a_stamp_tells_what_came_out(empty: Study, client: Client) -> None:
    done_again(empty, client, FIRST)
    stamp = json.loads((empty.home / "stages/first.json").read_text())
    assert list(stamp["files"]) == ["tables/first.csv"]
    assert stamp["cpu_seconds"] >= 0.0


def test_the_source_of_what_a_stage_imports_is_in_its_key() -> None:
    """published imports nothing of the study; sizes imports it, and shapes sizes."""
    names = ("published", "sizes", "shapes", "figures", "report")
    assert len({stages._own_sources(f"braidcast.study.{name}") for name in names}) == len(names)


def test_imports_are_found_wherever_they_stand() -> None:
    text = "import a.b\nfrom c import d, e\ndef f():\n    def g():\n        from h.i import j\n"
    found = set(stages._imported(compile(text, "module.py", "exec")))
    assert found == {"a.b", "c", "c.d", "c.e", "h.i", "h.i.j"}


def test_files_of_other_data_are_not_kept(empty: Study, client: Client) -> None:
    """The cases a stage reads are in its key by their checksums."""
    ids = empty.data_ids({5, 6, 90})
    assert len(set(ids.values())) == 3
    assert empty.data_ids({5}) == {5: ids[5]}
