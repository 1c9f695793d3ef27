"""Sobol indices against those of a function that is known."""

import numpy as np
import pytest

from braidcast.dataset.plan import Range
from braidcast.study import importance


def test_indices_of_ishigami(monkeypatch: pytest.MonkeyPatch) -> None:
    """sin x + 7 sin² y + 0.1 z⁴ sin x on (−π, π)³ (Ishigami & Homma 1990; Sobol & Levitan 1999)."""
    monkeypatch.setattr(importance, "SAMPLES", 4096)
    ranges = [Range(("site", name), -np.pi, np.pi, "") for name in "xyz"]
    design = importance._saltelli(ranges, np.random.default_rng(0))
    x, y, z = np.moveaxis(design, 2, 0)
    answers = np.sin(x) + 7.0 * np.sin(y) ** 2 + 0.1 * z**4 * np.sin(x)
    first, total = importance._indices(np.stack([answers, -2.0 * answers]))[:, 1]
    assert first == pytest.approx([0.3139, 0.4424, 0.0], abs=0.01)
    assert total == pytest.approx([0.5576, 0.4424, 0.2437], abs=0.01)
