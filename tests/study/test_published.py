"""What the paper printed, and what its Table 2 says when read rightly."""

from pathlib import Path

import numpy as np
import pytest

from braidcast.study import published
from braidcast.surrogate.classifiers import CLASSIFIERS
from braidcast.surrogate.metrics import ClassMetrics

HOME = Path(published.__file__).with_name("published")


def test_table2_read_rightly() -> None:
    """The values that errata row 17 gives for SVM and ANN at 600."""
    table = published.table2_read_rightly().set_index(["N_s", "model"])
    for model in ("support vector machine", "neural network"):
        row = table.loc[(600, model)]
        assert row["consistent"]
        found = row[["accuracy", "sensitivity", "specificity", "precision", "F1"]].to_numpy(float)
        assert found == pytest.approx([95.0, 95.7, 93.5, 97.1, 96.4], abs=0.06)


def test_rows_that_contradict_themselves_are_few_and_known() -> None:
    table = published.table2_read_rightly()
    wrong = table.loc[~table["consistent"], ["N_s", "model"]].itertuples(index=False)
    assert {tuple(row) for row in wrong} == {
        *((150, "naive Bayes"), (600, "decision tree"), (900, "logistic regression"))
    }


def test_reading_is_the_inverse_of_the_papers_convention() -> None:
    """Counts, through our own convention for the paper's columns, and back."""
    table = published.table2_read_rightly().set_index(["N_s", "model"])
    printed = published.table(2).set_index(["N_s", "model"])
    for key, row in table[table["consistent"]].iterrows():
        TN = round(row["specificity"] / 100.0 * published.FAILURES)
        TP = round(row["sensitivity"] / 100.0 * (published.TESTS - published.FAILURES))
        success = np.repeat([True, False], [69, 31])
        called = np.repeat([1.0, 0.0, 1.0, 0.0], [TP, 69 - TP, 31 - TN, TN])
        convention = ClassMetrics.of(success, called).paper_convention()
        for name, value in convention.items():
            assert 100.0 * value == pytest.approx(printed.loc[key, name], abs=0.7), (key, name)


def test_the_classifiers_are_ours() -> None:
    assert set(published.table(2)["model"]) == set(CLASSIFIERS)


@pytest.mark.parametrize("number", [1, 2, 3, 4])
def test_tables_are_whole(number: int) -> None:
    lines = (HOME / f"table{number}.csv").read_text(encoding="utf-8").splitlines()
    frame = published.table(number)
    assert frame.shape == (len(lines) - 1, len(lines[0].split(",")))
    assert not frame.isna().any(axis=None)
