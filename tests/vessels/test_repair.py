"""Damaged surfaces are mended, with a remark, or refused, with a place; see braidcast.vessels."""

import manifold3d
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from braidcast.errors import InputError
from braidcast.vessels import QuadraticBezier, SaccularVessel, Sphere, Tube, vessel_surface
from braidcast.vessels.edges import boundary_loops, edges_of
from braidcast.vessels.orientation import enclosed_volume
from braidcast.vessels.repair import repaired
from braidcast.vessels.self_intersection import self_intersections

R, L, FACETS = 1.5, 20.0, 32
#: Volume and wall area of a prism of 32 sides.
VOLUME = 0.5 * FACETS * np.sin(2 * np.pi / FACETS) * R**2 * L
AREA = 2 * FACETS * np.sin(np.pi / FACETS) * R * L


def area(surface):
    a, b, c = surface.vertices[surface.triangles].transpose(1, 0, 2)
    return 0.5 * np.sum(np.linalg.norm(np.cross(b - a, c - a), axis=1))


def volume(surface):
    return enclosed_volume(surface.vertices, surface.triangles)


def assert_is_wall(surface, openings):
    """Edges have one or two triangles, these agree, and the open ones are the openings' rims."""
    edges = edges_of(surface.triangles)
    assert edges.count.max() <= 2
    sides = np.stack(
        [surface.triangles.ravel(), np.roll(surface.triangles, -1, axis=1).ravel()], axis=1
    )
    assert len(np.unique(sides, axis=0)) == len(sides)
    assert len(surface.openings) == openings
    assert np.sum(edges.count == 1) == sum(len(end.rim) for end in surface.openings)
    assert volume(surface) > 0
    assert_array_equal(np.unique(surface.triangles), np.arange(len(surface.vertices)))


def assert_is_tube(surface, tolerance=1e-9):
    assert_is_wall(surface, 2)
    assert_allclose(volume(surface), VOLUME, rtol=tolerance)
    assert_allclose(area(surface), AREA, rtol=tolerance)
    ends = sorted(surface.openings, key=lambda end: end.centre[2])
    assert_allclose([end.centre for end in ends], [[0, 0, 0], [0, 0, L]], atol=10 * tolerance)
    assert_allclose([end.normal for end in ends], [[0, 0, -1], [0, 0, 1]], atol=10 * tolerance)
    radius = np.sqrt(0.5 * FACETS * np.sin(2 * np.pi / FACETS) / np.pi) * R
    assert_allclose([end.radius for end in ends], radius, rtol=tolerance)


def soup(vertices, triangles):
    """Each triangle with its own corners."""
    return vertices[triangles].reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3)


def nearest(vertices, triangles, point, count=1):
    return np.argsort(np.linalg.norm(vertices[triangles].mean(axis=1) - point, axis=1))[:count]


def test_sound_surface_is_left_alone(tube):
    vertices, triangles = tube()
    surface = repaired(vertices, triangles)
    assert_is_tube(surface)
    assert surface.remarks == ()
    assert len(surface.triangles) == len(triangles)


def test_rim_runs_as_the_wall_does_and_looks_out(tube):
    surface = repaired(*tube())
    for end, loop in zip(
        sorted(surface.openings, key=lambda end: end.rim.min()),
        sorted(boundary_loops(surface.triangles), key=min),
        strict=True,
    ):
        assert_array_equal(end.rim, np.roll(loop, -int(np.argmin(loop))))


def test_soup_and_float32_seams_are_joined(tube):
    vertices, triangles = soup(*tube())
    assert_is_tube(repaired(vertices, triangles))
    noise = np.random.default_rng(1).normal(0.0, 2e-5, vertices.shape)
    surface = repaired(vertices + noise, triangles)
    assert_is_tube(surface, 1e-4)
    assert "joined with another" in surface.remarks[0]


def test_unused_vertices_and_negative_zero_make_no_difference(tube):
    vertices, triangles = tube()
    extra = np.vstack([[[np.nan, 0, 0], [1e9, 0, 0]], np.where(vertices == 0.0, -0.0, vertices)])
    surface = repaired(extra, triangles + 2)
    assert surface.remarks == ()
    assert_array_equal(surface.vertices, repaired(vertices, triangles).vertices)


def test_inverted_surface_is_turned(tube):
    vertices, triangles = tube()
    surface = repaired(vertices, triangles[:, ::-1])
    assert_is_tube(surface)
    assert surface.remarks == ("all triangles faced into the lumen and were turned",)


