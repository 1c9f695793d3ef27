"""The study that is kept in the repository, and where the rest of it goes."""

import csv
from pathlib import Path

import numpy as np
import pytest

from braidcast.dataset.draw import draw
from braidcast.dataset.home import data_folder
from braidcast.dataset.plan import Plan
from braidcast.study import PLAN

STUDY = Path(__file__).parents[2] / "study"


@pytest.fixture(scope="module")
def rows() -> list[dict[str, str]]:
    with (STUDY / "cases.csv").open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


@pytest.mark.slow
def test_its_cases_are_drawn_from_its_plan(rows: list[dict[str, str]]) -> None:
    plan = Plan.from_toml(PLAN)
    names = [parameter.name for parameter in plan.ranges]
    kept = np.array([[float(row[name]) for name in names] for row in rows])
    np.testing.assert_allclose(draw(plan).values, kept, rtol=1e-12)


def test_all_are_finished_and_each_is_one_of_a_kind(rows: list[dict[str, str]]) -> None:
    assert {row["status"] for row in rows} == {"finished"}
    assert len({row["checksum"] for row in rows}) == len(rows) == 900


def test_a_third_fails_and_enough_tests_succeed(rows: list[dict[str, str]]) -> None:
    success = np.array([row["outcome"] == "success" for row in rows])
    assert 0.30 <= 1.0 - success.mean() <= 0.36
    assert success[:100].sum() >= 50


def test_shared_datasets_are_where_the_environment_says(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("BRAIDCAST_DATA", str(tmp_path))
    assert data_folder() == tmp_path
    monkeypatch.delenv("BRAIDCAST_DATA")
    assert data_folder().name == "braidcast"
