"""From the triangles of a file to the wall of a vessel: mended where that is safe, or refused."""

from __future__ import annotations

import numpy as np

from braidcast.vessels.crumbs import refuse_serious
from braidcast.vessels.edges import Array, IntArray
from braidcast.vessels.holes import holes_and_openings, opening
from braidcast.vessels.lids import without_lids
from braidcast.vessels.lumen_surface import LumenSurface
from braidcast.vessels.orientation import largest_piece, oriented
from braidcast.vessels.self_intersection import refuse_self_intersection
from braidcast.vessels.slivers import without_slivers
from braidcast.vessels.weld import welded


def repaired(vertices: Array, triangles: IntArray, *, open_lids: bool = True) -> LumenSurface:
    """The wall that vertices (n, 3) mm and triangles (m, 3) in any state are meant to be.

    Joins vertices and seams; removes triangles that are double or have no area, and loose crumbs;
    turns triangles outwards; opens flat lids, if told to; fills small holes in the wall. Each of
    these leaves a remark. The order of the triangles given and their facing make no difference to
    the result, whose openings come by falling size. A closed surface without flat lids has none.

    ``InputError``, its text to follow the surface's name, for what cannot be mended: coordinates
    that are no numbers, no area, several pieces, edges of three triangles, one side only, large
    holes, open edges that are no ends, a wall that passes through itself, a loose piece that passes
    through the wall or is a body in the lumen.
    """
    vertices, triangles, remarks = welded(
        np.asarray(vertices, dtype=np.float64), np.asarray(triangles, dtype=np.int64)
    )
    triangles, loose, left_out = largest_piece(vertices, triangles)
    crumbs = vertices[loose]
    triangles, turned = oriented(vertices, triangles)
    triangles, thinned = without_slivers(vertices, _canonical(triangles))
    triangles, opened = without_lids(vertices, triangles) if open_lids else (triangles, [])
    if opened:
        # What may have been inside a lid is gone.
        triangles = largest_piece(vertices, triangles)[0]
    vertices, triangles, rims, filled = holes_and_openings(vertices, triangles)
    creased = refuse_self_intersection(vertices, triangles)

    used, corners = np.unique(triangles, return_inverse=True)
    vertices = vertices[used]
    openings = [opening(vertices, np.searchsorted(used, _from_smallest(rim))) for rim in rims]
    # To a µm, or what rounding leaves would decide between two that are equally large.
    openings.sort(key=lambda end: (-round(end.radius, 3), *end.centre.round(3).tolist()))
    if not openings and open_lids:
        filled.append("the surface is closed: it has no opening and no flat end to open")
    surface = LumenSurface(
        vertices=vertices,
        triangles=_canonical(corners.reshape(-1, 3)),
        openings=tuple(openings),
        remarks=(*remarks, *left_out, *turned, *thinned, *opened, *filled, *creased),
    )
    refuse_serious(crumbs, surface)
    return surface


def _canonical(triangles: IntArray) -> IntArray:
    """Each triangle from its smallest corner, and all of them sorted."""
    first = np.argmin(triangles, axis=1)
    turned = np.take_along_axis(triangles, (first[:, None] + np.arange(3)) % 3, axis=1)
    return turned[np.lexsort(turned.T[::-1])]


def _from_smallest(rim: IntArray) -> IntArray:
    return np.roll(rim, -int(np.argmin(rim)))
