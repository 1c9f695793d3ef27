"""Coulomb friction that sticks at rest and slips at mu times the normal force.

Tangential slip is elastic up to the Coulomb limit, like plasticity: with ``s`` the slip since the
point last rested freely, measured in the tangent plane,

    t = k s           |k s| <= mu p      (stick)
    t = mu p s/|s|    beyond             (slip),

and after each converged step the stored slip is brought back to the limit (return mapping). The
force uses the normal force of the same iterate, so a converged step obeys Coulomb's law; nothing
creeps below the limit.
"""

from dataclasses import dataclass

import numba as nb
import numpy as np

from braidcast.mechanics.rotations import Array


@dataclass(frozen=True)
class FrictionMemory:
    """What the wall remembers of the last converged state at every contact point.

    ``points`` (n, 3) where the axis was, ``gap`` (n,) how near the wall, ``slip`` (n, 3) the
    elastic slip it held, all mm.
    """

    points: Array
    gap: Array
    slip: Array


@nb.njit(cache=True, inline="always")
def _tangential_slip(
    point: Array,
    gap: float,
    gradient: Array,
    threshold: float,
    old_point: Array,
    old_gap: float,
    old_slip: Array,
    normal: Array,
    slip: Array,
) -> float:
    """Slip in the tangent plane into ``slip``, unit normal into ``normal``; returns its share.

    A point that landed within the step slipped only since its landing, the share of the straight
    way from old to new at which the gap was below the threshold.
    """
    size = np.sqrt(gradient[0] ** 2 + gradient[1] ** 2 + gradient[2] ** 2)
    share = 1.0
    if old_gap > threshold:
        share = (threshold - gap) / (old_gap - gap)
    along = 0.0
    for i in range(3):
        normal[i] = gradient[i] / size
        slip[i] = share * (point[i] - old_point[i])
        if old_gap <= threshold:
            slip[i] += old_slip[i]
        along += slip[i] * normal[i]
    for i in range(3):
        slip[i] -= along * normal[i]
    return share


@nb.njit(cache=True)
def friction_traction(
    points: Array,
    gap: Array,
    gradient: Array,
    lengths: Array,
    normal_force: Array,
    friction: float,
    stiffness: float,
    threshold: float,
    old_points: Array,
    old_gap: Array,
    old_slip: Array,
    force: Array,
    tangent: Array,
    tangential: Array,
    kept_slip: Array,
) -> None:
    """Add friction to point forces (n, 3) and tangents (n, 3, 3); fill ``tangential`` (n,), N.

    ``kept_slip`` (n, 3) is the elastic slip that the wall remembers if this state converges.
    The tangent is the symmetric part: the dependence of the limit on the normal force is left
    out, so that the system stays symmetric.
    """
    normal = np.empty(3)
    slip = np.empty(3)
    for n in range(gap.shape[0]):
        kept_slip[n] = 0.0
        if gap[n] >= threshold:
            continue
        share = _tangential_slip(
            points[n],
            gap[n],
            gradient[n],
            threshold,
            old_points[n],
            old_gap[n],
            old_slip[n],
            normal,
            slip,
        )
        size = np.sqrt(slip[0] ** 2 + slip[1] ** 2 + slip[2] ** 2)
        stick = stiffness * lengths[n]
        limit = friction * normal_force[n]
        if stick * size <= limit:
            k = stick
            along = 0.0
        else:
            k = limit / size
            along = k / size**2
        tangential[n] = k * size
        for i in range(3):
            force[n, i] += k * slip[i]
            kept_slip[n, i] = k / stick * slip[i]
            for j in range(3):
                tangent[n, i, j] -= share * (k * normal[i] * normal[j] + along * slip[i] * slip[j])
            tangent[n, i, i] += share * k
