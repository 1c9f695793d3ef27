"""The two-node corotational Euler-Bernoulli element with finite rotations.

The element frame ``E = [e1 e2 e3]`` has ``e1`` along the chord and ``e2`` in the plane of ``e1``
and ``q = (q1 + q2)/2``, the mean of the two nodes' turned second directors (Battini & Pacoste
2002, section 3). In that frame the strain energy is quadratic,

    U = EA/(2 L) u^2 + 1/2 theta^T K theta,      theta_i = log(E^T R_i T),

with ``u`` the change of chord length, ``K`` the Hermitian bending (``EI/L [4 2; 2 4]``) and the
torsion (``GJ/L [1 -1; -1 1]``) stiffness. Force and tangent are the exact first and second
derivatives of U along ``x + dx, exp(w) R``, the latter symmetric.

Inside, all is done in the element frame with nine variables: the chord's change ``du`` and the two
spins ``w1``, ``w2``. The frame itself spins by ``G (du, w1, w2)``, and the nodes relative to it by
``w_i - G (du, w1, w2)``, whose moment is ``m_i = T(theta_i)^-T dU/dtheta_i``.
"""

import numba as nb
import numpy as np

from braidcast.mechanics.arrays import IntArray
from braidcast.mechanics.rotations import Array, log_into, log_tangent_coefficients


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
    theta = np.empty((2, 3))
    mu = np.empty((2, 3))
    m = np.empty((2, 3))
    inverse = np.empty((2, 3, 3))
    dm = np.empty((2, 3, 3))
    f = np.empty((3, 3))
    k9 = np.empty((9, 9))
    own = np.empty(3)
    mix = np.empty(3)
    work = (np.empty((2, 3, 3)), np.empty((3, 3)), np.zeros((3, 9)), np.empty((9, 9)))
    for n in range(elements.shape[0]):
        n1 = elements[n, 0]
        n2 = elements[n, 1]
        rest = lengths[n]
        length = _element_frame(
            positions[n1], positions[n2], rotations[n1], rotations[n2], triads[n], frame
        )
        _turned_into_frame(rotations[n1], triads[n], frame, bar[0])
        _turned_into_frame(rotations[n2], triads[n], frame, bar[1])
        log_into(bar[0], theta[0])
        log_into(bar[1], theta[1])
        # l - L without cancellation
        stretch = (length * length - rest * rest) / (length + rest)
        normal = stiffness[0] / rest * stretch
        energy += 0.5 * normal * stretch
        own[0] = stiffness[1] / rest
        mix[0] = -own[0]
        for i in range(1, 3):
            own[i] = 4.0 * stiffness[i + 1] / rest
            mix[i] = 2.0 * stiffness[i + 1] / rest
        for i in range(3):
            mu[0, i] = own[i] * theta[0, i] + mix[i] * theta[1, i]
            mu[1, i] = mix[i] * theta[0, i] + own[i] * theta[1, i]
            energy += 0.5 * (mu[0, i] * theta[0, i] + mu[1, i] * theta[1, i])
        _spin_moment(theta[0], mu[0], inverse[0], m[0], dm[0])
        _spin_moment(theta[1], mu[1], inverse[1], m[1], dm[1])
        _frame_forces(normal, m, bar, length, f)
        _forces_to_nodes(frame, f, forces[n])
        if with_tangent:
            if not np.isnan(axial[n]):
                f[0, 0] = axial[n]
            _frame_tangent(stiffness[0] / rest, own, mix, m, inverse, dm, bar, length, f, work, k9)
            _tangent_to_nodes(frame, k9, work[3], tangents[n])
    return energy


@nb.njit(cache=True, inline="always")
def _element_frame(x1: Array, x2: Array, r1: Array, r2: Array, triad: Array, frame: Array) -> float:
    """Fill the frame's columns; return the length of the chord."""
    ux = x2[0] - x1[0]
    uy = x2[1] - x1[1]
    uz = x2[2] - x1[2]
    length = np.sqrt(ux * ux + uy * uy + uz * uz)
    frame[0, 0] = ux / length
    frame[1, 0] = uy / length
    frame[2, 0] = uz / length
    for i in range(3):
        frame[i, 1] = 0.0
        for j in range(3):
            frame[i, 1] += 0.5 * (r1[i, j] + r2[i, j]) * triad[j, 1]
    # e3 = e1 x q / |e1 x q|, e2 = e3 x e1
    x = frame[1, 0] * frame[2, 1] - frame[2, 0] * frame[1, 1]
    y = frame[2, 0] * frame[0, 1] - frame[0, 0] * frame[2, 1]
    z = frame[0, 0] * frame[1, 1] - frame[1, 0] * frame[0, 1]
    norm = np.sqrt(x * x + y * y + z * z)
    frame[0, 2] = x / norm
    frame[1, 2] = y / norm
    frame[2, 2] = z / norm
    frame[0, 1] = frame[1, 2] * frame[2, 0] - frame[2, 2] * frame[1, 0]
    frame[1, 1] = frame[2, 2] * frame[0, 0] - frame[0, 2] * frame[2, 0]
    frame[2, 1] = frame[0, 2] * frame[1, 0] - frame[1, 2] * frame[0, 0]
    return length


@nb.njit(cache=True, inline="always")
def _turned_into_frame(rotation: Array, triad: Array, frame: Array, out: Array) -> None:
    """``out = E^T R T``."""
    for j in range(3):
        x = (
            rotation[0, 0] * triad[0, j]
            + rotation[0, 1] * triad[1, j]
            + rotation[0, 2] * triad[2, j]
        )
        y = (
            rotation[1, 0] * triad[0, j]
            + rotation[1, 1] * triad[1, j]
            + rotation[1, 2] * triad[2, j]
        )
        z = (
            rotation[2, 0] * triad[0, j]
            + rotation[2, 1] * triad[1, j]
            + rotation[2, 2] * triad[2, j]
        )
        for i in range(3):
            out[i, j] = frame[0, i] * x + frame[1, i] * y + frame[2, i] * z


