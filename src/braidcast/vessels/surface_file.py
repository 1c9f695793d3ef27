"""The wall of a vessel from a file: STL, PLY, OBJ, VTP or VTK, in any state that can be mended."""

from __future__ import annotations

import logging
import os
import re
import warnings
from pathlib import Path

import numpy as np

from braidcast.errors import InputError
from braidcast.vessels.edges import Array, IntArray
from braidcast.vessels.grid_spacing import COARSEST, grown_size, least_spacing
from braidcast.vessels.input_file import checked_ending
from braidcast.vessels.lumen_surface import LumenSurface
from braidcast.vessels.obj_file import read_obj
from braidcast.vessels.orientation import lumen_radius, pieces_of
from braidcast.vessels.repair import repaired
from braidcast.vessels.units import (
    MILLIMETRES,
    check_extent,
    check_lumen,
    likelier_units,
    millimetres,
)
from braidcast.vessels.vtk_file import ENDINGS as VTK_ENDINGS
from braidcast.vessels.vtk_file import read_vtk_polygons
from braidcast.vessels.wording import about, counted, was

ENDINGS = (".stl", ".ply", ".obj", *VTK_ENDINGS)

_FEWEST = 4
"""Triangles that can enclose a volume."""
_BEGINNING = 512
"""Bytes in which the header of an STL or the first comments of another file lie."""


def read_surface(
    path: str | os.PathLike[str], units: str = "mm", *, closed: bool = False
) -> LumenSurface:
    """The wall that a file holds, mended as ``repaired`` does, in mm.

    ``units``: those of the file, "mm", "cm", "m" or "inch". ``closed``: it is the surface of a part
    of a vessel, of any size, and its flat sides are no ends to open. VTP and VTK files need
    ``braidcast[pictures]``. ``InputError`` if the file cannot be read, is no surface of triangles
    or polygons, has a size that no vessel has in these units, or is damaged beyond mending.
    """
    factor = millimetres(units)
    where = f"surface = {os.fspath(path)}"
    ending = checked_ending(path, "surface", ENDINGS)
    if ending in VTK_ENDINGS:
        vertices, triangles, polygons = read_vtk_polygons(path)
    elif ending == ".obj":
        vertices, triangles, polygons = _read_obj(Path(path), where)
    else:
        vertices, triangles, polygons = _read_by_trimesh(Path(path), ending, where)
    with about(where):
        _check_corners(vertices, triangles)
        vertices = factor * vertices
        if not closed:
            _check_extent_before_repair(vertices, triangles, units)
        surface = repaired(vertices, triangles, open_lids=not closed)
        if not closed:
            _check_vessel(surface, units)
    if polygons == len(triangles):
        return surface
    remark = (
        f"{counted(polygons, 'polygon')} {was(polygons)} split into "
        f"{counted(len(triangles), 'triangle')}"
    )
    return LumenSurface(
        surface.vertices, surface.triangles, surface.openings, (remark, *surface.remarks)
    )


def _check_extent_before_repair(vertices: Array, triangles: IntArray, units: str) -> None:
    """As ``check_extent``, of the vertices (n, 3) mm; a crumb far away does not count."""
    used = vertices[np.unique(triangles)]
    if not np.all(np.isfinite(used)):
        return  # refused by the repair, with its place
    try:
        check_extent(np.ptp(used, axis=0), units)
    except InputError:
        main = _main_part(vertices, triangles)
        check_extent(np.ptp(vertices[np.unique(main)], axis=0), units)


def _main_part(vertices: Array, triangles: IntArray) -> IntArray:
    """The triangles that hang together and have most of the area; all, if none have most of it."""
    joined, same = np.unique(vertices, axis=0, return_inverse=True)
    part, area = pieces_of(joined, same.reshape(-1)[triangles])
    largest = int(np.argmax(area))
    return triangles[part == largest] if area[largest] > 0.5 * area.sum() else triangles


