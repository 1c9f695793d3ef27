"""The study from its first stage to its report, against the files of the cases themselves."""

import base64
import re
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray
from distributed import Client

from braidcast.dataset.folder import DatasetFolder
from braidcast.devices.braid import Braid
from braidcast.study.pipeline import pipeline
from braidcast.study.stages import run_stages
from braidcast.study.workspace import Study

pytestmark = pytest.mark.slow

TESTS, SAMPLES = 24, 90

TESTED = 12
"""Successes that test shapes: half as many as there are tests, the first ones."""


@pytest.fixture(scope="module")
def cases(store: DatasetFolder) -> list[xarray.Dataset]:
    """The files as anybody would open them."""
    paths = sorted((store.path / "cases").glob("*.nc"))
    return [xarray.load_dataset(path) for path in paths]


def successes(cases: list[xarray.Dataset]) -> np.ndarray:
    return np.array([case.attrs["outcome"] == "success" for case in cases])


def test_counts_are_those_of_the_files(study: Study, cases: list[xarray.Dataset]) -> None:
    row = study.table("table1").iloc[-1]
    succeeded = successes(cases)
    assert row["N_s"] == SAMPLES
    assert row["N_success"] == succeeded.sum() and row["N_failure"] == (~succeeded).sum()
    assert row["N_test_regr"] == TESTED
    assert row["N_train_regr"] == succeeded.sum() - TESTED
    assert row["N_test_class"] == TESTS and row["N_train_class"] == SAMPLES - TESTS


def test_projection_errors_are_those_of_numpy(study: Study, cases: list[xarray.Dataset]) -> None:
    """Singular values, L by tolerance and AE_rb from the positions in the files."""
    free = Braid(wires=12, segments=20, length=8.0).positions
    succeeded = successes(cases)
    moved = np.array([case["positions"].to_numpy() - free for case in cases]).reshape(SAMPLES, -1)
    tests, training = np.split(moved[succeeded], [TESTED])
    _, sigma, modes = np.linalg.svd(training, full_matrices=False)
    kept = study.table("singular_values")["sigma_mm"].to_numpy()
    assert kept == pytest.approx(sigma[: len(kept)], rel=1e-5, abs=1e-4)
    for _, row in study.table("table3").iterrows():
        L = int(np.argmax(np.cumsum(sigma) >= (1.0 - row["eps_POD"]) * sigma.sum())) + 1
        left = (tests - tests @ modes[:L].T @ modes[:L]).reshape(len(tests), -1, 3)
        distances = np.linalg.norm(left, axis=2)
        assert row["L"] == L
        assert row["AE_rb"] == pytest.approx(distances.mean(), rel=1e-5)
        assert row["ME_rb"] == pytest.approx(distances.max(axis=1).mean(), rel=1e-5)


def test_the_depth_of_ends_is_that_of_the_nodes(study: Study, cases: list[xarray.Dataset]) -> None:
    """Deeper than a wire radius is a failure, and the other way round."""
    table = study.table("cases").set_index("case")
    for number in (0, 7, 33, 89):
        case, row = cases[number], table.loc[number]
        centre = case["aneurysm_centre"].to_numpy()
        radius = 0.5 * float(case["aneurysm_diameter"])
        depth = radius - np.linalg.norm(case["positions"].to_numpy() - centre, axis=1)
        wire_radius = 0.014
        rings = Braid(wires=12, segments=20, length=8.0).rings
        for name, ring in (("depth_first_mm", 0), ("depth_last_mm", 20)):
            deepest = depth[rings == ring].max() - wire_radius
            assert row[name] == pytest.approx(deepest, abs=1e-5)
        failed = max(row["depth_first_mm"], row["depth_last_mm"]) >= 0.0
        assert row["success"] == (not failed) == (case.attrs["outcome"] == "success")


def test_metrics_follow_from_the_probabilities(study: Study) -> None:
    """Table 2 from what every classifier said of every test."""
    table = study.table("table2").set_index("model")
    for path in sorted((study.home / "tables/outcomes").glob("*.csv")):
        found = pd.read_csv(path)
        name = path.stem.rpartition("_")[0].replace("_", " ")
        row = table.loc[name.replace("k nearest", "k-nearest")]
        called = found["success_probability"] > row["threshold"]
        right = called == (found["success"] == 1)
        assert row["accuracy"] == pytest.approx(right.mean(), abs=1e-6)
        assert row["specificity"] == pytest.approx(right[found["success"] == 0].mean(), abs=1e-6)


