"""The distance to a vessel given as triangles, against that of the exact shapes."""

from collections.abc import Callable
from functools import cache

import manifold3d
import numpy as np
from numpy.typing import NDArray

from braidcast.vessels.distance_grid import DistanceGrid
from braidcast.vessels.extension import extended
from braidcast.vessels.grid_spacing import EXTENSION
from braidcast.vessels.lumen_surface import LumenSurface, Opening
from braidcast.vessels.mesh_distance import MeshDistance
from problems.row import Row

Array = NDArray[np.float64]
Exact = Callable[[Array], tuple[Array, Array]]

# shapes -------------------------------------------------------------------------------------------


def swept(centres: Array, tangents: Array, across: Array, radius: float, around: int) -> Array:
    """Rings (r, around, 3) about ``centres`` (r, 3), from the direction ``across`` (r, 3) on."""
    angle = np.linspace(0.0, 2.0 * np.pi, around, endpoint=False)[:, None]
    other = np.cross(tangents, across)
    spokes = across[:, None] * np.cos(angle) + other[:, None] * np.sin(angle)
    return centres[:, None] + radius * spokes


def wall(rings: Array, centres: Array, tangents: Array, radius: float) -> LumenSurface:
    """The surface through ``rings`` (r, k, 3), open at the first and the last."""
    count, around = rings.shape[:2]
    here = np.arange(count * around).reshape(count, around)
    right = np.roll(here, -1, axis=1)
    a, b, c, d = (part.ravel() for part in (here[:-1], right[:-1], right[1:], here[1:]))
    triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    ends = (
        Opening(centres[0], -tangents[0], radius, here[0]),
        Opening(centres[-1], tangents[-1], radius, here[-1]),
    )
    return LumenSurface(rings.reshape(-1, 3), triangles, ends)


def cylinder(radius: float, length: float, around: int = 128, stations: int = 61) -> LumenSurface:
    """About the z axis from z = 0."""
    centres = np.linspace(0.0, length, stations)[:, None] * [0.0, 0.0, 1.0]
    tangents, across = (np.tile(e, (stations, 1)) for e in ([0.0, 0.0, 1.0], [1.0, 0.0, 0.0]))
    return wall(swept(centres, tangents, across, radius, around), centres, tangents, radius)


def bend(large: float, small: float, around: int = 192, stations: int = 200) -> LumenSurface:
    """A quarter of a torus about the z axis, from the x axis to the y axis."""
    angle = np.linspace(0.0, 0.5 * np.pi, stations)
    outward = np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle])
    tangents = np.column_stack([-np.sin(angle), np.cos(angle), 0.0 * angle])
    rings = swept(large * outward, tangents, outward, small, around)
    return wall(rings, large * outward, tangents, small)


def closed(solid: manifold3d.Manifold) -> LumenSurface:
    """The surface of a solid; no openings."""
    mesh = solid.to_mesh64()
    vertices = np.array(mesh.vert_properties[:, :3])
    return LumenSurface(vertices, np.array(mesh.tri_verts, dtype=np.int64), ())


def from_cylinder(points: Array) -> tuple[Array, Array]:
    """Distance and gradient of the cylinder of radius 1."""
    rho = np.hypot(points[:, 0], points[:, 1])
    return rho - 1.0, points * [1.0, 1.0, 0.0] / rho[:, None]


def from_sphere(points: Array) -> tuple[Array, Array]:
    """Distance and gradient of the sphere of radius 1."""
    r = np.linalg.norm(points, axis=1)
    return r - 1.0, points / r[:, None]


def from_bend(points: Array) -> tuple[Array, Array]:
    """Distance and gradient of the torus of radii 8 and 1.5."""
    outward = points * [1.0, 1.0, 0.0]
    outward /= np.linalg.norm(outward, axis=1)[:, None]
    spokes = points - 8.0 * outward
    r = np.linalg.norm(spokes, axis=1)
    return r - 1.5, spokes / r[:, None]


SHAPES: dict[str, tuple[Callable[[], LumenSurface], Exact]] = {
    "cylinder, R = 1": (lambda: cylinder(1.0, 6.0), from_cylinder),
    "sphere, R = 1": (lambda: closed(manifold3d.Manifold.sphere(1.0, 256)), from_sphere),
    "bend, R = 8, r = 1.5": (lambda: bend(8.0, 1.5), from_bend),
}

# measures -----------------------------------------------------------------------------------------


@cache
def wall_errors(shape: str, spacing: float = 0.1, count: int = 20_000) -> tuple[float, ...]:
    """Within 0.1 mm of the wall: grid to mesh, mesh to exact, grid to exact, mm; gradient, degrees.

    Each is the largest; the exact shape is compared between its ends.
    """
    make, exact = SHAPES[shape]
    surface = make()
    rng = np.random.default_rng(1)
    corners = surface.vertices[surface.triangles[rng.integers(len(surface.triangles), size=count)]]
    on_wall = np.einsum("ik,ikj->ij", rng.dirichlet(np.ones(3), count), corners)
    _, normals = exact(on_wall)
    points = on_wall + rng.uniform(-0.1, 0.1, (count, 1)) * normals
    mesh = MeshDistance(extended(surface, EXTENSION)).distance(points)
    grid, gradients, _ = DistanceGrid.of(surface, spacing).evaluate(points)
    truth, normals = exact(points)
    sine = np.linalg.norm(np.cross(gradients, normals), axis=1)
    angle = np.degrees(np.arctan2(sine, np.einsum("ij,ij->i", gradients, normals)))
    return (
        float(np.abs(grid - mesh).max()),
        float(np.abs(mesh - truth).max()),
        float(np.abs(grid - truth).max()),
        float(angle.max()),
    )


def surface_distances() -> list[Row]:
    rows = []
    for shape in SHAPES:
        of_grid, of_mesh, both, angle = wall_errors(shape)
        name = f"distance on a grid of 0.1 mm, {shape}"
        for what, error, bar in (
            ("grid to mesh, mm", of_grid, 2e-3),
            ("mesh to shape, mm", of_mesh, 1e-3),
            ("grid to shape, mm", both, 2e-3),
            ("normal, degrees", angle, 0.3),
        ):
            rows.append(Row(f"{name}: {what}", "closed form", "0", f"{error:.1e}", error, bar))
    return rows


# Tube of radius 1.5 about the z axis with a sphere of radius 3.5 about (0, 4, 0).
DEPTHS = {(0.0, 1.2, 0.0): 1.3748, (0.0, 1.0, 2.0): 0.6723, (1.0, 1.0, 1.0): 0.2417}


@cache
def tube_with_sphere(facets: int = 512) -> LumenSurface:
    tube = manifold3d.Manifold.cylinder(20.0, 1.5, 1.5, facets).translate([0.0, 0.0, -10.0])
    return closed(tube + manifold3d.Manifold.sphere(3.5, facets).translate([0.0, 4.0, 0.0]))


def neck_depths() -> list[Row]:
    """Where the smooth minimum of tube and sphere is only a lower bound."""
    found = -MeshDistance(tube_with_sphere()).distance(list(DEPTHS))
    return [
        Row(
            f"depth in the neck of tube and sphere at {place}, mm",
            "closed form",
            f"{depth}",
            f"{ours:.4f}",
            abs(float(ours) - depth),
            5e-3,
        )
        for (place, depth), ours in zip(DEPTHS.items(), found, strict=True)
    ]


PROBLEMS: tuple[Callable[[], list[Row]], ...] = (surface_distances, neck_depths)
