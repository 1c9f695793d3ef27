"""One line from pieces that follow one another, such as segments of two points each."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Line = tuple[Array, Array | None]
"""Points (n, 3) mm and radii (n,) mm if they are known."""


def joined_chain(lines: list[Line]) -> Line | None:
    """The one unbranched line that ``lines`` make, joined where their ends coincide.

    None if they make none: if there are not just two free ends, if it is in several parts, comes
    to a place twice, or turns back at a joint, as the lines of VMTK from one inlet do. It runs as
    the line at its beginning does.
    """
    ends = np.array([[points[0], points[-1]] for points, _ in lines])
    _, node, count = np.unique(
        ends.reshape(-1, 3).round(_DECIMALS), axis=0, return_inverse=True, return_counts=True
    )
    node = node.reshape(-1, 2)
    free = np.flatnonzero(count[node.ravel()] == 1)
    if len(free) != 2 or count.max() > 2:
        return None
    here = next((end for end in free if end % 2 == 0), free[0])
    order = _walk(node, int(here))
    if len(order) < len(lines):
        return None
    parts = [_turned(lines[line], reverse) for line, reverse in order]
    points = np.concatenate([parts[0][0], *(part[1:] for part, _ in parts[1:])])
    if len(np.unique(points, axis=0)) < len(points) or _turns_back(parts):
        return None
    radii = [values for _, values in parts if values is not None]
    if len(radii) < len(parts):
        return points, None
    return points, np.concatenate([radii[0], *(values[1:] for values in radii[1:])])


_DECIMALS = 4
"""Of the places, mm, that are taken for the same."""


def _walk(node: NDArray[np.int64], end: int) -> list[tuple[int, bool]]:
    """Lines from a free end on, and whether each is gone through backwards."""
    at: dict[int, list[int]] = {}
    for other, place in enumerate(node.ravel().tolist()):
        at.setdefault(place, []).append(other)
    order = [(end // 2, end % 2 == 1)]
    while len(order) < len(node):
        leaving = end ^ 1
        onward = [other for other in at[int(node.flat[leaving])] if other != leaving]
        if not onward:
            break
        end = onward[0]
        order.append((end // 2, end % 2 == 1))
    return order


def _turned(line: Line, reverse: bool) -> Line:
    points, radii = line
    step = -1 if reverse else 1
    return points[::step], None if radii is None else radii[::step]


def _turns_back(parts: list[Line]) -> bool:
    before = np.array([points[-1] - points[-2] for points, _ in parts[:-1]])
    after = np.array([points[1] - points[0] for points, _ in parts[1:]])
    return bool(np.any(np.einsum("ij,ij->i", before, after) < 0.0))
