"""The centreline of a vessel's lumen between two ends, found in its signed distance.

A path through the lumen is moved to the middle of the tube that the wall around it lies on.
Aneurysms and side branches, whose wall is farther away, do not count: where they leave too little
of the vessel's own wall, centre and radius go on smoothly from the sections on either side.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from braidcast.errors import InputError
from braidcast.vessels.cross_sections import wall_points
from braidcast.vessels.lumen_path import Distance, lumen_path
from braidcast.vessels.polyline import Polyline
from braidcast.vessels.tube_fit import LEAST_SEEN, Sections, fitted
from braidcast.vessels.wording import place

Array = NDArray[np.float64]

# All lengths in radii of the vessel.
_STATION = 0.2
_REACH = 2.5
"""Farther than this from the centre no wall is looked for."""
_STAGES = ((0.5, 1.2, 4.0), (0.25, 1.0, 3.0), (0.12, 0.8, 2.0), (0.06, 0.65, 1.0))
"""Tolerance of the wall's misses and smoothing lengths of centre and radius: a stiff tube that
bridges an aneurysm settles before a finer one follows the wall."""
_STIFFNESS = (0.4, 0.35)
"""The smoothing lengths at last."""
_TOLERANCES = (0.02, 0.2)
"""Least and largest tolerance at last: twice the scatter of the wall, which need not be round."""
_BETWEEN = 0.12
"""Smoothing length of the line through the sections' centres, already smooth."""
_LONGEST_HIDDEN = 4.0
_LARGEST_DOUBT = 0.18
"""Of the centre's place: what another measure of smoothness makes of it, usually 5 to 10 times
what is in truth missed."""
_LEAST_DEPTH = 0.6
"""Of the centre of a section with its wall all around, away from the ends."""

_MOST_ROUNDS = 12
_SETTLED_MM = 0.005
_GIVE_IT = "give the centreline by `vessel.centreline`"


def find_centreline(
    distance: Distance, bounds: ArrayLike, ends: ArrayLike, end_radii: ArrayLike | None = None
) -> Polyline:
    """Centreline with lumen radii of the parent vessel from near ends[0] to near ends[1].

    ``distance`` gives the signed distance (n,) mm at points (n, 3), negative in the lumen, which
    ``bounds`` (2, 3) mm hold. ``ends`` (2, 3) mm lie in the lumen or near its wall; the line is
    cut where it is nearest to them. ``end_radii`` (2,) mm are those of the lumen there; without
    them they are those of the largest balls that hold the ends.

    ``InputError``, beginning with ``ends``, if one is not in the lumen, the lumen does not join
    them, or the result is doubtful: the wall is hidden along more than two diameters, or is not
    that of a tube.
    """
    bounds, ends = np.asarray(bounds, dtype=np.float64), np.asarray(ends, dtype=np.float64)
    given = None if end_radii is None else np.asarray(end_radii, dtype=np.float64)
    try:
        return _found(distance, bounds, ends, given)
    except InputError as error:
        raise InputError(f"ends = {place(ends[0])} and {place(ends[1])}: {error}") from None


def centred(distance: Distance, line: Polyline) -> Polyline:
    """A line through the lumen moved to its middle, with the radii of the tube around it.

    ``InputError`` if the result is doubtful, as that of ``find_centreline``.
    """
    places = line.at_arc_length(np.linspace(0.0, line.length, max(8, int(line.length / 0.25))))
    ends = places[[0, -1]]
    return _settled(distance, places, ends, np.maximum(-distance(ends), 0.1))


def _found(distance: Distance, bounds: Array, ends: Array, given: Array | None) -> Polyline:
    path, radii = lumen_path(distance, bounds, ends, given)
    return _settled(distance, path, ends, radii)


def _settled(distance: Distance, path: Array, ends: Array, radii: Array) -> Polyline:
    """The middle of the tube about a path (n, 3), between ends (2, 3) with rough radii (2,)."""
    typical = float(radii.mean())
    apart = float(np.linalg.norm(ends[1] - ends[0]))
    if apart < 2.0 * typical or len(path) < 4:
        raise InputError(
            f"they are {apart:.3g} mm apart, must be more than {2.0 * typical:.3g} mm, the "
            "diameter of the lumen"
        )
    line = Polyline.through(path, smoothing=typical)
    s = _stations(line, ends, typical)
    r = np.interp(s, [0.0, line.length], radii)

    # The tolerance at last is not known before the scatter of the wall is.
    least = _TOLERANCES[0]
    for number in range(len(_STAGES) + _MOST_ROUNDS):
        last = number >= len(_STAGES)
        tolerance, bend, swell = (0.0, *_STIFFNESS) if last else _STAGES[number]
        fit = (max(tolerance, least), bend * typical, swell * typical)
        sections = _sections(distance, line, s, r)
        centres, radii, share = fitted(sections, *fit)
        moved = float(np.linalg.norm(centres - sections.centres, axis=1).max())
        line = Polyline.through(centres, radii, smoothing=_BETWEEN * typical)
        if last and moved < _SETTLED_MM:
            break
        least = float(np.clip(2.0 * _scatter(sections, centres, radii), *_TOLERANCES))
        s = _stations(line, ends, typical)
        r = line.lumen_radius(s)
    # Where wall is missing another measure of smoothness leads elsewhere.
    other = fitted(sections, *fit, order=2)[0]
    doubt = np.maximum(np.linalg.norm(other - centres, axis=1), moved)
    _refuse_doubtful(distance, sections, centres, radii, share, doubt / radii)
    _refuse_far_ends(line, ends)
    return line


