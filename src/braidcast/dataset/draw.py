"""The cases of a plan: values of its ranges, every case checked."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from braidcast.dataset.plan import Plan

DrawProgress = Callable[[str, float], None]
"""Called with the stage and the share of it that is done."""


class Drawn(NamedTuple):
    """Values of the ranges of a plan for each case, (cases, ranges), in the units of the plan."""

    values: NDArray[np.float64]
    replaced: int
    """How many samples were infeasible and gave way to others."""


def draw(plan: Plan, progress: DrawProgress | None = None) -> Drawn:
    """Draw the cases of ``plan``; the same plan gives the same cases."""
    low = np.array([parameter.low for parameter in plan.ranges])
    high = np.array([parameter.high for parameter in plan.ranges])
    if not plan.ranges:
        return Drawn(np.empty((plan.cases, 0)), 0)
    points = qmc.LatinHypercube(len(low), rng=plan.seed).random(plan.cases)
    return Drawn(low + points * (high - low), 0)


def discrepancies(plan: Plan, values: NDArray[np.float64]) -> dict[int, float]:
    """Centred discrepancy (scipy's "CD") of each subset and of all cases, by their size."""
    low = np.array([parameter.low for parameter in plan.ranges])
    high = np.array([parameter.high for parameter in plan.ranges])
    points = (values - low) / (high - low)
    sizes = (*plan.subsets, plan.cases) if plan.ranges else ()
    return {size: float(qmc.discrepancy(points[:size], method="CD")) for size in sizes}
