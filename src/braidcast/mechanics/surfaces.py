"""Walls with a closed form: plane, cylinder, sphere, as exact signed distances.

Each is negative where the beams may be. Within ``CUSP`` times its radius from the axis or the
centre, where the distance has a cusp, the gradient fades to zero and the Hessian stays finite.
"""

import numpy as np
from numpy.typing import ArrayLike

from braidcast.errors import InputError
from braidcast.mechanics.arrays import Array, as_array

CUSP = 1e-6
"""Radius of the rounded cusp, as a share of the surface's radius."""


class Plane:
    """The half space behind a plane through ``point`` (3,), mm; ``normal`` (3,) points out of it.

    d = (x - point) . normal
    """

    def __init__(self, point: ArrayLike, normal: ArrayLike) -> None:
        self.point = as_array("plane.point", point, (3,))
        self.normal = _direction("plane.normal", normal)

    def evaluate(self, points: Array) -> tuple[Array, Array, Array]:
        """Distance (n,) mm, gradient (n, 3) and Hessian (n, 3, 3) 1/mm at points (n, 3)."""
        distance = (points - self.point) @ self.normal
        return distance, np.tile(self.normal, (len(points), 1)), np.zeros((len(points), 3, 3))


class Cylinder:
    """An endless cylinder of ``radius`` mm about the line through ``point`` (3,) along ``axis``.

    d = rho - radius for beams inside, radius - rho for beams ``outside`` it.
    """

    def __init__(
        self,
        radius: float,
        point: ArrayLike = (0.0, 0.0, 0.0),
        axis: ArrayLike = (0.0, 0.0, 1.0),
        *,
        outside: bool = False,
    ) -> None:
        self.radius = _positive("cylinder.radius", radius)
        self.point = as_array("cylinder.point", point, (3,))
        self.axis = _direction("cylinder.axis", axis)
        self.outside = outside

    def evaluate(self, points: Array) -> tuple[Array, Array, Array]:
        """Distance (n,) mm, gradient (n, 3) and Hessian (n, 3, 3) 1/mm at points (n, 3)."""
        across = np.eye(3) - np.outer(self.axis, self.axis)
        return _round((points - self.point) @ across, across, self.radius, self.outside)


class Sphere:
    """A sphere of ``radius`` mm about ``centre`` (3,).

    d = |x - centre| - radius for beams inside, the opposite for beams ``outside`` it.
    """

    def __init__(
        self, radius: float, centre: ArrayLike = (0.0, 0.0, 0.0), *, outside: bool = False
    ) -> None:
        self.radius = _positive("sphere.radius", radius)
        self.centre = as_array("sphere.centre", centre, (3,))
        self.outside = outside

    def evaluate(self, points: Array) -> tuple[Array, Array, Array]:
        """Distance (n,) mm, gradient (n, 3) and Hessian (n, 3, 3) 1/mm at points (n, 3)."""
        return _round(points - self.centre, np.eye(3), self.radius, self.outside)


def _round(arms: Array, across: Array, radius: float, outside: bool) -> tuple[Array, Array, Array]:
    """Distance to a round surface from arms (n, 3) out of its axis or centre.

    n = arm/rho, Hessian (P - n n^T)/rho with ``across`` P the projector on the arms' space.
    """
    rho = np.linalg.norm(arms, axis=1)
    safe = np.maximum(rho, CUSP * radius)
    normal = arms / safe[:, None]
    hessian = (across - normal[:, :, None] * normal[:, None, :]) / safe[:, None, None]
    if outside:
        return radius - rho, -normal, -hessian
    return rho - radius, normal, hessian


def _direction(name: str, value: ArrayLike) -> Array:
    vector = as_array(name, value, (3,))
    norm = np.linalg.norm(vector)
    if norm == 0.0:
        raise InputError(f"{name} is {vector.tolist()}; it must have a direction")
    return vector / norm


def _positive(name: str, value: float) -> float:
    if not (np.isfinite(value) and value > 0.0):
        raise InputError(f"{name} is {value}; it must be a positive number")
    return float(value)
