"""Nested Latin hypercubes: Latin, nested, evenly spread, and the same again for a seed."""

import numpy as np
import pytest
from scipy.stats import qmc

from braidcast.dataset.hypercube import best_candidate, nested_hypercube, nested_sets, spread

COUNT, DIMENSIONS, SUBSETS, TESTS = 120, 4, (30, 60), 20
SETS = nested_sets(COUNT, SUBSETS, TESTS)


@pytest.fixture(scope="module")
def points() -> np.ndarray:
    return nested_hypercube(COUNT, DIMENSIONS, SUBSETS, TESTS, seed=7)


def discrepancy(points: np.ndarray) -> float:
    return float(qmc.discrepancy(points, method="CD"))


def test_the_sets_are_tests_subsets_and_what_is_left_for_training() -> None:
    assert SETS == [(0, 20), (0, 30), (0, 60), (0, 120), (20, 30), (20, 60), (20, 120)]
    assert nested_sets(5, (), 0) == [(0, 5)]
    assert nested_sets(5, (3,), 3) == [(0, 3), (0, 5), (3, 5)]


@pytest.mark.parametrize(
    ("count", "dimensions"), [(COUNT, DIMENSIONS), (25_000, 2), (1, 3), (7, 1)]
)
def test_every_stratum_of_every_dimension_holds_one_point(count: int, dimensions: int) -> None:
    points = nested_hypercube(count, dimensions, (), 0, seed=3)
    assert points.shape == (count, dimensions)
    assert points.min() >= 0.0 and points.max() < 1.0
    strata = np.sort(np.floor(points * count).astype(int), axis=0)
    np.testing.assert_array_equal(strata, np.tile(np.arange(count)[:, None], dimensions))


def test_the_hypercube_stays_latin_with_subsets(points: np.ndarray) -> None:
    strata = np.sort(np.floor(points * COUNT).astype(int), axis=0)
    np.testing.assert_array_equal(strata, np.tile(np.arange(COUNT)[:, None], DIMENSIONS))


@pytest.mark.parametrize(("begin", "end"), SETS)
def test_each_subset_is_spread_better_than_any_drawn_from_the_whole(
    points: np.ndarray, begin: int, end: int
) -> None:
    rng = np.random.default_rng(0)
    if end - begin < COUNT:
        others = [points[rng.permutation(COUNT)[: end - begin]] for _ in range(50)]
    else:
        others = [qmc.LatinHypercube(DIMENSIONS, rng=rng).random(COUNT) for _ in range(50)]
    assert discrepancy(points[begin:end]) < 0.6 * min(map(discrepancy, others))


@pytest.mark.parametrize("size", [TESTS, *SUBSETS, COUNT])
def test_each_subset_is_about_as_good_as_a_hypercube_of_its_own(
    points: np.ndarray, size: int
) -> None:
    own = [
        qmc.LatinHypercube(DIMENSIONS, optimization="random-cd", rng=seed).random(size)
        for seed in range(3)
    ]
    assert discrepancy(points[:size]) < 1.25 * float(np.median([discrepancy(x) for x in own]))


@pytest.mark.parametrize("dimensions", [1, 2, 6])
@pytest.mark.parametrize("trials", [0, 1, 2000])
def test_discrepancies_kept_up_to_date_are_scipys(dimensions: int, trials: int) -> None:
    rng = np.random.default_rng(trials)
    begun = rng.random((40, dimensions))
    sets = nested_sets(40, (15, 25), 5)
    points, kept = spread(begun, sets, trials, rng)
    np.testing.assert_allclose(
        kept, [discrepancy(points[begin:end]) for begin, end in sets], rtol=1e-9
    )
    before = [discrepancy(begun[begin:end]) for begin, end in sets]
    assert np.log(kept).sum() <= np.log(before).sum() + 1e-12
    assert (trials < 2000) or np.log(kept).sum() < np.log(before).sum() - 0.5
    np.testing.assert_array_equal(np.sort(points, axis=0), np.sort(begun, axis=0))


def test_the_seed_makes_the_hypercube(points: np.ndarray) -> None:
    again = nested_hypercube(COUNT, DIMENSIONS, SUBSETS, TESTS, seed=7)
    np.testing.assert_array_equal(points, again)
    other = nested_hypercube(COUNT, DIMENSIONS, SUBSETS, TESTS, seed=8)
    assert not np.isin(points, other).any()


def test_progress_ends_at_one() -> None:
    said: list[float] = []
    nested_hypercube(10, 2, (), 0, seed=1, progress=said.append)
    assert said == sorted(said) and said[-1] == 1.0


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("sets", [[(0, 6)], [(0, 5), (0, 6)], [(0, 3), (4, 5), (4, 6)]])
def test_the_best_candidate_is_the_one_with_the_least_discrepancy(
    seed: int, sets: list[tuple[int, int]]
) -> None:
    rng = np.random.default_rng(seed)
    points, candidates = rng.random((7, 3)), rng.random((30, 3))
    costs = []
    for candidate in candidates:
        points[4] = candidate
        costs.append(sum((e - b) * discrepancy(points[b:e]) for b, e in sets if b <= 4 < e))
    # An absent point changes nothing, wherever it is; the region is the whole cube here.
    spaced = np.insert(points, 2, rng.random(3), axis=0)
    spaced[5] = rng.random(3)
    present = np.array([True, True, False, True, True, False, True, True])
    shifted = [(b + (b > 2), e + (e > 2)) for b, e in sets]
    middles = (np.arange(30) + 0.5) / 30
    cube = np.stack(np.meshgrid(middles, middles, middles), axis=-1).reshape(-1, 3)
    best = best_candidate(candidates, 5, spaced, present, shifted, cube)
    assert costs[best] == pytest.approx(min(costs), rel=1e-3)


def test_the_best_candidate_fills_the_region_and_no_more() -> None:
    rng = np.random.default_rng(0)
    half = rng.random((2000, 2)) * [0.5, 1.0]
    points = np.zeros((15, 2))
    present = np.zeros(15, dtype=bool)
    for place in range(15):
        candidates = rng.random((200, 2)) * [0.5, 1.0]
        best = best_candidate(candidates, place, points, present, [(0, 15)], half)
        points[place], present[place] = candidates[best], True
    filled = discrepancy(points * [2.0, 1.0])
    assert filled < 0.5 * min(discrepancy(rng.random((15, 2))) for _ in range(50))
