"""The cases of a plan: feasible, nested, replaced where they were not, the same for a seed."""

import numpy as np
import pytest
from scipy.stats import qmc

from braidcast import InputError
from braidcast.dataset import draw as drawing
from braidcast.dataset.draw import discrepancies, draw
from braidcast.dataset.hypercube import nested_hypercube
from braidcast.dataset.plan import Plan

# The paper's device goes into vessels from 1.624 to below 5.256 mm.
PLAN = """\
seed = 11
cases = 60
subsets = [20, 40]
tests = 10
[case.vessel]
P1 = [0.0, { min = 5.0, max = 30.0 }, 25.0]
diameter = { min = 2.0, max = 4.0 }
[case.site]
eta = { min = 0.0, max = 1.0 }
"""


def plan(
    diameter: str = "min = 2.0, max = 4.0", seed: str = "seed = 11", cases: str = "cases = 60"
) -> Plan:
    text = PLAN.replace("min = 2.0, max = 4.0", diameter)
    return Plan.from_text(text.replace("seed = 11", seed).replace("cases = 60", cases))


def test_a_feasible_plan_is_the_hypercube_scaled() -> None:
    drawn = draw(plan())
    assert drawn.values.shape == (60, 3) and drawn.replaced == 0
    points = nested_hypercube(60, 3, (20, 40), 10, seed=11)
    np.testing.assert_allclose(drawn.values, [5.0, 2.0, 0.0] + points * [25.0, 2.0, 1.0])
    strata = np.sort(np.floor((drawn.values - [5.0, 2.0, 0.0]) / [25.0, 2.0, 1.0] * 60), axis=0)
    np.testing.assert_array_equal(strata, np.tile(np.arange(60)[:, None], 3))


def test_the_same_seed_draws_the_same_and_another_another() -> None:
    partly = "min = 4.5, max = 5.4"
    first = draw(plan(diameter=partly))
    np.testing.assert_array_equal(first.values, draw(plan(diameter=partly)).values)
    other = draw(plan(diameter=partly, seed="seed = 12"))
    assert not np.isin(first.values, other.values).any()


@pytest.mark.parametrize(("diameter", "share"), [("max = 5.4", 0.042), ("max = 8.512", 0.5)])
def test_what_is_infeasible_is_replaced_and_counted(diameter: str, share: float) -> None:
    given = plan(diameter=f"min = 2.0, {diameter}")
    high = given.ranges[1].high
    drawn = draw(given)
    for row in drawn.values:
        given.case(row)
    assert drawn.values[:, 1].max() < 5.256 and drawn.values.min(axis=0)[1] >= 2.0
    points = nested_hypercube(60, 3, (20, 40), 10, seed=11)
    whole = [5.0, 2.0, 0.0] + points * [25.0, high - 2.0, 1.0]
    kept = whole[:, 1] < 5.256
    assert drawn.replaced == 60 - kept.sum() == pytest.approx(60 * share, abs=2.0)
    np.testing.assert_allclose(drawn.values[kept], whole[kept])
    assert len(np.unique(drawn.values, axis=0)) == 60


def test_replacements_keep_the_subsets_spread(monkeypatch: pytest.MonkeyPatch) -> None:
    """In the feasible box, and against taking whatever feasible sample comes first."""

    def logarithms() -> list[float]:
        found = []
        for seed in range(4):
            given = plan(diameter="min = 2.0, max = 8.512", seed=f"seed = {seed}")
            points = (draw(given).values - [5.0, 2.0, 0.0]) / [25.0, 3.256, 1.0]
            found.append([np.log(qmc.discrepancy(points[:n], method="CD")) for n in (20, 40, 60)])
        return np.mean(found, axis=0).tolist()

    chosen = logarithms()
    monkeypatch.setattr(drawing, "best_candidate", lambda *_: 0)
    assert all(a < b + np.log(0.75) for a, b in zip(chosen, logarithms(), strict=True))


def test_a_plan_without_a_feasible_case_says_why() -> None:
    says = "100 of 100 samples of the plan are infeasible, must be at most 90%; the last of them "
    with pytest.raises(InputError, match=says) as caught:
        draw(plan(diameter="min = 5.3, max = 6.0"))
    assert "because vessel.diameter = " in str(caught.value)
    assert "must be below 5.256 mm" in str(caught.value) and "\n" not in str(caught.value)
    with pytest.raises(InputError, match="100 of 100"):
        draw(plan(diameter="min = 5.3, max = 6.0", cases="cases = 40"))
    with pytest.raises(InputError, match=r"samples of the plan are infeasible"):
        draw(plan(diameter="min = 5.1, max = 10.0"))
    wrong = PLAN.replace("[case.site]", "[case.device]\nwires = 47\n[case.site]")
    with pytest.raises(InputError, match="because device.wires = 47 must be even"):
        draw(Plan.from_text(wrong))


def test_a_single_infeasible_sample_is_no_reason_to_refuse_a_plan() -> None:
    one = PLAN.replace("subsets = [20, 40]\ntests = 10\n", "").replace("= 60", "= 1")
    half = one.replace("max = 4.0", "max = 8.512")
    counts = [draw(Plan.from_text(half.replace("11", str(n)))).replaced for n in range(8)]
    assert set(counts) == {0, 1}


def test_a_plan_where_nothing_ranges_is_one_case() -> None:
    text = "cases = 1\n[case.vessel]\nP1 = [0, 9, 25]\ndiameter = 3\n[case.site]\neta = 0"
    drawn = draw(Plan.from_text(text))
    assert drawn.values.shape == (1, 0) and drawn.replaced == 0
    assert discrepancies(Plan.from_text(text), drawn.values) == {}
    with pytest.raises(InputError, match="vessel.diameter = 6 mm must be below"):
        draw(Plan.from_text(text.replace("diameter = 3", "diameter = 6")))


def test_discrepancies_are_scipys_by_size() -> None:
    points = nested_hypercube(60, 3, (20, 40), 10, seed=11)
    given = plan()
    expected = {n: qmc.discrepancy(points[:n], method="CD") for n in (20, 40, 60)}
    assert discrepancies(given, draw(given).values) == pytest.approx(expected)


def test_progress_names_the_stages() -> None:
    said: list[tuple[str, float]] = []
    draw(plan(diameter="min = 2.0, max = 5.4"), lambda stage, share: said.append((stage, share)))
    assert list(dict.fromkeys(stage for stage, _ in said)) == ["draw", "check", "replace"]
    assert all(dict(said)[stage] == 1.0 for stage in ("draw", "check", "replace"))
