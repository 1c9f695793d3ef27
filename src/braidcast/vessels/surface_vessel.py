"""A vessel from files: the wall's surface, its centreline, and the signed distance on a grid.

Reading, repairing and gridding a surface takes seconds; what comes out is kept in a file beside
it, under a name that changes with everything it depends on.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from braidcast.cache_folder import cache_folder
from braidcast.errors import InputError
from braidcast.kept_arrays import keep, read_kept
from braidcast.vessels.centreline import as_rows
from braidcast.vessels.centreline_file import ENDINGS as CENTRELINES
from braidcast.vessels.distance_grid import DistanceGrid
from braidcast.vessels.extension import extended
from braidcast.vessels.grid_spacing import EXTENSION, usual_spacing
from braidcast.vessels.input_file import checked_ending
from braidcast.vessels.lumen_surface import LumenSurface, Opening
from braidcast.vessels.mesh_distance import MeshDistance
from braidcast.vessels.polyline import Polyline
from braidcast.vessels.surface_centreline import centreline_of
from braidcast.vessels.surface_file import ENDINGS as SURFACES
from braidcast.vessels.surface_file import read_surface
from braidcast.vessels.wording import about

if TYPE_CHECKING:
    from braidcast.vessels.sacs import Sac

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]
"""Called with the stage, of ``STAGES``, and the share of it that is done."""

_FARTHEST_END = 1000.0

STAGES = ("surface", "centreline", "distance")


@dataclass(frozen=True)
class SurfaceSource:
    """The files of a vessel, and how to read them; what the fields of ``[vessel]`` say."""

    surface: str
    units: str = "mm"
    centreline: str | None = None
    ends: tuple[tuple[float, float, float], tuple[float, float, float]] | None = None
    spacing: float | None = None
    """Of the grid, mm; chosen from the wire and the vessel if None."""
    wire_radius: float = 0.014

    def __post_init__(self) -> None:
        for end in self.ends or ():
            if not all(abs(x) <= _FARTHEST_END for x in end):  # NaN is not either
                raise InputError(
                    f"ends = {' and '.join(f'{list(end)}' for end in self.ends or ())} must be two "
                    f"points of three numbers of mm from -{_FARTHEST_END:g} to {_FARTHEST_END:g}"
                )


@dataclass(frozen=True, eq=False)
class SurfaceVessel:
    """A lumen of any shape: the methods of ``SaccularVessel``, and what is known of its wall."""

    name: str
    surface: LumenSurface
    centreline: Polyline
    grid: DistanceGrid
    centreline_found: bool
    """Whether the centreline was found from the surface, not given."""
    remarks: tuple[str, ...] = ()
    aneurysm: Sac | None = None

    def with_aneurysm(self, sac: Sac | None) -> SurfaceVessel:
        """The same vessel with a region that counts as its sac."""
        return replace(self, aneurysm=sac)

    def evaluate(self, points: Array) -> tuple[Array, Array, Array]:
        """Signed distance (n,) mm, gradient (n, 3) and Hessian (n, 3, 3) 1/mm, from the grid.

        ``OutsideGrid`` for a point farther from the vessel than the grid reaches.
        """
        return self.grid.evaluate(points)

    def distance(self, points: ArrayLike) -> Array:
        """Exact signed distance (n,) mm of points (n, 3) to the wall, negative inside."""
        return self._wall.distance(as_rows(points))

    def parent_distance(self, points: ArrayLike) -> Array:
        """Signed distance (n,) mm of points (n, 3) to the wall of the parent vessel alone.

        The parent vessel is the tube about the centreline with its lumen's radius.
        """
        away, along = self.centreline.closest(points)
        return away - self.centreline.lumen_radius(along)

    @cached_property
    def _wall(self) -> MeshDistance:
        with about(f"surface = {self.name}"):
            return MeshDistance(extended(self.surface, EXTENSION))


def load_vessel(source: SurfaceSource, progress: Progress | None = None) -> SurfaceVessel:
    """The vessel of a surface: read, repaired, its centreline and distance made or taken from disk.

    ``InputError``, beginning with the field, for whatever is wrong with the files.
    """
    key, path = _key(source), Path(source.surface)
    if key not in _loaded:
        folders, name = (path.parent, cache_folder()), f"{path.stem}.distance-{key}.npz"
        kept = read_kept(folders, name)
        vessel = _restored(path.name, kept) if kept is not None else None
        if vessel is None:
            vessel = _made(source, progress or _no_progress)
            keep(folders, name, _arrays(vessel))
        while len(_loaded) >= _MOST_LOADED:
            del _loaded[next(iter(_loaded))]
        _loaded[key] = vessel
    return _loaded[key]


VERSION = 2
"""Raised whenever the same files would give another vessel."""

_MOST_LOADED = 2
_loaded: dict[str, SurfaceVessel] = {}


def _key(source: SurfaceSource) -> str:
    """Sixteen hexadecimal digits that change with the files and how they are read."""
    how = (VERSION, source.units, source.ends, source.spacing, source.wire_radius)
    digest = hashlib.sha256(repr(how).encode())
    files = (("surface", source.surface, SURFACES), ("centreline", source.centreline, CENTRELINES))
    for field, path, endings in files:
        if path is not None:
            ending = checked_ending(path, field, endings)
            try:
                digest.update(ending.encode() + Path(path).read_bytes())
            except OSError as error:
                reason = error.strerror or error
                raise InputError(f"{field} = {path} cannot be read: {reason}") from None
    return digest.hexdigest()[:16]


def _arrays(vessel: SurfaceVessel) -> dict[str, NDArray[Any]]:
    surface = vessel.surface
    return {
        "vertices": surface.vertices,
        "triangles": surface.triangles,
        "opening_places": np.array([[o.centre, o.normal] for o in surface.openings]),
        "opening_radii": np.array([o.radius for o in surface.openings]),
        "rims": np.concatenate([np.zeros(0, np.int64), *(o.rim for o in surface.openings)]),
        "rim_sizes": np.array([len(o.rim) for o in surface.openings], dtype=np.int64),
        "remarks": np.array([*vessel.remarks, ""]),
        "centreline_found": np.array(vessel.centreline_found),
        **{f"line_{name}": values for name, values in vessel.centreline.arrays().items()},
        **{f"grid_{name}": values for name, values in vessel.grid.arrays().items()},
    }


def _restored(name: str, kept: Mapping[str, NDArray[Any]]) -> SurfaceVessel | None:
    """The vessel of these arrays; None if they are not all there."""

    def part(prefix: str) -> dict[str, NDArray[Any]]:
        return {k.removeprefix(prefix): v for k, v in kept.items() if k.startswith(prefix)}

    try:
        rims = np.split(kept["rims"], np.cumsum(kept["rim_sizes"]))[:-1]
        places, radii = kept["opening_places"], kept["opening_radii"]
        openings = tuple(
            Opening(place[0], place[1], float(radius), rim)
            for place, radius, rim in zip(places, radii, rims, strict=True)
        )
        return SurfaceVessel(
            name,
            LumenSurface(kept["vertices"], kept["triangles"], openings),
            Polyline.from_arrays(part("line_")),
            DistanceGrid.from_arrays(part("grid_")),
            bool(kept["centreline_found"]),
            tuple(str(remark) for remark in kept["remarks"][:-1]),
        )
    except (KeyError, ValueError, IndexError):
        return None


def _no_progress(stage: str, fraction: float) -> None:
    pass


def _made(source: SurfaceSource, report: Progress) -> SurfaceVessel:
    name = Path(source.surface).name
    report("surface", 0.0)
    surface = read_surface(source.surface, source.units)
    where = f"surface = {source.surface}"
    with about(where):
        wall = MeshDistance(extended(surface, EXTENSION))
    report("surface", 1.0)
    report("centreline", 0.0)
    line, remarks = centreline_of(source, surface, wall)
    report("centreline", 1.0)
    with about(where):
        spacing = source.spacing or usual_spacing(surface, source.wire_radius)
        grid = DistanceGrid.of(surface, spacing, partial(report, "distance"))
    report("distance", 1.0)
    return SurfaceVessel(
        name,
        surface,
        line,
        grid,
        source.centreline is None,
        (*surface.remarks, *grid.remarks, *remarks),
    )
