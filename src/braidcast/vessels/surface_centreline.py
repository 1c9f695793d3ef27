"""The centreline of a vessel from a surface: given in a file and checked, or found."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from braidcast.errors import InputError
from braidcast.vessels.centreline_file import flipped_lps_ras, read_centreline
from braidcast.vessels.centreline_search import centred, find_centreline
from braidcast.vessels.lumen_surface import LumenSurface, Opening
from braidcast.vessels.mesh_distance import MeshDistance
from braidcast.vessels.polyline import Polyline
from braidcast.vessels.wording import about, counted, place

if TYPE_CHECKING:
    from braidcast.vessels.surface_vessel import SurfaceSource

Array = NDArray[np.float64]

_USUAL_RATIOS, _ALLOWED_RATIOS = (0.7, 1.5), (0.5, 2.0)
"""Given radii over the distance to the wall: the median of all places, and nine of ten of them."""
_BEYOND = 0.25
"""What a given line may reach beyond an open end before that is cut, mm."""
_STEP = 0.1
"""Between the places along a line that are looked at, mm."""
_OFF = 0.1
"""From here on it is said how far a line lies off the middle of the lumen, mm."""


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
    given = read_centreline(source.centreline, ends, source.surface)
    with about(f"{where}:"):
        line = Polyline.through(given.points, given.radii)
    line, cut = _within_ends(line, surface)
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
    remarks = [*given.remarks, *cut]
    if given.radii is not None:
        _check_radii(line, wall, where)
        return line, remarks
    line, moved = _centred(line, wall)
    return line, remarks + moved


def _within_ends(line: Polyline, surface: LumenSurface) -> tuple[Polyline, list[str]]:
    """The line without what lies beyond open ends, and a remark if that was cut."""
    along = np.linspace(0.0, line.length, max(8, int(line.length / _STEP)))
    places = line.at_arc_length(along)
    _, overrun = MeshDistance(surface).distance_and_overrun(places)
    within = np.flatnonzero(overrun == 0.0)
    if len(within) == 0:
        return line, []
    first, last = within[0], within[-1]
    beyond = along[first] + line.length - along[last]
    if beyond <= _BEYOND or last - first < 8:
        return line, []
    kept = slice(first, last + 1)
    radii = line.lumen_radius(along[kept]) if line.radius_curve is not None else None
    remark = f"the centreline goes {beyond:.2f} mm beyond the open ends and was cut there"
    return Polyline.through(places[kept], radii), [remark]


def _centred(line: Polyline, wall: MeshDistance) -> tuple[Polyline, list[str]]:
    """A line without radii moved to the middle of the lumen, with its radii, and remarks."""
    try:
        middle = centred(wall.distance, line)
    except InputError as error:
        return _with_depths(line, wall), [
            f"the centreline was left as it is, its radii being the distances to the wall: {error}"
        ]
    away = float(middle.closest(line.at_arc_length(_everywhere(line)))[0].max())
    if away < _OFF:
        return middle, []
    return middle, [
        f"the centreline lies up to {away:.2f} mm off the middle of the lumen and was moved there"
    ]


def _check_radii(line: Polyline, wall: MeshDistance, where: str) -> None:
    """``InputError`` for given radii that are not those of this lumen: diameters, say."""
    depths, radii = _depths(line, wall), line.lumen_radius(_everywhere(line))
    ratios = radii / np.maximum(depths, 1e-3)
    usual, share = float(np.median(ratios)), float(np.mean(_between(ratios, _ALLOWED_RATIOS)))
    if _between(usual, _USUAL_RATIOS) and share >= 0.9:
        return
    raise InputError(
        f"{where} has radii of {radii.min():.3g} to {radii.max():.3g} mm, must be those of the "
        f"lumen: the wall is {max(depths.min(), 0.0):.2g} to {depths.max():.2g} mm away, and they "
        f"are {usual:.2g} times that in the median, where {_USUAL_RATIOS[0]} to "
        f"{_USUAL_RATIOS[1]} are allowed"
    )


def _between(values: Any, limits: tuple[float, float]) -> Any:
    return (limits[0] <= values) & (values <= limits[1])


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
    return -wall.distance(line.at_arc_length(_everywhere(line)))


def _everywhere(line: Polyline) -> Array:
    """Arc lengths (200,) mm evenly along a line."""
    return np.linspace(0.0, line.length, 200)


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
