"""Flat lids on the ends of a vessel: found and taken off.

3D Slicer, SimVascular and ``vessel_surface`` close the ends of a vessel. Such a lid is plane, about
as round as a lumen's section, and meets the wall at a sharp edge from which the wall goes back.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from braidcast.vessels.edges import Array, IntArray, area_vectors, edges_of, sides_of
from braidcast.vessels.wording import place

#: Neighbours of one lid are within this angle, and all of it within the larger one of its mean.
STEP, SPREAD = math.radians(2.0), math.radians(5.0)
#: At most this share of a lid's radius is off its plane.
OFF_PLANE = 0.02
#: Share of the disc around it that a lid covers: half of it as an ellipse of axes 2 to 1.
ROUND = 0.4
#: The wall is at least this far bent from the lid's plane, along this share of the edge. Terraces
#: in the surface of a mask of voxels have edges of 45 degrees.
SHARP, ALONG = math.radians(50.0), 0.9
#: Smallest lid, mm, and smallest share of the largest one's radius.
SMALLEST, SHARE = 0.2, 0.2
#: A lid has more sides than what noise makes of two or three triangles.
SIDES = 6


def without_lids(vertices: Array, triangles: IntArray) -> tuple[IntArray, list[str]]:
    """Oriented triangles without the lids, and a remark for each."""
    vectors = area_vectors(vertices, triangles)
    area = np.linalg.norm(vectors, axis=1)
    normals = vectors / np.maximum(area, np.finfo(float).tiny)[:, None]
    pairs = edges_of(triangles).pairs()
    label = _patches(pairs, normals)
    lids: list[tuple[IntArray, float]] = []
    taken = np.zeros(len(triangles), dtype=bool)
    for patch in _candidates(vertices, triangles, normals, pairs, label, area).tolist():
        members = np.flatnonzero(label == patch)
        if taken[members].any():
            continue
        lid = _lid(vertices, triangles, normals, vectors, pairs, members)
        if lid is not None:
            taken[lid] = True
            lids.append((lid, float(np.sum(area[lid]))))
    if not lids or sum(size for _, size in lids) > 0.5 * np.sum(area):  # a box is no vessel
        return triangles, []
    enough = SHARE**2 * max(size for _, size in lids)
    lids = [(lid, size) for lid, size in lids if size >= enough]
    remarks = [
        f"the flat closed end at {place(_middle(vertices, triangles[lid]))}, of radius "
        f"{math.sqrt(size / math.pi):.2f} mm, was opened"
        for lid, size in lids
    ]
    return np.delete(triangles, np.concatenate([lid for lid, _ in lids]), axis=0), sorted(remarks)


def _patches(pairs: IntArray, normals: Array) -> IntArray:
    """A number for each triangle, the same for neighbours that are in a plane, (m,)."""
    one, two = (pairs // 3).T
    level = np.einsum("ij,ij->i", normals[one], normals[two]) > math.cos(STEP)
    links = (np.ones(int(np.sum(level))), (one[level], two[level]))
    m = len(normals)
    _, label = connected_components(coo_array(links, shape=(m, m)), directed=False)
    return label


def _candidates(
    vertices: Array,
    triangles: IntArray,
    normals: Array,
    pairs: IntArray,
    label: IntArray,
    area: Array,
) -> IntArray:
    """Patches that are large enough and have a sharp edge along part of their circumference."""
    one, two = (pairs // 3).T
    ends = vertices[sides_of(triangles)[pairs[:, 0]]]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) * (label[one] != label[two])
    sharp = np.einsum("ij,ij->i", normals[one], normals[two]) < math.cos(SHARP)
    around = sum(np.bincount(label[side], length, label.max() + 1) for side in (one, two))
    bent = sum(np.bincount(label[side], length * sharp, label.max() + 1) for side in (one, two))
    large = np.bincount(label, area) >= math.pi * SMALLEST**2
    return np.flatnonzero(large & (around > 0.0) & (bent >= 0.3 * around))


def _lid(
    vertices: Array,
    triangles: IntArray,
    normals: Array,
    vectors: Array,
    pairs: IntArray,
    members: IntArray,
) -> IntArray | None:
    """The triangles of the lid that ``members`` are, or None if they are none."""
    total = vectors[members].sum(axis=0)
    size = float(np.linalg.norm(total))
    if size < math.cos(SPREAD) * np.sum(np.linalg.norm(vectors[members], axis=1)):
        return None
    normal = total / size
    if np.min(normals[members] @ normal) < math.cos(SPREAD):
        return None
    points = vertices[np.unique(triangles[members])]
    centre = _middle(vertices, triangles[members])
    radius = float(np.max(np.linalg.norm(points - centre, axis=1)))
    if size < ROUND * math.pi * radius**2:
        return None
    if np.max(np.abs((points - centre) @ normal)) > OFF_PLANE * radius:
        return None
    # Slivers between its triangles have normals of their own: what lies in its plane belongs to it.
    corners = vertices[triangles] - centre
    near = np.linalg.norm(corners, axis=2).max(axis=1) <= 1.05 * radius
    level = np.abs(corners @ normal).max(axis=1) <= 0.5 * OFF_PLANE * radius
    faces = normals @ normal > 0.5
    members = np.union1d(members, np.flatnonzero(near & level & faces))
    out = _stands_out(vertices, triangles, normals, pairs, members, centre, normal)
    return members if out else None


def _stands_out(
    vertices: Array,
    triangles: IntArray,
    normals: Array,
    pairs: IntArray,
    members: IntArray,
    centre: Array,
    normal: Array,
) -> bool:
    """Whether the wall goes back from the edge of the lid, sharply."""
    inside = np.zeros(len(triangles), dtype=bool)
    inside[members] = True
    here, there = inside[pairs // 3].T
    pairs = np.where(there[:, None], pairs[:, ::-1], pairs)[here ^ there]
    if len(pairs) < SIDES:
        return False
    sides = vertices[sides_of(triangles)[pairs[:, 0]]]
    length = np.linalg.norm(sides[:, 1] - sides[:, 0], axis=1)
    wall = pairs[:, 1] // 3
    depth = ((vertices[triangles[wall]] - centre) @ normal).min(axis=1)
    sharp = (normals[wall] @ normal < math.cos(SHARP)) & (depth < 0.0)
    return bool(np.sum(length[sharp]) >= ALONG * np.sum(length))


def _middle(vertices: Array, triangles: IntArray) -> Array:
    """Centre of area (3,) of triangles (m, 3)."""
    area = np.linalg.norm(area_vectors(vertices, triangles), axis=1)
    return area @ vertices[triangles].mean(axis=1) / np.sum(area)
