"""Whether vessel, aneurysm, device and site of a case go together."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from braidcast.case_tables import SacRegion, Vessel
from braidcast.errors import InputError
from braidcast.vessels.wording import place

if TYPE_CHECKING:
    from braidcast.case import Case
    from braidcast.devices import Braid
    from braidcast.vessels.sacs import Sac
    from braidcast.vessels.surface_vessel import SurfaceVessel

#: Length of vessel, mm, that the crimped device leaves free at the least.
MARGIN = 0.5

#: Distance between places along the centreline that are looked at, mm.
_STEP = 0.1

#: A site's point lies within so many lumen radii of the centreline, or about the sac.
_MOST_RADII = 3.0

#: A sac's lumen reaches beyond the parent vessel by more than this share of its radius, and mm.
_BULGE = (0.1, 0.1)


def check(case: Case) -> None:
    """Raise ``InputError`` for the first thing that makes the deployment impossible."""
    _crimped_device_exists(case)
    if isinstance(case.vessel, Vessel):
        _tube_bends_gently(case)
        _device_fits_across_tube(case)
        _device_fits_along(case)
        if case.aneurysm is not None:
            _aneurysm_is_saccular(case)
        return
    vessel = case.surface_geometry
    _device_fits_along(case)
    _device_fits_across_surface(case, vessel)
    _sac_meets_vessel(case, vessel)


def _tube_bends_gently(case: Case) -> None:
    curvature = case.bezier.max_curvature
    if case.vessel_radius * curvature >= 1.0:
        raise InputError(
            f"vessel.P1 = {list(case.tube.P1)} bends the centreline to a radius of "
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


def _device_fits_across_tube(case: Case) -> None:
    braid, diameter = case.braid, case.tube.diameter
    least, most = 2.0 * least_radius(braid, case.crimped_radius), 2.0 * most_radius(braid)
    if diameter <= least:
        raise InputError(
            f"vessel.diameter = {diameter:.6g} mm must be above {least:.4g} mm, the crimped "
            "stent and a wire either side"
        )
    if diameter >= most:
        raise InputError(
            f"vessel.diameter = {diameter:.6g} mm must be below {most:.4g} mm, the free stent's, "
            "or the stent lies loose"
        )


def least_radius(braid: Braid, crimped_radius: float) -> float:
    """Of a lumen in which the crimped device has a wire's thickness of room, mm."""
    return crimped_radius + 2.0 * braid.wire_radius


def most_radius(braid: Braid) -> float:
    """Of a lumen that the free device still touches, mm."""
    return braid.axis_radius + braid.wire_radius


def _device_fits_along(case: Case) -> None:
    length, spare, start = case.centreline.length, case.spare_length, case.start_arc_length
    if spare < 0.0:
        raise InputError(
            f"device.length = {case.braid.length:.6g} mm gives a stent of "
            f"{case.crimped_length:.4g} mm when crimped, must be at most {length - MARGIN:.4g} mm: "
            f"the vessel's centreline is {length:.4g} mm long and {MARGIN} mm stay free"
        )
    if 0.0 <= start <= spare:
        if case.site.point is not None:
            _point_is_beside(case, np.array(case.site.point))
        return
    site, far = case.site, spare + case.crimped_length
    if site.proximal_end_mm is not None:
        field, value, limits = "proximal_end_mm", f"{site.proximal_end_mm} mm", (0.0, spare)
    elif site.distal_end_mm is not None:
        field, value = "distal_end_mm", f"{site.distal_end_mm} mm"
        limits = (case.crimped_length, far)
    else:
        middle = 0.5 * case.crimped_length
        field, value = "point", f"{list(site.point or ())}, at {start + middle:.4g} mm of the line,"
        limits = (middle, spare + middle)
    raise InputError(
        f"site.{field} = {value} must be from {limits[0]:.4g} to {limits[1]:.4g} mm along the "
        f"centreline of {length:.4g} mm, or the crimped stent of {case.crimped_length:.4g} mm "
        "reaches beyond its ends"
    )


def _point_is_beside(case: Case, point: np.ndarray) -> None:
    away, along = (float(value[0]) for value in case.centreline.closest(point))
    sac = case.vessel_geometry.aneurysm
    if isinstance(case.vessel, Vessel):
        lumen = case.vessel_radius
    else:
        lumen = float(case.surface_geometry.centreline.lumen_radius(along)[0])
    most = _MOST_RADII * lumen
    if sac is not None:
        most = max(most, float(case.centreline.closest(sac.centre)[0][0]) + sac.radius)
    if away > most:
        raise InputError(
            f"site.point = {list(point.tolist())} is {away:.4g} mm from the vessel's centreline, "
            f"must be at most {most:.4g} mm from it"
        )


