"""The quadratic Bézier centreline against closed forms, quadrature and polynomial roots."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.integrate import quad

from braidcast.errors import InputError
from braidcast.vessels import QuadraticBezier

ARCH = QuadraticBezier([0, 0, 0], [0, 15, 20], [0, 0, 40])
STRAIGHT = QuadraticBezier([0, 0, 0], [0, 0, 20], [0, 0, 40])

coordinate = st.floats(-30, 30).map(lambda x: round(x, 3))
point = st.tuples(coordinate, coordinate, coordinate).map(np.array)


@st.composite
def curves(draw):
    P0, P1, P2 = draw(point), draw(point), draw(point)
    # Nearly folded curves are legal; their curvature would dominate every tolerance below.
    assume(min(np.linalg.norm(P1 - P0), np.linalg.norm(P2 - P1)) > 0.1)
    assume(np.linalg.norm(np.cross(P1 - P0, P2 - P1)) > 0.1)
    return QuadraticBezier(P0, P1, P2)


def nearest_by_roots(curve, x):
    """Distance to the continued curve from the roots of (B − x)·B' = 0 and the two end tangents."""
    a, b, p = curve.P1 - curve.P0, curve.P2 - 2 * curve.P1 + curve.P0, curve.P0 - x
    roots = np.roots([b @ b, 3 * a @ b, 2 * a @ a + p @ b, p @ a]).real
    t = np.concatenate([np.clip(roots, 0, 1), [0, 1]])
    candidates = list(np.linalg.norm(curve.point(t) - x, axis=1))
    for end, out in ((curve.P0, -a), (curve.P2, a + b)):
        out = out / np.linalg.norm(out)
        along = max((x - end) @ out, 0)
        candidates.append(np.linalg.norm(x - end - along * out))
    return min(candidates)


def test_distance_to_reference_points():
    distance, _ = ARCH.closest([[1, 5, 10], [-1, 9, 20], [0, 3, 33]])
    assert_allclose(distance, [1.15826818, 1.80277564, 1.19187881], rtol=0, atol=1e-8)


def test_length_of_reference_curve():
    assert_allclose(ARCH.length, 43.483924815, rtol=0, atol=1e-9)


@settings(deadline=None, max_examples=60)
@given(curves())
def test_length_is_the_integral_of_speed(curve):
    a, b = curve.P1 - curve.P0, curve.P2 - 2 * curve.P1 + curve.P0
    slowest = float(np.clip(-(a @ b) / max(b @ b, 1e-30), 1e-6, 1 - 1e-6))
    length = quad(
        lambda t: 2 * np.linalg.norm(a + t * b),
        0,
        1,
        points=[slowest],
        epsabs=1e-11,
        epsrel=1e-12,
        limit=200,
    )[0]
    assert_allclose(curve.length, length, rtol=1e-10)


@pytest.mark.parametrize("bow", [0.0, 1e-9, 1e-6, 1e-3, 0.9, 1.1, 2.0])
def test_length_is_continuous_across_its_two_formulas(bow):
    # |b| = 2 bow against |a| = 10: the formulas change over at |b| = |a|/10.
    curve = QuadraticBezier([0, 0, 0], [0, bow / 2, 10], [0, 0, 20])
    n, w = np.polynomial.legendre.leggauss(60)
    t = (n + 1) / 2
    speed = np.hypot(bow * (1 - 2 * t), 20)
    assert_allclose(curve.length, w @ speed / 2, rtol=1e-14)


@settings(deadline=None, max_examples=60)
@given(curves(), st.lists(st.floats(-0.5, 1.5), min_size=1, max_size=8))
def test_a_place_at_arc_length_s_is_found_again_at_s(curve, fractions):
    s = np.array(fractions) * curve.length
    points, tangents = curve.at_arc_length(s), curve.tangent_at_arc_length(s)
    distance, found = curve.closest(points)
    assert_allclose(distance, 0, atol=1e-7)
    assert_allclose(found, s, atol=1e-6)
    assert_allclose(np.linalg.norm(tangents, axis=1), 1, rtol=1e-12)


@settings(deadline=None, max_examples=200)
@given(curves(), st.lists(point, min_size=1, max_size=8))
def test_closest_is_the_global_minimum(curve, points):
    distance, s = curve.closest(points)
    assert_allclose(distance, [nearest_by_roots(curve, x) for x in points], rtol=0, atol=1e-7)
    assert_allclose(
        np.linalg.norm(curve.at_arc_length(s) - points, axis=1), distance, rtol=0, atol=1e-7
    )


def test_closest_where_the_cubic_degenerates():
    # On the evolute's cusp the three roots are one; on the straight line the cubic is linear.
    cusp = ARCH.point(0.5) - [0, 1 / ARCH.max_curvature, 0]
    assert_allclose(ARCH.closest(cusp)[0], 1 / ARCH.max_curvature, rtol=1e-12)
    distance, s = STRAIGHT.closest([[3, 4, 7], [3, 4, -7], [3, 4, 47], [0, 0, 0]])
    assert_allclose(distance, [5, 5, 5, 0], atol=1e-14)
    assert_allclose(s, [7, -7, 47, 0], atol=1e-13)


def test_a_straight_line_with_uneven_speed():
    curve = QuadraticBezier([0, 0, 0], [0, 0, 5], [0, 0, 40])
    assert_allclose(curve.length, 40, rtol=1e-15)
    assert_allclose(curve.at_arc_length([10, 25])[:, 2], [10, 25], rtol=1e-14)
    assert_allclose(curve.max_curvature, 0)


def test_curvature_against_differences():
    t, step = np.linspace(0.1, 0.9, 9), 1e-4
    before, at, after = (ARCH.point(t + k * step) for k in (-1, 0, 1))
    first, second = (after - before) / (2 * step), (after - 2 * at + before) / step**2
    expected = np.linalg.norm(np.cross(first, second), axis=1) / np.linalg.norm(first, axis=1) ** 3
    assert_allclose(ARCH.curvature(t), expected, rtol=1e-5)
    assert_allclose(ARCH.max_curvature, ARCH.curvature(0.5), rtol=1e-14)


def test_tangents_go_on_straight_beyond_the_ends():
    tangent = np.array([0, 15, 20]) / 25
    assert_allclose(ARCH.at_arc_length([-5.0])[0], -5 * tangent, atol=1e-14)
    assert_allclose(ARCH.tangent_at_arc_length([-5.0, 0.0]), [tangent, tangent], atol=1e-14)
    assert_allclose(ARCH.at_arc_length([ARCH.length + 5])[0], [0, -3, 44], atol=1e-12)


@pytest.mark.parametrize(
    "P1",
    [
        [0, 0, 0],
        [0, 0, 40],
        [0, 0, -1],
        [0, 0, 41],
        [0, float("nan"), 20],
        [0, float("inf"), 20],
        [0, 20],
    ],
)
def test_impossible_control_points_are_named(P1):
    with pytest.raises(InputError, match="P1"):
        QuadraticBezier([0, 0, 0], P1, [0, 0, 40])


def test_control_points_cannot_be_changed():
    with pytest.raises(ValueError, match="read-only"):
        ARCH.P1[0] = 1.0
