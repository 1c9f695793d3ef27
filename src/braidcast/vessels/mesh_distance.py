"""Exact signed distance to a surface of triangles.

The nearest triangle is looked up with fcpw (Sawhney, 2021) in single precision and made exact, with
the sign, by ``vessels.mesh_kernels``.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from braidcast.errors import InputError
from braidcast.vessels import mesh_kernels
from braidcast.vessels.centreline import as_rows
from braidcast.vessels.lumen_surface import LumenSurface

Array = NDArray[np.float64]

# Points looked up at a time: fcpw makes an object of some 100 bytes for each.
_CHUNK = 200_000


class MeshDistance:
    """Signed distance to the triangles of a surface, negative on the side of the lumen.

    Exact to double precision, except that of two walls whose distances differ by less than single
    precision resolves (some 1e-6 of the surface's size) either may be taken. ``InputError``, its
    text to follow the surface's name, if fcpw is not installed.
    """

    def __init__(self, surface: LumenSurface) -> None:
        vertices = np.require(surface.vertices, np.float64, ["C", "W"])
        triangles = np.require(surface.triangles, np.int64, ["C", "W"])
        self._middle = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
        self._scene = _scene(vertices - self._middle, triangles)
        outward = np.zeros_like(vertices)
        for opening in surface.openings:
            outward[opening.rim] = opening.normal
        self._mesh = (
            vertices,
            triangles,
            *mesh_kernels.vertex_triangles(triangles, len(vertices)),
            *_normals(vertices, triangles),
            outward,
        )

    def distance(self, points: ArrayLike) -> Array:
        """Signed distance (n,) mm at points (n, 3).

        Beyond an open end, where its rim is the nearest wall, the wall is taken to go on along the
        opening's normal; exact if the rim is plane and square to it, as ``extended`` makes it.
        """
        return self.distance_and_overrun(points)[0]

    def distance_and_overrun(self, points: ArrayLike) -> tuple[Array, Array]:
        """Signed distance (n,) and how far beyond an open end (n,) each point is, mm.

        The overrun is 0 wherever the nearest wall is not the rim of an opening. ``ValueError`` for
        points that are not finite.
        """
        points = as_rows(points)
        if not np.isfinite(points).all():
            raise ValueError("points must be finite")
        distance, overrun = np.empty(len(points)), np.empty(len(points))
        for first in range(0, len(points), _CHUNK):
            part = slice(first, first + _CHUNK)
            mesh_kernels.nearest(
                points[part],
                self._near_triangle(points[part]),
                *self._mesh,
                distance[part],
                overrun[part],
            )
        return distance, overrun

    def _near_triangle(self, points: Array) -> NDArray[np.int64]:
        import fcpw

        found = fcpw.py.interaction_3D_list()
        self._scene.find_closest_points(  # type: ignore[attr-defined]
            np.asfortranarray(points - self._middle, dtype=np.float32),
            np.full(len(points), np.inf, dtype=np.float32),
            found,
            True,
        )
        return np.fromiter((f.primitive_index for f in found), np.int64, len(points))


def _scene(vertices: Array, triangles: NDArray[np.int64]) -> object:
    try:
        import fcpw
    except ImportError as problem:
        raise InputError(
            "needs the package fcpw to be used, which is not installed or has no build for this "
            "machine"
        ) from problem
    scene = fcpw.scene_3D()
    scene.set_object_count(1)
    scene.set_object_vertices(np.asfortranarray(vertices, dtype=np.float32), 0)
    scene.set_object_triangles(np.asfortranarray(triangles, dtype=np.int32), 0)
    scene.build(fcpw.py.aggregate_type.bvh_surface_area, True)
    return scene


def _normals(
    vertices: Array, triangles: NDArray[np.int64]
) -> tuple[Array, Array, Array, NDArray[np.bool_]]:
    """Normals of faces (m, 3), edges (m, 3, 3), corners (n, 3); edges on a rim (m, 3)."""
    corners = vertices[triangles]
    sides = np.roll(corners, -1, axis=1) - corners
    faces = np.cross(sides[:, 0], sides[:, 1])
    size = np.linalg.norm(faces, axis=1, keepdims=True)
    # A triangle without area has no side to be on; its neighbours decide.
    faces = np.divide(faces, size, out=np.zeros_like(faces), where=size > 0.0)

    before = -np.roll(sides, 1, axis=1)
    sine = np.linalg.norm(np.cross(sides, before), axis=2)
    angles = np.arctan2(sine, np.einsum("tki,tki->tk", sides, before))
    weighted = angles[:, :, None] * faces[:, None]
    at_vertices: Array = np.stack(
        [
            np.bincount(triangles.ravel(), weighted[:, :, axis].ravel(), len(vertices))
            for axis in range(3)
        ],
        axis=1,
    )

    ends = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2)
    keys = np.minimum(ends[:, 0], ends[:, 1]) * len(vertices) + np.maximum(ends[:, 0], ends[:, 1])
    _, edge, uses = np.unique(keys, return_inverse=True, return_counts=True)
    of_face = np.repeat(faces, 3, axis=0)
    at_edges: Array = np.stack([np.bincount(edge, of_face[:, k]) for k in range(3)], axis=1)
    return faces, at_edges[edge].reshape(-1, 3, 3), at_vertices, (uses[edge] == 1).reshape(-1, 3)