def test_flipped_patch_is_turned(tube):
    vertices, triangles = tube()
    patch = nearest(vertices, triangles, [R, 0, 10], 17)
    triangles[patch] = triangles[patch][:, ::-1]
    surface = repaired(vertices, triangles)
    assert_is_tube(surface)
    assert surface.remarks == (
        f"17 of {len(triangles)} triangles faced into the lumen and were turned",
    )


def test_orientation_of_a_bent_vessel_with_a_sac_goes_by_its_volume():
    curve = QuadraticBezier([0, 0, 0], [0, 30, 18], [0, 0, 50])
    top = curve.at_arc_length(curve.length / 2)[0]
    vessel = SaccularVessel(Tube(curve, 2.0), Sphere(top + [0, 5, 0], 5.0), 0.0)
    vertices, triangles = vessel_surface(vessel, 100)
    surface = repaired(vertices, triangles[:, ::-1])
    assert_is_wall(surface, 2)
    a, b, c = vertices[triangles].transpose(1, 0, 2)
    assert_allclose(volume(surface), np.sum(a * np.cross(b, c)) / 6, rtol=1e-6)
    for end in surface.openings:
        tangent = curve.tangent_at_arc_length(np.array([curve.closest(end.centre[None])[1][0]]))[0]
        assert abs(end.normal @ tangent) == pytest.approx(1.0, abs=1e-5)
        assert end.normal @ (end.centre - [0, 0, 25]) > 0


@pytest.mark.parametrize("facets", [12, 32, 400])
def test_flat_lids_are_opened(tube, capped, facets):
    mesh = tube(R, L, facets, 9 if facets == 400 else 41)
    surface = repaired(*capped(*mesh, facets))
    assert_is_wall(surface, 2)
    assert len(surface.triangles) == len(mesh[1])
    assert [remark[:40] for remark in surface.remarks] == [
        "the flat closed end at (0, 0, 0) mm, of ",
        "the flat closed end at (0, 0, 20) mm, of",
    ]
    assert [len(end.rim) for end in surface.openings] == [facets, facets]


@pytest.mark.parametrize(("height", "openings"), [(0.015, 2), (0.5, 1)])
def test_lid_may_be_a_little_uneven_but_no_cone(tube, capped, height, openings):
    vertices, triangles = capped(*tube())
    vertices[-1, 2] += height
    assert_is_wall(repaired(vertices, triangles), openings)


def test_oblique_lid_with_a_hole_is_opened_as_a_whole(tube, capped):
    vertices, triangles = tube()
    vertices[:, 2] *= 1 + 0.7 * vertices[:, 0] / L
    vertices, triangles = capped(vertices, triangles)
    surface = repaired(vertices, np.delete(triangles, [len(triangles) - 3], axis=0))
    assert_is_wall(surface, 2)
    ends = sorted(surface.openings, key=lambda end: end.centre[2])
    assert_allclose(ends[1].normal, np.array([-0.7, 0, 1]) / np.hypot(0.7, 1), atol=1e-9)


def test_sphere_has_no_opening_and_is_said_to_be_closed():
    import manifold3d

    mesh = manifold3d.Manifold.sphere(5.0, 64).to_mesh64()
    surface = repaired(mesh.vert_properties[:, :3], mesh.tri_verts)
    assert_is_wall(surface, 0)
    assert surface.remarks == ("the surface is closed: it has no opening and no flat end to open",)


@pytest.mark.parametrize("count", [1, 6, 10])
def test_small_hole_is_filled(tube, count):
    vertices, triangles = tube()
    hole = nearest(vertices, triangles, [R, 0, 10], count)
    surface = repaired(vertices, np.delete(triangles, hole, axis=0))
    assert_is_wall(surface, 2)
    assert len(surface.remarks) == 1 and "hole at (1." in surface.remarks[0]
    assert surface.remarks[0].endswith("was filled")
    assert_allclose(volume(surface), VOLUME, rtol=2e-3)
    assert_allclose(area(surface), AREA, rtol=2e-3)


def test_holes_that_touch_at_a_vertex_are_filled_both(tube):
    vertices, triangles = tube()
    at = int(np.argmin(np.linalg.norm(vertices - [R, 0, 10], axis=1)))
    around = np.flatnonzero((triangles == at).any(axis=1))
    first = around[0]
    other = next(t for t in around if len(np.intersect1d(triangles[t], triangles[first])) == 1)
    surface = repaired(vertices, np.delete(triangles, [first, other], axis=0))
    assert_is_tube(surface)
    assert len(surface.remarks) == 2


