"""What the README promises a newcomer."""

import re
import tomllib
from pathlib import Path

import braidcast
from braidcast import Case, Deployment, Prediction
from braidcast.deployment.output import summary
from braidcast.surrogate import output

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", README, flags=re.DOTALL | re.MULTILINE)


def test_its_case_file_is_the_main_example_with_all_defaults_written_out() -> None:
    (text,) = blocks("toml")
    shown = Case.from_dict(tomllib.loads(text))
    example = Case.from_toml(ROOT / "examples" / "success.toml")
    assert shown.braid == example.braid
    assert abs(shown.crimped_radius - example.crimped_radius) < 5e-4
    for name in ("title", "vessel", "aneurysm", "wall"):
        assert getattr(shown, name) == getattr(example, name)
    assert shown.site.eta == example.site.eta


def test_its_python_names_exist() -> None:
    for code in blocks("python"):
        compile(code, "README.md", "exec")
        for name in re.findall(r"braidcast\.(\w+)", code):
            assert hasattr(braidcast, name)
        for variable, kind in (("deployment", Deployment), ("prediction", Prediction)):
            for name in re.findall(rf"\b{variable}\.(\w+)", code):
                assert name in kind.__dataclass_fields__ or hasattr(kind, name)


def test_every_key_of_a_summary_and_every_array_is_explained(deployment: Deployment) -> None:
    prediction = braidcast.load_model().predict(Case.from_toml(ROOT / "examples" / "success.toml"))
    names = (*summary(deployment), *deployment.point_arrays)
    for name in (*names, *output.summary(prediction), *prediction.point_arrays):
        assert f"`{name}`" in README


def test_its_links_and_pictures_are_there() -> None:
    for page in (ROOT / "README.md", *(ROOT / "docs").glob("*.md")):
        for target in re.findall(r"\]\(([^)#:]+)\)", page.read_text(encoding="utf-8")):
            assert (page.parent / target).exists(), f"{page.name}: {target}"
    assert (ROOT / "docs" / "images" / "success.png").stat().st_size <= 300_000
