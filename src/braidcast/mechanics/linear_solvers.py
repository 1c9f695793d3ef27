"""One door to sparse symmetric solvers, opened by key.

    factorise = solver("band_cholesky", indptr, indices, levels)
    solve = factorise(data)          # raises NotPositiveDefinite
    x = solve(b)

The pattern (CSR, both triangles) is analysed once, the numbers change at every Newton step. A
failed Cholesky factorisation is the cheap and exact sign of an indefinite tangent.
"""

import weakref
from collections.abc import Callable
from importlib.util import find_spec

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from braidcast.errors import InputError
from braidcast.mechanics.arrays import IntArray
from braidcast.mechanics.band_cholesky import BandCholesky, NotPositiveDefinite
from braidcast.mechanics.rotations import Array

ZERO_PIVOT = -4
"""PARDISO's error number for a pivot that is not positive."""

Solve = Callable[[Array], Array]
Factorise = Callable[[Array], Solve]


def solver(key: str, indptr: IntArray, indices: IntArray, levels: IntArray) -> Factorise:
    """The factorisation of matrices with one pattern.

    ``key``: "band_cholesky" (no extra dependency), "pardiso" (MKL's
    Cholesky, extra ``braidcast[pardiso]``) or "superlu" (SciPy's LU, last resort). ``levels`` (n,)
    numbers the unknowns so that only those of the same or neighbouring levels are coupled.

    Raises InputError for an unknown key or one that is not installed.
    """
    if key == "band_cholesky":
        return BandCholesky(indptr, indices, levels).factorise
    if key == "superlu":
        return _superlu(indptr, indices)
    if key == "pardiso":
        if find_spec("pypardiso") is None:
            raise InputError(
                'linear solver "pardiso" is not installed; pip install "braidcast[pardiso]", '
                'or use "band_cholesky" or "superlu"'
            )
        return _pardiso(indptr, indices)
    raise InputError(
        f'linear solver "{key}" is unknown; use "band_cholesky", "pardiso" or "superlu"'
    )


def _superlu(indptr: IntArray, indices: IntArray) -> Factorise:
    n = len(indptr) - 1

    def factorise(data: Array) -> Solve:
        matrix = sp.csc_matrix((data, indices, indptr), shape=(n, n))
        try:
            lu = splu(
                matrix,
                permc_spec="MMD_AT_PLUS_A",
                diag_pivot_thresh=0.0,
                options={"SymmetricMode": True},
            )
        except RuntimeError as error:
            raise NotPositiveDefinite from error
        # without row exchanges L U is L D L^T, whose inertia is the signs of D
        if (lu.perm_r != lu.perm_c).any() or (lu.U.diagonal() <= 0.0).any():
            raise NotPositiveDefinite
        return lu.solve

    return factorise


def _pardiso(indptr: IntArray, indices: IntArray) -> Factorise:
    from pypardiso import PyPardisoSolver
    from pypardiso.pardiso_wrapper import PyPardisoError

    n = len(indptr) - 1
    if n == 0:
        return lambda data: np.copy
    rows = np.repeat(np.arange(n), np.diff(indptr))
    upper = indices >= rows
    columns = indices[upper].astype(np.int32)
    starts = np.concatenate([[0], np.cumsum(np.bincount(rows[upper], minlength=n))]).astype(
        np.int32
    )
    pardiso = PyPardisoSolver(mtype=2)
    # MKL keeps one factor: which matrix it is of
    factored: sp.csr_matrix | None = None

    def call(phase: int, matrix: sp.csr_matrix, b: Array) -> Array:
        pardiso.set_phase(phase)
        return pardiso._call_pardiso(matrix, b.reshape(-1, 1)).ravel()

    def refactor(matrix: sp.csr_matrix) -> None:
        nonlocal factored
        factored = None
        try:
            call(22, matrix, np.zeros(n))
        except PyPardisoError as error:
            if error.value != ZERO_PIVOT:
                raise
            raise NotPositiveDefinite from error
        factored = matrix

    def factorise(data: Array) -> Solve:
        matrix = sp.csr_matrix((data[upper], columns, starts), shape=(n, n))
        refactor(matrix)

        def solve(b: Array) -> Array:
            if factored is not matrix:
                refactor(matrix)
            return call(33, matrix, np.array(b, dtype=np.float64))

        return solve

    call(11, sp.csr_matrix((np.zeros(len(columns)), columns, starts), shape=(n, n)), np.zeros(n))
    # all that is handed out holds on to ``call``
    weakref.finalize(call, pardiso.free_memory, everything=True)
    return factorise


def breadth_first_levels(graph: sp.csr_matrix) -> IntArray:
    """Levels (n,) of a symmetric graph, breadth first from an outermost vertex of each part."""
    from scipy.sparse.csgraph import connected_components, dijkstra

    parts, part = connected_components(graph, directed=False)
    levels = np.zeros(graph.shape[0], dtype=np.int64)
    for p in range(parts):
        members = np.flatnonzero(part == p)
        piece = graph[members][:, members]
        far = np.argmax(dijkstra(piece, unweighted=True, indices=0))
        levels[members] = dijkstra(piece, unweighted=True, indices=int(far)).astype(np.int64)
    return levels
