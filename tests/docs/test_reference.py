"""What the pages list is all there is, and is there."""

import re
import tomllib
from pathlib import Path

import braidcast
from braidcast import Case, Deployment
from braidcast.deployment.output import summary
from braidcast.surrogate import output

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_the_case_file_is_the_main_example_with_all_defaults_written_out() -> None:
    text, _ = re.findall(r"^```toml\n(.*?)^```", README, flags=re.DOTALL | re.MULTILINE)
    shown = Case.from_dict(tomllib.loads(text))
    example = Case.from_toml(ROOT / "examples" / "success.toml")
    assert shown.braid == example.braid
    assert abs(shown.crimped_radius - example.crimped_radius) < 5e-4
    for name in ("title", "vessel", "aneurysm", "wall"):
        assert getattr(shown, name) == getattr(example, name)
    assert shown.site.eta == example.site.eta


def test_every_key_of_a_summary_and_every_array_is_explained(deployment: Deployment) -> None:
    prediction = braidcast.load_model().predict(Case.from_toml(ROOT / "examples" / "success.toml"))
    names = (*summary(deployment), *deployment.point_arrays)
    for name in (*names, *output.summary(prediction), *prediction.point_arrays):
        assert f"`{name}`" in README


def test_every_public_name_is_in_the_reference() -> None:
    page = (ROOT / "docs" / "reference" / "python.md").read_text(encoding="utf-8")
    shown = re.findall(r"auto(?:class|function|exception):: (\w+)", page)
    assert sorted([*shown, "__version__"]) == sorted(braidcast.__all__)


def test_the_house_is_as_the_readme_says() -> None:
    rooms = re.findall(r"^\| `([^`]+)`", README.partition("## The house")[2], flags=re.MULTILINE)
    assert len(rooms) > 10
    for room in rooms:
        assert (ROOT / room).exists(), room


def test_the_picture_is_small() -> None:
    assert (ROOT / "docs" / "images" / "success.png").stat().st_size <= 300_000
