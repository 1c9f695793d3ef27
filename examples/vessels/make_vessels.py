"""Two vessels as a segmentation gives them: `python make_vessels.py [DIR]` writes their files.

Each lumen is a function on a grid in the scanner's axes: the smooth minimum of the distances to a
tube along a bent curve, to a side branch, and to the two ellipsoids of an aneurysm, plus the noise
of an image. Its zero surface is cut open across the three ends. Lengths in mm, angles in degrees.
"""

import sys
from pathlib import Path

import numpy as np
import pyvista as pv
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.sparse import coo_array
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from braidcast.vessels.surface import write_stl

GRID = 0.25  # spacing of the grid, and about the edge of a triangle
NOISE, NOISE_LENGTH = 0.013, 0.8  # rms along the normal; covariance exp(-d^2 / (2 length^2))
BLEND = 0.55  # the smooth minimum rounds a square edge to a radius of about BLEND / sqrt(2)
STEP = 0.02  # between the points of a curve
BEYOND = 1.2  # every tube goes on so far past its end, and is cut off there


# Pose: first point, Euler angles of the first frame. Bends, radii: see Curve. A place is an arc
# length and an azimuth from N1 to N2 (a bend's outside is opposite its direction). Branch: place,
# length outside, two radii. Sac: place, distance of its centre in lumen radii, semi-axes along,
# across and away from the vessel, lean downstream and sideways. Bleb: direction, semi-axes.
VESSELS = {
    "siphon": {
        "pose": ((-31.4, 22.7, 84.3), (-20.0, 35.0, 50.0)),
        "length": 56.0,
        "bends": ((3.5, 13.0, 7.5, 0.0), (16.0, 32.0, 7.5, 205.0), (41.0, 50.0, 8.5, 310.0)),
        "radii": (2.1, 1.5, 0.05),
        "branch": (23.0, -25.0, 7.0, 0.7, 0.62),
        "sac": (36.0, 60.0, 1.78, (2.3, 2.1, 2.9), (9.0, -8.0)),
        "bleb": ((0.75, 0.35, 0.6), (1.25, 1.1, 1.0)),
        "seed": 11,
        "sac_alone": False,
    },
    "middle_cerebral": {
        "pose": ((27.9, -14.2, 61.8), (65.0, -25.0, 110.0)),
        "length": 43.0,
        "bends": ((3.0, 12.0, 12.0, 20.0), (14.5, 27.0, 8.5, 150.0), (30.0, 39.0, 11.0, 260.0)),
        "radii": (1.7, 1.3, 0.04),
        "branch": (29.5, 40.0, 6.5, 0.95, 0.88),
        "sac": (20.5, -30.0, 1.75, (2.3, 1.9, 2.5), (-14.0, 12.0)),
        "bleb": ((-0.55, -0.55, 0.65), (1.0, 1.1, 0.9)),
        "seed": 23,
        "sac_alone": True,
    },
}


class Curve:
    """Points of a centreline with turning frames (N1, N2, T), which do not twist (Bishop 1975).

    ``bends``: (from, to, radius of curvature, direction); a bend of direction 0 turns to N1, of 90
    to N2, and has its radius all along but for soft ends. ``radii``: proximal, distal, waviness.
    """

    def __init__(self, start, frame, length, bends, radii):
        self.s = np.arange(-BEYOND, length + BEYOND + STEP / 2, STEP)
        bending = np.zeros((len(self.s), 2))
        for first, last, radius, direction in bends:
            soft = np.tanh((self.s - first) / 1.2) - np.tanh((self.s - last) / 1.2)
            turn = np.deg2rad(direction)
            bending += soft[:, None] / (2.0 * radius) * [np.cos(turn), np.sin(turn)]
        frames = [frame]
        for k1, k2 in (bending[1:] + bending[:-1]) / 2.0:
            frames.append(frames[-1] * Rotation.from_rotvec([-k2 * STEP, k1 * STEP, 0.0]))
        self.frames = np.array([turned.as_matrix() for turned in frames])
        tangents = self.frames[:, :, 2]
        self.points = start + np.concatenate(
            [np.zeros((1, 3)), np.cumsum((tangents[1:] + tangents[:-1]) / 2.0 * STEP, axis=0)]
        )
        self.tightest = 1.0 / np.linalg.norm(bending, axis=1).max()
        proximal, distal, waviness = radii
        t = np.clip(self.s / length, 0.0, 1.0)
        waves = 0.6 * np.sin(self.s / 1.9 + 0.7) + 0.4 * np.sin(self.s / 1.1 + 2.0)
        self.radius = (proximal + (distal - proximal) * t) * (1.0 + waviness * waves)

    def at(self, s, azimuth=0.0):
        """Point, frame turned by ``azimuth`` about its T, and lumen radius at arc length s."""
        i = round((s + BEYOND) / STEP)
        turn = Rotation.from_euler("z", azimuth, degrees=True).as_matrix()
        return self.points[i], self.frames[i] @ turn, self.radius[i]

    def distance(self, points):
        """To the swept sphere, negative inside."""
        away, i = cKDTree(self.points).query(points)
        return away - self.radius[i]


def ellipsoid(points, centre, axes, semi_axes):
    """Distance to an ellipsoid, exact to first order; ``axes`` in columns."""
    q = (points - centre) @ axes / semi_axes
    size = np.linalg.norm(q, axis=1)
    return size * (size - 1.0) / np.maximum(np.linalg.norm(q / semi_axes, axis=1), 1e-9)


def smooth_minimum(a, b):
    nearness = np.maximum(BLEND - np.abs(a - b), 0.0)
    return np.minimum(a, b) - nearness**2 / (4.0 * BLEND)


