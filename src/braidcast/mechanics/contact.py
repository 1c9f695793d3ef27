"""Contact of beams with a signed distance field, along the beams and not only at their nodes.

The axis of a beam is the cubic through its nodes with their turned tangents,

    x(s) = H1 x1 + H2 L t1 + H3 x2 + H4 L t2,          t_i = R_i t_i0,

with t_i0 the reference tangents of ``BeamNet.end_tangents``,

sampled at Gauss-Lobatto points, the nodes among them. A point at gap ``g`` (depth inside the lumen
less the wire's radius) carries the line force of reference length, regularised below the threshold
``h`` (errata row 10):

    p(g) = k (h/2 - g)              g <= 0
         = k (g^2/(2h) - g + h/2)   0 < g <= h
         = 0                        beyond,            Pi(g) = int_g^h p.
"""

from dataclasses import dataclass
from typing import Protocol

import numba as nb
import numpy as np

from braidcast.errors import InputError
from braidcast.mechanics.arrays import IntArray
from braidcast.mechanics.beams import BeamNet, State
from braidcast.mechanics.friction import FrictionMemory, friction_traction
from braidcast.mechanics.rotations import Array


class SignedDistance(Protocol):
    """A rigid wall, negative where the beams may be."""

    def evaluate(self, points: Array) -> tuple[Array, Array, Array]:
        """Distance (n,), its gradient (n, 3) and Hessian (n, 3, 3) at points (n, 3)."""
        ...


@dataclass(frozen=True)
class Contact:
    """A wall and the law by which it pushes and holds.

    ``stiffness`` k in N/mm^2 (line force per penetration), ``threshold`` h in mm, ``friction``
    Coulomb's coefficient, ``points`` Gauss-Lobatto points an element (2 or more),
    ``stick_stiffness`` in N/mm^2 the tangential line force per elastic slip below Coulomb's limit.
    """

    surface: SignedDistance
    wire_radius: float
    stiffness: float
    threshold: float
    friction: float = 0.0
    points: int = 4
    stick_stiffness: float = 1.0

    def __post_init__(self) -> None:
        for name in ("wire_radius", "stiffness", "threshold", "stick_stiffness"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0.0):
                raise InputError(f"contact.{name} is {value}; it must be a positive number")
        if not (np.isfinite(self.friction) and self.friction >= 0.0):
            raise InputError(f"contact.friction is {self.friction}; it must be 0 or more")
        if self.points < 2:
            raise InputError(f"contact.points is {self.points}; it must be 2 or more")


@dataclass(frozen=True)
class ContactForces:
    """Contact at the sampled points: ``gap`` (n,) mm, normal and tangential force (n,) N.

    ``memory`` is what the wall remembers once this state has converged.
    """

    energy: float
    gap: Array
    normal: Array
    tangential: Array
    memory: FrictionMemory

    @property
    def total(self) -> float:
        """Sum of the normal forces, N."""
        return float(self.normal.sum())

    @property
    def penetration(self) -> float:
        """Depth of the deepest point beyond first touch (gap 0), mm."""
        return float(max(0.0, -self.gap.min())) if len(self.gap) else 0.0


@nb.njit(cache=True, inline="always")
def contact_law(gap: float, stiffness: float, threshold: float) -> tuple[float, float, float]:
    """Energy Pi (N), line force p = -dPi/dg (N/mm) and -dp/dg (N/mm^2) at a gap (mm)."""
    h = threshold
    if gap >= h:
        return 0.0, 0.0, 0.0
    if gap > 0.0:
        rest = h - gap
        return (
            stiffness * rest**3 / (6.0 * h),
            stiffness * rest**2 / (2.0 * h),
            stiffness * rest / h,
        )
    energy = stiffness * (h * h / 6.0 - 0.5 * h * gap + 0.5 * gap * gap)
    return energy, stiffness * (0.5 * h - gap), stiffness


def lobatto(count: int) -> tuple[Array, Array]:
    """Places on [0, 1], both ends among them, and weights (count,) of Gauss-Lobatto quadrature."""
    legendre = np.polynomial.Legendre.basis(count - 1)
    places = np.concatenate([[-1.0], np.sort(legendre.deriv().roots().real), [1.0]])
    weights = 2.0 / (count * (count - 1) * legendre(places) ** 2)
    return 0.5 * (places + 1.0), 0.5 * weights


