"""Whether vessel, aneurysm, device and site of a case go together."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from braidcast.errors import InputError

if TYPE_CHECKING:
    from braidcast.case import Case

#: Length of vessel, mm, that the crimped device leaves free at the least.
MARGIN = 0.5


def check(case: Case) -> None:
    """Raise ``InputError`` for the first thing that makes the deployment impossible."""
    _vessel_bends_gently(case)
    _crimped_device_exists(case)
    _device_fits_across(case)
    _device_fits_along(case)
    if case.aneurysm is not None:
        _aneurysm_is_saccular(case)


def _vessel_bends_gently(case: Case) -> None:
    curvature = case.centreline.max_curvature
    if case.vessel_radius * curvature >= 1.0:
        raise InputError(
            f"vessel.P1 = {list(case.vessel.P1)} bends the centreline to a radius of "
            f"{1.0 / curvature:.3g} mm, must be more than the vessel's radius of "
            f"{case.vessel_radius:.4g} mm"
        )


def _crimped_device_exists(case: Case) -> None:
    braid, radius = case.braid, case.crimped_radius
    # In each ring the crossings of half the wires lie side by side, each two wires wide.
    least = braid.wires * braid.wire_radius / math.pi
    if not least <= radius < braid.axis_radius:
        raise InputError(
            f"site.crimped_radius = {radius:.4g} mm must be from {least:.4g} mm, where the wires "
            f"lie side by side, to below {braid.axis_radius:.4g} mm, the free device's"
        )


def _device_fits_across(case: Case) -> None:
    braid, diameter = case.braid, case.vessel.diameter
    least = 2.0 * (case.crimped_radius + 2.0 * braid.wire_radius)
    if diameter <= least:
        raise InputError(
            f"vessel.diameter = {diameter:.6g} mm must be above {least:.4g} mm, the crimped "
            "stent and a wire either side"
        )
    most = 2.0 * (braid.axis_radius + braid.wire_radius)
    if diameter >= most:
        raise InputError(
            f"vessel.diameter = {diameter:.6g} mm must be below {most:.4g} mm, the free stent's, "
            "or the stent lies loose"
        )


def _device_fits_along(case: Case) -> None:
    needed, length = case.crimped_length + MARGIN, case.centreline.length
    if length < needed:
        raise InputError(
            f"device.length = {case.braid.length:.6g} mm gives a stent of "
            f"{case.crimped_length:.4g} mm when crimped, must be at most {length - MARGIN:.4g} mm: "
            f"the vessel's centreline is {length:.4g} mm long and {MARGIN} mm stay free"
        )


def _aneurysm_is_saccular(case: Case) -> None:
    centre, table, vessel = case.aneurysm_centre, case.aneurysm, case.vessel_radius
    assert table is not None and centre is not None
    sac = table.diameter / 2.0
    if table.centre is not None:
        field = f"aneurysm.centre = {list(table.centre)}"
    else:
        field = f"aneurysm.protrusion = {table.protrusion}"
    away = float(case.centreline.closest(centre)[0][0])
    if not vessel <= away < vessel + sac:
        raise InputError(
            f"{field} puts the sac's centre {away:.4g} mm from the centreline, must be from "
            f"{vessel:.4g} mm (outside the vessel) to below {vessel + sac:.4g} mm (touching it)"
        )
    if table.neck_fillet >= min(vessel, sac):
        raise InputError(
            f"aneurysm.neck_fillet = {table.neck_fillet} mm must be below {min(vessel, sac):.4g} "
            "mm, the smaller radius of vessel and sac"
        )
    ends = [np.linalg.norm(centre - np.array(end)) for end in (case.vessel.P0, case.vessel.P2)]
    if min(ends) <= vessel + sac:
        raise InputError(
            f"{field} puts the sac's centre {min(ends):.4g} mm from an end of the vessel, must be "
            f"more than {vessel + sac:.4g} mm, or the sac swallows that end"
        )
