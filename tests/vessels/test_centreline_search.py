"""Centrelines found in exact signed distances against the curves that made the vessels."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from braidcast.errors import InputError
from braidcast.vessels import QuadraticBezier, SaccularVessel, Sphere, Tube
from braidcast.vessels.centreline_search import find_centreline
from braidcast.vessels.polyline import Polyline

R = 2.0
ARCH = QuadraticBezier([0, 0, 0], [0, 15, 20], [0, 0, 40])
BOUNDS = np.array([[-13.0, -13.0, -3.0], [13.0, 20.0, 43.0]])
ENDS = np.array([ARCH.P0, ARCH.P2])
FIRST_OUT, LAST_OUT = ARCH.tangent_at_arc_length([0.0, ARCH.length]) * [[-1.0], [1.0]]


def with_sac(diameter, height, angle, s=0.5 * ARCH.length):
    """The arch with a sac ``height`` mm from its centreline, ``angle`` about it from inside."""
    centre, tangent = ARCH.at_arc_length(s)[0], ARCH.tangent_at_arc_length(s)[0]
    inward = np.cross([1.0, 0.0, 0.0], tangent)
    aside = np.cos(angle) * inward + np.sin(angle) * np.array([1.0, 0.0, 0.0])
    return SaccularVessel(Tube(ARCH, R), Sphere(centre + height * aside, 0.5 * diameter))


def misses(line, curve, radius, count=300):
    """Distance (n,) mm of places of the line from the curve and relative errors of the radius."""
    s = np.linspace(0.0, line.length, count)
    distance, along = curve.closest(line.at_arc_length(s))
    return distance, line.lumen_radius(s) / radius(along) - 1.0


def constant(s):
    return np.full(len(s), R)


def assert_finds_arch(line, centre=0.005, radius=0.01):
    distance, swell = misses(line, ARCH, constant)
    assert distance.mean() < centre
    assert distance.max() < 0.03
    assert np.abs(swell).max() < radius


def test_tube_alone():
    line = find_centreline(SaccularVessel(Tube(ARCH, R)).distance, BOUNDS, ENDS)
    assert_finds_arch(line, centre=1e-4, radius=1e-4)
    assert_allclose(line.length, ARCH.length, rtol=0, atol=2e-3)
    assert_allclose([line.start, line.end], ENDS, rtol=0, atol=2e-3)
    assert_allclose(line.max_curvature, ARCH.max_curvature, rtol=0.02)


@pytest.mark.parametrize(
    ("diameter", "height", "angle"),
    [
        # Protrusions of 0.3, 0.5 and 0.75, then centres at 1.1 and 1.2 radii.
        (5.0, 2.75, 0.0),
        (7.0, 3.75, np.pi),
        (10.0, 5.75, np.pi / 2),
        (10.0, 3.5, np.pi),
        (5.0, 2.2, 0.0),
        (7.0, 2.4, np.pi / 2),
        (10.0, 2.4, np.pi),
        (10.0, 2.2, 0.0),
    ],
)
def test_aneurysm_does_not_draw_the_line_aside(diameter, height, angle):
    vessel = with_sac(diameter, height, angle)
    assert_finds_arch(find_centreline(vessel.distance, BOUNDS, ENDS))


def test_two_aneurysms_and_one_near_an_end():
    first, second = with_sac(7.0, 3.0, 0.0, 3.0), with_sac(8.0, 3.2, np.pi, 24.0)
    third = with_sac(8.0, 2.4, 0.0, 25.0)

    def distance(points):
        return np.minimum.reduce([v.distance(points) for v in (first, second, third)])

    assert_finds_arch(find_centreline(distance, BOUNDS, ENDS))


@pytest.mark.parametrize(("share", "angle"), [(0.5, 45), (0.9, 90), (0.9, 45)])
def test_side_branch_does_not_draw_the_line_aside(share, angle):
    centre, tangent = ARCH.at_arc_length(20.0)[0], ARCH.tangent_at_arc_length(20.0)[0]
    across = np.cross([1.0, 0.0, 0.0], tangent)
    way = np.cos(np.radians(angle)) * tangent + np.sin(np.radians(angle)) * across
    trunk = SaccularVessel(Tube(ARCH, R))

    def distance(points):
        along = np.maximum((points - centre) @ way, 0.0)
        branch = np.linalg.norm(points - centre - along[:, None] * way, axis=1) - share * R
        return np.minimum(trunk.distance(points), branch)

    assert_finds_arch(find_centreline(distance, BOUNDS, ENDS))


def test_curve_in_space_of_varying_radius():
    u = np.linspace(0.0, 1.0, 60)
    points = np.stack([6 * np.sin(2 * np.pi * u), 5 * np.cos(1.5 * np.pi * u), 45 * u], axis=1)
    curve = Polyline.through(points, smoothing=0.1)

    def ball(s):
        return 1.8 * (1.0 + 0.2 * np.sin(2 * np.pi * s / 30.0))

    offsets = np.linspace(-1.0, 1.0, 17)

    def distance(points):
        nearest = curve.closest(points)[1][:, None] + offsets
        centres = curve.at_arc_length(nearest.ravel()).reshape(*nearest.shape, 3)
        return (np.linalg.norm(points[:, None] - centres, axis=2) - ball(nearest)).min(axis=1)

    def radius(s):
        balls = ball(s[:, None] + offsets) ** 2 - offsets**2
        return np.sqrt(balls.max(axis=1))

    ends = np.array([curve.start, curve.end])
    bounds = np.array([points.min(axis=0) - 3.0, points.max(axis=0) + 3.0])
    away, swell = misses(find_centreline(distance, bounds, ends), curve, radius)
    assert away.mean() < 0.005 and away.max() < 0.02
    assert np.abs(swell).max() < 0.01


def test_stenosis_is_the_vessels_own():
    def radius(s):
        return R * (1.0 - 0.5 * np.exp(-(((s - 20.0) / 3.0) ** 2)))

    def distance(points):
        away, s = ARCH.closest(points)
        return away - radius(s)

    away, swell = misses(find_centreline(distance, BOUNDS, ENDS), ARCH, radius)
    assert away.max() < 0.01
    assert np.abs(swell).max() < 0.02


@pytest.mark.parametrize("off", [1.0, 2.3])
def test_ends_off_the_middle_cut_the_line_beside_them(off):
    inner = ARCH.at_arc_length([5.0, 36.0])
    ends = inner + off * np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
    line = find_centreline(with_sac(7.0, 3.75, 0.0).distance, BOUNDS, ends)
    assert_finds_arch(line)
    assert_allclose([line.start, line.end], inner, rtol=0, atol=0.01)


def test_lids_over_the_ends_do_not_count():
    vessel = with_sac(7.0, 3.75, 0.0)

    def distance(points):
        lids = np.maximum((points - ENDS[0]) @ FIRST_OUT, (points - ENDS[1]) @ LAST_OUT)
        return np.maximum(vessel.distance(points), lids)

    line = find_centreline(distance, BOUNDS, ENDS)
    assert_finds_arch(line)
    assert_allclose([line.start, line.end], ENDS, rtol=0, atol=0.01)


def test_wall_that_is_not_round():
    straight = QuadraticBezier([0, 0, 0], [0, 0, 20], [0, 0, 40])

    def distance(points):
        return 1.8 * (np.hypot(points[:, 0] / 2.2, points[:, 1] / 1.8) - 1.0)

    ends = np.array([straight.P0, straight.P2])
    away, swell = misses(find_centreline(distance, BOUNDS, ends), straight, constant)
    assert away.max() < 0.005
    assert np.abs(swell).max() < 0.03


def test_size_does_not_matter():
    vessel = with_sac(7.0, 2.6, 0.3)
    lines = [
        find_centreline(lambda p, k=k: k * vessel.distance(p / k), k * BOUNDS, k * ENDS)
        for k in (0.5, 4.0)
    ]
    for k, line in zip((0.5, 4.0), lines, strict=True):
        away = ARCH.closest(line.at_arc_length(np.linspace(0, line.length, 200)) / k)[0]
        assert away.max() < 0.02


def test_given_radii_of_the_ends_need_not_be_right():
    line = find_centreline(with_sac(7.0, 2.6, 0.3).distance, BOUNDS, ENDS, end_radii=[1.2, 3.0])
    assert_finds_arch(line)


def test_hidden_wall_is_refused():
    vessel = with_sac(20.0, 6.0, 0.0)
    bounds = np.array([[-20.0, -25.0, -3.0], [20.0, 25.0, 43.0]])
    with pytest.raises(InputError, match=r"^ends = .* mm: no centreline found: .*centreline`$"):
        find_centreline(vessel.distance, bounds, ENDS)


def test_ends_that_cannot_be_used_are_refused():
    vessel = with_sac(7.0, 3.75, 0.0)
    with pytest.raises(InputError, match="ends = .* mm: the second must lie in the lumen"):
        find_centreline(vessel.distance, BOUNDS, [ENDS[0], [12.0, 0.0, 30.0]])
    with pytest.raises(InputError, match="the second .* from the middle of the vessel"):
        find_centreline(vessel.distance, BOUNDS, [ENDS[0], vessel.aneurysm.centre])
    with pytest.raises(InputError, match="apart, must be more than"):
        find_centreline(vessel.distance, BOUNDS, ARCH.at_arc_length([5.0, 7.0]))

    def parted(points):
        return np.maximum(vessel.distance(points), 0.5 - np.abs(points[:, 2] - 10.0))

    with pytest.raises(InputError, match="must be joined by the lumen"):
        find_centreline(parted, BOUNDS, ENDS)
