"""Closed-form walls: distances, gradients and Hessians exact, finite on the axis."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from braidcast.errors import InputError
from braidcast.mechanics import Cylinder, Plane, Sphere
from problems.elements import difference

SURFACES = [
    Plane([1.0, 2.0, 3.0], [0.0, 3.0, 4.0]),
    Cylinder(2.0, [1.0, 0.0, 0.0], [1.0, 1.0, 0.5]),
    Cylinder(2.0, outside=True),
    Sphere(2.0, [0.0, 1.0, 0.0]),
    Sphere(1.0, outside=True),
]


@pytest.mark.parametrize("surface", SURFACES)
def test_derivatives_are_those_of_the_distance(surface):
    for point in np.random.default_rng(0).normal(0.0, 2.0, (20, 3)):
        _, gradient, hessian = (a[0] for a in surface.evaluate(point[None]))
        assert_allclose(np.linalg.norm(gradient), 1.0, rtol=1e-13)
        assert_allclose(hessian, hessian.T, atol=1e-14)

        def at(step, which, point=point):
            return surface.evaluate((point + step)[None])[which][0]

        assert_allclose(gradient, difference(lambda s: at(s, 0), 3, 1e-3), atol=1e-9)
        assert_allclose(hessian, difference(lambda s: at(s, 1), 3, 1e-3), atol=1e-7)


def test_distances():
    points = np.array([[3.0, 4.0, 7.0], [0.0, 0.0, -1.0]])
    assert_allclose(Cylinder(2.0).evaluate(points)[0], [3.0, -2.0])
    assert_allclose(Cylinder(2.0, outside=True).evaluate(points)[0], [-3.0, 2.0])
    assert_allclose(Cylinder(2.0, axis=[0, 9, 0]).evaluate(points)[0], [58**0.5 - 2.0, -1.0])
    assert_allclose(Sphere(2.0, [3.0, 4.0, 0.0]).evaluate(points)[0], [5.0, 26**0.5 - 2.0])
    assert_allclose(Plane([0, 0, 1], [0, 0, 2]).evaluate(points)[0], [6.0, -2.0])


@pytest.mark.parametrize("surface", [Cylinder(2.0), Cylinder(2.0, outside=True), Sphere(2.0)])
@pytest.mark.parametrize("offset", [0.0, 1e-12, 1e-6])
def test_finite_on_the_axis(surface, offset):
    distance, gradient, hessian = surface.evaluate(np.array([[offset, 0.0, 0.0]]))
    assert_allclose(abs(distance), 2.0 - offset, rtol=1e-14)
    assert np.isfinite(gradient).all() and np.linalg.norm(gradient) <= 1.0
    assert np.isfinite(hessian).all()


@pytest.mark.parametrize(
    "make, names",
    [
        (lambda: Cylinder(0.0), "cylinder.radius is 0"),
        (lambda: Cylinder(np.nan), "cylinder.radius is nan"),
        (lambda: Cylinder(1.0, axis=[0, 0, 0]), "cylinder.axis"),
        (lambda: Sphere(1.0, [0, np.inf, 0]), r"sphere.centre\[1\] is inf"),
        (lambda: Sphere(-1.0), "sphere.radius is -1"),
        (lambda: Plane([0, 0], [0, 0, 1]), "plane.point has shape"),
        (lambda: Plane([0, 0, 0], "up"), "plane.normal"),
    ],
)
def test_bad_input_is_named(make, names):
    with pytest.raises(InputError, match=names):
        make()
