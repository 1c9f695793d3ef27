"""Two-node corotational Euler-Bernoulli beams with finite rotations, and the nets made of them.

The element frame ``E = [e1 e2 e3]`` has ``e1`` along the chord and ``e2`` in the plane of ``e1``
and ``q = (q1 + q2)/2``, the mean of the two nodes' turned second directors (Battini & Pacoste
2002, section 3). In that frame the strain energy is quadratic,

    U = EA/(2 L) u^2 + 1/2 theta^T K theta,      theta_i = log(E^T R_i T),

with ``u`` the change of chord length, ``K`` the Hermitian bending (``EI/L [4 2; 2 4]``) and the
torsion (``GJ/L [1 -1; -1 1]``) stiffness. Force and tangent are the exact first and second
derivatives of U along ``x + dx, exp(w) R``, the latter symmetric.
"""

from dataclasses import dataclass
from typing import Self

import numba as nb
import numpy as np
from numpy.typing import ArrayLike

from braidcast.errors import InputError
from braidcast.mechanics.arrays import IntArray, as_array, as_indices, require_nodes
from braidcast.mechanics.rotations import Array, log_into, log_tangent_coefficients


@dataclass(frozen=True)
class Section:
    """Stiffnesses of a cross-section: ``EA`` in N, ``GJ``, ``EIy``, ``EIz`` in N mm^2.

    ``EIy`` resists bending about the second director, ``EIz`` about the third.
    """

    EA: float
    GJ: float
    EIy: float
    EIz: float

    def __post_init__(self) -> None:
        for name in ("EA", "GJ", "EIy", "EIz"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0.0):
                raise InputError(f"section.{name} is {value}; it must be a positive number")

    @classmethod
    def circular(cls, radius: float, young_modulus: float, poisson_ratio: float) -> Self:
        """Solid circle: ``radius`` in mm, ``young_modulus`` in MPa."""
        for name, value in (("radius", radius), ("young_modulus", young_modulus)):
            if not (np.isfinite(value) and value > 0.0):
                raise InputError(f"section.{name} is {value}; it must be a positive number")
        if not -1.0 < poisson_ratio <= 0.5:
            raise InputError(
                f"section.poisson_ratio is {poisson_ratio}; it must be above -1 and at most 0.5"
            )
        area = np.pi * radius**2
        inertia = np.pi * radius**4 / 4.0
        shear_modulus = young_modulus / (2.0 * (1.0 + poisson_ratio))
        bending = young_modulus * inertia
        return cls(young_modulus * area, 2.0 * shear_modulus * inertia, bending, bending)


@dataclass(frozen=True)
class State:
    """Configuration of a net: ``positions`` (N, 3) mm; ``rotations`` (N, 3, 3) from reference."""

    positions: Array
    rotations: Array

    def copy(self) -> "State":
        return State(self.positions.copy(), self.rotations.copy())


class BeamNet:
    """Nodes joined by straight, stress-free beams.

    Parameters: ``nodes`` (N, 3) mm; ``elements`` (M, 2) node indices; ``section`` one for all;
    ``second_director`` (3,) or (M, 3), the direction of the section's second axis (made normal to
    the beam; any normal when omitted, which is enough for circular sections); ``end_tangents``
    (M, 2, 3), the directions of the axis at both ends of each beam where it only approximates a
    curve: contact then sees the curve and not the polygon (the chords when omitted).

    Raises InputError for elements without length, indices out of range or values not finite.
    """

    def __init__(
        self,
        nodes: ArrayLike,
        elements: ArrayLike,
        section: Section,
        second_director: ArrayLike | None = None,
        end_tangents: ArrayLike | None = None,
    ) -> None:
        self.nodes: Array = as_array("nodes", nodes, (None, 3))
        self.elements: IntArray = as_indices("elements", elements)
        self.section = section
        if not len(self.elements):
            raise InputError("elements must be node indices of shape (M, 2), at least one")
        require_nodes("elements", self.elements, len(self.nodes))
        chords = self.nodes[self.elements[:, 1]] - self.nodes[self.elements[:, 0]]
        self.lengths: Array = np.linalg.norm(chords, axis=1)
        if not (self.lengths > 0.0).all():
            raise InputError(f"element {int(np.argmin(self.lengths))} has no length")
        e1 = chords / self.lengths[:, None]
        self.triads = _reference_triads(e1, second_director)
        self.end_tangents: Array = np.repeat(e1[:, None], 2, axis=1)
        if end_tangents is not None:
            given = as_array("end_tangents", end_tangents, (len(e1), 2, 3))
            norm = np.linalg.norm(given, axis=2, keepdims=True)
            if not ((given * self.end_tangents).sum(axis=2) > 0.0).all():
                raise InputError("end_tangents must point along their beams, from first to second")
            self.end_tangents = given / norm

    @property
    def reference(self) -> State:
        """The stress-free state."""
        return State(self.nodes.copy(), np.tile(np.eye(3), (len(self.nodes), 1, 1)))