def test_many_holes_are_filled_and_reported_together(tube):
    vertices, triangles = tube(facets=64, rings=81)
    surface = repaired(vertices, np.delete(triangles, np.arange(500, 9500, 900), axis=0))
    assert_is_wall(surface, 2)
    assert len(surface.triangles) == len(triangles)
    assert len(surface.remarks) == 1
    assert surface.remarks[0].startswith("10 holes were filled, the largest at (")


def test_hole_beside_a_rim_makes_it_jagged_only(tube):
    vertices, triangles = tube()
    surface = repaired(vertices, np.delete(triangles, nearest(vertices, triangles, [R, 0, 0]), 0))
    assert_is_wall(surface, 2)
    jagged = min(surface.openings, key=lambda end: end.centre[2])
    assert_allclose(jagged.radius, R, rtol=0.02)
    assert_allclose(jagged.normal, [0, 0, -1], atol=0.1)


def test_large_hole_is_refused_with_its_place(tube):
    vertices, triangles = tube(facets=64, rings=81)
    middle = vertices[triangles].mean(axis=1)
    hole = np.linalg.norm(middle - [R, 0, 10], axis=1) < 1.1
    with pytest.raises(InputError, match=r"hole in its wall at \(1\.\d+, .*, 10\) mm, of radius"):
        repaired(vertices, triangles[~hole])


def test_tear_from_end_to_end_is_refused(tube):
    vertices, triangles = tube()
    strip = np.abs(np.arctan2(*vertices[triangles].mean(axis=1)[:, [1, 0]].T) - 0.1) < 0.1
    with pytest.raises(InputError, match=r"has (a hole in its wall|an open edge) at"):
        repaired(vertices, triangles[~strip])


def test_crumb_is_left_out(tube):
    vertices, triangles = tube()
    crumb = np.array([[9.0, 0, 0], [9.5, 0, 0], [9, 0.5, 0]])
    surface = repaired(
        np.vstack([vertices, crumb]), np.vstack([triangles, [np.arange(3) + len(vertices)]])
    )
    assert_is_tube(surface)
    assert surface.remarks == (
        "1 loose piece of 1 triangle was left out, the largest around (9.17, 0.17, 0) mm",
    )


@pytest.mark.parametrize(
    "centre, radius, match",
    [
        ([0.0, 1.0, 5.0], 0.8, "passes through its wall at"),
        ([0.0, 0.0, 5.0], 0.8, "loose pieces up to 1.6 mm wide in its lumen about"),
        ([0.0, 0.0, 5.0], 0.1, None),
        ([0.0, 8.0, 5.0], 0.8, None),
    ],
    ids=["sac of its own", "body", "crumb inside", "crumb outside"],
)
def test_only_what_changes_nothing_is_a_crumb(tube, centre, radius, match):
    ball = manifold3d.Manifold.sphere(radius, 24).translate(centre).to_mesh()
    vertices, triangles = tube(length=10.0, facets=48, rings=21)
    both = np.vstack([vertices, ball.vert_properties[:, :3]])
    faces = np.vstack([triangles, ball.tri_verts.astype(np.int64) + len(vertices)])
    if match:
        with pytest.raises(InputError, match=match):
            repaired(both, faces)
    else:
        assert "loose piece" in repaired(both, faces).remarks[0]


def test_second_vessel_is_refused(tube):
    vertices, triangles = tube()
    two = np.vstack([vertices, vertices * [1, 1, 0.3] + [30, 0, 0]])
    with pytest.raises(InputError, match=r"2 separate pieces.*around \(30, 0, 3\) mm, has 30 %"):
        repaired(two, np.vstack([triangles, triangles + len(vertices)]))


def test_double_and_flat_triangles_are_removed(tube):
    vertices, triangles = tube()
    more = np.vstack([triangles, triangles[5:8], triangles[9:10, ::-1], [[4, 4, 7], [3, 3, 3]]])
    surface = repaired(vertices, more)
    assert_is_tube(surface)
    assert surface.remarks == (
        "2 triangles without area were removed",
        "4 triangles given twice were removed once",
    )


def test_sliver_between_a_side_and_a_vertex_on_it_is_removed(tube):
    vertices, triangles = tube()
    (a, b, c), middle = triangles[700], len(vertices)
    vertices = np.vstack([vertices, [0.5 * (vertices[a] + vertices[b])]])
    triangles = np.vstack(
        [np.delete(triangles, 700, axis=0), [[a, middle, c], [middle, b, c], [a, b, middle]]]
    )
    surface = repaired(vertices, triangles)
    assert_is_tube(surface)
    assert surface.remarks == ("1 triangle without height was removed",)
    corners = surface.vertices[surface.triangles]
    height = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    assert height.min() > 1e-3


