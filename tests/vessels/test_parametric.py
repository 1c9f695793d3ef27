"""Signed distance of tube and aneurysm: closed forms, derivatives, smoothness, speed of use."""

import pickle

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from braidcast.errors import InputError
from braidcast.vessels import QuadraticBezier, SaccularVessel, Sphere, Tube, kernels

STRAIGHT = QuadraticBezier([0, 0, 0], [0, 0, 20], [0, 0, 40])
ARCH = QuadraticBezier([0, 0, 0], [0, 15, 20], [0, 0, 40])
SPHERE = Sphere([0, 7.5 + 1.5 + 0.5 * 3.5, 20], 3.5)
SAC = SaccularVessel(Tube(ARCH, 1.5), SPHERE, neck_fillet=0.2)


def sample(count=4000, seed=0):
    return np.random.default_rng(seed).uniform([-4, -2, -5], [4, 14, 45], (count, 3))


def near_the_neck(count=4000):
    """Points the blend moves, a few of them inside its kink-free borders."""
    points = SPHERE.centre + np.random.default_rng(1).uniform(-4, 4, (60 * count, 3))
    off = SAC.tube.distance(points) - (np.linalg.norm(points - SPHERE.centre, axis=1) - 3.5)
    return points[np.abs(off) < 0.2][:count]


def differences(function, points, step=1e-6):
    """Central differences of function (n, …) along the three axes, on the last axis."""
    steps = step * np.eye(3)
    return np.stack([(function(points + e) - function(points - e)) / (2 * step) for e in steps], -1)


@pytest.mark.parametrize("points", [sample(), near_the_neck()], ids=["anywhere", "neck"])
def test_gradient_and_hessian_against_differences(points):
    # Differences break on the straight centreline beyond the ends and the centre of the sphere.
    points = points[SAC.centreline.closest(points)[0] > 0.05]
    _, gradient, hessian = SAC.evaluate(points)
    assert_allclose(gradient, differences(SAC.distance, points), atol=1e-7)
    assert_allclose(hessian, differences(lambda x: SAC.evaluate(x)[1], points), atol=1e-5)
    assert_array_equal(hessian, hessian.transpose(0, 2, 1))


def test_distance_alone_agrees_with_evaluate():
    points = np.concatenate([sample(), near_the_neck()])
    assert_allclose(SAC.distance(points), SAC.evaluate(points)[0], rtol=0, atol=1e-14)


def test_away_from_the_neck_it_is_the_smaller_distance_and_its_gradient_has_length_one():
    points = sample()
    tube = SAC.centreline.closest(points)[0] - 1.5
    sphere = np.linalg.norm(points - SPHERE.centre, axis=1) - 3.5
    away = np.abs(tube - sphere) >= 0.2
    distance, gradient, _ = SAC.evaluate(points)
    assert_allclose(distance[away], np.minimum(tube, sphere)[away], rtol=0, atol=1e-13)
    assert_allclose(np.linalg.norm(gradient[away], axis=1), 1, atol=1e-12)
    taken = np.minimum(tube, sphere) - distance
    assert taken.min() > -1e-13 and taken.max() <= 3 * 0.2 / 16 + 1e-13


def test_hessian_is_continuous_where_the_blend_ends():
    # On the straight line from the sphere's centre, find u = w by bisection of u − w.
    direction = np.array([0.2, -1.0, 0.3]) / np.linalg.norm([0.2, -1.0, 0.3])

    def off(r):
        point = SPHERE.centre + r * direction
        return SAC.tube.distance(point)[0] - (r - 3.5) - 0.2

    low, high = 0.5, 3.0
    assert off(low) > 0 > off(high)
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if off(middle) > 0 else (low, middle)
    jump = [SAC.evaluate(SPHERE.centre + (low + side) * direction)[2] for side in (-1e-6, 1e-6)]
    assert_allclose(jump[0], jump[1], atol=1e-3)


def test_straight_tube_is_a_cylinder():
    points = sample()
    r = np.hypot(points[:, 0], points[:, 1])
    distance, gradient, hessian = Tube(STRAIGHT, 1.5).evaluate(points)
    radial = np.column_stack([points[:, :2] / r[:, None], np.zeros(len(r))])
    around = np.column_stack([-radial[:, 1], radial[:, 0], np.zeros(len(r))])
    assert_allclose(distance, r - 1.5, atol=1e-13)
    assert_allclose(gradient, radial, atol=1e-12)
    expected = around[:, :, None] * around[:, None, :] / r[:, None, None]
    assert_allclose(hessian, expected, rtol=1e-9, atol=1e-12)


