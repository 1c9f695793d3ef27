"""Every linear solver against dense algebra, on the same matrices."""

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from braidcast.deployment.net import braid_net
from braidcast.devices import catalogue
from braidcast.errors import InputError
from braidcast.mechanics import Joints, Problem
from braidcast.mechanics.band_cholesky import BandCholesky, NotPositiveDefinite
from braidcast.mechanics.linear_solvers import breadth_first_levels, solver
from braidcast.mechanics.system import System
from problems.nets import SOLVERS

every_solver = pytest.mark.parametrize("key", SOLVERS)


def random_matrix(seed, levels=9, width=7, density=0.4):
    """Symmetric positive definite (n, n) whose entries couple only neighbouring levels."""
    rng = np.random.default_rng(seed)
    level = np.repeat(np.arange(levels), rng.integers(1, width + 1, levels))
    rng.shuffle(level)
    n = len(level)
    coupled = (np.abs(level[:, None] - level) <= 1) & (rng.random((n, n)) < density)
    dense = np.where(coupled, rng.normal(size=(n, n)), 0.0)
    dense = dense + dense.T
    dense += np.diag(np.abs(dense).sum(axis=1) + 0.1)
    return dense, level


def pattern(dense):
    matrix = sp.csr_matrix(dense)
    return matrix.indptr.astype(np.int64), matrix.indices.astype(np.int64), matrix.data


@every_solver
@settings(deadline=None, max_examples=25)
@given(seed=st.integers(0, 10_000), width=st.sampled_from([1, 3, 8, 40]))
def test_solves_any_level_pattern(key, seed, width):
    dense, levels = random_matrix(seed, width=width)
    indptr, indices, data = pattern(dense)
    b = np.random.default_rng(seed).normal(size=len(dense))
    before = b.copy()
    x = solver(key, indptr, indices, levels)(data)(b)
    np.testing.assert_allclose(dense @ x, b, atol=1e-11)
    np.testing.assert_array_equal(b, before)


@every_solver
def test_factors_live_side_by_side(key):
    dense, levels = random_matrix(4, width=20)
    indptr, indices, data = pattern(dense)
    other_indptr, other_indices, other_data = pattern(random_matrix(5, width=20)[0])
    factorise = solver(key, indptr, indices, levels)
    b = np.arange(1.0, len(dense) + 1.0)
    first = factorise(data)
    second = factorise(3.0 * data)
    third = solver(key, other_indptr, other_indices, random_matrix(5, width=20)[1])(other_data)
    for _ in range(2):
        np.testing.assert_allclose(dense @ first(b), b, rtol=1e-10)
        np.testing.assert_allclose(dense @ second(b), b / 3.0, rtol=1e-10)
        third(np.ones(len(other_indptr) - 1))


@every_solver
@pytest.mark.parametrize("where", [0, -1, "odd level", "even level"])
def test_indefinite_matrices_are_refused_and_the_next_one_solved(key, where):
    dense, levels = random_matrix(7)
    if where == "odd level":
        where = int(np.flatnonzero(levels == 3)[0])
    elif where == "even level":
        where = int(np.flatnonzero(levels == 4)[-1])
    indptr, indices, data = pattern(dense)
    factorise = solver(key, indptr, indices, levels)
    b = np.ones(len(dense))
    for spoilt in (-1.0, 0.0):
        wrong = dense.copy()
        wrong[where, where] = spoilt
        values = wrong[np.repeat(np.arange(len(dense)), np.diff(indptr)), indices]
        with pytest.raises(NotPositiveDefinite):
            factorise(values)
    np.testing.assert_allclose(dense @ factorise(data)(b), b, rtol=1e-10)


@every_solver
def test_slightly_indefinite_is_told_from_slightly_definite(key):
    dense, levels = random_matrix(11)
    indptr, indices, _ = pattern(dense)
    rows = np.repeat(np.arange(len(dense)), np.diff(indptr))
    factorise = solver(key, indptr, indices, levels)
    lowest = np.linalg.eigvalsh(dense)[0]
    for sign in (1.0, -1.0):
        shifted = dense - (1.0 - sign * 1e-6) * lowest * np.eye(len(dense))
        data = shifted[rows, indices]
        if sign > 0.0:
            factorise(data)
        else:
            with pytest.raises(NotPositiveDefinite):
                factorise(data)


@every_solver
def test_no_unknowns_at_all(key):
    empty = np.zeros(0, dtype=np.int64)
    factorise = solver(key, np.zeros(1, dtype=np.int64), empty, empty)
    assert factorise(np.zeros(0))(np.zeros(0)).shape == (0,)


@pytest.mark.parametrize("mirrored", [False, True])
def test_the_band_of_a_braid_is_hardly_wider_than_a_ring(mirrored):
    braid = catalogue["paper"]
    rings = np.array(braid.rings)
    levels = rings.max() - rings if mirrored else rings
    problem = Problem(braid_net(braid), joints=Joints(np.array(braid.crossings)), levels=levels)
    system = System(problem)
    band = BandCholesky(system.indptr, system.indices, system._dof_levels())
    # 36 rings of 24 crossings are left, 9 unknowns each; neighbours are up to 26 crossings apart
    assert len(band.order) == 36 * 24 * 9
    assert 24 * 9 < band.height <= 27 * 9


def test_not_finite_is_not_positive_definite():
    dense, levels = random_matrix(2)
    indptr, indices, data = pattern(dense)
    with pytest.raises(NotPositiveDefinite):
        solver("band_cholesky", indptr, indices, levels)(np.nan * data)


def test_unknown_and_missing_solvers_are_named():
    empty = np.zeros(0, dtype=np.int64)
    with pytest.raises(InputError, match='"cg" is unknown; use "band_cholesky"'):
        solver("cg", np.zeros(1, dtype=np.int64), empty, empty)
    if "pardiso" not in SOLVERS:
        with pytest.raises(InputError, match="pip install"):
            solver("pardiso", np.zeros(1, dtype=np.int64), empty, empty)


@settings(deadline=None, max_examples=40)
@given(st.integers(0, 10_000), st.integers(1, 40))
def test_breadth_first_levels_differ_by_one_at_most(seed, n):
    rng = np.random.default_rng(seed)
    graph = sp.csr_matrix(np.triu(rng.random((n, n)) < 1.5 / n, 1).astype(float))
    graph = graph + graph.T
    levels = breadth_first_levels(graph)
    rows, columns = graph.nonzero()
    assert (np.abs(levels[rows] - levels[columns]) <= 1).all()
    assert (levels >= 0).all()
