"""The cases of a plan: values of its ranges, every case checked."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from braidcast.dataset.hypercube import (
    MOST_SWAPPED,
    BoolArray,
    best_candidate,
    nested_hypercube,
    nested_sets,
)
from braidcast.dataset.plan import Plan
from braidcast.errors import InputError

Array = NDArray[np.float64]
DrawProgress = Callable[[str, float], None]
"""Called with the stage, "draw", "check" or "replace", and the share of it that is done."""

#: A plan is refused if a larger share of what is drawn from it is infeasible.
_MOST_INFEASIBLE = 0.9
#: … but not before so many samples.
_LEAST_TRIED = 100
#: From so many feasible samples the one is chosen that takes the place of an infeasible one;
_CANDIDATES = 64
#: from fewer if that times cases times replacements would be more: some ten seconds.
_MOST_WORK = 2e8
#: So many feasible samples stand for the region to fill.
_REGION = 500


class Drawn(NamedTuple):
    """Values of the ranges of a plan for each case, (cases, ranges), in the units of the plan."""

    values: Array
    replaced: int
    """How many samples were infeasible and gave way to others."""


def draw(plan: Plan, progress: DrawProgress | None = None) -> Drawn:
    """Draw the cases of ``plan``, all of them feasible; the same plan gives the same cases.

    They are a Latin hypercube with nested subsets. Where a sample of it is infeasible it gives way
    to one of 64 feasible ones drawn uniformly: to that which leaves the subsets most evenly spread
    over what is feasible. ``InputError``, with the last reason, if more than nine in ten samples
    are infeasible.
    """
    report = progress or _no_progress
    if not plan.ranges:
        plan.case(())
        return Drawn(np.empty((plan.cases, 0)), 0)
    points = nested_hypercube(
        plan.cases, len(plan.ranges), plan.subsets, plan.tests, plan.seed, partial(report, "draw")
    )
    check = _Check(plan)
    present = np.ones(plan.cases, dtype=bool)
    for place, point in enumerate(points):
        present[place] = check.is_feasible(point)
        report("check", (place + 1) / plan.cases)
    replaced = int((~present).sum())
    if replaced:
        _replace(plan, check, points, present, partial(report, "replace"))
    return Drawn(_scaled(plan, points), replaced)


def _replace(
    plan: Plan,
    check: _Check,
    points: Array,
    present: BoolArray,
    report: Callable[[float], None],
) -> None:
    """Put feasible points in the places of ``points`` that are not ``present``."""
    fresh = _feasible(check, np.random.default_rng([plan.seed, 1]))
    region = np.array([next(fresh) for _ in range(_REGION)])
    places = np.flatnonzero(~present).tolist()
    count = min(_CANDIDATES, 1 + int(_MOST_WORK / (len(points) * len(places))))
    candidates = [next(fresh) for _ in range(count)]
    sets = nested_sets(plan.cases, plan.subsets, plan.tests)
    for done, place in enumerate(places):
        best = best_candidate(np.array(candidates), place, points, present, sets, region)
        points[place], candidates[best] = candidates[best], next(fresh)
        present[place] = True
        report((done + 1) / len(places))


def discrepancies(plan: Plan, values: Array) -> dict[int, float]:
    """Centred discrepancy (scipy's "CD") of each subset and of all cases, by their size.

    Of no more than 20 000 cases, and of none where nothing ranges.
    """
    if not plan.ranges:
        return {}
    low, width = _box(plan)
    points = np.clip((values - low) / width, 0.0, 1.0)
    sizes = [size for size in (*plan.subsets, plan.cases) if size <= MOST_SWAPPED]
    return {size: float(qmc.discrepancy(points[:size], method="CD")) for size in sizes}


class _Check:
    """Tells feasible points of the unit cube from others; raises if there are too many others."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self._tried = self._infeasible = 0

    def is_feasible(self, point: Array) -> bool:
        self._tried += 1
        try:
            self.plan.case(_scaled(self.plan, point).tolist())
        except InputError as error:
            self._infeasible += 1
            if self._tried >= _LEAST_TRIED and self._infeasible > _MOST_INFEASIBLE * self._tried:
                raise InputError(
                    f"{self._infeasible} of {self._tried} samples of the plan are infeasible, must "
                    f"be at most {_MOST_INFEASIBLE:.0%}; the last of them because {error}"
                ) from None
            return False
        return True


def _feasible(check: _Check, rng: np.random.Generator) -> Iterator[Array]:
    """Feasible points, uniformly from the unit cube."""
    while True:
        point = rng.random(len(check.plan.ranges))
        if check.is_feasible(point):
            yield point


def _box(plan: Plan) -> tuple[Array, Array]:
    low = np.array([parameter.low for parameter in plan.ranges])
    return low, np.array([parameter.high for parameter in plan.ranges]) - low


def _scaled(plan: Plan, points: Array) -> Array:
    low, width = _box(plan)
    return np.clip(low + points * width, low, low + width)


def _no_progress(stage: str, fraction: float) -> None:
    pass
