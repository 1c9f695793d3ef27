"""Exact distance to triangles: against closed forms, a search of all triangles, and the side."""

import sys
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from numpy.testing import assert_allclose

from braidcast.errors import InputError
from braidcast.vessels.extension import extended
from braidcast.vessels.lumen_surface import LumenSurface
from braidcast.vessels.mesh_distance import MeshDistance
from problems.surfaces import cylinder

RNG = np.random.default_rng(4)


def cube(side=2.0):
    box = trimesh.creation.box([side] * 3)
    return LumenSurface(np.array(box.vertices), np.array(box.faces, dtype=np.int64), ())


def from_cube(points, half=1.0):
    q = np.abs(points) - half
    outside = np.linalg.norm(np.maximum(q, 0), axis=1)
    return outside + np.minimum(q.max(axis=1), 0)


def test_a_cube_is_exact_at_faces_edges_and_corners():
    points = RNG.uniform(-2, 2, (20_000, 3))
    assert_allclose(MeshDistance(cube()).distance(points), from_cube(points), atol=1e-14)


def test_exact_far_from_the_origin_of_coordinates():
    offset = np.array([300.0, -200.0, 1500.0])
    moved = replace(cube(), vertices=cube().vertices + offset)
    points = RNG.uniform(-2, 2, (5000, 3))
    assert_allclose(MeshDistance(moved).distance(points + offset), from_cube(points), atol=1e-12)


def test_rough_walls_against_all_triangles():
    # Sharp valleys and ridges, where the normal of the nearest face alone gives the wrong side.
    ball = trimesh.creation.icosphere(subdivisions=3)
    vertices = ball.vertices * RNG.uniform(0.85, 1.15, (len(ball.vertices), 1))
    rough = trimesh.Trimesh(vertices, ball.faces)
    points = RNG.uniform(-1.3, 1.3, (400, 3))
    corners = vertices[ball.faces]
    every = np.array(
        [
            np.linalg.norm(
                trimesh.triangles.closest_point(corners, np.tile(p, (len(corners), 1))) - p, axis=1
            ).min()
            for p in points
        ]
    )
    # The solid angle of a closed surface is 4π inside and 0 outside.
    a, b, c = (corners[None] - points[:, None, None]).transpose(2, 0, 1, 3)
    x, y, z = (np.linalg.norm(spoke, axis=2) for spoke in (a, b, c))
    volume = np.einsum("pti,pti->pt", a, np.cross(b, c))
    dots = [np.einsum("pti,pti->pt", *pair) for pair in ((a, b), (b, c), (c, a))]
    angle = 2 * np.arctan2(volume, x * y * z + dots[0] * z + dots[1] * x + dots[2] * y).sum(axis=1)
    expected = np.where(angle > 2 * np.pi, -every, every)
    surface = LumenSurface(rough.vertices, rough.faces.astype(np.int64), ())
    assert_allclose(MeshDistance(surface).distance(points), expected, atol=1e-12)
    assert (expected < 0).any() and (expected > 0).any()


def test_beyond_an_open_end_the_wall_goes_on():
    surface = extended(cylinder(1.0, 6.0, around=360), 5.0)
    points = RNG.uniform([-1.5, -1.5, -7], [1.5, 1.5, 13], (5000, 3))
    distance, overrun = MeshDistance(surface).distance_and_overrun(points)
    assert_allclose(distance, np.hypot(*points[:, :2].T) - 1, atol=5e-5)
    assert_allclose(overrun, np.maximum(np.abs(points[:, 2] - 3) - 8, 0), atol=1e-12)


def test_chunks_make_no_difference(monkeypatch):
    distance = MeshDistance(cube())
    points = RNG.uniform(-1.5, 1.5, (1000, 3))
    whole = distance.distance(points)
    monkeypatch.setattr("braidcast.vessels.mesh_distance._CHUNK", 77)
    assert (distance.distance(points) == whole).all()
    assert distance.distance(np.empty((0, 3))).shape == (0,)
    with pytest.raises(ValueError, match="finite"):
        distance.distance([np.nan, 0, 0])


def test_without_fcpw_one_sentence(monkeypatch):
    monkeypatch.setitem(sys.modules, "fcpw", None)
    with pytest.raises(InputError, match="needs the package fcpw"):
        MeshDistance(cube())
