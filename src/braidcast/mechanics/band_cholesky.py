"""Cholesky factorisation of band matrices, every second level eliminated first.

Unknowns stand in levels, coupled only to their own and the neighbouring ones. Within an odd level
they fall into small groups that know nothing of each other (the crossings of one ring of a braid),
so the odd levels are eliminated by tiny Cholesky factors,

    S = K_ee - K_eo K_oo^-1 K_oe,

the first step of block cyclic reduction (Golub & Van Loan 2013, section 4.5.4). What is left is
numbered level by level, within a level by the first neighbour in the level before (Cuthill & McKee
1969): around a tube that winds like a screw thread, and the band is hardly wider than a level. It
goes to LAPACK's band Cholesky, which skips what a factorisation by dense blocks fills with zeros.
Where the groups of the odd levels are large, nothing is eliminated first.
"""

from collections.abc import Callable

import numba as nb
import numpy as np
import scipy.sparse as sp
from scipy.linalg.lapack import dpbtrf, dpbtrs
from scipy.sparse.csgraph import connected_components

from braidcast.mechanics.arrays import IntArray
from braidcast.mechanics.rotations import Array

LARGEST_GROUP = 24
"""Odd levels are eliminated first while their independent groups have no more unknowns."""


class NotPositiveDefinite(Exception):
    """The matrix has a pivot that is not positive."""


