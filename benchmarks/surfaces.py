"""Ten damaged surfaces, and what is said of each: python benchmarks/surfaces.py [FILE.md]

The siphon of the examples, damaged, and a bend of quads are given to ``load_vessel``. What is
repaired must have the signed distance of the undamaged surface, but for the damage itself. Ends
with 1 if a side is wrong, or if something other than a sentence is said.
"""

import os
import sys
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from braidcast.case import Case
from braidcast.errors import InputError
from braidcast.vessels.surface import write_stl
from braidcast.vessels.surface_file import read_surface
from braidcast.vessels.surface_vessel import SurfaceSource, load_vessel
from problems.surfaces import bend

EXAMPLE = Path(__file__).parents[1] / "examples" / "vessels" / "siphon.toml"
AT, CLEAR = 12.0, 4.0
"""Where along the centreline the wall is damaged; how far away it must be as it was, mm."""
Array = NDArray[np.float64]
Write = Callable[[Path], object]


def damages(vertices: Array, triangles: NDArray[np.int64], place: Array, inward: Array):
    """Each damage at ``place`` (3,) mm: its name, the file's ending and units, what writes it."""
    reach = np.linalg.norm(vertices[triangles].mean(axis=1) - place, axis=1)
    dent = np.clip(1.5 - np.linalg.norm(vertices - place, axis=1, keepdims=True), 0.0, 1.0)
    crumb = vertices[triangles[reach < 0.5]].reshape(-1, 3) - 8.0 * inward
    loose = np.arange(len(crumb)).reshape(-1, 3) + len(vertices)
    unknown = np.where(np.arange(len(vertices))[:, None] == 4711, np.nan, vertices)
    tube = bend(8.0, 1.5)
    half = len(tube.triangles) // 2
    quads = np.column_stack([tube.triangles[:half], tube.triangles[half:, 2]]) + 1
    obj = "\n".join(
        [f"v {x:.9f} {y:.9f} {z:.9f}" for x, y, z in tube.vertices.tolist()]
        + [f"f {a} {b} {c} {d}" for a, b, c, d in quads.tolist()]
    )

    def stl(points: Array, corners: NDArray[np.int64] = triangles) -> Write:
        return lambda path: write_stl(path, points, corners)

    return [
        ("hole of 0.5 mm radius", ".stl", "mm", stl(vertices, triangles[reach > 0.5])),
        ("hole of 1.5 mm radius", ".stl", "mm", stl(vertices, triangles[reach > 1.5])),
        (
            "patch of 2 mm radius, flipped",
            ".stl",
            "mm",
            stl(vertices, np.where((reach < 2.0)[:, None], triangles[:, ::-1], triangles)),
        ),
        (
            "crumb beside the vessel",
            ".stl",
            "mm",
            stl(np.concatenate([vertices, crumb]), np.concatenate([triangles, loose])),
        ),
        ("wall pushed through itself", ".stl", "mm", stl(vertices + 6.0 * dent * inward)),
        ("empty file", ".stl", "mm", lambda path: path.write_bytes(b"")),
        ("text that is no surface", ".stl", "mm", lambda path: path.write_text("solid?\n" * 99)),
        ("quads", ".obj", "mm", lambda path: path.write_text(obj)),
        ("one triangle", ".stl", "mm", stl(vertices, triangles[:1])),
        ("metres, not said", ".stl", "mm", stl(1e-3 * vertices)),
        ("metres, said", ".stl", "m", stl(1e-3 * vertices)),
        ("a vertex that is no number", ".stl", "mm", stl(unknown)),
    ]


def near_wall(vertices: Array, triangles: NDArray[np.int64], count: int = 5000) -> Array:
    """Points (count, 3) mm up to 0.3 mm from the wall."""
    rng = np.random.default_rng(0)
    corners = vertices[triangles[rng.integers(len(triangles), size=count)]]
    return np.einsum("nk,nki->ni", rng.dirichlet(np.ones(3), count), corners) + rng.uniform(
        -0.17, 0.17, (count, 3)
    )


def main() -> int:
    case = Case.from_toml(EXAMPLE)
    ends, whole = case.vessel.ends, read_surface(case.vessel.surface)
    siphon, tube = case.vessel_geometry, bend(8.0, 1.5)
    middle = siphon.centreline.at_arc_length(AT)[0]
    place = whole.vertices[np.argmin(np.linalg.norm(whole.vertices - middle, axis=1))]
    inward = (middle - place) / np.linalg.norm(middle - place)
    held, lines = True, []
    with tempfile.TemporaryDirectory() as scratch:
        os.environ["BRAIDCAST_CACHE"] = scratch
        plain = Path(scratch, "tube.stl")
        write_stl(plain, tube.vertices, tube.triangles)
        source = SurfaceSource("", ends=ends)
        for name, ending, units, write in damages(whole.vertices, whole.triangles, place, inward):
            path = Path(scratch, "damaged" + ending)
            write(path)
            mine, undamaged = replace(source, surface=str(path), units=units), siphon
            if name == "quads":
                mine, undamaged = replace(mine, ends=None), load_vessel(SurfaceSource(str(plain)))
            try:
                vessel = load_vessel(mine)
            except InputError as error:
                said, verdict, difference = str(error).replace(f"{scratch}/", ""), "refused", "| "
            except Exception as error:  # a traceback, were this the command
                said, verdict, difference = repr(error), "**traceback**", "| "
                held = False
            else:
                said, verdict = "; ".join(vessel.remarks) or "nothing", "repaired"
                points = near_wall(undamaged.surface.vertices, undamaged.surface.triangles)
                before, after = undamaged.distance(points), vessel.distance(points)
                gridded = vessel.grid.distance(points)
                away = np.linalg.norm(points - place, axis=1) > CLEAR
                sure = away & (np.abs(before) > 5e-3)
                others = int(np.sum(before * after < 0.0))
                far = int(np.sum((before * after < 0.0)[sure] | (before * gridded < 0.0)[sure]))
                off = float(np.abs(after - before).max())
                difference = f"{off:.1g} | {others}, {far} away from it"
                held &= far == 0
            lines.append(f"| {name} | {verdict} | {said} | {difference} |")
            print(lines[-1], file=sys.stderr, flush=True)
    head = "| damage | | what is said | distance differs, mm | other side, of 5000 points |"
    text = "\n".join([head, "|---|---|---|---|---|", *lines, ""])
    print(text)
    if sys.argv[1:]:
        Path(sys.argv[1]).write_text(text, encoding="utf-8")
    return 0 if held else 1


if __name__ == "__main__":
    sys.exit(main())
