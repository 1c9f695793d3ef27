"""What the README promises a newcomer."""

import re
import tomllib
from pathlib import Path

import braidcast
from braidcast import Case, Deployment
from braidcast.deployment.output import summary

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def block(language: str) -> str:
    found = re.findall(rf"^```{language}\n(.*?)^```", README, flags=re.DOTALL | re.MULTILINE)
    assert len(found) == 1
    return found[0]


def test_its_case_file_is_the_main_example_with_all_defaults_written_out() -> None:
    shown = Case.from_dict(tomllib.loads(block("toml")))
    example = Case.from_toml(ROOT / "examples" / "success.toml")
    assert shown.braid == example.braid
    assert abs(shown.crimped_radius - example.crimped_radius) < 5e-4
    for name in ("title", "vessel", "aneurysm", "wall"):
        assert getattr(shown, name) == getattr(example, name)
    assert shown.site.eta == example.site.eta


def test_its_python_names_exist() -> None:
    code = block("python")
    compile(code, "README.md", "exec")
    for name in re.findall(r"braidcast\.(\w+)", code):
        assert hasattr(braidcast, name)
    for name in re.findall(r"deployment\.(\w+)", code):
        assert name in Deployment.__dataclass_fields__ or hasattr(Deployment, name)


def test_every_key_of_the_summary_and_every_array_is_explained(deployment: Deployment) -> None:
    for name in (*summary(deployment), *deployment.point_arrays):
        assert f"`{name}`" in README


def test_its_links_and_pictures_are_there() -> None:
    for page in (ROOT / "README.md", *(ROOT / "docs").glob("*.md")):
        for target in re.findall(r"\]\(([^)#:]+)\)", page.read_text(encoding="utf-8")):
            assert (page.parent / target).exists(), f"{page.name}: {target}"
    assert (ROOT / "docs" / "images" / "success.png").stat().st_size <= 300_000
