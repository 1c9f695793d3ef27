"""Longer ends: straight, plane, turned like the wall, and never through the vessel."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from braidcast.errors import InputError
from braidcast.vessels.extension import extended
from braidcast.vessels.mesh_distance import MeshDistance
from problems.surfaces import bend, cylinder, swept, wall


def is_consistent(surface):
    """Every directed edge once, and all but those of the rims also the other way."""
    t = surface.triangles
    edges = np.stack([t, np.roll(t, -1, axis=1)], axis=2).reshape(-1, 2)
    forward = set(map(tuple, edges.tolist()))
    single = {edge for edge in forward if edge[::-1] not in forward}
    rims = sum(len(opening.rim) for opening in surface.openings)
    return len(forward) == len(edges) and len(single) == rims


@pytest.mark.parametrize("backwards", [False, True])
def test_a_cylinder_gets_longer(backwards):
    surface = cylinder(1.0, 6.0)
    if backwards:
        turned = tuple(replace(o, rim=o.rim[::-1]) for o in surface.openings)
        surface = replace(surface, openings=turned)
    longer = extended(surface, 5.0)
    assert is_consistent(longer) and not longer.remarks
    assert_allclose(np.hypot(*longer.vertices[:, :2].T), 1, atol=1e-12)
    assert_allclose([o.centre for o in longer.openings], [[0, 0, -5], [0, 0, 11]], atol=1e-12)
    expected = np.sqrt(128 / (2 * np.pi) * np.sin(2 * np.pi / 128))
    assert_allclose([o.radius for o in longer.openings], expected, rtol=1e-12)
    assert_allclose(longer.vertices[longer.openings[1].rim][:, 2], 11)
    assert MeshDistance(longer).distance([[0.5, 0, -4.0], [0, 1.5, 10.0]]).round(1).tolist() == [
        -0.5,
        0.5,
    ]


def test_an_uneven_rim_ends_on_a_plane():
    surface = cylinder(1.0, 6.0)
    vertices = surface.vertices.copy()
    rim = surface.openings[1].rim
    vertices[rim, 2] += 0.3 * np.sin(3 * np.arctan2(vertices[rim, 1], vertices[rim, 0]))
    longer = extended(replace(surface, vertices=vertices), 4.0)
    assert is_consistent(longer)
    top = vertices[rim, 2].max()
    assert_allclose(longer.vertices[longer.openings[1].rim, 2], top + 4, atol=1e-12)
    assert_allclose(np.hypot(*longer.vertices[:, :2].T), 1, atol=1e-12)


def test_the_triangles_are_no_slivers():
    longer = extended(bend(8.0, 1.5, around=96, stations=100), 5.0)
    corners = longer.vertices[longer.triangles]
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    assert (sides.max(axis=1) / sides.min(axis=1)).max() < 6


def hook(gap):
    """Three quarters of a circle, then a straight run across the first end, ``gap`` mm from it."""
    angle = np.linspace(0, 1.5 * np.pi, 300)
    arc = 4.0 * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    arc_tangents = np.column_stack([-np.sin(angle), np.cos(angle), 0 * angle])
    run = np.linspace(0.1, 8, 80)[:, None] * [1.0, 0, 0] + arc[-1]
    lead = np.linspace(-(4 - 1 - gap), -0.1, 20)[:, None] * [0, 1.0, 0] + arc[0]
    centres = np.concatenate([lead, arc, run])
    tangents = np.concatenate(
        [np.tile([0, 1.0, 0], (20, 1)), arc_tangents, np.tile([1.0, 0, 0], (80, 1))]
    )
    across = np.tile([0, 0, 1.0], (len(centres), 1))
    return wall(swept(centres, tangents, across, 1.0, 64), centres, tangents, 1.0)


def test_shortened_where_the_vessel_is_in_the_way():
    # 2.7 mm to the wall across, less 0.2 mm clearance and 1 mm free beyond: 5/4 mm fit.
    longer = extended(hook(gap=2.7), 5.0)
    assert len(longer.remarks) == 1 and "instead of 5 mm" in longer.remarks[0]
    assert_allclose(longer.openings[0].centre[1], hook(2.7).openings[0].centre[1] - 1.25)
    assert is_consistent(longer)


def test_refused_where_not_even_one_millimetre_fits():
    with pytest.raises(InputError, match=r"opening at \(4, -1.6, 0\) mm that cannot be continued"):
        extended(hook(gap=1.4), 5.0)
