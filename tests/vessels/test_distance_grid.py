"""The lumen as a spline on a grid: exact near the wall, smooth, and never on the wrong side."""

from dataclasses import replace
from functools import cache

import manifold3d
import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import ndimage

from braidcast.errors import InputError
from braidcast.vessels.distance_grid import DistanceGrid, OutsideGrid, _bricks
from braidcast.vessels.extension import extended
from braidcast.vessels.grid_spacing import usual_spacing
from braidcast.vessels.lumen_surface import LumenSurface
from braidcast.vessels.mesh_distance import MeshDistance
from problems.surfaces import (
    SHAPES,
    bend,
    closed,
    cylinder,
    tube_with_sphere,
)

RNG = np.random.default_rng(5)
BALL = manifold3d.Manifold.sphere(1.0, 64)


@cache
def tube():
    return DistanceGrid.of(cylinder(1.0, 6.0), 0.1)


def joined(a, b):
    """Two surfaces in one, not united."""
    return LumenSurface(
        np.concatenate([a.vertices, b.vertices]),
        np.concatenate([a.triangles, b.triangles + len(a.vertices)]),
        a.openings,
    )


def test_spline_is_of_order_four_for_value_three_for_slope_two_for_curvature():
    def f(p):
        return np.sin(p @ [1.0, 0.7, -0.4]) + np.cos(p @ [0.3, -0.9, 0.8])

    points = RNG.uniform(1.2, 2.2, (500, 3))
    errors = []
    for h in (0.2, 0.1):
        nodes = np.moveaxis(np.indices([round(3.2 / h)] * 3), 0, -1) * h
        coefficients = ndimage.spline_filter(f(nodes), 3, output=np.float64).astype(np.float32)
        count = len(nodes) // 8
        blocks = np.argwhere(np.ones([count] * 3))
        numbers = np.arange(count**3, dtype=np.int32).reshape([count] * 3)
        bricks = _bricks(coefficients, blocks)
        far = np.zeros(numbers.shape, dtype=np.float32)
        grid = DistanceGrid(np.zeros(3), h, bricks, numbers, far, np.empty((0, 8)))
        d, g, H = grid.evaluate(points)
        k, m = np.array([1.0, 0.7, -0.4]), np.array([0.3, -0.9, 0.8])
        slope = np.cos(points @ k)[:, None] * k - np.sin(points @ m)[:, None] * m
        bent = -np.sin(points @ k)[:, None, None] * np.outer(k, k)
        bent = bent - np.cos(points @ m)[:, None, None] * np.outer(m, m)
        errors.append(
            [np.abs(d - f(points)).max(), np.abs(g - slope).max(), np.abs(H - bent).max()]
        )
    coarse, fine = np.array(errors)
    assert (np.log2(coarse / fine) > [3.7, 2.7, 1.8]).all()


def test_derivatives_are_those_of_the_value():
    points = np.column_stack([RNG.uniform(-1.2, 1.2, (400, 2)), RNG.uniform(0, 6, 400)])
    grid, step = tube(), 1e-4
    d, g, H = grid.evaluate(points)
    assert_allclose(grid.distance(points), d, atol=1e-13)
    shifts = step * np.eye(3)
    differences = [
        (grid.distance(points + s) - grid.distance(points - s)) / (2 * step) for s in shifts
    ]
    assert_allclose(np.stack(differences, axis=1), g, atol=1e-5)
    differences = [
        (grid.evaluate(points + s)[1] - grid.evaluate(points - s)[1]) / (2 * step) for s in shifts
    ]
    assert_allclose(np.stack(differences, axis=1), H, atol=2e-3)
    assert_allclose(H, H.transpose(0, 2, 1))


