"""Counts and places in the sentences about a surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def place(point: NDArray[np.float64]) -> str:
    """A point (3,) in words."""
    return "({}) mm".format(", ".join(f"{round(value, 2) + 0.0:g}" for value in point.tolist()))


def counted(number: int, one: str, more: str = "") -> str:
    """A number and what it counts: 1 hole, 2 holes."""
    return f"{number} {one if number == 1 else more or one + 's'}"


def was(number: int) -> str:
    return "was" if number == 1 else "were"