def _reference_triads(e1: Array, second_director: ArrayLike | None) -> Array:
    """Directors (M, 3, 3) as columns, the first along the beam."""
    if second_director is None:
        least = np.argmin(np.abs(e1), axis=1)
        hint = np.eye(3)[least]
    else:
        shape = (3,) if np.ndim(second_director) == 1 else e1.shape
        hint = np.broadcast_to(as_array("second_director", second_director, shape), e1.shape)
    e3 = np.cross(e1, hint)
    norm = np.linalg.norm(e3, axis=1, keepdims=True)
    if not (norm > 1e-9).all():
        raise InputError("second_director must not lie along a beam")
    e3 = e3 / norm
    return np.ascontiguousarray(np.stack([e1, np.cross(e3, e1), e3], axis=2))


@nb.njit(cache=True)
def _moment(theta: Array, mu: Array, tinv: Array, h: Array, dh: Array) -> None:
    """Spin moment ``h = T^-T mu``, the inverse tangent ``tinv`` and ``dh/dtheta`` at fixed mu."""
    t2 = theta[0] ** 2 + theta[1] ** 2 + theta[2] ** 2
    c, d = log_tangent_coefficients(t2)
    dot = theta[0] * mu[0] + theta[1] * mu[1] + theta[2] * mu[2]
    for i in range(3):
        for j in range(3):
            tinv[i, j] = c * theta[i] * theta[j]
            dh[i, j] = c * (theta[i] * mu[j] - 2.0 * mu[i] * theta[j])
            dh[i, j] += d * (theta[i] * dot - t2 * mu[i]) * theta[j]
        tinv[i, i] += 1.0 - c * t2
        dh[i, i] += c * dot
    for i in range(3):
        j = (i + 1) % 3
        k = (i + 2) % 3
        # -[theta]/2 in the inverse tangent, -[mu]/2 in the derivative
        tinv[i, j] += 0.5 * theta[k]
        tinv[i, k] -= 0.5 * theta[j]
        dh[i, j] += 0.5 * mu[k]
        dh[i, k] -= 0.5 * mu[j]
    for i in range(3):
        h[i] = tinv[0, i] * mu[0] + tinv[1, i] * mu[1] + tinv[2, i] * mu[2]


