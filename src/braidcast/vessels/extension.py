"""Longer ends: the wall of a vessel continued straight at its openings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from braidcast.errors import InputError
from braidcast.vessels.edges import loop_section
from braidcast.vessels.lumen_surface import LumenSurface, Opening
from braidcast.vessels.mesh_distance import MeshDistance
from braidcast.vessels.wording import place

Array = NDArray[np.float64]

SHORTEST = 1.0
"""Least length of a continued wall, mm."""
CLEARANCE = 0.2
"""Least distance of a continued wall from the rest of the vessel, mm."""
BEYOND = 1.0
"""The space that must be free beyond a continued wall's end, mm."""
# How densely a continued wall is compared with the rest, mm.
_STEP = 0.1
# A triangle of a continued wall is at most so many times as long as the edges of the rim.
_ASPECT = 4.0


def extended(surface: LumenSurface, length: float) -> LumenSurface:
    """The surface with its wall continued at each opening, along the opening's normal.

    The new ends are plane, square to the normal and ``length`` mm beyond the outermost vertex of
    the old rim; they are the openings of the result. Where the wall would come nearer than 0.2 mm
    to the rest of the vessel it is half as long, or a quarter, and so on, with a remark;
    ``InputError``, its text to follow the surface's name, if not even 1 mm fits.
    """
    for index in range(len(surface.openings)):
        surface = _with_longer_end(surface, index, length)
    return surface


def _with_longer_end(surface: LumenSurface, index: int, length: float) -> LumenSurface:
    opening = surface.openings[index]
    rim = surface.vertices[opening.rim]
    heights = (rim - opening.centre) @ opening.normal
    top = float(heights.max())
    # Every vertex of the rim on the plane through the outermost.
    flat = rim + (top - heights)[:, None] * opening.normal
    free = _free_length(surface, flat, opening.normal, length + BEYOND) - BEYOND
    fitting = length
    while fitting > free and fitting > SHORTEST:
        fitting = max(0.5 * fitting, SHORTEST)
    if fitting > free:
        raise InputError(
            f"has an opening at {place(opening.centre)} that cannot be continued straight by "
            f"{SHORTEST:g} mm without meeting the rest of the vessel: cut the vessel "
            "elsewhere there"
        )
    remarks = surface.remarks
    if fitting < length:
        remarks += (
            f"the opening at {place(opening.centre)} is continued by {fitting:.3g} mm "
            f"instead of {length:g} mm, for the vessel itself is in the way",
        )
    end = flat + fitting * opening.normal
    edge = np.linalg.norm(np.roll(rim, -1, axis=0) - rim, axis=1).mean()
    rings = max(1, round((fitting + np.ptp(heights)) / (_ASPECT * edge)))
    shares = np.arange(1, rings + 1)[:, None, None] / rings
    added = (rim + shares * (end - rim)).reshape(-1, 3)
    numbers = len(surface.vertices) + np.arange(len(added)).reshape(rings, -1)
    here = np.concatenate([opening.rim[None], numbers])
    openings = list(surface.openings)
    centre, _, radius = loop_section(end)
    openings[index] = Opening(centre, opening.normal, radius, numbers[-1])
    return replace(
        surface,
        vertices=np.concatenate([surface.vertices, added]),
        triangles=np.concatenate([surface.triangles, _strips(here, surface.triangles)]),
        openings=tuple(openings),
        remarks=remarks,
    )


def _free_length(surface: LumenSurface, flat: Array, normal: Array, length: float) -> float:
    """How far, up to ``length`` mm, the wall can go from the plane rim ``flat`` (k, 3)."""
    travel = _STEP * np.arange(1, round(length / _STEP) + 1)
    # Between far vertices of the rim a thin vessel could slip through.
    rim = np.concatenate([flat, 0.5 * (flat + np.roll(flat, -1, axis=0))])
    points = rim + travel[:, None, None] * normal
    near = np.hypot(*MeshDistance(surface).distance_and_overrun(points.reshape(-1, 3)))
    # The rim itself is as near as the way travelled; half of it leaves room for a flared wall.
    allowed = np.minimum(CLEARANCE, 0.5 * travel)
    blocked = (near.reshape(len(travel), -1) < allowed[:, None]).any(axis=1)
    return float(travel[np.argmax(blocked)] - _STEP) if blocked.any() else length


def _strips(rings: NDArray[np.int64], triangles: NDArray[np.int64]) -> NDArray[np.int64]:
    """Triangles between successive ``rings`` (r, k), turned like those on the first of them."""
    following = np.roll(rings, -1, axis=1)
    a, b, c, d = (part.ravel() for part in (rings[:-1], following[:-1], following[1:], rings[1:]))
    strips = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    directed = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2)
    same_way = (directed == [rings[0, 0], rings[0, 1]]).all(axis=1).any()
    return strips[:, ::-1] if same_way else strips
