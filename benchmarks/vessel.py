"""Deployments in vessels from surfaces: python benchmarks/vessel.py [FILE.md]

The paper's vessel as a parametric case and as its own STL file; the two example vessels, each
solved four ways; their centrelines, found, against those they were made about; time and memory of
reading a surface of a hundred thousand triangles. Ends with 1 if a bar is missed.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

import numpy as np

from braidcast.case import Case
from braidcast.deployment.simulate import simulate
from braidcast.vessels.surface import vessel_surface, write_stl
from braidcast.vessels.surface_vessel import SurfaceSource, load_vessel
from deployment import VARIANTS, cholesky_seconds, options_of, peak_memory, plan
from report import Bar, table_of_bars

EXAMPLES = Path(__file__).parents[1] / "examples" / "vessels"
NAMES = ("siphon", "middle_cerebral")


def own_surface(number: int, folder: Path) -> list[Bar]:
    """A case of the plan against the same with its vessel's STL file and centreline."""
    case = plan()[number]
    path, line = folder / f"vessel_{number}.stl", folder / f"vessel_{number}.csv"
    write_stl(path, *vessel_surface(case.vessel_geometry))
    curve = case.bezier
    places = curve.at_arc_length(np.linspace(0.0, curve.length, 200))
    radii = np.full(len(places), case.vessel_radius)
    np.savetxt(line, np.column_stack([places, radii]), "%.9f", ",", header="x,y,z,radius")
    tables = case.to_dict()
    tables["vessel"] = {"surface": str(path), "centreline": str(line)}
    tables["aneurysm"] = {"diameter": case.sac.diameter, "centre": list(case.aneurysm_centre)}
    ours, theirs = simulate(Case.from_dict(tables)), simulate(case)
    apart = 1e3 * np.linalg.norm(ours.positions - theirs.positions, axis=1)
    name = f"paper's vessel {number} as its own STL"
    changed = int((ours.outcome, ours.converged) != (theirs.outcome, theirs.converged))
    return [
        (f"{name}: nodes, mean", float(apart.mean()), 5.0, "µm"),
        (f"{name}: nodes, largest", float(apart.max()), 30.0, "µm"),
        (f"{name}: outcomes that changed", changed, 0, ""),
    ]


def centreline(name: str) -> list[Bar]:
    """The centreline found in an example against that which it was made about."""
    made = np.loadtxt(EXAMPLES / f"{name}_centreline.csv", delimiter=",", skiprows=1)
    line = Case.from_toml(EXAMPLES / f"{name}.toml").centreline
    away, along = line.closest(made[:, :3])
    wide = 100.0 * (line.lumen_radius(along) / made[:, 3] - 1.0)
    return [
        (f"centreline of {name}: mean", float(away.mean()), 0.1, "mm"),
        (f"centreline of {name}: radius, mean error", float(np.abs(wide).mean()), 3.0, "%"),
        (f"centreline of {name}: radius, largest error", float(np.abs(wide).max()), 3.0, "%"),
    ]


def example(name: str) -> list[Bar]:
    """An example, four ways."""
    case = Case.from_toml(EXAMPLES / f"{name}.toml")
    done = {}
    for variant in VARIANTS:
        done[variant] = d = simulate(case, options=options_of(variant))
        print(
            f"{name} {variant}: {d.outcome}, {d.reason}, {d.newton_iterations} iterations, "
            f"{d.cpu_seconds:.1f} s CPU, {d.end_nodes_in_sac} end nodes in the sac",
            file=sys.stderr,
        )
    rows: list[Bar] = [
        (f"{name}: not converged", sum(not d.converged for d in done.values()), 0, ""),
        (f"{name}: residual, worst", max(d.residual_relative for d in done.values()), 1e-4, ""),
        (
            f"{name}: penetration, worst",
            1e3 * max(d.max_penetration_mm for d in done.values()),
            1e3 * case.braid.wire_radius / 4.0,
            "µm",
        ),
    ]
    for variant in VARIANTS[1:]:
        apart = np.linalg.norm(done[variant].positions - done["default"].positions, axis=1)
        rows += [
            (f"{name}, {variant}: nodes, mean", 1e3 * float(apart.mean()), 5.0, "µm"),
            (f"{name}, {variant}: nodes, largest", 1e3 * float(apart.max()), 20.0, "µm"),
        ]
    return rows


def fine_surface(folder: Path) -> Path:
    """The siphon with each triangle cut in four: 125 000 triangles."""
    import trimesh

    path = folder / "fine.stl"
    trimesh.load_mesh(EXAMPLES / "siphon.stl").subdivide().export(path)
    return path


def reading(path: Path) -> dict[str, float]:
    """CPU seconds and memory of reading a surface, in this process: from the files, or kept."""
    ends = ((-31.30, 23.46, 85.22), (-11.13, 34.48, 116.46))
    seconds = {}

    def report(stage: str, share: float) -> None:
        seconds.setdefault(stage, time.process_time())

    # What is imported on first use is not counted.
    load_vessel(SurfaceSource(str(EXAMPLES / "siphon.stl"), ends=ends))
    begin = time.process_time()
    vessel = load_vessel(SurfaceSource(str(path), ends=ends, spacing=0.1), report)
    vessel.evaluate(vessel.centreline.at_arc_length([10.0]))
    end = time.process_time()
    return {
        "triangles": len(vessel.surface.triangles),
        "distance": end - seconds.get("distance", begin),
        "all": end - begin,
        "MB": peak_memory(),
    }


def read_in_a_process(path: Path) -> dict[str, float]:
    """The same in a new process."""
    command = [sys.executable, __file__, "--read", str(path)]
    return json.loads(subprocess.run(command, check=True, capture_output=True).stdout)


def main() -> int:
    if sys.argv[1:2] == ["--read"]:
        print(json.dumps(reading(Path(sys.argv[2]))))
        return 0
    rows: list[Bar] = []
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        path = fine_surface(folder)
        first, again = read_in_a_process(path), read_in_a_process(path)
        what = f"{first['triangles']:.0f} triangles, every 0.1 mm"
        rows += [
            (f"distance of {what}: CPU", first["distance"], 20.0, "s"),
            (f"surface of {what}, repaired, with centreline: CPU", first["all"], 60.0, "s"),
            ("memory of that process, imports included", first["MB"], 2000.0, "MB"),
            ("the same vessel again, from what was kept: CPU", again["all"], 0.5, "s"),
        ]
        for name in NAMES:
            rows += centreline(name)
        for number in range(6):
            rows += own_surface(number, folder)
            print(f"vessel {number} done", file=sys.stderr)
    for name in NAMES:
        rows += example(name)
    held = all(ours <= bar for _, ours, bar, _ in rows)
    text = "\n".join(
        [
            f"ref = {median(cholesky_seconds(3)):.3f} s",
            "",
            *table_of_bars(rows),
            "",
        ]
    )
    print(text)
    if sys.argv[1:]:
        Path(sys.argv[1]).write_text(text, encoding="utf-8")
    return 0 if held else 1


if __name__ == "__main__":
    os.environ.update(dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1"))
    sys.exit(main())
