"""Triangles about the neck of a sac: made fine, and moved onto the rounded edge."""

from __future__ import annotations

import numpy as np

from braidcast.vessels.edges import Array, IntArray, edges_of
from braidcast.vessels.parametric import SaccularVessel

EDGES = 3.0
"""So many edges lie across the fillet's width."""


def rounded_neck(
    vessel: SaccularVessel, vertices: Array, triangles: IntArray
) -> tuple[Array, IntArray]:
    """The union of tube and sphere with its sharp edge taken to the wall of ``vessel``.

    Edges of triangles within the fillet, vertices (n, 3) mm, are halved until they are short, and
    what lies there is moved to where the signed distance is zero. A closed surface stays closed.
    """
    longest = vessel.neck_fillet / EDGES
    while True:
        edges = edges_of(triangles)
        ends = vertices[edges.ends]
        middles = ends.mean(axis=1)
        reach = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        split = reach > longest
        # A long edge may cross the fillet with both ends and its middle outside.
        split[split] = _off_fillet(vessel, middles[split]) < 0.5 * reach[split]
        if not split.any():
            break
        middle = np.full(len(edges.ends), -1)
        middle[split] = len(vertices) + np.arange(split.sum())
        vertices = np.concatenate([vertices, middles[split]])
        triangles = _split(triangles, middle[edges.of_side].reshape(-1, 3))
    # What the union left between the exact vertices too; the middles of closed ends are far off.
    off = np.abs(vessel.distance(vertices))
    near = (off > 1e-12) & (off < 0.5 * vessel.neck_fillet)
    # Short steps follow the lines of the gradient, which do not cross; the last ones are Newton's.
    for share in (0.25,) * 12 + (1.0,) * 3:
        distance, gradient, _ = vessel.evaluate(vertices[near])
        square = np.einsum("ni,ni->n", gradient, gradient)
        vertices[near] -= (share * distance / square)[:, None] * gradient
    return vertices, triangles


def _off_fillet(vessel: SaccularVessel, points: Array) -> Array:
    """How far points (n, 3) are from where the fillet acts, (n,) mm or less, negative inside."""
    assert vessel.aneurysm is not None
    # Both distances change by no more than the way walked.
    apart = np.abs(vessel.tube.distance(points) + vessel.aneurysm.depth(points))
    return 0.5 * (apart - vessel.neck_fillet)


def _split(triangles: IntArray, middles: IntArray) -> IntArray:
    """Each triangle in one to four, by new vertices in the middles (m, 3) of its edges, or -1."""
    count = (middles >= 0).sum(axis=1)
    # Turned so that the first edge is split, and with two of them the last is whole.
    first = np.where(count == 1, np.argmax(middles >= 0, axis=1), np.argmin(middles, axis=1) + 1)
    turn = (first[:, None] + np.arange(3)) % 3
    a, b, c = np.take_along_axis(triangles, turn, axis=1).T
    m, n, o = np.take_along_axis(middles, turn, axis=1).T
    parts = {
        0: ((a, b, c),),
        1: ((a, m, c), (m, b, c)),
        2: ((m, b, n), (a, m, n), (a, n, c)),
        3: ((a, m, o), (m, b, n), (o, n, c), (m, n, o)),
    }
    return np.concatenate(
        [
            np.stack(corners, axis=1)[count == number]
            for number, made in parts.items()
            for corners in made
        ]
    )
