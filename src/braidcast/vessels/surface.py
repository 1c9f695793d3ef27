"""The lumen's surface as triangles, and its STL file.

Vertices lie on the exact wall of the vessel, at the neck on its rounded edge.
"""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import TYPE_CHECKING

import manifold3d
import numpy as np
from numpy.typing import ArrayLike, NDArray

from braidcast.atomic import write_atomically
from braidcast.errors import InputError
from braidcast.vessels.neck_surface import rounded_neck
from braidcast.vessels.parametric import SaccularVessel, Tube

if TYPE_CHECKING:
    from braidcast.vessels.surface_vessel import SurfaceVessel

Triangles = tuple[NDArray[np.float64], NDArray[np.int64]]

_STL_TRIANGLE = np.dtype(
    [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")], align=False
)

FLAT = 3e-4
"""The finest bumps of the rounded neck that stay, mm."""


def vessel_surface(vessel: SaccularVessel | SurfaceVessel, facets: int = 120) -> Triangles:
    """Watertight surface of tube, from P0 to P2 and closed there, and aneurysm.

    Of a vessel that came from a surface that surface, as it was repaired, open at its ends.

    Returns vertices (n, 3) mm and triangles (m, 3), anticlockwise seen from outside. ``facets``
    go around the tube; they make it too narrow by up to R (1 − cos π/facets), 0.7 µm for
    R = 2 mm and 120 facets. ``InputError`` for fewer than 100.
    """
    if not isinstance(vessel, SaccularVessel):
        return vessel.surface.vertices, vessel.surface.triangles
    if facets < 100:
        raise InputError(f"facets = {facets} must be 100 or more, or the tube is too narrow")
    body = _solid(*_tube_surface(vessel.tube, facets))
    if vessel.aneurysm is not None:
        sphere = manifold3d.Manifold.sphere(vessel.aneurysm.radius, facets)
        body += sphere.translate(vessel.aneurysm.centre.tolist())
    vertices, triangles = _mesh(body)
    if vessel.aneurysm is None or vessel.neck_fillet == 0.0:
        return vertices, triangles
    return _mesh(_solid(*rounded_neck(vessel, vertices, triangles)).simplify(FLAT))


def _tube_surface(tube: Tube, facets: int) -> Triangles:
    """The tube alone: rings of ``facets`` vertices across the centreline and a fan at each end."""
    curve, radius = tube.centreline, tube.radius
    # As flat along the bend as around, and no triangle longer than eight times its width.
    sag = radius * (1.0 - math.cos(math.pi / facets))
    step = 16.0 * math.pi * radius / facets
    if curve.max_curvature > 0.0:
        step = min(step, math.sqrt(8.0 * sag / curve.max_curvature))
    stations = math.ceil(curve.length / step) + 1
    s = np.linspace(0.0, curve.length, stations)
    centres, tangents = curve.at_arc_length(s), curve.tangent_at_arc_length(s)
    # A quadratic curve is plane: its binormal is the same all along.
    binormal = _binormal(tangents)
    normals = np.cross(binormal, tangents)
    angle = np.arange(facets) * (2.0 * np.pi / facets)
    spokes = normals[:, None] * np.cos(angle)[:, None] + binormal * np.sin(angle)[:, None]
    rings = (centres[:, None] + radius * spokes).reshape(-1, 3)
    vertices = np.concatenate([rings, centres[:1], centres[-1:]])

    here = np.arange(stations * facets).reshape(stations, facets)
    right = np.roll(here, -1, axis=1)
    first, last = len(rings), len(rings) + 1
    a, b, c, d = (part.ravel() for part in (here[:-1], right[:-1], right[1:], here[1:]))
    start, end = np.full(facets, first), np.full(facets, last)
    corners = [(a, b, c), (a, c, d)] + [(start, right[0], here[0])] + [(end, here[-1], right[-1])]
    triangles = np.concatenate([np.stack(corner, axis=1) for corner in corners])
    return vertices, triangles


def _binormal(tangents: NDArray[np.float64]) -> NDArray[np.float64]:
    """Unit vector square to all ``tangents`` (n, 3) of a plane curve."""
    across = np.cross(tangents[0], tangents[-1])
    if np.linalg.norm(across) < 1e-9:
        across = np.cross(tangents[0], np.eye(3)[np.argmin(np.abs(tangents[0]))])
    return across / np.linalg.norm(across)


def _mesh(body: manifold3d.Manifold) -> Triangles:
    mesh = body.to_mesh64()
    return np.array(mesh.vert_properties[:, :3]), np.array(mesh.tri_verts, dtype=np.int64)


def _solid(vertices: NDArray[np.float64], triangles: NDArray[np.int64]) -> manifold3d.Manifold:
    solid = manifold3d.Manifold(manifold3d.Mesh64(vertices, triangles.astype(np.uint64)))
    if solid.status() != manifold3d.Error.NoError:
        raise RuntimeError(f"the tube's surface is no closed solid: {solid.status()}")
    return solid


def write_stl(path: str | os.PathLike[str], vertices: ArrayLike, triangles: ArrayLike) -> None:
    """Write a binary STL file from vertices (n, 3) and triangles (m, 3).

    The file appears under its name complete or not at all. ``OSError`` if it cannot be written.
    """
    corners = np.asarray(vertices, dtype=np.float64)[np.asarray(triangles)]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(normals, axis=1, keepdims=True)
    records = np.zeros(len(corners), dtype=_STL_TRIANGLE)
    records["normal"] = np.divide(normals, size, out=np.zeros_like(normals), where=size > 0.0)
    records["corners"] = corners
    header = b"braidcast lumen surface, mm".ljust(80)
    write_atomically(
        Path(path), header + np.array(len(records), dtype="<u4").tobytes() + records.tobytes()
    )