class BandCholesky:
    """Analysis of one CSR pattern (both triangles) with levels (n,)."""

    def __init__(self, indptr: IntArray, indices: IntArray, levels: IntArray) -> None:
        n = len(levels)
        rows = np.repeat(np.arange(n), np.diff(indptr))
        if len(rows) and np.abs(levels[rows] - levels[indices]).max() > 1:
            raise ValueError("levels couple more than neighbours")
        self.group_of = _groups(rows, indices, levels)
        kept = self.group_of < 0
        graph = _graph_of_the_rest(rows, indices, self.group_of)
        self.order = np.flatnonzero(kept)[_banded_order(graph, levels[kept])]
        self.place = np.full(n, -1)
        self.place[self.order] = np.arange(len(self.order))
        self.height = 1 + _bandwidth(graph, self.place[kept])
        entries = np.flatnonzero(kept[rows] & kept[indices])
        target = self._target(rows[entries], indices[entries])
        self.direct_from = entries[target >= 0]
        self.direct_to = target[target >= 0]
        self._map_groups(indptr, indices)

    def _target(self, rows: IntArray, columns: IntArray) -> IntArray:
        """Place in the band, LAPACK's lower form, of kept entries; -1 for the upper triangle."""
        r, c = self.place[rows], self.place[columns]
        return np.where(r >= c, c * self.height + r - c, -1)

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
        key = group * n + self.place[column]
        around = np.sort(key[outside])
        around = around[np.diff(around, prepend=-1) != 0]
        self.neighbour_places = around % n
        self.neighbours = self.order[self.neighbour_places]
        beside = np.bincount(around // n, minlength=size)
        self.neighbour_at = _starts(beside)
        # each group keeps two dense blocks: its rows by itself, then by its neighbours
        rank = np.zeros(n, dtype=np.int64)
        rank[members] = np.arange(len(members))
        inside_place = row * own[group] + rank[column] - self.member_at[group]
        beyond = np.searchsorted(around, key) - self.neighbour_at[group]
        outside_place = own[group] ** 2 + row * beside[group] + beyond
        self.entry_at = _starts(own * (own + beside))
        self.entries = np.full(self.entry_at[-1], -1)
        self.entries[self.entry_at[group] + np.where(outside, outside_place, inside_place)] = slot

    def factorise(self, data: Array) -> Callable[[Array], Array]:
        """Cholesky factor of the matrix with CSR values ``data``; returns the solution operator.

        Raises NotPositiveDefinite.
        """
        half = _gather(data, self.entries)
        if not _eliminate(half, self.member_at, self.neighbour_at, self.entry_at):
            raise NotPositiveDefinite
        size = len(self.order)
        flat = np.zeros(size * self.height)
        flat[self.direct_to] = data[self.direct_from]
        _subtract_products(
            half,
            self.member_at,
            self.neighbour_places,
            self.neighbour_at,
            self.entry_at,
            flat.reshape((size, self.height)),
        )
        band = flat.reshape((self.height, size), order="F")
        if size:
            band, info = dpbtrf(band, lower=1, overwrite_ab=1)
            if info:
                raise NotPositiveDefinite
        groups = (self.members, self.member_at, self.neighbours, self.neighbour_at, self.entry_at)

        def solve(b: Array) -> Array:
            x = np.array(b, dtype=np.float64)
            _groups_forward(x, *groups, half)
            if size:
                x[self.order] = dpbtrs(band, x[self.order], lower=1, overwrite_b=1)[0]
            _groups_backward(x, *groups, half)
            return x

        return solve


def _groups(rows: IntArray, columns: IntArray, levels: IntArray) -> IntArray:
    """Group (n,) of every unknown that is eliminated first, -1 for the others."""
    group_of = np.full(len(levels), -1)
    odd = np.flatnonzero(levels % 2 == 1)
    if not len(odd):
        return group_of
    same = (levels[rows] == levels[columns]) & (levels[rows] % 2 == 1)
    graph = _graph(rows[same], columns[same], (len(levels),) * 2)
    label = connected_components(graph[odd][:, odd], directed=False)[1]
    if np.bincount(label).max() <= LARGEST_GROUP:
        group_of[odd] = label
    return group_of


def _graph(rows: IntArray, columns: IntArray, shape: tuple[int, int]) -> sp.csr_matrix:
    return sp.csr_matrix((np.ones(len(rows), dtype=np.int32), (rows, columns)), shape=shape)


def _graph_of_the_rest(rows: IntArray, columns: IntArray, group_of: IntArray) -> sp.csr_matrix:
    """Couplings of the unknowns that are kept, once the neighbours of a group know each other."""
    n, count = len(group_of), int(group_of.max(initial=-1)) + 1
    kept = np.flatnonzero(group_of < 0)
    beside = (group_of[rows] >= 0) & (group_of[columns] < 0)
    neighbours = _graph(group_of[rows[beside]], columns[beside], (count, n))[:, kept]
    return _graph(rows, columns, (n, n))[kept][:, kept] + neighbours.T @ neighbours


def _banded_order(graph: sp.csr_matrix, levels: IntArray) -> IntArray:
    """Order (n,) of the vertices with a narrow band: the better of both directions."""
    orders = [_levelled_order(graph, levels), _levelled_order(graph, -levels)]
    return min(orders, key=lambda order: _bandwidth(graph, np.argsort(order)))


def _levelled_order(graph: sp.csr_matrix, levels: IntArray) -> IntArray:
    """Order level by level, within one by the first neighbour among those already numbered."""
    n = len(levels)
    by_level = np.argsort(levels, kind="stable")
    place = np.full(n, n)
    starts = np.flatnonzero(np.diff(levels[by_level], prepend=np.nan, append=np.nan))
    for start, end in zip(starts[:-1], starts[1:], strict=True):
        level = by_level[start:end]
        around = graph[level]
        first = np.full(len(level), n)
        linked = np.diff(around.indptr) > 0
        first[linked] = np.minimum.reduceat(place[around.indices], around.indptr[:-1][linked])
        by_level[start:end] = level[np.argsort(first, kind="stable")]
        place[by_level[start:end]] = np.arange(start, end)
    return by_level


def _bandwidth(graph: sp.csr_matrix, place: IntArray) -> int:
    """Largest distance from the diagonal when vertex i stands at ``place`` (n,)."""
    rows = np.repeat(np.arange(len(place)), np.diff(graph.indptr))
    return int(np.abs(place[rows] - place[graph.indices]).max(initial=0))


def _starts(lengths: IntArray) -> IntArray:
    """Where each of consecutive pieces begins, and the last one ends."""
    return np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64)