def test_the_law_is_learned(study: Study) -> None:
    """The departure is one smooth bulge: ours finds it, and beats what it starts from by far."""
    row = study.table("recipes").query("recipe == 'ours'").iloc[0]
    assert row["AE"] < 0.1 * row["AE_geometry"]
    assert row["AE_projection"] <= row["AE"]


def test_examples_are_at_even_ranks(study: Study) -> None:
    every = study.table("recipes/paper_50").sort_values("AE")
    shown = study.table("examples").query("recipe == 'paper'")
    assert shown["AE"].is_monotonic_increasing and len(shown) == 6
    assert shown["case"].iloc[[0, -1]].tolist() == every["case"].iloc[[0, -1]].tolist()
    errors = every.set_index("case").loc[shown["case"], "AE"].to_numpy()
    assert shown["AE"].to_numpy() == pytest.approx(errors, rel=1e-5)


class Page(HTMLParser):
    """What a page points to, what it shows, and the cells of its tables."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.hrefs: list[str] = []
        self.images: list[tuple[str, str]] = []
        self.ids: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attrs}
        self.ids += [given["id"]] if "id" in given else []
        self.hrefs += [given["href"]] if "href" in given else []
        if tag == "img":
            self.images.append((given["src"], given["alt"]))
        assert tag not in ("script", "link", "iframe")


@pytest.fixture(scope="module")
def page(study: Study) -> Page:
    return Page((study.home / "report.html").read_text(encoding="utf-8"))


def test_the_report_holds_every_figure_and_points_to_its_file(study: Study, page: Page) -> None:
    figures = sorted((study.home / "figures").iterdir())
    assert len(page.images) == len(figures) >= 17
    shown = set()
    for source, alternative in page.images:
        head, _, content = source.partition(";base64,")
        assert head in ("data:image/png", "data:image/svg+xml") and len(alternative) > 10
        shown.add(base64.b64decode(content))
    assert shown == {path.read_bytes() for path in figures}
    assert {f"figures/{path.name}" for path in figures} <= set(page.hrefs)


def test_every_link_of_the_report_leads_somewhere(study: Study, page: Page) -> None:
    assert len(page.ids) == len(set(page.ids))
    for href in page.hrefs:
        if href.startswith("#"):
            assert href[1:] in page.ids
        else:
            assert (study.home / href).exists(), href


def test_tables_of_the_report_are_the_files(study: Study) -> None:
    text = (study.home / "report.html").read_text(encoding="utf-8")
    for name, column in (("table3", "AE_p"), ("table4", "ME_p"), ("recipes", "AE")):
        body = text[text.index(f'id="table-{name}"') :]
        cells = re.findall(r"<td[^>]*>(.*?)</td>", body[: body.index("</table>")])
        digits = 4 if name == "recipes" else 3
        for value in study.table(name)[column]:
            assert any(cell.startswith(f"{value:.{digits}f} ±") for cell in cells)


def test_sizes_that_the_paper_has_not_are_not_compared(study: Study) -> None:
    assert study.table("agreement").empty
    text = (study.home / "report.html").read_text(encoding="utf-8")
    assert "The paper has no study of these sizes" in text and "findings of the paper" not in text


def test_done_again_it_is_the_same_to_the_last_byte(study: Study, client: Client) -> None:
    """Stages that a kill took with it: their stamps are gone, and some of their files."""
    files = [path for path in study.home.rglob("*") if path.is_file() and path.suffix != ".json"]
    before = {path: path.read_bytes() for path in files}
    lost = ("cases", "table_2", "sobol", "train_ours_50", "shapes_50_Bezier", "figure_modes")
    for name in lost:
        (study.home / "stages" / f"{name}.json").unlink()
    (study.home / "tables/cases.csv").unlink()
    (study.home / "figures/modes.svg").write_bytes(b"<svg")
    done = run_stages(study, pipeline(study, SAMPLES), client)
    assert {stage.name.replace(" ", "_") for stage in done if stage.again} == set(lost)
    assert {path: path.read_bytes() for path in files} == before


def test_leaves_nothing_else_behind(study: Study) -> None:
    assert {path.name for path in study.home.iterdir()} == {
        *("tables", "data", "figures", "models", "stages", "report.html", "model_card.md")
    }
    assert not list(Path(study.home).rglob("*tmp*"))
