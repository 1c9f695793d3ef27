"""The lumen's surface: closed, on the wall, of the right volume, and its STL file."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad

from braidcast.errors import InputError
from braidcast.vessels import (
    QuadraticBezier,
    SaccularVessel,
    Sphere,
    Tube,
    vessel_surface,
    write_stl,
)

STRAIGHT = QuadraticBezier([0, 0, 0], [0, 0, 20], [0, 0, 40])
ARCH = QuadraticBezier([0, 0, 0], [0, 15, 25], [0, 0, 50])


def volume(vertices, triangles):
    a, b, c = vertices[triangles].transpose(1, 0, 2)
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6


def is_watertight(triangles):
    """Every directed edge once, and once the other way."""
    a, b = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2).T
    count = triangles.max() + 1
    forward, back = np.unique(a * count + b), np.unique(b * count + a)
    return len(forward) == len(a) and np.array_equal(forward, back)


def sac(y, z, R, R_a, f):
    curve = QuadraticBezier([0, 0, 0], [0, y, z], [0, 0, 50])
    top = curve.at_arc_length(curve.length / 2)[0]
    return SaccularVessel(Tube(curve, R), Sphere(top + [0, R + f * R_a, 0], R_a))


def lens(R, R_a, h):
    """Area common to two discs of radii R and R_a, h apart."""
    if h >= R + R_a:
        return 0.0
    if h <= abs(R - R_a):
        return np.pi * min(R, R_a) ** 2
    cos_R, cos_a = (h**2 + R**2 - R_a**2) / (2 * h * R), (h**2 + R_a**2 - R**2) / (2 * h * R_a)
    A, B = np.arccos(cos_R), np.arccos(cos_a)
    return R**2 * (A - np.sin(2 * A) / 2) + R_a**2 * (B - np.sin(2 * B) / 2)


@pytest.mark.parametrize(
    "shape",
    [(15, 25, 1.5, 3.5, 0.5), (5, 32, 1.0, 5.0, 0.3), (30, 18, 2.0, 2.5, 0.8), (30, 32, 2, 5, 0.8)],
)
def test_union_is_watertight_and_on_the_wall(shape):
    vessel = sac(*shape)
    vertices, triangles = vessel_surface(vessel)
    assert is_watertight(triangles)
    s = vessel.centreline.closest(vertices)[1]
    between = (s > 1e-6) & (s < vessel.centreline.length - 1e-6)
    assert_allclose(vessel.distance(vertices)[between], 0, atol=1e-9)
    middles = vertices[triangles].mean(axis=1)
    inner = between[triangles].all(axis=1)
    # A facet of the tube is 0.7 µm within the wall, of the larger sphere or the fillet more.
    assert_allclose(vessel.distance(middles)[inner], 0, atol=5e-3)
    a, b, c = vertices[triangles].transpose(1, 0, 2)
    outward = np.einsum("ij,ij->i", np.cross(b - a, c - a), vessel.evaluate(middles)[1])[inner]
    # Slivers of the union's may be turned over.
    assert -outward[outward < 0].sum() < 1e-5 * outward.sum()


def test_volume_of_a_bent_tube_is_area_times_length():
    # Pappus and Guldinus: bending does not change the volume; n facets lose sin(2π/n)/(2π/n).
    vertices, triangles = vessel_surface(SaccularVessel(Tube(ARCH, 1.5)), facets=100)
    expected = np.pi * 1.5**2 * ARCH.length * np.sin(2 * np.pi / 100) / (2 * np.pi / 100)
    assert is_watertight(triangles)
    assert_allclose(volume(vertices, triangles), expected, rtol=3e-4)


def test_volume_with_a_sphere_on_the_axis():
    # Cylinder and the sphere without its cylindrical core: the napkin ring, 4π/3 (R_a² − R²)^3/2.
    R, R_a = 1.5, 3.5
    vessel = SaccularVessel(Tube(STRAIGHT, R), Sphere([0, 0, 20], R_a))
    expected = np.pi * R**2 * 40 + 4 / 3 * np.pi * (R_a**2 - R**2) ** 1.5
    assert_allclose(volume(*vessel_surface(vessel, 240)), expected, rtol=5e-4)


def test_volume_with_a_sphere_beside_the_axis():
    R, R_a, h = 1.5, 3.5, 1.5 + 0.5 * 3.5
    vessel = SaccularVessel(Tube(STRAIGHT, R), Sphere([0, h, 20], R_a))
    common = 2 * quad(lambda z: lens(R, np.sqrt(R_a**2 - z**2), h), 0, R_a, limit=200)[0]
    expected = np.pi * R**2 * 40 + 4 / 3 * np.pi * R_a**3 - common
    assert_allclose(volume(*vessel_surface(vessel, 240)), expected, rtol=5e-4)


def test_stl_reads_back(tmp_path):
    vertices, triangles = vessel_surface(sac(15, 25, 1.5, 3.5, 0.5), facets=100)
    path = tmp_path / "vessel.stl"
    path.write_text("an older file")
    write_stl(path, vertices, triangles)
    content = path.read_bytes()
    assert int.from_bytes(content[80:84], "little") == len(triangles)
    assert len(content) == 84 + 50 * len(triangles)
    assert not content.startswith(b"solid")
    rows = np.frombuffer(content[84:], "u1").reshape(-1, 50)[:, :48].copy().view("<f4")
    normals, corners = rows[:, :3], rows[:, 3:].reshape(-1, 3, 3)
    assert_allclose(corners, vertices[triangles], atol=1e-5)
    assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-5)
    _, welded = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    assert is_watertight(welded.reshape(-1, 3))
    assert [p.name for p in tmp_path.iterdir()] == ["vessel.stl"]


def test_a_failed_write_leaves_nothing_behind(tmp_path):
    target = tmp_path / "taken"
    target.mkdir()
    with pytest.raises(OSError):
        write_stl(target, np.eye(3), [[0, 1, 2]])
    assert [p.name for p in tmp_path.iterdir()] == ["taken"]


def test_too_few_facets_are_refused():
    with pytest.raises(InputError, match="facets = 20 must be 100 or more"):
        vessel_surface(SaccularVessel(Tube(STRAIGHT, 1.5)), facets=20)
