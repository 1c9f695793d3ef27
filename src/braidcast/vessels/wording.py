"""Counts, places and beginnings of the sentences about a surface."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray

from braidcast.errors import InputError


def place(point: NDArray[np.float64]) -> str:
    """A point (3,) in words."""
    return "({}) mm".format(", ".join(f"{round(value, 2) + 0.0:g}" for value in point.tolist()))


def counted(number: int, one: str, more: str = "") -> str:
    """A number and what it counts: 1 hole, 2 holes."""
    return f"{number} {one if number == 1 else more or one + 's'}"


def was(number: int) -> str:
    return "was" if number == 1 else "were"


@contextmanager
def about(where: str) -> Iterator[None]:
    """Put the field and its value before what is said of them."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{where} {error}") from None
