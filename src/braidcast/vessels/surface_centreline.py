"""The centreline of a vessel from a surface: given in a file and checked, or found."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from braidcast.errors import InputError
from braidcast.vessels.centreline_file import flipped_lps_ras, read_centreline
from braidcast.vessels.centreline_search import find_centreline
from braidcast.vessels.lumen_surface import LumenSurface, Opening
from braidcast.vessels.mesh_distance import MeshDistance
from braidcast.vessels.polyline import Polyline
from braidcast.vessels.wording import about, counted, place

if TYPE_CHECKING:
    from braidcast.vessels.surface_vessel import SurfaceSource

Array = NDArray[np.float64]

_RADII_TO_DEPTHS = 3.0
"""The largest given radius and the distances to the wall differ by this factor at most."""


def centreline_of(
    source: SurfaceSource, surface: LumenSurface, wall: MeshDistance
) -> tuple[Polyline, list[str]]:
    """The centreline, given or found, with the lumen's radius along it, and remarks.

    ``wall``: the distance to the surface with its ends continued. ``InputError``, beginning with
    the field, for a centreline that is not of this vessel and for ends that it cannot join.
    """
    ends = None if source.ends is None else np.array(source.ends)
    where = f"centreline = {source.centreline}"
    if source.centreline is None:
        if ends is None:
            ends = _two_openings(source, surface)
        bounds = np.array([surface.vertices.min(axis=0), surface.vertices.max(axis=0)])
        return find_centreline(wall.distance, bounds, ends, _end_radii(surface, ends)), []
    given = read_centreline(source.centreline, ends)
    with about(f"{where}:"):
        line = Polyline.through(given.points, given.radii)
    inside = _share_inside(line, wall)
    if inside < 0.9:
        turned = Polyline.through(flipped_lps_ras(given.points))
        guess = (
            ": it would lie inside with x and y negated, the other of RAS and LPS coordinates"
            if _share_inside(turned, wall) > 0.9
            else ""
        )
        raise InputError(
            f"{where} lies within the surface for {100.0 * inside:.0f} % of its length, must for "
            f"90 % at least{guess}"
        )
    if given.radii is None:
        return _with_depths(line, wall), list(given.remarks)
    _check_radii(given.radii, _depths(line, wall), where)
    return line, list(given.remarks)


def _check_radii(radii: Array, depths: Array, where: str) -> None:
    """``InputError`` for given radii that are not those of this lumen: diameters in cm, say."""
    most, least = _RADII_TO_DEPTHS * depths.max(), depths.min() / _RADII_TO_DEPTHS
    if radii.max() > most or radii.max() < least:
        raise InputError(
            f"{where} has a largest radius of {radii.max():.3g} mm, must be from "
            f"{max(least, 0.0):.2g} to {most:.2g} mm: the wall is {max(depths.min(), 0.0):.2g} to "
            f"{depths.max():.2g} mm away"
        )


def _end_radii(surface: LumenSurface, ends: Array) -> Array | None:
    """Radii (2,) of the openings at the ends; None unless each end lies in one."""
    radii = []
    for end in ends:
        here = [o.radius for o in surface.openings if np.linalg.norm(end - o.centre) < o.radius]
        radii += here[:1]
    return np.array(radii) if len(radii) == 2 else None


def _share_inside(line: Polyline, wall: MeshDistance) -> float:
    return float((_depths(line, wall) > 0.0).mean())


def _depths(line: Polyline, wall: MeshDistance) -> Array:
    """Distance to the wall, (200,) mm, from places evenly along a line; negative outside."""
    return -wall.distance(line.at_arc_length(np.linspace(0.0, line.length, 200)))


def _with_depths(line: Polyline, wall: MeshDistance) -> Polyline:
    """A line without radii, given those of the largest spheres about it."""
    along = np.linspace(0.0, line.length, max(8, int(line.length / 0.25)))
    places = line.at_arc_length(along)
    return Polyline.through(places, np.maximum(-wall.distance(places), 1e-3))


def _two_openings(source: SurfaceSource, surface: LumenSurface) -> Array:
    """Centres (2, 3) of the two openings, the wider one first."""
    openings: list[Opening] = sorted(surface.openings, key=lambda o: -o.radius)
    if len(openings) == 2:
        return np.array([opening.centre for opening in openings])
    ends = ", ".join(f"{place(o.centre)} of radius {o.radius:.2f} mm" for o in openings)
    found = f"has {counted(len(openings), 'open end')}: {ends}" if openings else "has no open end"
    raise InputError(
        f"surface = {source.surface} {found}; ends = [[x, y, z], [x, y, z]] must say between which "
        "two places the centreline runs, from proximal to distal"
    )
