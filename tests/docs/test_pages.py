"""Every block of README.md and of the pages under docs/ does what the page says."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", *sorted(p for p in DOCS.rglob("*.md") if "_build" not in p.parts)]
#: Tables and prose: nothing to run.
SHORT = [page for page in PAGES if "```" not in page.read_text(encoding="utf-8")]


@pytest.mark.slow
@pytest.mark.parametrize(
    "page", [p for p in PAGES if p not in SHORT], ids=lambda p: str(p.relative_to(ROOT))
)
def test_its_blocks(page: Path, follow: Callable[[Path], int]) -> None:
    assert follow(page)


@pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_its_links_and_pictures_are_there(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#:]+)[^):]*\)", page.read_text(encoding="utf-8")):
        assert (page.parent / target).exists(), target


WRONG = {
    "python": "```python\nassert 1 == 2\n```\n",
    "a warning": "```python\nimport warnings\nwarnings.warn('old')\n```\n",
    "command": "```sh\nbraidcast simulate nowhere.toml\n```\n",
    "first of two commands": "```sh\nfalse\ntrue\n```\n",
    "failure nobody shows": "```sh\necho braidcast: it; false\n```\n```python\n1\n```\n",
    "output": "```python\nprint(1.5)\n```\n```text\n1.4\n```\n",
    "too much output": "```python\nprint(1, 2)\n```\n```text\n1\n```\n",
    "output of nothing": "```text\n1\n```\n",
    "case": "```toml\n[vessel]\ndiameter = -1.0\n```\n",
    "plan": "```toml\ncases = 0\n[case.site]\neta = 0.5\n```\n",
    "file nobody uses": "```python\n# forgotten.py\n```\n",
    "target": "```sh\nmake nothing\n```\n",
    "extra": "```sh\npip install 'braidcast[nothing]'\n```\n",
    "no language": "```\nbraidcast\n```\n",
    "unknown language": "```json\n{}\n```\n",
    "unknown directive": "```{code-block} python\n1 / 0\n```\n",
    "indented": "Text:\n\n    1 / 0\n",
    "in a list": "- Text:\n\n  ```python\n  1 / 0\n  ```\n",
}


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_block_is_found(name: str, tmp_path: Path, follow: Callable[[Path], int]) -> None:
    page = tmp_path / "page.md"
    page.write_text(WRONG[name])
    with pytest.raises(Exception) as found:
        follow(page)
    assert not isinstance(found.value, OSError)


RIGHT = """\
```python
# half.py
print(0.5)
```
```sh
python half.py
```
```text
0.501
```
```sh
braidcast simulate nowhere.toml
```
```text
braidcast: nowhere.toml: there is no ...
```
"""


def test_a_right_page_is_followed(tmp_path: Path, follow: Callable[[Path], int]) -> None:
    page = tmp_path / "page.md"
    page.write_text(RIGHT)
    assert follow(page) == 5
