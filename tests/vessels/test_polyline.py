"""Centrelines through points against the curves the points are from, and a dense sampling."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial import cKDTree

from braidcast.errors import InputError
from braidcast.vessels import QuadraticBezier
from braidcast.vessels.polyline import Polyline

ARCH = QuadraticBezier([0, 0, 0], [0, 15, 20], [0, 0, 40])


def along(curve, spacing):
    return np.append(np.arange(0.0, curve.length, spacing), curve.length)


@pytest.fixture(scope="module")
def arch():
    s = along(ARCH, 0.5)
    return Polyline.through(ARCH.at_arc_length(s), 2.0 + 0.01 * s)


def helix(radius, pitch, turns, spacing):
    around = np.hypot(radius, pitch / (2 * np.pi))
    angle = np.arange(0.0, 2 * np.pi * turns, spacing / around)
    return np.stack(
        [radius * np.cos(angle), radius * np.sin(angle), pitch * angle / (2 * np.pi)], axis=1
    )


def test_clean_points_give_their_curve_back(arch):
    assert_allclose(arch.length, ARCH.length, rtol=0, atol=2e-3)
    s = np.linspace(0.0, ARCH.length, 500)
    assert_allclose(arch.at_arc_length(s), ARCH.at_arc_length(s), rtol=0, atol=5e-3)
    assert_allclose(arch.max_curvature, ARCH.max_curvature, rtol=1e-3)
    assert_allclose(arch.start, [0, 0, 0], rtol=0, atol=1e-3)
    assert_allclose(arch.end, [0, 0, 40], rtol=0, atol=1e-3)


def test_parameter_is_the_arc_length(arch):
    s, h = np.linspace(0.01, arch.length - 0.01, 2000), 1e-4
    speed = (arch.at_arc_length(s + h) - arch.at_arc_length(s - h)) / (2 * h)
    assert_allclose(np.linalg.norm(speed, axis=1), 1.0, rtol=0, atol=1e-6)
    assert_allclose(speed, arch.tangent_at_arc_length(s), rtol=0, atol=1e-6)


def test_curvature_is_continuous_and_that_of_a_helix():
    line = Polyline.through(helix(6.0, 8.0, 2.0, 0.4))
    s = np.linspace(2.0, line.length - 2.0, 4000)
    expected = 6.0 / (6.0**2 + (8.0 / (2 * np.pi)) ** 2)
    assert_allclose(line.curvature_at_arc_length(s), expected, rtol=1e-2)
    assert np.abs(np.diff(line.curvature_at_arc_length(s))).max() < 1e-4
    assert line.curvature_at_arc_length([-1.0, line.length + 1.0]).tolist() == [0.0, 0.0]


def test_a_circle_keeps_its_radius():
    angle = np.arange(0.0, 5.0, 0.08)
    circle = 5.0 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    line = Polyline.through(circle)
    found = np.linalg.norm(line.at_arc_length(np.linspace(0, line.length, 400)), axis=1)
    assert_allclose(found, 5.0, rtol=0, atol=0.01)


@pytest.mark.parametrize("spacing", [0.3, 0.5])
def test_jitter_is_smoothed_away(spacing):
    s = along(ARCH, spacing)
    jitter = np.random.default_rng(1).uniform(-0.1, 0.1, (len(s), 3))
    line = Polyline.through(ARCH.at_arc_length(s) + jitter)
    away = ARCH.closest(line.at_arc_length(np.linspace(0, line.length, 400)))[0]
    assert away.mean() < 0.03
    assert_allclose(line.length, ARCH.length, rtol=0.01)
    assert line.max_curvature < 2.5 * ARCH.max_curvature


def test_closest_place_against_a_dense_sampling(arch):
    random = np.random.default_rng(2)
    places = arch.at_arc_length(random.uniform(-6, arch.length + 6, 1000))
    points = places + 3.0 * random.normal(size=(1000, 3))
    distance, s = arch.closest(points)
    beyond = arch.length + 20.0
    dense = arch.at_arc_length(np.linspace(-20.0, beyond, 100_001))
    assert_allclose(distance, cKDTree(dense).query(points)[0], rtol=0, atol=1e-6)
    assert_allclose(
        np.linalg.norm(arch.at_arc_length(s) - points, axis=1), distance, rtol=0, atol=1e-9
    )
    assert (s < 0).any() and (s > arch.length).any()


def test_arc_length_comes_back_from_its_place(arch):
    s = np.linspace(-5.0, arch.length + 5.0, 300)
    distance, found = arch.closest(arch.at_arc_length(s))
    assert_allclose(distance, 0.0, rtol=0, atol=1e-8)
    assert_allclose(found, s, rtol=0, atol=1e-8)


def test_radius_along_the_line_and_beyond(arch):
    s = np.linspace(0.0, arch.length, 50)
    assert_allclose(arch.lumen_radius(s), 2.0 + 0.01 * s, rtol=1e-3)
    assert_allclose(arch.lumen_radius([-9.0, 99.0]), arch.lumen_radius([0.0, arch.length]))
    bare = Polyline.through(ARCH.at_arc_length(s))
    assert bare.radius_curve is None
    with pytest.raises(ValueError, match="not known"):
        bare.lumen_radius(1.0)


def test_arrays_hold_everything(arch):
    back = Polyline.from_arrays({k: v.copy() for k, v in arch.arrays().items()})
    s = np.linspace(-1.0, arch.length + 1.0, 40)
    assert (back.at_arc_length(s) == arch.at_arc_length(s)).all()
    assert (back.lumen_radius(s) == arch.lumen_radius(s)).all()
    assert Polyline.from_arrays(Polyline(arch.curve).arrays()).radius_curve is None


def test_four_points_far_apart_are_met():
    points = np.array([[0, 0, 0], [0, 1, 10], [0, 2, 20], [1, 0, 30]], dtype=float)
    assert Polyline.through(points).closest(points)[0].max() < 0.02


@pytest.mark.parametrize(
    ("points", "radii", "message"),
    [
        ([[0, 0, 0], [0, 0, 1], [0, 0, 1], [0, 0, 2]], None, "3 different points"),
        ([[0, 0, 0], [0, 0, np.nan], [0, 0, 2], [0, 0, 3]], None, "point 2"),
        ([[0, 0, 0], [0, 0, 5], [0, 0, 10], [0, 0, 15]], [1, 1, 0, 1], "radius 0.0 mm of point 3"),
        ([[0, 0, 0], [0, 0, 20], [0, 0, 10], [0, 0, 30]], None, "turns back"),
        ([[0, 0.01 * i, min(i, 40 - i) / 2] for i in range(40)], None, "turns back"),
        (
            ARCH.at_arc_length(np.random.default_rng(3).uniform(0, 40, 60)),
            None,
            "turns back",
        ),
    ],
)
def test_what_is_no_centreline_is_refused(points, radii, message):
    with pytest.raises(InputError, match=message):
        Polyline.through(points, radii)