def test_coordinate_that_is_no_number_is_refused(tube):
    vertices, triangles = tube()
    vertices[17, 1] = np.nan
    with pytest.raises(InputError, match=r"1 vertex without a finite place: vertex 17 is at \("):
        repaired(vertices, triangles)


def test_fin_on_the_wall_is_refused(tube):
    vertices, triangles = tube()
    a, b, _ = triangles[700]
    fin = vertices[[a, b]].mean(axis=0) * [1.5, 1.5, 1]
    with pytest.raises(InputError, match=r"1 edge with three or more triangles.*first is at \("):
        repaired(np.vstack([vertices, fin]), np.vstack([triangles, [[a, b, len(vertices)]]]))


def test_one_sided_surface_is_refused():
    n = 40
    angle = np.arange(n) * (2 * np.pi / n)
    across = np.stack(
        [np.cos(angle / 2) * np.cos(angle), np.cos(angle / 2) * np.sin(angle), np.sin(angle / 2)], 1
    )
    middle = 10 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], 1)
    vertices = np.vstack([middle - 2 * across, middle + 2 * across])
    i = np.arange(n - 1)
    strip = np.vstack([np.stack([i, i + 1, i + n], 1), np.stack([i + 1, i + n + 1, i + n], 1)])
    last = [[n - 1, n, 2 * n - 1], [n, 0, 2 * n - 1]]
    with pytest.raises(InputError, match="one side only, as a Möbius band has"):
        repaired(vertices, np.vstack([strip, last]))


def test_wall_that_passes_through_itself_is_refused(tube):
    vertices, triangles = tube(rings=81)
    near = np.exp(-((vertices[:, 2] - 10) ** 2)) * (vertices[:, 0] > 0.5)
    vertices[:, 0] -= 4.0 * near  # one side pushed through the other
    with pytest.raises(InputError, match=r"passes through itself: \d+ pairs of triangles cross"):
        repaired(vertices, triangles)


def test_crease_is_said_not_refused(tube):
    """A vertex pushed past its neighbours, as noise does it."""
    vertices, triangles = tube(rings=81)
    at = int(np.argmin(np.linalg.norm(vertices - [R, 0, 10], axis=1)))
    vertices[at] += [-0.03, 0.55, 0.1]
    surface = repaired(vertices, triangles)
    assert_is_wall(surface, 2)
    assert len(surface.remarks) == 1
    assert surface.remarks[0].startswith("the wall is creased: ")


def test_box_is_not_opened_on_all_sides(tube, capped):
    surface = repaired(*capped(*tube(3.0, 1.0, rings=2)))
    assert surface.openings == ()


def test_crossings_are_those_of_two_squares():
    square = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    upright = square[:, [2, 0, 1]] * [1, 0.5, 1] + [0.25, 0.1, 0]
    triangles = np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]])
    pairs = self_intersections(np.vstack([square, upright]), triangles)
    assert len(pairs) > 0
    assert set(map(tuple, pairs.tolist())) <= {(0, 2), (0, 3), (1, 2), (1, 3)}
    away = self_intersections(np.vstack([square, upright + [0, 0, 1.01]]), triangles)
    assert len(away) == 0


def test_no_triangle_with_an_area_is_refused():
    with pytest.raises(InputError, match="holds no triangle that has an area"):
        repaired(np.zeros((3, 3)), np.array([[0, 1, 2]]))
    with pytest.raises(InputError, match="holds no triangle that has an area"):
        repaired(np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]]), np.array([[0, 1, 2]]))


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), flips=st.floats(0.0, 1.0))
def test_order_and_facing_of_triangles_make_no_difference(tube, seed, flips):
    """The same surface, to the bit, from its triangles in any order, any start and any facing."""
    vertices, triangles = tube(rings=11)
    expected = repaired(vertices, triangles)
    random = np.random.default_rng(seed)
    mixed = triangles[random.permutation(len(triangles))]
    mixed = np.take_along_axis(
        mixed, (np.arange(3) + random.integers(3, size=(len(mixed), 1))) % 3, 1
    )
    flipped = random.random(len(mixed)) < flips
    mixed[flipped] = mixed[flipped][:, ::-1]
    label = random.permutation(len(vertices))
    shuffled = np.empty_like(vertices)
    shuffled[label] = vertices
    found = repaired(shuffled, label[mixed])
    assert_array_equal(found.vertices, expected.vertices)
    assert_array_equal(found.triangles, expected.triangles)
    for end, as_before in zip(found.openings, expected.openings, strict=True):
        assert_array_equal(end.rim, as_before.rim)
        assert_array_equal(end.centre, as_before.centre)