def _check_vessel(surface: LumenSurface, units: str) -> None:
    """Refuse a size that no vessel has, or one too large for a grid that other units make fit."""
    size = np.ptp(surface.vertices, axis=0)
    check_extent(size, units)
    extent, radius = float(size.max()), lumen_radius(surface.vertices, surface.triangles)
    check_lumen(radius, extent, units)
    if least_spacing(grown_size(surface)) <= COARSEST:
        return
    if likelier := likelier_units(extent, radius, units):
        scale = MILLIMETRES[likelier] / MILLIMETRES[units]
        raise InputError(
            f'is {extent:.3g} mm long with a lumen of radius {radius:.2g} mm with units = "{units}"'
            f', too large for a grid: units = "{likelier}" would make it {scale * extent:.3g} mm '
            f"long with {scale * radius:.2g} mm; or cut it to the part of the vessel that is needed"
        )


def declared_axes(path: str | os.PathLike[str]) -> str | None:
    """ "LPS" or "RAS" if a file's beginning says so, as 3D Slicer writes it; None if not."""
    with Path(path).open("rb") as stream:
        found = re.search(rb"SPACE=(LPS|RAS)\b", stream.read(_BEGINNING))
    return found[1].decode() if found else None


def _read_obj(path: Path, where: str) -> tuple[Array, IntArray, int]:
    try:
        with about(where):
            return read_obj(path)
    except OSError as error:
        raise InputError(f"{where} cannot be read: {error.strerror or error}") from None


def _read_by_trimesh(path: Path, ending: str, where: str) -> tuple[Array, IntArray, int]:
    """Vertices, triangles and how many polygons these were."""
    import trimesh  # takes a while to import

    logging.getLogger("trimesh").addHandler(logging.NullHandler())  # or its warnings are printed
    try:
        with path.open("rb") as stream, warnings.catch_warnings():
            warnings.simplefilter("error")  # numbers that trimesh could not read to their end
            scene = trimesh.load_scene(
                stream,
                file_type=ending[1:],
                process=False,
                maintain_order=True,
                skip_materials=True,
            )
        polygons = _polygons(path, ending)
    except OSError as error:
        raise InputError(f"{where} cannot be read: {error.strerror or error}") from None
    except MemoryError:
        raise
    except Exception as error:  # trimesh raises whatever a damaged file leads it to
        reason = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"{where} is damaged or no {ending} file: {reason}") from None
    meshes = [mesh for mesh in scene.geometry.values() if len(getattr(mesh, "faces", ()))]
    if not meshes:
        raise InputError(f"{where} is damaged or holds no triangle")
    vertices = np.concatenate([np.asarray(mesh.vertices, dtype=np.float64) for mesh in meshes])
    first = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes])
    triangles = np.concatenate(
        [
            np.asarray(mesh.faces, dtype=np.int64) + offset
            for mesh, offset in zip(meshes, first, strict=False)
        ]
    )
    return vertices, triangles, len(triangles) if polygons is None else polygons


def _polygons(path: Path, ending: str) -> int | None:
    """How many polygons a file that may hold other than triangles says it has."""
    if ending == ".ply":
        for line in path.read_bytes().split(b"end_header", 1)[0].splitlines():
            if line.startswith(b"element face"):
                return int(line.split()[2])
    return None


def _check_corners(vertices: Array, triangles: IntArray) -> None:
    if len(triangles) == 0:
        raise InputError("is damaged or holds no triangle")
    if triangles.min() < 0 or triangles.max() >= len(vertices):
        raise InputError(
            f"is damaged: a triangle has the vertex {triangles.max()}, "
            f"where there are {len(vertices)}"
        )
    if (number := len(triangles)) < _FEWEST:
        one = "is" if number == 1 else "are"
        raise InputError(
            f"holds {counted(number, 'triangle')}, which {one} no vessel: must be {_FEWEST} or more"
        )
