"""Exponential and logarithm of rotations, from no turn at all to half a turn."""

import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from braidcast.mechanics.rotations import (
    exp_so3,
    log_so3,
    log_tangent_coefficients,
    spin_in_place,
)

angles = st.one_of(
    st.floats(0.0, np.pi),
    st.floats(-14.0, -1.0).map(lambda e: 10.0**e),
    st.floats(-14.0, -1.0).map(lambda e: np.pi - 10.0**e),
)
axes = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda a: np.linalg.norm(a) > 0.1)
quick = settings(deadline=None, max_examples=200)


def vector(angle, axis):
    return angle * np.array(axis) / np.linalg.norm(axis)


@quick
@given(angles, axes)
@example(0.0, (1.0, 0.0, 0.0))
@example(1e-2, (0.0, 1.0, 0.0))
@example(np.pi, (0.0, 0.0, 1.0))
@example(np.pi, (1.0, -1.0, 1.0))
def test_exponential_is_scipys_and_logarithm_undoes_it(angle, axis):
    w = vector(angle, axis)
    r = exp_so3(w[None])[0]
    assert_allclose(r, Rotation.from_rotvec(w).as_matrix(), atol=4e-15)
    assert_allclose(r @ r.T, np.eye(3), atol=4e-15)
    back = log_so3(r[None])[0]
    assert np.linalg.norm(back) <= np.pi + 1e-14
    # the turn is known to rounding; the vector too, but for its sign at half a turn
    assert_allclose(exp_so3(back[None])[0], r, atol=1e-14)
    if angle < np.pi - 1e-7:
        assert_allclose(back, w, atol=1e-14, rtol=1e-13)


@quick
@given(angles, axes, axes, st.floats(0.0, 3.0))
def test_spins_turn_from_the_left(angle, axis, other, turn):
    r = exp_so3(vector(angle, axis)[None])
    w = vector(turn, other)
    turned = r.copy()
    spin_in_place(turned, w[None])
    assert_allclose(turned[0], exp_so3(w[None])[0] @ r[0], atol=4e-15)


@quick
@given(st.one_of(st.floats(1e-3, 3.0), st.just(0.1)), axes, axes)
def test_tangent_of_the_logarithm(angle, axis, direction):
    """d log(exp(h s) exp(t))/dh = (I - [t]/2 + c [t]^2) s."""
    t, s = vector(angle, axis), vector(1.0, direction)
    c, _ = log_tangent_coefficients(float(t @ t))
    exact = s - 0.5 * np.cross(t, s) + c * np.cross(t, np.cross(t, s))
    h = 1e-4

    def at(x):
        return log_so3((exp_so3(x * s[None])[0] @ exp_so3(t[None])[0])[None])[0]

    found = (8 * (at(h) - at(-h)) - at(2 * h) + at(-2 * h)) / (12 * h)
    assert_allclose(found, exact, atol=1e-9)


@quick
@given(st.floats(1e-6, 9.0))
def test_coefficients_of_the_tangent(t2):
    """c against its definition, and c'(t)/t against differences of c."""
    c, d = log_tangent_coefficients(t2)
    half = 0.5 * np.sqrt(t2)
    if t2 > 1e-3:
        assert_allclose(c, (1.0 - half / np.tan(half)) / t2, rtol=1e-10)
    h = 1e-3 * max(t2, 0.02)
    at = [log_tangent_coefficients(t2 + k * h)[0] for k in (1, -1, 2, -2)]
    # c'(t)/t = 2 dc/d(t^2)
    found = 2.0 * (8 * (at[0] - at[1]) - at[2] + at[3]) / (12 * h)
    assert_allclose(d, found, rtol=1e-7, atol=1e-9)


def test_series_meets_closed_form():
    below, above = (log_tangent_coefficients(1e-2 * (1.0 + e)) for e in (-1e-9, 1e-9))
    assert_allclose(below, above, rtol=1e-8)