def _stations(line: Polyline, ends: Array, typical: float) -> Array:
    """Arc lengths from the place nearest to ends[0] to that nearest to ends[1], evenly spaced.

    They may lie beyond the line, by a diameter at most.
    """
    half, beyond = 0.5 * line.length, 2.0 * typical
    limits = []
    for end, way in zip(
        ends, (np.linspace(-beyond, half), np.linspace(half, half + half + beyond)), strict=True
    ):
        s = way[np.argmin(np.linalg.norm(line.at_arc_length(way) - end, axis=1))]
        for _ in range(5):
            ahead = float((end - line.at_arc_length(s)[0]) @ line.tangent_at_arc_length(s)[0])
            s = float(np.clip(s + ahead, way[0], way[-1]))
        limits.append(s)
    first, last = limits
    return np.linspace(first, last, 1 + max(8, int(np.ceil((last - first) / (_STATION * typical)))))


def _sections(distance: Distance, line: Polyline, s: Array, r: Array) -> Sections:
    centres, tangents = line.at_arc_length(s), line.tangent_at_arc_length(s)
    wall, seen = wall_points(distance, centres, tangents, _REACH * r)
    # A lid over the end is not the wall.
    at_end = np.minimum(s - s[0], s[-1] - s) < 1.5 * r
    seen[at_end & (-distance(centres) < 0.5 * r)] = False
    return Sections(s, tangents, centres, r, wall, seen)


def _scatter(sections: Sections, centres: Array, r: Array) -> float:
    """Root mean square of the wall's misses, in radii, of the usual section without an opening."""
    relative = sections.misses(centres, r)[0] / r[:, None]
    whole = (sections.seen & (np.abs(relative) < 0.5)).all(axis=1)
    if not whole.any():
        return 0.0
    return float(np.median(np.sqrt((relative[whole] ** 2).mean(axis=1))))


def _refuse_doubtful(
    distance: Distance, sections: Sections, centres: Array, r: Array, share: Array, doubt: Array
) -> None:
    """``InputError`` if too much wall is hidden, ``doubt`` (m,) is large or a wall is too near."""
    hidden = share < LEAST_SEEN
    step = sections.u[1] - sections.u[0]
    edges = np.flatnonzero(np.diff(np.concatenate([[0], hidden.astype(int), [0]])))
    for first, stop in edges.reshape(-1, 2):
        middle = (first + stop - 1) // 2
        if (stop - first) * step > _LONGEST_HIDDEN * r[middle]:
            raise InputError(
                f"no centreline found: the vessel's wall cannot be told for "
                f"{(stop - first) * step:.3g} mm about {place(centres[middle])}; {_GIVE_IT}"
            )
    worst = int(np.argmax(doubt))
    if doubt[worst] > _LARGEST_DOUBT:
        raise InputError(
            f"no centreline found: its place near {place(centres[worst])} is uncertain by "
            f"{doubt[worst] * r[worst]:.2g} mm; {_GIVE_IT}"
        )
    depth = -distance(centres) / r
    at_end = np.minimum(sections.u - sections.u[0], sections.u[-1] - sections.u) < 1.5 * r
    shallow = np.where(at_end | (share < 0.9), 1.0, depth)
    worst = int(np.argmin(shallow))
    if shallow[worst] < _LEAST_DEPTH:
        raise InputError(
            f"no centreline found: near {place(centres[worst])} the wall is "
            f"{depth[worst] * r[worst]:.3g} mm from the middle of a vessel of radius "
            f"{r[worst]:.3g} mm; {_GIVE_IT}"
        )


def _refuse_far_ends(line: Polyline, ends: Array) -> None:
    for name, end, middle, s in zip(
        ("first", "second"), ends, (line.start, line.end), (0.0, line.length), strict=True
    ):
        away, radius = float(np.linalg.norm(end - middle)), float(line.lumen_radius(s)[0])
        if away > 1.5 * radius:
            raise InputError(
                f"the {name} is {away:.3g} mm from the middle of the vessel, must be less than "
                f"{1.5 * radius:.3g} mm"
            )