def _device_fits_across_surface(case: Case, vessel: SurfaceVessel) -> None:
    line, start = vessel.centreline, case.start_arc_length
    along = np.arange(start, start + case.crimped_length + _STEP, _STEP)
    places, lumen = line.at_arc_length(along), line.lumen_radius(along)
    room = -vessel.distance(places)
    least, most = least_radius(case.braid, case.crimped_radius), most_radius(case.braid)
    narrowest = int(room.argmin())
    if room[narrowest] <= least:
        if case.site.crimped_radius is not None:
            raise InputError(
                f"site.crimped_radius = {case.site.crimped_radius:.4g} mm must be below "
                f"{room[narrowest] - 2.0 * case.braid.wire_radius:.4g} mm, or the stent and a wire "
                f"do not fit at {place(places[narrowest])}"
            )
        raise InputError(
            f"vessel.surface = {vessel.name} leaves {room[narrowest]:.4g} mm about the centreline "
            f"at {along[narrowest]:.4g} mm of it, {place(places[narrowest])}, must leave more "
            f"than {least:.4g} mm, the crimped stent and a wire"
        )
    if lumen.min() >= most:
        raise InputError(
            f"vessel.surface = {vessel.name} has a lumen of {lumen.min():.4g} mm radius or more "
            f"where the stent is put, must have less than {most:.4g} mm somewhere, the free "
            "stent's, or the stent lies loose"
        )
    bend = line.curvature_at_arc_length(along)
    tightest = int(bend.argmax())
    if bend[tightest] * least >= 1.0:
        raise InputError(
            f"vessel.surface = {vessel.name} has a centreline of {1.0 / bend[tightest]:.3g} mm "
            f"radius at {along[tightest]:.4g} mm of it, {place(places[tightest])}, must be above "
            f"{least:.4g} mm, the crimped stent's"
        )


def _sac_meets_vessel(case: Case, vessel: SurfaceVessel) -> None:
    table, sac = case.aneurysm, vessel.aneurysm
    if table is None or sac is None:
        return
    away, along = vessel.centreline.closest(sac.centre)
    lumen = float(vessel.centreline.lumen_radius(along)[0])
    least = 0.0
    if isinstance(table, SacRegion) and table.neck is not None:
        field, least, most = f"neck = {list(table.neck)}", 0.5 * lumen, 2.0 * lumen
    elif isinstance(table, SacRegion):
        field, most = f"surface = {table.surface}", lumen + sac.radius
    else:
        field, most = f"centre = {sac.centre.tolist()}", lumen + sac.radius
    if not least <= away[0] < most:
        raise InputError(
            f"aneurysm.{field} is {away[0]:.4g} mm from the vessel's centreline, must be from "
            f"{least:.4g} to below {most:.4g} mm, or it is not at this vessel's side"
        )
    places = vessel.centreline.at_arc_length(np.arange(0.0, vessel.centreline.length, _STEP))
    held = float((sac.depth(places) > 0.0).mean())
    if held > 0.5:
        raise InputError(
            f"aneurysm.{field} holds {held:.0%} of the vessel's centreline, must be the sac alone"
        )
    if not _bulges(vessel, sac):
        raise InputError(
            f"aneurysm.{field} holds no lumen beyond the parent vessel, of {lumen:.4g} mm radius "
            "there, must be where the wall bulges out"
        )


def _bulges(vessel: SurfaceVessel, sac: Sac) -> bool:
    """Whether some of the lumen lies in the sac and clearly beyond the parent vessel."""
    shares = np.linspace(-1.0, 1.0, 25)
    ball = np.stack(np.meshgrid(shares, shares, shares), axis=-1).reshape(-1, 3)
    points = sac.centre + sac.radius * ball[np.linalg.norm(ball, axis=1) <= 1.0]
    points = points[sac.depth(points) > 0.0]
    points = points[vessel.distance(points) < 0.0] if len(points) else points
    if len(points) == 0:
        return False
    _, along = vessel.centreline.closest(points)
    share, length = _BULGE
    beyond = share * vessel.centreline.lumen_radius(along) + length
    # Beyond an end of the centreline there is no parent vessel to be beyond of.
    beside = (along > 0.0) & (along < vessel.centreline.length)
    return bool((beside & (vessel.parent_distance(points) > beyond)).any())


def _aneurysm_is_saccular(case: Case) -> None:
    if isinstance(case.aneurysm, SacRegion):
        raise InputError(
            "aneurysm.neck and aneurysm.surface are for a vessel from a surface, must be diameter "
            "and protrusion, or diameter and centre, in one about a Bézier curve"
        )
    centre, table, vessel = case.aneurysm_centre, case.sac, case.vessel_radius
    assert centre is not None
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
    ends = [np.linalg.norm(centre - np.array(end)) for end in (case.tube.P0, case.tube.P2)]
    if min(ends) <= vessel + sac:
        raise InputError(
            f"{field} puts the sac's centre {min(ends):.4g} mm from an end of the vessel, must be "
            f"more than {vessel + sac:.4g} mm, or the sac swallows that end"
        )
