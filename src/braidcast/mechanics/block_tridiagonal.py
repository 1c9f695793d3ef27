"""Cholesky factorisation of block-tridiagonal matrices, every second level eliminated first.

Unknowns stand in levels, coupled only to their own and the neighbouring ones. Within an odd level
they fall into small groups that know nothing of each other (the crossings of one ring of a braid),
so the odd levels are eliminated by tiny Cholesky factors,

    S = K_ee - K_eo K_oo^-1 K_oe,

and what is left, block tridiagonal over the even levels, goes to LAPACK block by block. This is
the first step of block cyclic reduction (Golub & Van Loan 2013, section 4.5.4). Where the groups
of the odd levels are large, nothing is eliminated first.
"""

from collections.abc import Callable

import numba as nb
import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.linalg.blas import dgemv, dsyrk, dtrsm, dtrsv
from scipy.linalg.lapack import dpotrf
from scipy.sparse.csgraph import connected_components

from braidcast.mechanics.arrays import IntArray
from braidcast.mechanics.rotations import Array

LARGEST_GROUP = 24
"""Odd levels are eliminated first while their independent groups have no more unknowns."""


class NotPositiveDefinite(Exception):
    """The matrix has a pivot that is not positive."""


class BlockTridiagonal:
    """Analysis of one CSR pattern (both triangles) with levels (n,)."""

    def __init__(self, indptr: IntArray, indices: IntArray, levels: IntArray) -> None:
        n = len(levels)
        rows = np.repeat(np.arange(n), np.diff(indptr))
        if len(rows) and np.abs(levels[rows] - levels[indices]).max() > 1:
            raise ValueError("levels couple more than neighbours")
        levels = np.unique(levels, return_inverse=True)[1]
        self.group_of = self._groups(rows, indices, levels)
        kept = self.group_of < 0
        eliminating = not kept.all()
        self.level = np.where(kept, levels // 2 if eliminating else levels, -1)
        count = int(self.level.max(initial=-1)) + 1
        self.sizes = np.bincount(self.level[kept], minlength=count)
        self.starts = np.concatenate([[0], np.cumsum(self.sizes)])
        order = np.flatnonzero(kept)[np.argsort(self.level[kept], kind="stable")]
        self.order = order
        self.place = np.full(n, -1)
        self.place[order] = np.arange(len(order)) - np.repeat(self.starts[:-1], self.sizes)
        # flat storage: diagonal block i (Fortran order), then the block below it
        following = np.append(self.sizes[1:], 0)
        area = self.sizes * self.sizes
        self.diagonal_at = np.concatenate([[0], np.cumsum(area + following * self.sizes)])
        self.below_at = self.diagonal_at[:-1] + area
        self._map_direct(rows, indices, kept)
        self._map_groups(indptr, indices)

    @staticmethod
    def _groups(rows: IntArray, columns: IntArray, levels: IntArray) -> IntArray:
        """Group (n,) of every unknown that is eliminated first, -1 for the others."""
        group_of = np.full(len(levels), -1)
        odd = np.flatnonzero(levels % 2 == 1)
        if not len(odd):
            return group_of
        same = (levels[rows] == levels[columns]) & (levels[rows] % 2 == 1)
        ones = np.ones(int(same.sum()))
        graph = sp.csr_matrix((ones, (rows[same], columns[same])), shape=(len(levels),) * 2)
        label = connected_components(graph[odd][:, odd], directed=False)[1]
        if np.bincount(label).max() <= LARGEST_GROUP:
            group_of[odd] = label
        return group_of

    def _target(self, rows: IntArray, columns: IntArray) -> IntArray:
        """Place in the flat storage of entries of the kept part; -1 for the upper triangle."""
        lr, lc = self.level[rows], self.level[columns]
        r, c = self.place[rows], self.place[columns]
        target = np.full(rows.shape, -1)
        same = (lr == lc) & (r >= c)
        target[same] = self.diagonal_at[lr[same]] + c[same] * self.sizes[lr[same]] + r[same]
        below = lr == lc + 1
        target[below] = self.below_at[lc[below]] + c[below] * self.sizes[lr[below]] + r[below]
        return target

    def _map_direct(self, rows: IntArray, columns: IntArray, kept: NDArray[np.bool_]) -> None:
        both = np.flatnonzero(kept[rows] & kept[columns])
        target = self._target(rows[both], columns[both])
        self.direct_from = both[target >= 0]
        self.direct_to = target[target >= 0]

    def _map_groups(self, indptr: IntArray, indices: IntArray) -> None:
        """For each group: its unknowns, its neighbours, and where their entries come from."""
        n, size = len(self.group_of), int(self.group_of.max(initial=-1)) + 1
        members = np.flatnonzero(self.group_of >= 0)
        members = members[np.argsort(self.group_of[members], kind="stable")]
        own = np.bincount(self.group_of[members], minlength=size)
        self.members = members
        self.member_at = _starts(own)
        # all entries of the members' rows: group, row within it, column, place in the CSR values
        length = indptr[members + 1] - indptr[members]
        slot = np.repeat(indptr[members], length) + _count_up(length)
        column = indices[slot]
        group = np.repeat(self.group_of[members], length)
        row = np.repeat(np.arange(len(members)) - self.member_at[self.group_of[members]], length)
        outside = self.group_of[column] < 0
        key = group * n + column
        around = np.sort(key[outside])
        around = around[np.diff(around, prepend=-1) != 0]
        self.neighbours = around % n
        beside = np.bincount(around // n, minlength=size)
        self.neighbour_at = _starts(beside)
        # each group keeps a dense block, its rows by [itself, its neighbours]
        rank = np.zeros(n, dtype=np.int64)
        rank[members] = np.arange(len(members))
        inside_place = rank[column] - self.member_at[group]
        outside_place = own[group] + np.searchsorted(around, key) - self.neighbour_at[group]
        self.entry_at = _starts(own * (own + beside))
        self.entries = np.full(self.entry_at[-1], -1)
        place = np.where(outside, outside_place, inside_place)
        self.entries[self.entry_at[group] + row * (own + beside)[group] + place] = slot
        self.target_at = _starts(beside**2)
        of = np.repeat(np.arange(size), beside**2)
        first, second = np.divmod(_count_up(beside**2), beside[of])
        base = self.neighbour_at[of]
        self.targets = self._target(self.neighbours[base + first], self.neighbours[base + second])

    def factorise(self, data: Array) -> Callable[[Array], Array]:
        """Cholesky factor of the matrix with CSR values ``data``; returns the solution operator.

        Raises NotPositiveDefinite.
        """
        flat = np.zeros(self.diagonal_at[-1])
        flat[self.direct_to] = data[self.direct_from]
        half = np.empty(len(self.entries))
        ok = _eliminate(
            data,
            self.member_at,
            self.neighbour_at,
            self.entry_at,
            self.entries,
            self.target_at,
            self.targets,
            half,
            flat,
        )
        if not ok:
            raise NotPositiveDefinite
        diagonal: list[Array] = []
        below: list[Array] = []
        for i, size in enumerate(self.sizes):
            a, b = self.diagonal_at[i], self.below_at[i]
            block = flat[a:b].reshape((size, size), order="F")
            if i:
                block = dsyrk(-1.0, below[-1], beta=1.0, c=block, lower=1, overwrite_c=1)
            factor, info = dpotrf(block, lower=1, clean=0, overwrite_a=1)
            if info:
                raise NotPositiveDefinite
            diagonal.append(factor)
            if i + 1 < len(self.sizes):
                under = flat[b : self.diagonal_at[i + 1]].reshape((-1, size), order="F")
                below.append(dtrsm(1.0, factor, under, side=1, lower=1, trans_a=1, overwrite_b=1))

        def solve(b: Array) -> Array:
            x = np.array(b, dtype=np.float64)
            _groups_forward(
                x, self.members, self.member_at, self.neighbours, self.neighbour_at,
                self.entry_at, half,
            )  # fmt: skip
            y = x[self.order]
            pieces = [y[s:e] for s, e in zip(self.starts[:-1], self.starts[1:], strict=True)]
            for i, piece in enumerate(pieces):
                if i:
                    piece -= dgemv(1.0, below[i - 1], pieces[i - 1])
                piece[:] = dtrsv(diagonal[i], piece, lower=1)
            for i in range(len(pieces) - 1, -1, -1):
                piece = pieces[i]
                if i + 1 < len(pieces):
                    piece -= dgemv(1.0, below[i], pieces[i + 1], trans=1)
                piece[:] = dtrsv(diagonal[i], piece, lower=1, trans=1)
            x[self.order] = y
            _groups_backward(
                x, self.members, self.member_at, self.neighbours, self.neighbour_at,
                self.entry_at, half,
            )  # fmt: skip
            return x

        return solve


def _starts(lengths: IntArray) -> IntArray:
    """Where each of consecutive pieces begins, and the last one ends."""
    return np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64)


def _count_up(lengths: IntArray) -> IntArray:
    """0, 1, ... within each of consecutive pieces."""
    return np.arange(int(lengths.sum())) - np.repeat(_starts(lengths)[:-1], lengths)


@nb.njit(cache=True)
def _eliminate(
    data: Array,
    member_at: IntArray,
    neighbour_at: IntArray,
    entry_at: IntArray,
    entries: IntArray,
    target_at: IntArray,
    targets: IntArray,
    half: Array,
    flat: Array,
) -> bool:
    """Per group: L L^T = K_oo, W = L^-1 K_oe into ``half`` (as [L W]), and -W^T W into ``flat``."""
    for g in range(len(member_at) - 1):
        m = member_at[g + 1] - member_at[g]
        n = neighbour_at[g + 1] - neighbour_at[g]
        w = half[entry_at[g] : entry_at[g + 1]].reshape((m, m + n))
        e = entries[entry_at[g] : entry_at[g + 1]].reshape((m, m + n))
        for i in range(m):
            for j in range(m + n):
                w[i, j] = data[e[i, j]] if e[i, j] >= 0 else 0.0
        for i in range(m):
            # row i of the lower factor, then of L^-1 K_oe
            for j in range(i):
                v = w[i, j]
                for k in range(j):
                    v -= w[i, k] * w[j, k]
                w[i, j] = v / w[j, j]
            pivot = w[i, i]
            for k in range(i):
                pivot -= w[i, k] * w[i, k]
            if not pivot > 0.0:
                return False
            w[i, i] = np.sqrt(pivot)
            for k in range(i):
                for j in range(m, m + n):
                    w[i, j] -= w[i, k] * w[k, j]
            for j in range(m, m + n):
                w[i, j] /= w[i, i]
        t = targets[target_at[g] : target_at[g + 1]].reshape((n, n))
        for i in range(n):
            for j in range(n):
                if t[i, j] < 0:
                    continue
                v = 0.0
                for k in range(m):
                    v += w[k, m + i] * w[k, m + j]
                flat[t[i, j]] -= v
    return True


@nb.njit(cache=True)
def _groups_forward(
    x: Array,
    members: IntArray,
    member_at: IntArray,
    neighbours: IntArray,
    neighbour_at: IntArray,
    entry_at: IntArray,
    half: Array,
) -> None:
    for g in range(len(member_at) - 1):
        m = member_at[g + 1] - member_at[g]
        around = neighbours[neighbour_at[g] : neighbour_at[g + 1]]
        own = members[member_at[g] : member_at[g + 1]]
        n = len(around)
        w = half[entry_at[g] : entry_at[g + 1]].reshape((m, m + n))
        for i in range(m):
            v = x[own[i]]
            for k in range(i):
                v -= w[i, k] * x[own[k]]
            x[own[i]] = v / w[i, i]
        for i in range(m):
            for j in range(n):
                x[around[j]] -= w[i, m + j] * x[own[i]]


@nb.njit(cache=True)
def _groups_backward(
    x: Array,
    members: IntArray,
    member_at: IntArray,
    neighbours: IntArray,
    neighbour_at: IntArray,
    entry_at: IntArray,
    half: Array,
) -> None:
    for g in range(len(member_at) - 1):
        m = member_at[g + 1] - member_at[g]
        around = neighbours[neighbour_at[g] : neighbour_at[g + 1]]
        own = members[member_at[g] : member_at[g + 1]]
        n = len(around)
        w = half[entry_at[g] : entry_at[g + 1]].reshape((m, m + n))
        for i in range(m - 1, -1, -1):
            v = x[own[i]]
            for j in range(n):
                v -= w[i, m + j] * x[around[j]]
            for k in range(i + 1, m):
                v -= w[k, i] * x[own[k]]
            x[own[i]] = v / w[i, i]