def _count_up(lengths: IntArray) -> IntArray:
    """0, 1, ... within each of consecutive pieces."""
    return np.arange(int(lengths.sum())) - np.repeat(_starts(lengths)[:-1], lengths)


@nb.njit(cache=True)
def _eliminate(
    half: Array, member_at: IntArray, neighbour_at: IntArray, entry_at: IntArray
) -> bool:
    """Per group, L L^T = K_oo and W = L^-1 K_oe in place of the entries in ``half``.

    Inner loops run over whole rows, so that the compiler works on several entries at once.
    """
    for g in range(len(member_at) - 1):
        m = member_at[g + 1] - member_at[g]
        n = neighbour_at[g + 1] - neighbour_at[g]
        factor, w = _blocks(half[entry_at[g] : entry_at[g + 1]], m, n)
        for i in range(m):
            for j in range(i):
                v = factor[i, j]
                for k in range(j):
                    v -= factor[i, k] * factor[j, k]
                factor[i, j] = v / factor[j, j]
            pivot = factor[i, i]
            for k in range(i):
                pivot -= factor[i, k] * factor[i, k]
            if not pivot > 0.0:
                return False
            factor[i, i] = np.sqrt(pivot)
            for k in range(i):
                v = factor[i, k]
                for j in range(n):
                    w[i, j] -= v * w[k, j]
            scale = 1.0 / factor[i, i]
            for j in range(n):
                w[i, j] *= scale
    return True


@nb.njit(cache=True)
def _subtract_products(
    half: Array,
    member_at: IntArray,
    places: IntArray,
    neighbour_at: IntArray,
    entry_at: IntArray,
    band: Array,
) -> None:
    """Per group, -W^T W into ``band``, by columns; ``places`` of its neighbours ascend."""
    product = np.empty((band.shape[1], band.shape[1]))
    for g in range(len(member_at) - 1):
        m = member_at[g + 1] - member_at[g]
        n = neighbour_at[g + 1] - neighbour_at[g]
        _, w = _blocks(half[entry_at[g] : entry_at[g + 1]], m, n)
        for i in range(n):
            for j in range(n):
                product[i, j] = 0.0
            for k in range(m):
                v = w[k, i]
                for j in range(n):
                    product[i, j] += v * w[k, j]
        place = places[neighbour_at[g] : neighbour_at[g + 1]]
        for i in range(n):
            for j in range(i, n):
                band[place[i], place[j] - place[i]] -= product[i, j]


@nb.njit(cache=True)
def _gather(data: Array, entries: IntArray) -> Array:
    """The entries of the groups' blocks; 0 where the pattern has none."""
    out = np.empty(len(entries))
    for i in range(len(entries)):
        out[i] = data[entries[i]] if entries[i] >= 0 else 0.0
    return out


@nb.njit(cache=True, inline="always")
def _blocks(half: Array, m: int, n: int) -> tuple[Array, Array]:
    """Factor (m, m) of a group and its rows (m, n) by the neighbours."""
    return half[: m * m].reshape((m, m)), half[m * m :].reshape((m, n))


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
        around = neighbours[neighbour_at[g] : neighbour_at[g + 1]]
        own = members[member_at[g] : member_at[g + 1]]
        m, n = len(own), len(around)
        factor, w = _blocks(half[entry_at[g] : entry_at[g + 1]], m, n)
        for i in range(m):
            v = x[own[i]]
            for k in range(i):
                v -= factor[i, k] * x[own[k]]
            x[own[i]] = v / factor[i, i]
        for i in range(m):
            for j in range(n):
                x[around[j]] -= w[i, j] * x[own[i]]


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
        around = neighbours[neighbour_at[g] : neighbour_at[g + 1]]
        own = members[member_at[g] : member_at[g + 1]]
        m, n = len(own), len(around)
        factor, w = _blocks(half[entry_at[g] : entry_at[g + 1]], m, n)
        for i in range(m - 1, -1, -1):
            v = x[own[i]]
            for j in range(n):
                v -= w[i, j] * x[around[j]]
            for k in range(i + 1, m):
                v -= factor[k, i] * x[own[k]]
            x[own[i]] = v / factor[i, i]