class BeamContact:
    """A ``Contact`` of one net: adds its forces and tangents to those of the elements."""

    def __init__(self, net: BeamNet, contact: Contact) -> None:
        self.net = net
        self.contact = contact
        s, self.weights = lobatto(contact.points)
        self.shape: Array = np.stack(
            [
                1 - 3 * s**2 + 2 * s**3,
                s - 2 * s**2 + s**3,
                3 * s**2 - 2 * s**3,
                s**3 - s**2,
            ],
            axis=1,
        )
        count = len(net.elements) * contact.points
        self._force: Array = np.zeros((count, 3))
        self._tangent: Array = np.zeros((count, 3, 3))
        self._normal: Array = np.zeros(count)
        self._tangential: Array = np.zeros(count)

    def axis_points(self, state: State) -> Array:
        """Sampled points (M * points, 3) on the axes."""
        net = self.net
        return _axis_points(
            state.positions,
            state.rotations,
            net.elements,
            net.end_tangents,
            net.lengths,
            self.shape,
        )

    def at_rest(self, state: State) -> FrictionMemory:
        """Memory of a wall that holds no slip yet."""
        points = self.axis_points(state)
        gap = -self.contact.surface.evaluate(points)[0] - self.contact.wire_radius
        return FrictionMemory(points, gap, np.zeros_like(points))

    def add(
        self,
        state: State,
        forces: Array,
        tangents: Array,
        with_tangent: bool,
        memory: FrictionMemory | None,
    ) -> ContactForces:
        """Add to element ``forces`` (M, 12) and ``tangents`` (M, 12, 12); say what acts."""
        net, law = self.net, self.contact
        points = self.axis_points(state)
        distance, gradient, hessian = law.surface.evaluate(points)
        gap = -distance - law.wire_radius
        lengths = np.repeat(net.lengths, law.points) * np.tile(self.weights, len(net.elements))
        energy = _normal_traction(
            gap,
            gradient,
            hessian,
            lengths,
            law.stiffness,
            law.threshold,
            self._force,
            self._tangent,
            self._normal,
        )
        self._tangential[:] = 0.0
        slip = np.zeros_like(points)
        if law.friction > 0.0 and memory is not None:
            friction_traction(
                points,
                gap,
                gradient,
                lengths,
                self._normal,
                law.friction,
                law.stick_stiffness,
                law.threshold,
                memory.points,
                memory.gap,
                memory.slip,
                self._force,
                self._tangent,
                self._tangential,
                slip,
            )
        _to_elements(
            state.rotations,
            net.elements,
            net.end_tangents,
            net.lengths,
            self.shape,
            gap,
            law.threshold,
            self._force,
            self._tangent,
            forces,
            tangents,
            with_tangent,
        )
        return ContactForces(
            energy,
            gap,
            self._normal.copy(),
            self._tangential.copy(),
            FrictionMemory(points, gap, slip),
        )


@nb.njit(cache=True)
def _axis_points(
    positions: Array,
    rotations: Array,
    elements: IntArray,
    ends: Array,
    lengths: Array,
    shape: Array,
) -> Array:
    count = shape.shape[0]
    out = np.empty((elements.shape[0] * count, 3))
    for n in range(elements.shape[0]):
        n1 = elements[n, 0]
        n2 = elements[n, 1]
        for i in range(3):
            t1 = 0.0
            t2 = 0.0
            for j in range(3):
                t1 += rotations[n1, i, j] * ends[n, 0, j]
                t2 += rotations[n2, i, j] * ends[n, 1, j]
            for q in range(count):
                out[n * count + q, i] = (
                    shape[q, 0] * positions[n1, i]
                    + shape[q, 1] * lengths[n] * t1
                    + shape[q, 2] * positions[n2, i]
                    + shape[q, 3] * lengths[n] * t2
                )
    return out


@nb.njit(cache=True)
def _normal_traction(
    gap: Array,
    gradient: Array,
    hessian: Array,
    lengths: Array,
    stiffness: float,
    threshold: float,
    force: Array,
    tangent: Array,
    normal: Array,
) -> float:
    """Gradient and Hessian of Pi(g(x)) at every point, times its length of beam."""
    energy = 0.0
    for n in range(gap.shape[0]):
        normal[n] = 0.0
        if gap[n] >= threshold:
            for i in range(3):
                force[n, i] = 0.0
                for j in range(3):
                    tangent[n, i, j] = 0.0
            continue
        e, p, dp = contact_law(gap[n], stiffness, threshold)
        weight = lengths[n]
        energy += weight * e
        size = 0.0
        for i in range(3):
            size += gradient[n, i] ** 2
            force[n, i] = weight * p * gradient[n, i]
            for j in range(3):
                tangent[n, i, j] = weight * (
                    dp * gradient[n, i] * gradient[n, j] + p * hessian[n, i, j]
                )
        normal[n] = weight * p * np.sqrt(size)
    return energy


