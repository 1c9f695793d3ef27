"""Finite rotations: exponential and logarithm of SO(3), and the tangent of the logarithm.

Vectors are length-3 arrays, rotations 3x3 arrays; a spin ``w`` turns ``R`` into ``exp(w) R``.
Reference: Battini & Pacoste 2002, appendix; Geradin & Cardona 2001, chapter 4.
"""

import numba as nb
import numpy as np

from braidcast.mechanics.arrays import Array

SMALL_ANGLE = 1e-2
"""Below this angle (rad) the coefficients are taken from their series, exact to rounding."""


@nb.njit(cache=True, inline="always")
def exp_into(wx: float, wy: float, wz: float, out: Array) -> None:
    """Rodrigues' formula, ``out = I + sin(t)/t [w] + (1 - cos(t))/t^2 [w]^2``."""
    t2 = wx * wx + wy * wy + wz * wz
    if t2 < SMALL_ANGLE**2:
        a = 1.0 - t2 / 6.0 * (1.0 - t2 / 20.0 * (1.0 - t2 / 42.0))
        b = 0.5 - t2 / 24.0 * (1.0 - t2 / 30.0 * (1.0 - t2 / 56.0))
    else:
        t = np.sqrt(t2)
        a = np.sin(t) / t
        b = 2.0 * (np.sin(0.5 * t) / t) ** 2
    out[0, 0] = 1.0 - b * (wy * wy + wz * wz)
    out[1, 1] = 1.0 - b * (wx * wx + wz * wz)
    out[2, 2] = 1.0 - b * (wx * wx + wy * wy)
    out[0, 1] = b * wx * wy - a * wz
    out[1, 0] = b * wx * wy + a * wz
    out[0, 2] = b * wx * wz + a * wy
    out[2, 0] = b * wx * wz - a * wy
    out[1, 2] = b * wy * wz - a * wx
    out[2, 1] = b * wy * wz + a * wx


@nb.njit(cache=True)
def log_into(r: Array, out: Array) -> None:
    """Rotation vector of ``r``, by way of the unit quaternion so that all angles below pi work."""
    trace = r[0, 0] + r[1, 1] + r[2, 2]
    if trace > 0.0:
        s = 2.0 * np.sqrt(1.0 + trace)
        q0 = 0.25 * s
        q1 = (r[2, 1] - r[1, 2]) / s
        q2 = (r[0, 2] - r[2, 0]) / s
        q3 = (r[1, 0] - r[0, 1]) / s
    elif r[0, 0] >= r[1, 1] and r[0, 0] >= r[2, 2]:
        s = 2.0 * np.sqrt(1.0 + r[0, 0] - r[1, 1] - r[2, 2])
        q0 = (r[2, 1] - r[1, 2]) / s
        q1 = 0.25 * s
        q2 = (r[0, 1] + r[1, 0]) / s
        q3 = (r[0, 2] + r[2, 0]) / s
    elif r[1, 1] >= r[2, 2]:
        s = 2.0 * np.sqrt(1.0 + r[1, 1] - r[0, 0] - r[2, 2])
        q0 = (r[0, 2] - r[2, 0]) / s
        q1 = (r[0, 1] + r[1, 0]) / s
        q2 = 0.25 * s
        q3 = (r[1, 2] + r[2, 1]) / s
    else:
        s = 2.0 * np.sqrt(1.0 + r[2, 2] - r[0, 0] - r[1, 1])
        q0 = (r[1, 0] - r[0, 1]) / s
        q1 = (r[0, 2] + r[2, 0]) / s
        q2 = (r[1, 2] + r[2, 1]) / s
        q3 = 0.25 * s
    v2 = q1 * q1 + q2 * q2 + q3 * q3
    v = np.sqrt(v2)
    if v < 1e-4:
        # atan2(v, q0) / v for small v, q0 = sqrt(1 - v^2)
        factor = 2.0 * (1.0 + v2 / 6.0 + 3.0 * v2 * v2 / 40.0) * (1.0 if q0 > 0.0 else -1.0)
    else:
        factor = 2.0 * np.arctan2(v, q0) / v
        if q0 < 0.0:
            factor = 2.0 * (np.arctan2(v, q0) - np.pi) / v
    out[0] = factor * q1
    out[1] = factor * q2
    out[2] = factor * q3


@nb.njit(cache=True, inline="always")
def log_tangent_coefficients(t2: float) -> tuple[float, float]:
    """Coefficient ``c`` of ``[t]^2`` in the inverse tangent, and ``c'(t)/t``, for ``t2 = |t|^2``.

    ``T(t)^-1 = I - [t]/2 + c [t]^2`` maps a spin of ``exp(t)`` to the change of ``t``;
    ``c = (1 - (t/2) cot(t/2)) / t^2``.
    """
    if t2 < SMALL_ANGLE:
        c = 1.0 / 12.0 + t2 / 720.0 + t2 * t2 / 30240.0 + t2**3 / 1209600.0
        d = 1.0 / 360.0 + t2 / 7560.0 + t2 * t2 / 201600.0 + t2**3 / 5987520.0
        return c, d
    t = np.sqrt(t2)
    half = 0.5 * t
    cot = np.cos(half) / np.sin(half)
    c = (1.0 - half * cot) / t2
    # d/dt of (1 - (t/2) cot(t/2)) is -cot/2 + (t/4) / sin^2
    d = (-0.5 * cot + 0.5 * half / np.sin(half) ** 2) / (t2 * t) - 2.0 * c / t2
    return c, d


@nb.njit(cache=True)
def exp_so3(vectors: Array) -> Array:
    """Rotations (n, 3, 3) of rotation vectors (n, 3), rad."""
    out = np.empty((vectors.shape[0], 3, 3))
    for i in range(vectors.shape[0]):
        exp_into(vectors[i, 0], vectors[i, 1], vectors[i, 2], out[i])
    return out


@nb.njit(cache=True)
def log_so3(rotations: Array) -> Array:
    """Rotation vectors (n, 3), rad, of rotations (n, 3, 3); angles in [0, pi]."""
    out = np.empty((rotations.shape[0], 3))
    for i in range(rotations.shape[0]):
        log_into(rotations[i], out[i])
    return out


@nb.njit(cache=True)
def spin_in_place(rotations: Array, spins: Array) -> None:
    """Turn every rotation (n, 3, 3) by its spin (n, 3): ``R <- exp(w) R``."""
    e = np.empty((3, 3))
    r = np.empty((3, 3))
    for i in range(rotations.shape[0]):
        exp_into(spins[i, 0], spins[i, 1], spins[i, 2], e)
        for a in range(3):
            for b in range(3):
                r[a, b] = rotations[i, a, b]
        for a in range(3):
            for b in range(3):
                rotations[i, a, b] = e[a, 0] * r[0, b] + e[a, 1] * r[1, b] + e[a, 2] * r[2, b]