@nb.njit(cache=True)
def beam_energy(
    positions: Array,
    rotations: Array,
    elements: IntArray,
    triads: Array,
    lengths: Array,
    stiffness: Array,
    axial: Array,
    forces: Array,
    tangents: Array,
    with_tangent: bool,
) -> float:
    """Strain energy of all elements (mJ); fills ``forces`` (M, 12) and ``tangents`` (M, 12, 12).

    Order of the twelve: translation and spin of the first node, then of the second.
    ``stiffness`` = (EA, GJ, EIy, EIz). ``axial`` (M,) is the axial force (N) that enters the
    geometric stiffness: the element's own where it is NaN, see ``equilibrium.newton``.
    """
    energy = 0.0
    frame = np.empty((3, 3))
    bar = np.empty((2, 3, 3))
    director = np.empty((3, 3))
    theta = np.empty((2, 3))
    mu = np.empty((2, 3))
    m = np.empty((2, 3))
    tinv = np.empty((2, 3, 3))
    dh = np.empty((2, 3, 3))
    a_own = np.empty((2, 3, 3))
    a_mix = np.empty((3, 3))
    f = np.empty((3, 3))
    k9 = np.empty((9, 9))
    tmp = np.empty((9, 9))
    g = np.zeros((3, 9))
    w = np.empty((2, 3))
    dm = np.empty((2, 3))
    df = np.empty((3, 3))
    e2 = np.empty(3)
    for n in range(elements.shape[0]):
        n1 = elements[n, 0]
        n2 = elements[n, 1]
        length0 = lengths[n]
        ux = positions[n2, 0] - positions[n1, 0]
        uy = positions[n2, 1] - positions[n1, 1]
        uz = positions[n2, 2] - positions[n1, 2]
        length = np.sqrt(ux * ux + uy * uy + uz * uz)
        frame[0, 0] = ux / length
        frame[1, 0] = uy / length
        frame[2, 0] = uz / length
        for i in range(3):
            e2[i] = 0.0
            for j in range(3):
                r = rotations[n1, i, j] + rotations[n2, i, j]
                e2[i] += 0.5 * r * triads[n, j, 1]
        # e3 = e1 x q / |e1 x q|, e2 = e3 x e1
        x = frame[1, 0] * e2[2] - frame[2, 0] * e2[1]
        y = frame[2, 0] * e2[0] - frame[0, 0] * e2[2]
        z = frame[0, 0] * e2[1] - frame[1, 0] * e2[0]
        norm = np.sqrt(x * x + y * y + z * z)
        frame[0, 2] = x / norm
        frame[1, 2] = y / norm
        frame[2, 2] = z / norm
        frame[0, 1] = frame[1, 2] * frame[2, 0] - frame[2, 2] * frame[1, 0]
        frame[1, 1] = frame[2, 2] * frame[0, 0] - frame[0, 2] * frame[2, 0]
        frame[2, 1] = frame[0, 2] * frame[1, 0] - frame[1, 2] * frame[0, 0]
        for s in range(2):
            node = n1 if s == 0 else n2
            for i in range(3):
                for j in range(3):
                    director[i, j] = (
                        rotations[node, i, 0] * triads[n, 0, j]
                        + rotations[node, i, 1] * triads[n, 1, j]
                        + rotations[node, i, 2] * triads[n, 2, j]
                    )
            for i in range(3):
                for j in range(3):
                    bar[s, i, j] = (
                        frame[0, i] * director[0, j]
                        + frame[1, i] * director[1, j]
                        + frame[2, i] * director[2, j]
                    )
            log_into(bar[s], theta[s])
        stretch = (length * length - length0 * length0) / (length + length0)
        normal = stiffness[0] / length0 * stretch
        energy += 0.5 * normal * stretch
        own0 = stiffness[1] / length0
        for i in range(3):
            if i == 0:
                own = own0
                mix = -own0
            else:
                own = 4.0 * stiffness[i + 1] / length0
                mix = 2.0 * stiffness[i + 1] / length0
            mu[0, i] = own * theta[0, i] + mix * theta[1, i]
            mu[1, i] = mix * theta[0, i] + own * theta[1, i]
            energy += 0.5 * (mu[0, i] * theta[0, i] + mu[1, i] * theta[1, i])
        _moment(theta[0], mu[0], tinv[0], m[0], dh[0])
        _moment(theta[1], mu[1], tinv[1], m[1], dh[1])

        a = 0.5 * (bar[0, 0, 1] + bar[1, 0, 1])
        b = 0.5 * (bar[0, 1, 1] + bar[1, 1, 1])
        s1 = m[0, 0] + m[1, 0]
        s2 = m[0, 1] + m[1, 1]
        s3 = m[0, 2] + m[1, 2]
        f[0, 0] = normal
        f[0, 1] = -s3 / length
        f[0, 2] = (s2 + s1 * a / b) / length
        for s in range(2):
            f[s + 1, 0] = m[s, 0] - 0.5 * s1 / b * bar[s, 1, 1]
            f[s + 1, 1] = m[s, 1] + 0.5 * s1 / b * bar[s, 0, 1]
            f[s + 1, 2] = m[s, 2]
        for i in range(3):
            fu = frame[i, 0] * f[0, 0] + frame[i, 1] * f[0, 1] + frame[i, 2] * f[0, 2]
            forces[n, i] = -fu
            forces[n, 6 + i] = fu
            for s in range(2):
                forces[n, 6 * s + 3 + i] = (
                    frame[i, 0] * f[s + 1, 0]
                    + frame[i, 1] * f[s + 1, 1]
                    + frame[i, 2] * f[s + 1, 2]
                )
        if not with_tangent:
            continue

        for s in range(2):
            for i in range(3):
                for j in range(3):
                    a_own[s, i, j] = 0.0
                    for p in range(3):
                        own = own0 if p == 0 else 4.0 * stiffness[p + 1] / length0
                        a_own[s, i, j] += (dh[s, i, p] + tinv[s, p, i] * own) * tinv[s, p, j]
        for i in range(3):
            for j in range(3):
                a_mix[i, j] = 0.0
                for p in range(3):
                    mix = -own0 if p == 0 else 2.0 * stiffness[p + 1] / length0
                    a_mix[i, j] += tinv[0, p, i] * mix * tinv[1, p, j]
        # spin of the element frame: w_r = g (du, w1, w2), all in the element frame
        g[0, 2] = -a / (b * length)
        g[1, 2] = -1.0 / length
        g[2, 1] = 1.0 / length
        for s in range(2):
            g[0, 3 + 3 * s] = 0.5 * bar[s, 1, 1] / b
            g[0, 4 + 3 * s] = -0.5 * bar[s, 0, 1] / b
        if not np.isnan(axial[n]):
            f[0, 0] = axial[n]
        for j in range(9):
            for s in range(2):
                for i in range(3):
                    w[s, i] = -g[i, j]
            if 3 <= j < 6:
                w[0, j - 3] += 1.0
            elif j >= 6:
                w[1, j - 6] += 1.0
            for i in range(3):
                dm[0, i] = 0.0
                dm[1, i] = 0.0
                for p in range(3):
                    dm[0, i] += a_own[0, i, p] * w[0, p] + a_mix[i, p] * w[1, p]
                    dm[1, i] += a_own[1, i, p] * w[1, p] + a_mix[p, i] * w[0, p]
            da = 0.0
            db = 0.0
            for s in range(2):
                # change of q_s in the frame: w x q_s
                da += 0.5 * (w[s, 1] * bar[s, 2, 1] - w[s, 2] * bar[s, 1, 1])
                db += 0.5 * (w[s, 2] * bar[s, 0, 1] - w[s, 0] * bar[s, 2, 1])
            dl = 1.0 if j == 0 else 0.0
            ds1 = dm[0, 0] + dm[1, 0]
            ds2 = dm[0, 1] + dm[1, 1]
            ds3 = dm[0, 2] + dm[1, 2]
            df[0, 0] = stiffness[0] / length0 * dl
            df[0, 1] = (-ds3 - f[0, 1] * dl) / length
            df[0, 2] = (ds2 + ds1 * a / b + s1 * (da - a / b * db) / b - f[0, 2] * dl) / length
            for s in range(2):
                dqx = w[s, 1] * bar[s, 2, 1] - w[s, 2] * bar[s, 1, 1]
                dqy = w[s, 2] * bar[s, 0, 1] - w[s, 0] * bar[s, 2, 1]
                factor = 0.5 * s1 / b
                dfactor = 0.5 * (ds1 - s1 * db / b) / b
                df[s + 1, 0] = dm[s, 0] - dfactor * bar[s, 1, 1] - factor * dqy
                df[s + 1, 1] = dm[s, 1] + dfactor * bar[s, 0, 1] + factor * dqx
                df[s + 1, 2] = dm[s, 2]
            for c in range(3):
                for i in range(3):
                    p = (i + 1) % 3
                    q = (i + 2) % 3
                    k9[3 * c + i, j] = df[c, i] + g[p, j] * f[c, q] - g[q, j] * f[c, p]
        for i in range(9):
            for j in range(i):
                mean = 0.5 * (k9[i, j] + k9[j, i])
                k9[i, j] = mean
                k9[j, i] = mean
        # to global axes: frame on both sides, block by block
        for c in range(3):
            for i in range(3):
                for j in range(9):
                    tmp[3 * c + i, j] = (
                        frame[i, 0] * k9[3 * c, j]
                        + frame[i, 1] * k9[3 * c + 1, j]
                        + frame[i, 2] * k9[3 * c + 2, j]
                    )
        for i in range(9):
            for c in range(3):
                for j in range(3):
                    k9[i, 3 * c + j] = (
                        tmp[i, 3 * c] * frame[j, 0]
                        + tmp[i, 3 * c + 1] * frame[j, 1]
                        + tmp[i, 3 * c + 2] * frame[j, 2]
                    )
        for i in range(3):
            for j in range(3):
                v = k9[i, j]
                tangents[n, i, j] = v
                tangents[n, i, 6 + j] = -v
                tangents[n, 6 + i, j] = -v
                tangents[n, 6 + i, 6 + j] = v
                for s in range(2):
                    v = k9[i, 3 + 3 * s + j]
                    col = 6 * s + 3 + j
                    tangents[n, i, col] = -v
                    tangents[n, col, i] = -v
                    tangents[n, 6 + i, col] = v
                    tangents[n, col, 6 + i] = v
                    for t in range(2):
                        tangents[n, 6 * t + 3 + i, col] = k9[3 + 3 * t + i, 3 + 3 * s + j]
    return energy


@nb.njit(cache=True)
def axial_forces(
    positions: Array, elements: IntArray, lengths: Array, EA: float, steps: Array
) -> Array:
    """Axial force (M,), N, after nodal displacements ``steps`` (N, 3) to first order."""
    out = np.empty(elements.shape[0])
    for n in range(elements.shape[0]):
        n1 = elements[n, 0]
        n2 = elements[n, 1]
        l2 = 0.0
        along = 0.0
        for i in range(3):
            u = positions[n2, i] - positions[n1, i]
            l2 += u * u
            along += u * (steps[n2, i] - steps[n1, i])
        length = np.sqrt(l2)
        out[n] = EA / lengths[n] * (length - lengths[n] + along / length)
    return out