@nb.njit(cache=True)
def _spin_moment(theta: Array, mu: Array, tinv: Array, h: Array, dh: Array) -> None:
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


@nb.njit(cache=True, inline="always")
def _frame_forces(normal: float, m: Array, bar: Array, length: float, f: Array) -> None:
    """Forces (3, 3) in the frame: on the chord, and the moments on the two nodes.

    The frame's own spin carries the total moment ``m1 + m2`` back to chord and directors.
    """
    a = 0.5 * (bar[0, 0, 1] + bar[1, 0, 1])
    b = 0.5 * (bar[0, 1, 1] + bar[1, 1, 1])
    s1 = m[0, 0] + m[1, 0]
    f[0, 0] = normal
    f[0, 1] = -(m[0, 2] + m[1, 2]) / length
    f[0, 2] = (m[0, 1] + m[1, 1] + s1 * a / b) / length
    for s in range(2):
        f[s + 1, 0] = m[s, 0] - 0.5 * s1 / b * bar[s, 1, 1]
        f[s + 1, 1] = m[s, 1] + 0.5 * s1 / b * bar[s, 0, 1]
        f[s + 1, 2] = m[s, 2]


@nb.njit(cache=True, inline="always")
def _forces_to_nodes(frame: Array, f: Array, out: Array) -> None:
    for i in range(3):
        fu = frame[i, 0] * f[0, 0] + frame[i, 1] * f[0, 1] + frame[i, 2] * f[0, 2]
        out[i] = -fu
        out[6 + i] = fu
        for s in range(2):
            out[6 * s + 3 + i] = (
                frame[i, 0] * f[s + 1, 0] + frame[i, 1] * f[s + 1, 1] + frame[i, 2] * f[s + 1, 2]
            )


@nb.njit(cache=True)
def _frame_tangent(
    stretching: float,
    own: Array,
    mix: Array,
    m: Array,
    inverse: Array,
    dm_dtheta: Array,
    bar: Array,
    length: float,
    f: Array,
    work: tuple[Array, Array, Array, Array],
    k9: Array,
) -> None:
    """Symmetric tangent (9, 9) in the frame, column by column: each a unit change of du, w1, w2.

    The derivative along spins is made symmetric in the end: off equilibrium it differs from the
    second derivative of U along ``exp(w) R`` by an antisymmetric part only.
    """
    dm_own, dm_mix, g, _ = work
    w = np.empty((2, 3))
    dm = np.empty((2, 3))
    df = np.empty((3, 3))
    for s in range(2):
        for i in range(3):
            for j in range(3):
                dm_own[s, i, j] = 0.0
                for p in range(3):
                    dm_own[s, i, j] += (dm_dtheta[s, i, p] + inverse[s, p, i] * own[p]) * inverse[
                        s, p, j
                    ]
    for i in range(3):
        for j in range(3):
            dm_mix[i, j] = 0.0
            for p in range(3):
                dm_mix[i, j] += inverse[0, p, i] * mix[p] * inverse[1, p, j]
    a = 0.5 * (bar[0, 0, 1] + bar[1, 0, 1])
    b = 0.5 * (bar[0, 1, 1] + bar[1, 1, 1])
    s1 = m[0, 0] + m[1, 0]
    # spin of the frame, w_r = g (du, w1, w2)
    g[0, 2] = -a / (b * length)
    g[1, 2] = -1.0 / length
    g[2, 1] = 1.0 / length
    for s in range(2):
        g[0, 3 + 3 * s] = 0.5 * bar[s, 1, 1] / b
        g[0, 4 + 3 * s] = -0.5 * bar[s, 0, 1] / b
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
                dm[0, i] += dm_own[0, i, p] * w[0, p] + dm_mix[i, p] * w[1, p]
                dm[1, i] += dm_own[1, i, p] * w[1, p] + dm_mix[p, i] * w[0, p]
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
        df[0, 0] = stretching * dl
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


@nb.njit(cache=True, inline="always")
def _tangent_to_nodes(frame: Array, k9: Array, half: Array, out: Array) -> None:
    """Global axes on both sides, and the chord's change as the difference of the nodes'."""
    for c in range(3):
        for i in range(3):
            for j in range(9):
                half[3 * c + i, j] = (
                    frame[i, 0] * k9[3 * c, j]
                    + frame[i, 1] * k9[3 * c + 1, j]
                    + frame[i, 2] * k9[3 * c + 2, j]
                )
    for i in range(9):
        for c in range(3):
            for j in range(3):
                k9[i, 3 * c + j] = (
                    half[i, 3 * c] * frame[j, 0]
                    + half[i, 3 * c + 1] * frame[j, 1]
                    + half[i, 3 * c + 2] * frame[j, 2]
                )
    for i in range(3):
        for j in range(3):
            v = k9[i, j]
            out[i, j] = v
            out[i, 6 + j] = -v
            out[6 + i, j] = -v
            out[6 + i, 6 + j] = v
            for s in range(2):
                v = k9[i, 3 + 3 * s + j]
                column = 6 * s + 3 + j
                out[i, column] = -v
                out[column, i] = -v
                out[6 + i, column] = v
                out[column, 6 + i] = v
                for t in range(2):
                    out[6 * t + 3 + i, column] = k9[3 + 3 * t + i, 3 + 3 * s + j]


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
