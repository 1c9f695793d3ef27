"""Verdicts on findings of the paper, from tables like those of the study."""

import numpy as np
import pandas as pd
import pytest

from braidcast.dataset.folder import DatasetFolder
from braidcast.study import agreement, published
from braidcast.study.agreement import Claim
from braidcast.study.workspace import Study


@pytest.fixture
def paper(tmp_path, store: DatasetFolder) -> Study:
    """A study whose every number is that of the paper."""
    study = Study(tmp_path, store.path)
    one = published.table(1)
    both = one.merge(one.rename(columns=lambda c: c if c == "N_s" else f"paper_{c}"), on="N_s")
    study.write_table("table1", both)
    two = published.table2_read_rightly()
    metrics = ["accuracy", "sensitivity", "specificity", "precision", "F1"]
    two[metrics] /= 100.0
    counts = {"TP": 66.0, "FN": 3.0, "FP": 2.0, "TN": 29.0}
    study.write_table("table2", two.join(two[metrics].add_prefix("paper_")).assign(**counts))
    three = published.table(3)
    study.write_table("table3", three.join(three.iloc[:, 2:].add_prefix("paper_")))
    four = published.table(4).rename(columns={"N(ME_p>0.15)": "ME_p_above_3DRA"})
    four = four.join(four.iloc[:, 1:].add_prefix("paper_")).assign(N_train=146)
    study.write_table("table4", four)
    errors = pd.DataFrame({"L": np.arange(1, 41), "N_train": 146, "AE_p": 0.164})
    study.write_table("errors_by_modes", errors)
    ratios = published.RATIOS_TO_146
    own = ratios.rename(columns=lambda c: c.removeprefix("paper_"))
    study.write_table("simulations", ratios.merge(own, on="N_train"))
    return study


def test_the_paper_agrees_with_itself(paper: Study) -> None:
    agreement.agreement(paper)
    table = paper.table("agreement")
    assert set(table["section"]) == {"sizes", "outcomes", "modes", "predictors"}
    ratio = table[table["finding"].str.startswith("AE_p with μ_B over")].iloc[0]
    assert ratio["here"] == pytest.approx(0.164 / 0.029) and ratio["paper"] == 5.65
    assert set(table["verdict"]) == {"agrees"} and table["why"].isna().all()
    assert len(table) > 25


def test_a_number_that_is_off_is_found_and_explained(paper: Study) -> None:
    table3 = paper.table("table3")
    table3.loc[table3["L"] == 124, "L"] = 25
    paper.write_table("table3", table3)
    agreement.agreement(paper)
    other = paper.table("agreement").query("verdict != 'agrees'")
    assert other["finding"].tolist() == ["modes L for ε_POD = 0.001, 555 shapes"]
    assert other["verdict"].tolist() == ["lower here"] and len(other["why"].iloc[0]) > 50


def test_shares_differ_by_the_error_of_their_difference() -> None:
    """0.95 and 0.90 of a hundred each: 1.96 √(0.95·0.05 + 0.90·0.10)/10."""
    claim = agreement._share("outcomes", "accuracy", [0.95, 0.90], [100, 100], "")
    assert claim.may_differ_by == pytest.approx(0.0727, abs=1e-4)
    assert claim.verdict == "agrees"
    assert Claim("modes", "L", 10.0, 12.0, 1.0, "").verdict == "higher here"
