"""Arrays as a user gives them, checked once at the door."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from braidcast.errors import InputError

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]


def as_array(name: str, value: ArrayLike, shape: tuple[int | None, ...]) -> Array:
    """Finite numbers of a shape, None standing for any length; a contiguous copy."""
    wanted = "(" + ", ".join("N" if n is None else str(n) for n in shape) + ")"
    try:
        array = np.array(value, dtype=np.float64, order="C")
    except (TypeError, ValueError):
        raise InputError(f"{name} must be numbers of shape {wanted}") from None
    if array.ndim != len(shape) or any(
        n is not None and n != m for n, m in zip(shape, array.shape, strict=True)
    ):
        raise InputError(f"{name} has shape {array.shape}; it must be {wanted}")
    if not np.isfinite(array).all():
        where = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise InputError(f"{name}{list(where)} is {array[where]}; it must be finite")
    return array


def as_indices(name: str, value: ArrayLike) -> IntArray:
    """Pairs of node indices (M, 2); a contiguous copy."""
    array = np.asarray(value)
    if array.size == 0:
        return np.zeros((0, 2), dtype=np.int64)
    if array.ndim != 2 or array.shape[1] != 2 or not np.issubdtype(array.dtype, np.integer):
        raise InputError(f"{name} must be whole numbers of shape (M, 2), node indices")
    return np.array(array, dtype=np.int64, order="C")


def require_nodes(name: str, indices: IntArray, count: int) -> None:
    """InputError unless all indices name one of ``count`` nodes."""
    if len(indices) and (indices.min() < 0 or indices.max() >= count):
        raise InputError(f"{name} must name nodes 0 to {count - 1}")
