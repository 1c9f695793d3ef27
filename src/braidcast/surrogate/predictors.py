"""What a surrogate is told of a case: numbers computed from the case alone (paper, section 2.3).

The paper has two sets, the parameters of the vessel μ_B and points of the positioned centreline
μ_cl. Ours, ``site_predictors``, says where the stent lies to the neck and how wide and bent things
are there: quantities of which the deployed shape is a smoother function. ``end_predictors`` says
the same as seen from either end, for the question whether that end opens into the sac.
"""

import numpy as np
from numpy.typing import NDArray

from braidcast.case import Case
from braidcast.errors import InputError
from braidcast.surrogate.placed_braid import PlacedBraid

Array = NDArray[np.float64]

BEZIER = ("vessel_P1_y", "vessel_P1_z", "vessel_diameter", "aneurysm_diameter", "y_Ca", "site_eta")
"""Names of μ_B, mm; η is a number."""

SITE = (
    *("middle", "lean", "bend", "lumen_radius", "neck_radius", "protrusion", "sac_radius"),
    *("exposure", "exposure_difference", "turn_difference", "turn"),
)
"""Names of ours: mm, but for the protrusion and the exposures (numbers) and the turns (rad)."""

SITE_MIRROR = np.array([-1.0, -1.0, *[1.0] * 5, 1.0, -1.0, -1.0, 1.0])
"""What happens to ours when vessel and stent are seen from the other end."""

SHAPE = 7
"""So many of ``SITE`` do not depend on how deep the ends lie."""

REACH = 2.0
"""Depth in which an end's exposure to the sac changes by a factor of e, mm."""


def bezier_predictors(case: Case) -> Array:
    """The paper's μ_B (6,), named by ``BEZIER``."""
    centre, radius = _sac(case)
    _, y, z = case.tube.P1
    diameter = 2.0 * case.vessel_radius
    return np.array([y, z, diameter, 2.0 * radius, centre[1], case.eta])


def centreline_predictors(case: Case, points: int) -> Array:
    """The paper's μ_cl (2 N_cl + 3,): y and z of points on C_T, then D_v, D_a, y_Ca; mm.

    The ``points`` N_cl, 2 or more, are spread evenly over the positioned centreline C_T of the
    crimped stent, both ends among them; x is 0 for all of them.
    """
    if points < 2:
        raise InputError(f"N_cl = {points} must be 2 or more")
    centre, radius = _sac(case)
    places = case.start_arc_length + case.crimped_length * np.linspace(0.0, 1.0, points)
    along = case.centreline.at_arc_length(places)[:, 1:].ravel()
    return np.concatenate([along, [2.0 * case.vessel_radius, 2.0 * radius, centre[1]]])


def site_predictors(case: Case, placed: PlacedBraid) -> Array:
    """Ours (11,), named by ``SITE``; ``placed``: the case's geometrically placed braid.

    ``middle``: arc length from the place below the sac's centre to the middle of the stent;
    ``lean`` and ``bend``: P1 along and across the line from P0 to P2, from its middle;
    ``neck_radius``: of the circle in which the sac meets a flat wall; ``protrusion``: height of the
    sac's centre above the wall over its radius. ``exposure``: exp(depth/``REACH``) of an end,
    ``turn``: angle from the tangent below the sac's centre to that at an end, negative against the
    vessel's direction; of both the sum of the ends and the first's less the other's, for turns the
    last's less the first's.
    """
    centre, radius = _sac(case)
    line = case.bezier
    away, below = line.closest(centre)
    chord = line.P2 - line.P0
    chord = chord / np.linalg.norm(chord)
    arm = line.P1 - 0.5 * (line.P0 + line.P2)
    lean = float(arm @ chord)
    height = float(away[0]) - case.vessel_radius
    middle = case.start_arc_length + 0.5 * case.crimped_length - float(below[0])
    first, last = np.exp(end_depths(case, placed.positions) / REACH)
    back, ahead = _turns(line.tangent_at_arc_length(below)[0], placed, middle)
    return np.array(
        [
            middle,
            lean,
            float(np.linalg.norm(arm - lean * chord)),
            case.vessel_radius,
            np.sqrt(max(radius * radius - height * height, 0.0)),
            height / radius,
            radius,
            first + last,
            first - last,
            back + ahead,
            ahead - back,
        ]
    )


def end_predictors(case: Case, placed: PlacedBraid, site: Array) -> Array:
    """Ours of either end (2, 8): its depth in the sac, mm, and the site's shape seen from there.

    ``site`` (11,): the case's ``site_predictors``.
    """
    seen = np.stack([site[:SHAPE], site[:SHAPE] * SITE_MIRROR[:SHAPE]])
    return np.column_stack([end_depths(case, placed.positions), seen])


def end_depths(case: Case, positions: Array) -> Array:
    """How deep the first and the last ring of nodes (N, 3) reach into the sac, (2,) mm.

    R_a − |C_a − x| − r_w of the deepest node, negative outside: the paper's failure is a depth of
    0 or more.
    """
    centre, radius = _sac(case)
    rings = positions.reshape(-1, case.braid.segments + 1, 3)[:, [0, -1]]
    depth = radius - np.linalg.norm(rings - centre, axis=2) - case.braid.wire_radius
    return depth.max(axis=0)


def _turns(below: Array, placed: PlacedBraid, middle: float) -> Array:
    """Angles (2,) from the tangent ``below`` the sac to those of the first and last ring."""
    ends = placed.axes[[0, -1], :, 2]
    angles = np.arctan2(np.linalg.norm(np.cross(below, ends), axis=1), ends @ below)
    return angles * np.sign(middle + 0.5 * placed.length * np.array([-1.0, 1.0]))


def _sac(case: Case) -> tuple[Array, float]:
    """Centre (3,) and radius of the sac, mm."""
    return np.asarray(case.aneurysm_centre), 0.5 * case.sac.diameter
