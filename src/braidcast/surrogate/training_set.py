"""What a surrogate learns from: the finished cases of a dataset, and those kept for its test."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from braidcast.case import Case
from braidcast.dataset.folder import DatasetFolder
from braidcast.dataset.ledger import Ledger
from braidcast.dataset.store import dataset
from braidcast.errors import InputError
from braidcast.surrogate.predictors import end_depths

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Simulations:
    """Finished cases of a dataset, n of them.

    ``positions`` (n, N, 3) mm; ``numbers`` (n,) in the dataset, ``test`` (n,): whether kept out of
    training; ``end_in_sac`` (n, 2): whether a node of the first and of the last ring lies in the
    sac, which makes a failure; ``success`` (n,).
    """

    plan_id: str
    cases: tuple[Case, ...]
    numbers: Indices
    test: NDArray[np.bool_]
    positions: Array
    end_in_sac: NDArray[np.bool_]
    success: NDArray[np.bool_]
    limits: dict[str, tuple[float, float]]
    """The plan's ranges, by the field's name."""

    @classmethod
    def of(
        cls, folder: DatasetFolder, *, finished_only: bool = False, cases: int | None = None
    ) -> Self:
        """Read a dataset folder, or its first ``cases``.

        ``InputError`` if a case has failed or waits, unless ``finished_only`` leaves them out, if
        none is finished, or if a case has no aneurysm.
        """
        everything = Ledger.read(folder)
        ledger = everything.first(cases)
        failed, waiting = len(ledger.failed), ledger.waiting
        if (failed or waiting) and not finished_only:
            raise InputError(
                f"dataset folder = {folder.path} has {failed} failed and {waiting} waiting cases, "
                "must have none: `braidcast dataset run` it, or leave them out with "
                "--finished-only"
            )
        numbers = np.array(sorted(k for k, r in ledger.records.items() if r.finished), dtype=int)
        if not len(numbers):
            raise InputError(f"dataset folder = {folder.path} has no finished case, must have some")
        described = tuple(folder.case(k) for k in numbers)
        if any(case.aneurysm is None for case in described):
            raise InputError(
                f"dataset folder = {folder.path} has cases without [aneurysm], must have one in all"
            )
        found = dataset(folder, everything).isel(case=numbers)
        positions = np.asarray(found.positions.values, dtype=np.float64)
        depths = [end_depths(case, nodes) for case, nodes in zip(described, positions, strict=True)]
        return cls(
            folder.plan_id,
            described,
            numbers,
            np.array([folder.is_test(k) for k in numbers]),
            positions,
            np.array(depths) >= 0.0,
            np.asarray(found.outcome.values == "success"),
            {r.name: (r.low, r.high) for r in folder.plan.ranges},
        )

    @property
    def regression_tests(self) -> Indices:
        """Indices of the successes that shapes are tested on: half as many as there are tests,
        the first of them (the paper has 50 beside 100, errata row 23)."""
        return np.flatnonzero(self.test & self.success)[: int(self.test.sum()) // 2]

    @property
    def regression_training(self) -> Indices:
        """Indices of all other successes."""
        return np.setdiff1d(np.flatnonzero(self.success), self.regression_tests)

    @property
    def classification_training(self) -> Indices:
        """Indices of all cases that are no tests."""
        return np.flatnonzero(~self.test)

    @property
    def classification_tests(self) -> Indices:
        """Indices of the tests."""
        return np.flatnonzero(self.test)