@nb.njit(cache=True)
def _to_elements(
    rotations: Array,
    elements: IntArray,
    ends: Array,
    lengths: Array,
    shape: Array,
    gap: Array,
    threshold: float,
    force: Array,
    tangent: Array,
    forces: Array,
    tangents: Array,
    with_tangent: bool,
) -> None:
    """Carry point forces and tangents to the twelve freedoms of their elements.

    First to x1, L t1, x2, L t2, in which the points are linear; then to the spins, which turn
    these by d(L t) = C w with C = L [t]^T.
    """
    count = shape.shape[0]
    f = np.empty((4, 3))
    k = np.empty((4, 4, 3, 3))
    arm = np.empty(3)
    turn = np.zeros((2, 3, 3))
    for n in range(elements.shape[0]):
        first, last = n * count, (n + 1) * count
        if gap[first:last].min() >= threshold:
            continue
        _to_cubic(shape, force[first:last], tangent[first:last], f, k, with_tangent)
        for s in range(2):
            c = 2 * s + 1
            for i in range(3):
                arm[i] = 0.0
                for j in range(3):
                    arm[i] += lengths[n] * rotations[elements[n, s], i, j] * ends[n, s, j]
            turn[s, 0, 1], turn[s, 1, 0] = arm[2], -arm[2]
            turn[s, 1, 2], turn[s, 2, 1] = arm[0], -arm[0]
            turn[s, 2, 0], turn[s, 0, 2] = arm[1], -arm[1]
            along = arm[0] * f[c, 0] + arm[1] * f[c, 1] + arm[2] * f[c, 2]
            for i in range(3):
                forces[n, 6 * s + i] += f[2 * s, i]
                for j in range(3):
                    forces[n, 6 * s + 3 + i] += turn[s, j, i] * f[c, j]
            if with_tangent:
                for b in range(4):
                    _turn_rows(turn[s], k[c, b])
                for a in range(4):
                    _turn_columns(turn[s], k[a, c])
                for i in range(3):
                    k[c, c, i, i] -= along
                    for j in range(3):
                        k[c, c, i, j] += 0.5 * (f[c, i] * arm[j] + f[c, j] * arm[i])
        if with_tangent:
            for a in range(4):
                for i in range(3):
                    for b in range(4):
                        for j in range(3):
                            tangents[n, 3 * a + i, 3 * b + j] += k[a, b, i, j]


@nb.njit(cache=True, inline="always")
def _to_cubic(
    shape: Array, force: Array, tangent: Array, f: Array, k: Array, with_tangent: bool
) -> None:
    """Force (4, 3) and tangent (4, 4, 3, 3) on the coefficients of an element's cubic."""
    for a in range(4):
        for i in range(3):
            f[a, i] = 0.0
            for q in range(shape.shape[0]):
                f[a, i] += shape[q, a] * force[q, i]
        if not with_tangent:
            continue
        for b in range(a + 1):
            for i in range(3):
                for j in range(3):
                    k[a, b, i, j] = 0.0
            for q in range(shape.shape[0]):
                weight = shape[q, a] * shape[q, b]
                for i in range(3):
                    for j in range(3):
                        k[a, b, i, j] += weight * tangent[q, i, j]
            for i in range(3):
                for j in range(3):
                    k[b, a, i, j] = k[a, b, i, j]


@nb.njit(cache=True, inline="always")
def _turn_rows(turn: Array, block: Array) -> None:
    """``block = turn^T block``, ``turn`` antisymmetric."""
    for j in range(3):
        x, y, z = block[0, j], block[1, j], block[2, j]
        block[0, j] = turn[1, 0] * y + turn[2, 0] * z
        block[1, j] = turn[0, 1] * x + turn[2, 1] * z
        block[2, j] = turn[0, 2] * x + turn[1, 2] * y


@nb.njit(cache=True, inline="always")
def _turn_columns(turn: Array, block: Array) -> None:
    """``block = block turn``, ``turn`` antisymmetric."""
    for i in range(3):
        x, y, z = block[i, 0], block[i, 1], block[i, 2]
        block[i, 0] = y * turn[1, 0] + z * turn[2, 0]
        block[i, 1] = x * turn[0, 1] + z * turn[2, 1]
        block[i, 2] = x * turn[0, 2] + y * turn[1, 2]
