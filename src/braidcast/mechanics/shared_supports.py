"""Supports of nodes that share one translation: what holds one of them holds all."""

import numpy as np
from numpy.typing import NDArray

from braidcast.errors import InputError
from braidcast.mechanics.arrays import Array, IntArray

Flags = NDArray[np.bool_]


def share_supports(
    master: IntArray, fixed: Flags, motion: Array, axes: Array
) -> tuple[Flags, Array, Array]:
    """Supports (N, 6), motion (N, 6) and axes (N, 3, 3) after joining nodes to ``master`` (N,).

    Raises InputError where joined nodes are held in different axes or moved differently.
    """
    held = np.logical_or.reduce(fixed, axis=1)
    leader = _first(master, held)
    differs = held & (np.abs(axes - axes[leader]).max(axis=(1, 2)) > 1e-9)
    if differs.any():
        node = int(np.argmax(differs))
        raise InputError(f"joined nodes {leader[node]} and {node} are held in different axes")
    fixed, motion = fixed.copy(), motion.copy()
    for i in range(3):
        leader_i = _first(master, fixed[:, i])
        differs = fixed[:, i] & (np.abs(motion[:, i] - motion[leader_i, i]) > 1e-9)
        if differs.any():
            node = int(np.argmax(differs))
            raise InputError(f"joined nodes {leader_i[node]} and {node} are moved differently")
        motion[:, i] = motion[leader_i, i]
        fixed[:, i] = fixed[leader_i, i]
    return fixed, motion, np.ascontiguousarray(axes[leader])


def _first(master: IntArray, wanted: Flags) -> IntArray:
    """For every node the first wanted one it shares its master with, or else the master."""
    count = len(master)
    first = np.full(count, count)
    nodes = np.flatnonzero(wanted)
    np.minimum.at(first, master[nodes], nodes)
    first = first[master]
    return np.where(first == count, master, first)
