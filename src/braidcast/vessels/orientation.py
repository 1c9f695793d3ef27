"""One piece of surface, its triangles facing the same way, outwards."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order, connected_components

from braidcast.errors import InputError
from braidcast.vessels.edges import (
    Array,
    IntArray,
    area_vectors,
    boundary_loops,
    edges_of,
    sides_of,
)
from braidcast.vessels.wording import counted, place, was

#: A second piece of more than this share of the first one's area is no crumb.
CRUMB = 0.2


def pieces_of(vertices: Array, triangles: IntArray) -> tuple[IntArray, Array]:
    """The piece (m,) that each triangle belongs to, and the area of each piece, mm².

    Triangles hang together at edges.
    """
    edges = edges_of(triangles)
    # Each triangle is linked with the edges it has.
    m, e = len(triangles), len(edges.ends)
    links = (np.ones(3 * m), (np.arange(3 * m) // 3, m + edges.of_side))
    pieces, label = connected_components(coo_array(links, shape=(m + e, m + e)), directed=False)
    size = np.linalg.norm(area_vectors(vertices, triangles), axis=1)
    of_triangle = label[:m].astype(np.int64)
    return of_triangle, np.bincount(of_triangle, size, pieces).astype(np.float64)


def largest_piece(vertices: Array, triangles: IntArray) -> tuple[IntArray, IntArray, list[str]]:
    """The triangles of the piece with the largest area, those left out, and a remark on them.

    ``InputError`` if another has more than a fifth of its area.
    """
    label, area = pieces_of(vertices, triangles)
    pieces = len(area)
    if pieces == 1:
        return triangles, triangles[:0], []
    order = np.argsort(-area, kind="stable")
    second = triangles[label == order[1]]
    where = place(vertices[second].mean(axis=(0, 1)))
    if area[order[1]] > CRUMB * area[order[0]]:
        raise InputError(
            f"is in {pieces} separate pieces: the second, around {where}, has "
            f"{100.0 * area[order[1]] / area[order[0]]:.0f} % of the area of the first, where "
            f"at most {100.0 * CRUMB:.0f} % are left out as a crumb"
        )
    crumbs, left_out = pieces - 1, int(np.sum(label != order[0]))
    remark = (
        f"{counted(crumbs, 'loose piece')} of {counted(left_out, 'triangle')} {was(crumbs)} "
        f"left out, the largest around {where}"
    )
    return triangles[label == order[0]], triangles[label != order[0]], [remark]


def oriented(vertices: Array, triangles: IntArray) -> tuple[IntArray, list[str]]:
    """The triangles of one piece, all facing outwards, and a remark if any did not.

    Outwards is what makes the volume positive once each open edge is closed by a fan.
    ``InputError`` where three triangles meet at an edge, or if the surface has one side only.
    """
    edges = edges_of(triangles)
    if np.any(many := edges.count > 2):
        where = place(vertices[edges.ends[many][0]].mean(axis=0))
        raise InputError(
            f"has {counted(int(np.sum(many)), 'edge')} with three or more triangles, where a wall "
            f"has one or two: the first is at {where}"
        )
    pairs = edges.pairs()
    sides = sides_of(triangles)
    against = np.all(sides[pairs[:, 0]] == sides[pairs[:, 1]], axis=1)
    turned = _turned(len(triangles), pairs // 3, against)
    unequal = turned[pairs[:, 0] // 3] ^ turned[pairs[:, 1] // 3] ^ against
    if np.any(unequal):
        where = place(vertices[sides[pairs[unequal][0, 0]]].mean(axis=0))
        raise InputError(f"has one side only, as a Möbius band has: seen at {where}")
    result = _flipped(triangles, turned)
    if enclosed_volume(vertices, result) < 0.0:
        turned = ~turned
        result = _flipped(triangles, turned)
    number, total = int(np.sum(turned)), len(triangles)
    if number == total:
        return result, ["all triangles faced into the lumen and were turned"]
    if number:
        return result, [f"{number} of {total} triangles faced into the lumen and were turned"]
    return result, []


def enclosed_volume(vertices: Array, triangles: IntArray) -> float:
    """Volume, mm³, with each open edge closed by a fan; negative if the triangles face inwards."""
    corners = vertices[triangles] - vertices.mean(axis=0)
    volume = np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))
    for loop in boundary_loops(triangles):
        rim = vertices[loop] - vertices.mean(axis=0)
        # A lid runs round its rim the other way than the wall does.
        volume += np.sum(np.cross(np.roll(rim, -1, axis=0), rim) @ rim.mean(axis=0))
    return float(volume) / 6.0


def lumen_radius(vertices: Array, triangles: IntArray) -> float:
    """Twice the volume over the wall's area, mm: the radius, if the lumen is a tube."""
    area = np.sum(np.linalg.norm(area_vectors(vertices, triangles), axis=1))
    return 2.0 * enclosed_volume(vertices, triangles) / float(area)


def _turned(number: int, neighbours: IntArray, against: np.ndarray) -> np.ndarray:
    """Which of ``number`` triangles to turn so that all agree with the first, (number,) bool."""
    if len(neighbours) == 0:
        return np.zeros(number, dtype=bool)
    link = 1.0 + against
    graph = coo_array((link, tuple(neighbours.T)), shape=(number, number)).tocsr()
    graph = graph.maximum(graph.T).tocsr()
    order, parent = breadth_first_order(graph, 0, directed=False)
    steps = np.asarray(graph[order[1:], parent[order[1:]]]).ravel() > 1
    turned = [False] * number
    for triangle, before, step in zip(
        order[1:].tolist(), parent[order[1:]].tolist(), steps.tolist(), strict=True
    ):
        turned[triangle] = turned[before] ^ step
    return np.array(turned)


def _flipped(triangles: IntArray, turned: np.ndarray) -> IntArray:
    return np.where(turned[:, None], triangles[:, ::-1], triangles)
