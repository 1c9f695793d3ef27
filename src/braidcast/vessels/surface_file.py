"""The wall of a vessel from a file: STL, PLY, OBJ, VTP or VTK, in any state that can be mended."""

from __future__ import annotations

import logging
import os
import warnings
from pathlib import Path

import numpy as np

from braidcast.errors import InputError
from braidcast.vessels.edges import Array, IntArray
from braidcast.vessels.input_file import checked_ending
from braidcast.vessels.lumen_surface import LumenSurface
from braidcast.vessels.orientation import lumen_radius
from braidcast.vessels.repair import repaired
from braidcast.vessels.units import check_extent, check_lumen, millimetres
from braidcast.vessels.vtk_file import ENDINGS as VTK_ENDINGS
from braidcast.vessels.vtk_file import read_vtk_polygons
from braidcast.vessels.wording import counted, was

ENDINGS = (".stl", ".ply", ".obj", *VTK_ENDINGS)


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
    else:
        vertices, triangles, polygons = _read_by_trimesh(Path(path), ending, where)
    try:
        _check_corners(vertices, triangles)
        used = factor * vertices[np.unique(triangles)]
        if np.all(np.isfinite(used)) and not closed:  # what is not is refused below, with its place
            check_extent(np.ptp(used, axis=0), units)
        surface = repaired(factor * vertices, triangles, open_lids=not closed)
        if not closed:
            extent = float(np.max(np.ptp(surface.vertices, axis=0)))
            check_lumen(lumen_radius(surface.vertices, surface.triangles), extent, units)
    except InputError as error:
        raise InputError(f"{where} {error}") from None
    if polygons == len(triangles):
        return surface
    remark = (
        f"{counted(polygons, 'polygon')} {was(polygons)} split into "
        f"{counted(len(triangles), 'triangle')}"
    )
    return LumenSurface(
        surface.vertices, surface.triangles, surface.openings, (remark, *surface.remarks)
    )


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
    if ending == ".obj":
        return sum(line.lstrip().startswith(b"f ") for line in path.read_bytes().splitlines())
    if ending == ".ply":
        for line in path.read_bytes().split(b"end_header", 1)[0].splitlines():
            if line.startswith(b"element face"):
                return int(line.split()[2])
    return None


def _check_corners(vertices: Array, triangles: IntArray) -> None:
    if len(triangles) == 0:
        raise InputError("holds no triangle")
    if triangles.min() < 0 or triangles.max() >= len(vertices):
        raise InputError(
            f"is damaged: a triangle has the vertex {triangles.max()}, "
            f"where there are {len(vertices)}"
        )