def zero_surface(values, origin):
    """The mesh where a grid of ``values`` is zero, its triangles evened out on that surface."""
    grid = pv.ImageData(dimensions=values.shape, spacing=(GRID,) * 3, origin=origin)
    mesh = grid.contour([0.0], values.ravel(order="F"), method="flying_edges")
    triangles, points = mesh.regular_faces[:, ::-1], np.asarray(mesh.points, dtype=float)
    i, j = np.concatenate([triangles, np.roll(triangles, 1, 1), np.roll(triangles, 2, 1)])[:, :2].T
    near = coo_array((np.ones(len(i)), (i, j)), shape=(len(points),) * 2).tocsr()
    slopes = np.gradient(values, GRID)
    for _ in range(12):
        points = 0.4 * points + 0.6 * (near @ points) / near.sum(axis=1)[:, None]
        at = ((points - origin) / GRID).T
        slope = np.stack([map_coordinates(g, at, order=1) for g in slopes], axis=1)
        height = map_coordinates(values, at, order=3)[:, None]
        points -= height * slope / (slope**2).sum(axis=1, keepdims=True)
    return pv.PolyData.from_regular_faces(points, triangles)


def cut_open(mesh, point, out, radius):
    """The surface less the end of a tube that lies past the plane at ``point`` with normal out."""
    points, triangles = np.array(mesh.points), mesh.regular_faces
    here = np.linalg.norm(points - point, axis=1) < radius + BEYOND + 0.5
    short = np.where(here, (point - points) @ out, 1.0)
    snapped = np.abs(short) < 0.4 * GRID  # or the cut would leave slivers
    points[snapped] += short[snapped, None] * out
    short[snapped] = 0.0
    mesh = pv.PolyData.from_regular_faces(points, triangles[(short[triangles] > 0.0).any(axis=1)])
    mesh["short"] = short
    return mesh.clip_scalar(scalars="short", value=0.0, invert=False).triangulate().clean()


def make(name, folder, pose, length, bends, radii, branch, sac, bleb, seed, sac_alone):
    """Write the surface, the sac's if asked, and the true centreline of one of ``VESSELS``."""
    start, heading = pose
    tube = Curve(start, Rotation.from_euler("xyz", heading, degrees=True), length, bends, radii)

    # The branch starts on the axis, leaves it at 60 degrees and bends a little.
    s, azimuth, outside, first, last = branch
    root, frame, radius = tube.at(s, azimuth)
    tilted = Rotation.from_matrix(frame) * Rotation.from_euler("y", 60.0, degrees=True)
    reach = radius / np.sin(np.pi / 3.0) + outside - BEYOND
    side = Curve(root, tilted, reach, ((3.0, reach, 12.0, 20.0),), (first, last, 0.02))

    # The sac's centre lies outside the lumen, the bleb's near the sac's wall.
    s, azimuth, away, semi_axes, lean = sac
    middle, frame, radius = tube.at(s, azimuth)
    up = frame[:, 0]
    axes = np.stack([frame[:, 2], -frame[:, 1], up], axis=1)
    axes = axes @ Rotation.from_euler("yx", lean, degrees=True).as_matrix()
    centre = middle + away * radius * up
    toward = np.array(bleb[0]) / np.linalg.norm(bleb[0])
    bleb_centre = centre + 0.85 * axes @ (toward * semi_axes)

    ends = np.concatenate([tube.points, side.points, [centre, bleb_centre]])
    origin = ends.min(axis=0) - 4.0
    shape = np.ceil((np.ptp(ends, axis=0) + 8.0) / GRID).astype(int)
    points = origin + GRID * np.indices(shape).reshape(3, -1).T
    bulge = smooth_minimum(
        ellipsoid(points, centre, axes, semi_axes), ellipsoid(points, bleb_centre, axes, bleb[1])
    )
    lumen = smooth_minimum(smooth_minimum(tube.distance(points), side.distance(points)), bulge)
    white = np.random.default_rng(seed).standard_normal(shape)
    noise = gaussian_filter(white, NOISE_LENGTH / np.sqrt(2.0) / GRID, mode="wrap")
    lumen += (NOISE / noise.std() * noise).ravel()

    mesh = zero_surface(lumen.reshape(shape), origin)
    for place, outward in ((tube.at(0.0), -1), (tube.at(length), 1), (side.at(reach), 1)):
        mesh = cut_open(mesh, place[0], outward * place[1][:, 2], place[2])
    write_stl(folder / f"{name}.stl", mesh.points, mesh.regular_faces)

    neck = middle + radius * up
    if sac_alone:
        # A little larger than the lumen, and from just below the neck: no node falls in between.
        beyond = np.maximum(lumen - 0.05, (neck - points) @ up - 0.1)
        beyond = np.maximum(beyond, np.linalg.norm(points - centre, axis=1) - 5.0)
        closed = zero_surface(beyond.reshape(shape), origin)
        write_stl(folder / f"{name}_sac.stl", closed.points, closed.regular_faces)

    stations = np.linspace(0.0, length, round(length / 0.25) + 1)
    rows = [[*point, radius] for point, _, radius in map(tube.at, stations)]
    file = folder / f"{name}_centreline.csv"
    np.savetxt(file, rows, fmt="%.4f", delimiter=",", header="x,y,z,radius", comments="")
    print(f"{name}: {mesh.n_cells} triangles, radii of curvature from {tube.tightest:.2f} mm")
    print(f"  ends {tube.at(0.0)[0].round(2)}, {tube.at(length)[0].round(2)}")
    print(f"  neck {neck.round(2)}, {s} mm along {length} mm")


if __name__ == "__main__":
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
    target.mkdir(parents=True, exist_ok=True)
    for each, drawing in VESSELS.items():
        make(each, target, **drawing)