def test_curvature_of_the_bent_wall():
    # At the top of the arch the wall has the curvatures 1/R around and κ/(1 ± κR) along.
    kappa, R = ARCH.max_curvature, 1.5
    outer, inner = ARCH.point(0.5) + [0, R, 0], ARCH.point(0.5) - [0, R, 0]
    distance, gradient, hessian = SAC.tube.evaluate([outer, inner])
    assert_allclose(distance, 0, atol=1e-14)
    assert_allclose(gradient, [[0, 1, 0], [0, -1, 0]], atol=1e-14)
    assert_allclose(hessian[0], np.diag([1 / R, 0, kappa / (1 + kappa * R)]), atol=1e-12)
    assert_allclose(hessian[1], np.diag([1 / R, 0, -kappa / (1 - kappa * R)]), atol=1e-12)


def test_everything_is_finite_on_the_axis_at_the_centre_and_on_the_evolute():
    focus = ARCH.point(0.5) - [0, 1 / ARCH.max_curvature, 0]
    points = [ARCH.point(0.3), ARCH.point(0.5), [0, 0, 0], SPHERE.centre, focus, [0, -3, -4]]
    for vessel in (SAC, SAC.tube):
        for values in vessel.evaluate(points):
            assert np.isfinite(values).all()
    distance, gradient, _ = SAC.tube.evaluate(ARCH.point(0.3))
    assert_allclose(distance, -1.5, atol=1e-14)
    assert np.linalg.norm(gradient) <= 1.0


def test_sharp_neck_and_missing_aneurysm():
    sharp, points = SaccularVessel(SAC.tube, SPHERE, neck_fillet=0.0), near_the_neck()
    sphere = np.linalg.norm(points - SPHERE.centre, axis=1) - 3.5
    assert_allclose(
        sharp.distance(points), np.minimum(SAC.tube.distance(points), sphere), atol=1e-13
    )
    assert all(np.isfinite(values).all() for values in sharp.evaluate(points))
    plain = SaccularVessel(SAC.tube)
    for one, other in zip(plain.evaluate(points), SAC.tube.evaluate(points), strict=True):
        assert_array_equal(one, other)


def test_a_vessel_moves_with_its_control_points():
    turn, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))
    shift, points = np.array([5.0, -3.0, 2.0]), sample(500)
    moved = SaccularVessel(
        Tube(QuadraticBezier(*(turn @ p + shift for p in (ARCH.P0, ARCH.P1, ARCH.P2))), 1.5),
        Sphere(turn @ SPHERE.centre + shift, 3.5),
    )
    distance, gradient, hessian = SAC.evaluate(points)
    there = moved.evaluate(points @ turn.T + shift)
    assert_allclose(there[0], distance, atol=1e-12)
    assert_allclose(there[1], gradient @ turn.T, atol=1e-9)
    scale = 1.0 + np.abs(hessian).max(axis=(1, 2), keepdims=True) ** 2
    assert_allclose(there[2] / scale, turn @ hessian @ turn.T / scale, atol=1e-8)


def test_pickled_vessel_is_the_same_and_needs_no_new_compilation():
    # Compiled code tells read-only arrays, such as a braid's nodes, from others.
    points = sample(50)
    expected, compiled = SAC.distance(points), len(kernels.distance.signatures)
    points.flags.writeable = False
    assert_array_equal(pickle.loads(pickle.dumps(SAC)).distance(points), expected)
    assert len(kernels.distance.signatures) == compiled


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: Tube(ARCH, 0.0), "radius = 0.0 mm must be positive"),
        (lambda: Tube(ARCH, float("nan")), "radius = nan"),
        (lambda: Tube(ARCH, 30.0), "smallest radius of curvature"),
        (lambda: Sphere([0, 1], 1.0), "centre"),
        (lambda: Sphere([0, 1, 2], -1.0), "radius = -1.0"),
        (lambda: SaccularVessel(SAC.tube, SPHERE, -0.1), "neck_fillet = -0.1"),
        (lambda: SaccularVessel(SAC.tube, Sphere([0, 20, 20], 2.0)), "does not meet"),
        (lambda: SaccularVessel(SAC.tube, Sphere([0, 7.5, 20], 1.0)), "holds the whole"),
    ],
)
def test_impossible_vessels_are_refused_in_words(build, words):
    with pytest.raises(InputError, match=words):
        build()


def test_points_of_another_shape_are_refused():
    with pytest.raises(ValueError, match="shape"):
        SAC.evaluate(np.zeros((4, 2)))