def test_the_curvature_of_the_wall():
    # ∇∇d of a cylinder has the eigenvalues 0, 0 and 1/ρ.
    grid = DistanceGrid.of(closed(manifold3d.Manifold.sphere(1.0, 400)), 0.1)
    points = RNG.normal(size=(500, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    _, _, H = grid.evaluate(0.95 * points)
    assert_allclose(np.linalg.eigvalsh(H), np.tile([0, 1, 1], (500, 1)) / 0.95, atol=0.25)


def test_everywhere_close_to_the_mesh():
    spacing = 0.1
    surface = extended(tube_with_sphere(128), 5.0)
    grid = DistanceGrid.of(surface, spacing)
    points = RNG.uniform([-4, -2, -10.9], [4, 8, 10.9], (20_000, 3))
    mesh = MeshDistance(surface).distance(points)
    error = np.abs(grid.distance(points) - mesh)
    assert (np.sign(grid.distance(points)) == np.sign(mesh))[np.abs(mesh) > 0.03].all()
    # On ridges of the distance a spline is off by some of its spacing, elsewhere by much less; far
    # from the wall it is interpolated between the centres of blocks 8 spacings wide.
    assert np.quantile(error[np.abs(mesh) < 0.3], 0.99) < 0.1 * spacing
    assert error[np.abs(mesh) < 0.3].max() < 0.6 * spacing
    assert error.max() < 0.6


@pytest.mark.parametrize(
    "surface",
    [
        pytest.param(cylinder(1.0, 4.0, around=12, stations=5), id="coarse"),
        pytest.param(cylinder(1.0, 4.0, around=250, stations=25), id="fine"),
        pytest.param(bend(4.0, 1.0, around=48, stations=50), id="bent"),
        pytest.param(closed(manifold3d.Manifold.cube([2, 2, 2])), id="sharp edges"),
    ],
)
def test_good_surfaces_pass(surface):
    assert DistanceGrid.of(surface, 0.1).distance(surface.vertices).max() < 0.1


def test_a_rough_surface_passes():
    surface = cylinder(1.0, 4.0, around=64, stations=41)
    vertices = surface.vertices + RNG.normal(scale=0.006, size=surface.vertices.shape)
    grid = DistanceGrid.of(replace(surface, vertices=vertices), 0.1)
    points = np.column_stack([RNG.uniform(-0.6, 0.6, (500, 2)), RNG.uniform(0, 4, 500)])
    expected = np.hypot(*points[:, :2].T) - 1
    assert_allclose(grid.distance(points), expected, atol=0.15)


def flipped_patch():
    surface = cylinder(1.0, 6.0)
    middles = surface.vertices[surface.triangles].mean(axis=1)
    patch = np.linalg.norm(middles - [1, 0, 3], axis=1) < 0.3
    triangles = surface.triangles.copy()
    triangles[patch] = triangles[patch][:, ::-1]
    return replace(surface, triangles=triangles)


def turned(surface):
    return replace(surface, triangles=surface.triangles[:, ::-1])


@pytest.mark.parametrize(
    "surface, place",
    [
        (flipped_patch, r"near \((0\.[89]\d?|1|1\.[01]\d?), .*, (2\.[6-9]\d?|3|3\.[0-4]\d?)\) mm"),
        (lambda: joined(closed(BALL), closed(BALL.translate([1.2, 0, 0]))), r"near \(0\.[3-9]"),
        (lambda: joined(cylinder(1.0, 8.0), bored()), r"near \(-?[01].*\) mm"),
        (lambda: turned(closed(BALL)), "turned inside out"),
        (lambda: turned(cylinder(1.0, 6.0)), "turned inside out"),
    ],
    ids=["flipped patch", "two spheres", "two tubes", "closed, inside out", "open, inside out"],
)
def test_the_wrong_side_is_never_silent(surface, place):
    with pytest.raises(InputError, match=place):
        DistanceGrid.of(surface(), 0.1)


def bored():
    """A closed tube across the cylinder, not united with it."""
    across = manifold3d.Manifold.cylinder(4.0, 0.7, 0.7, 64).rotate([0, 90, 0])
    return closed(across.translate([0, 0, 4.0]))


@pytest.mark.parametrize(
    "point", [[0, 0, -5.01], [0.9, 0, 11.5], [3, 0, 0], [0, 0, 1e9], [np.nan, 0, 0]]
)
def test_outside_the_grid_is_an_error(point):
    with pytest.raises(OutsideGrid, match="beyond an open end of the vessel or more than 1.0 mm"):
        tube().distance([[0, 0, 1], point])
    with pytest.raises(OutsideGrid):
        tube().evaluate([[0, 0, 1], point])


def test_the_lumen_goes_on_to_the_end_of_the_extension():
    z = np.linspace(-4.99, 10.99, 200)
    points = np.column_stack([np.full(200, 0.8), 0 * z, z])
    assert_allclose(tube().distance(points), -0.2, atol=2e-3)


def test_moving_the_vessel_moves_its_distance():
    surface = cylinder(1.0, 3.0)
    shift = np.array([0.037, -0.052, 0.081])
    ends = tuple(replace(o, centre=o.centre + shift) for o in surface.openings)
    moved = replace(surface, vertices=surface.vertices + shift, openings=ends)
    points = np.column_stack([RNG.uniform(-1, 1, (200, 2)), RNG.uniform(0, 3, 200)])
    a, b = DistanceGrid.of(surface, 0.2), DistanceGrid.of(moved, 0.2)
    assert_allclose(a.distance(points), b.distance(points + shift), atol=1e-6)


def test_through_a_file_and_back(tmp_path):
    np.savez(tmp_path / "grid.npz", **tube().arrays())
    with np.load(tmp_path / "grid.npz") as stored:
        again = DistanceGrid.from_arrays(stored)
    points = np.column_stack([RNG.uniform(-1, 1, (100, 2)), RNG.uniform(0, 6, 100)])
    for ours, theirs in zip(tube().evaluate(points), again.evaluate(points), strict=True):
        assert (ours == theirs).all()
    assert again.remarks == tube().remarks


def test_progress_rises_to_one():
    shares = []
    DistanceGrid.of(cylinder(1.0, 3.0), 0.1, shares.append)
    assert shares == sorted(shares) and shares[-1] == 1.0


def test_too_large_a_grid_is_refused():
    with pytest.raises(InputError, match="makes .* million points of a grid .* of 0.01 mm"):
        DistanceGrid.of(cylinder(2.0, 20.0), 0.01)


def test_usual_spacing():
    # Where nothing asks for less 0.1 mm; a lumen of R asks for 0.1 R^3/4, a wire for 8 radii.
    assert_allclose(usual_spacing(cylinder(2.0, 10.0), 0.05), 0.1)
    assert_allclose(usual_spacing(cylinder(2.0, 10.0), 0.007), 0.056)
    assert_allclose(usual_spacing(cylinder(0.5, 4.0), 0.05), 0.1 * 0.5**0.75, rtol=0.05)
    wide = replace(SHAPES["cylinder, R = 1"][0](), openings=())
    wide = replace(wide, vertices=wide.vertices * [40.0, 40.0, 10.0])
    assert 0.11 < usual_spacing(wide, 0.05) < 0.13
    with pytest.raises(InputError, match="too large for a grid"):
        usual_spacing(replace(wide, vertices=3.0 * wide.vertices), 0.05)
