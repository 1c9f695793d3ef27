"""Triangles as they stand in a file, joined: one vertex where several coincide, no triangle twice.

Formats such as STL give each triangle its own corners; what is exactly alike is joined without a
word. Open edges closer to one another than the rounding of such files are joined too: seams.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from braidcast.errors import InputError
from braidcast.vessels.edges import Array, IntArray, area_vectors, edges_of
from braidcast.vessels.wording import counted, place, was

#: Seams are joined that gape by this share of the surface's extent: 0.5 µm for 50 mm.
SEAM = 1e-5
#: Of coordinates in single precision, as most files hold them, with some arithmetic before.
ROUNDING = 4.0 * float(np.finfo(np.float32).eps)


def welded(vertices: Array, triangles: IntArray) -> tuple[Array, IntArray, list[str]]:
    """Vertices, sorted, and triangles without repetition, and remarks on what was done.

    ``InputError`` if a coordinate is no number or no triangle has an area.
    """
    used, corners = np.unique(triangles, return_inverse=True)
    vertices, triangles = vertices[used] + 0.0, corners.reshape(-1, 3)  # + 0.0: no -0.0
    if not np.all(finite := np.isfinite(vertices).all(axis=1)):
        bad = int(np.argmin(finite))
        raise InputError(
            f"has {counted(int(np.sum(~finite)), 'vertex', 'vertices')} without a finite place: "
            f"vertex {used[bad]} is at {place(vertices[bad])}"
        )
    vertices, triangles = _joined(vertices, triangles)
    triangles, flat, double = _distinct(triangles)
    remarks = []
    near = _near(vertices, triangles)
    if len(near):
        before = len(vertices)
        vertices, triangles = _merged(vertices, triangles, near)
        triangles, more_flat, more_double = _distinct(triangles)
        flat, double = flat + more_flat, double + more_double
        number, width = before - len(vertices), 1e3 * SEAM * _extent(vertices)
        remarks.append(
            f"{counted(number, 'vertex', 'vertices')} {was(number)} joined with another "
            f"less than {width:.2g} µm away"
        )
    if flat:
        remarks.append(f"{counted(flat, 'triangle')} without area {was(flat)} removed")
    if double:
        remarks.append(f"{counted(double, 'triangle')} given twice {was(double)} removed once")
    if not np.any(area_vectors(vertices, triangles)):
        raise InputError("holds no triangle that has an area")
    return vertices, triangles, remarks


def _joined(vertices: Array, triangles: IntArray) -> tuple[Array, IntArray]:
    """Vertices sorted by x, y, z, and one for all that are exactly alike."""
    order = np.lexsort(vertices.T[::-1])
    ordered = vertices[order]
    first = np.ones(len(vertices), dtype=bool)
    first[1:] = np.any(ordered[1:] != ordered[:-1], axis=1)
    number = np.empty(len(vertices), dtype=np.int64)
    number[order] = np.cumsum(first) - 1
    return ordered[first], number[triangles]


def _distinct(triangles: IntArray) -> tuple[IntArray, int, int]:
    """Triangles of three different vertices, each once; how many had not, how many were double."""
    a, b, c = triangles.T
    proper = triangles[(a != b) & (b != c) & (c != a)]
    ordered = np.sort(proper, axis=1)
    order = np.lexsort(ordered.T[::-1])
    first = np.ones(len(order), dtype=bool)
    first[1:] = np.any(ordered[order[1:]] != ordered[order[:-1]], axis=1)
    kept = proper[np.sort(order[first])]
    return kept, len(triangles) - len(proper), len(proper) - len(kept)


def _near(vertices: Array, triangles: IntArray) -> IntArray:
    """Pairs (p, 2) to join: across a seam, or at the ends of an edge as short as the rounding."""
    if len(triangles) == 0:
        return np.empty((0, 2), dtype=np.int64)
    edges = edges_of(triangles)
    open_ends = np.unique(edges.ends[edges.count == 1])
    tree = cKDTree(vertices[open_ends])
    across = open_ends[tree.query_pairs(SEAM * _extent(vertices), output_type="ndarray")]
    length = np.linalg.norm(np.diff(vertices[edges.ends], axis=1)[:, 0], axis=1)
    return np.concatenate([across, edges.ends[length < rounding(vertices)]])


def _merged(vertices: Array, triangles: IntArray, pairs: IntArray) -> tuple[Array, IntArray]:
    """One vertex, the first, for all that are linked by ``pairs``."""
    number = len(vertices)
    links = coo_array((np.ones(len(pairs)), tuple(pairs.T)), shape=(number, number))
    _, label = connected_components(links, directed=False)
    _, first, group = np.unique(label, return_index=True, return_inverse=True)
    return _joined(vertices[first], group.reshape(-1)[triangles])


def _extent(vertices: Array) -> float:
    return float(np.max(np.ptp(vertices, axis=0), initial=0.0))


def rounding(vertices: Array) -> float:
    """What single precision leaves uncertain in these coordinates, mm."""
    return ROUNDING * float(np.max(np.abs(vertices), initial=0.0))
