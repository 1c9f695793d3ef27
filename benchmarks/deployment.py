"""Twelve deployments, each solved four ways: python benchmarks/deployment.py -o DIR

Repeatability, equilibrium, CPU time and memory of the simulation over a Latin hypercube of the
paper's study (errata row 6). Every simulation runs in a process of its own and leaves one file
``case-variant.json`` (and the positions beside it) in DIR; what is there, made by the same
sources, is not run again. Ends with 1 if a bar is missed.
"""

import argparse
import json
import multiprocessing
import os
import sys
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import qmc

import braidcast
from braidcast.case import Case
from braidcast.deployment.crimp import crimped_state
from braidcast.deployment.release import ReleaseOptions
from braidcast.deployment.simulate import simulate
from braidcast.deployment.sources import fingerprint
from report import page

NAMES = ("y_P1", "z_P1", "D_v", "D_a", "f", "eta")
LOWER = np.array([5.0, 18.0, 2.0, 5.0, 0.3, 0.0])
UPPER = np.array([30.0, 32.0, 4.0, 10.0, 0.8, 1.0])
VARIANTS = ("default", "tight", "half_step", "twice_path")
ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


@cache
def plan() -> list[Case]:
    """The twelve cases."""
    sampler = qmc.LatinHypercube(6, optimization="random-cd", rng=1)
    return [case_of(row) for row in LOWER + (UPPER - LOWER) * sampler.random(12)]


def case_of(row: np.ndarray) -> Case:
    """The case of one row of the plan, in the order of ``NAMES``."""
    y, z, vessel, sac, protrusion, eta = map(float, row)
    return Case.from_dict(
        {
            "vessel": {"P1": [0.0, y, z], "diameter": vessel},
            "aneurysm": {"diameter": sac, "protrusion": protrusion},
            "site": {"eta": eta},
        }
    )


def options_of(variant: str) -> ReleaseOptions:
    """How a variant solves: nothing may change but the numerics."""
    options = ReleaseOptions()
    if variant == "tight":
        return replace(options, tolerance=options.tolerance / 10, balance=options.balance / 10)
    if variant == "half_step":
        return replace(options, move=options.move / 2)
    if variant == "twice_path":
        return replace(options, duration=2 * options.duration)
    return options


def cholesky_seconds(repeats: int) -> list[float]:
    """CPU seconds of numpy's Cholesky of 3000 x 3000, the yardstick of machines."""
    root = np.random.default_rng(0).standard_normal((3000, 3000))
    matrix = root @ root.T + 3000.0 * np.eye(3000)
    seconds = []
    for _ in range(repeats):
        begin = time.process_time()
        np.linalg.cholesky(matrix)
        seconds.append(time.process_time() - begin)
    return seconds


def peak_memory() -> float:
    """Largest resident size of this process so far, MB."""
    import resource

    size = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return size / (1e6 if sys.platform == "darwin" else 1e3)


def run(number: int, variant: str, folder: Path, made_by: str, solver: str) -> dict[str, Any]:
    """One simulation, in a process of its own, written to ``folder``."""
    small = plan()[number].to_dict()
    small["device"] = {"wires": 12, "segments": 24}
    simulate(Case.from_dict(small), linear_solver=solver)  # numba's code is loaded on first use
    result = simulate(plan()[number], options=options_of(variant), linear_solver=solver)
    memory = peak_memory()
    record = {
        "case": number,
        "variant": variant,
        "sources": made_by,
        "version": braidcast.__version__,
        "linear_solver": solver,
        "parameters": dict(zip(NAMES, parameters(number), strict=True)),
        "converged": result.converged,
        "reason": result.reason,
        "outcome": result.outcome,
        "clinical_outcome": result.clinical_outcome,
        "end_nodes_in_sac": result.end_nodes_in_sac,
        "newton_iterations": result.newton_iterations,
        "residual_relative": result.residual_relative,
        "max_penetration_mm": result.max_penetration_mm,
        "penetration_bar_mm": result.case.braid.wire_radius / 4.0,
        "deployed_length_mm": result.deployed_length_mm,
        "cpu_seconds": result.cpu_seconds,
        "wall_seconds": result.wall_seconds,
        "peak_memory_MB": memory,
        "ref_seconds": cholesky_seconds(3),
    }
    stem = folder / f"{number:02d}-{variant}"
    with open(stem.with_suffix(".npy.tmp"), "wb") as file:
        np.save(file, result.positions)
    os.replace(stem.with_suffix(".npy.tmp"), stem.with_suffix(".npy"))
    write(stem.with_suffix(".json"), json.dumps(record, indent=1))
    return record


def parameters(number: int) -> list[float]:
    """The row of the plan, in the order of ``NAMES``."""
    case = plan()[number]
    assert case.aneurysm is not None and case.aneurysm.protrusion is not None
    return [
        *case.vessel.P1[1:],
        case.vessel.diameter,
        case.aneurysm.diameter,
        case.aneurysm.protrusion,
        case.site.eta,
    ]


def write(path: Path, text: str) -> None:
    """Whole or not at all."""
    temporary = path.with_name(f"{path.name}.tmp")
    temporary.write_text(text, encoding="utf-8")
    os.replace(temporary, path)


def kept(path: Path, made_by: str, solver: str) -> dict[str, Any] | None:
    """The record of an earlier run of the same sources, or None."""
    try:
        record = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    same = (record.get("sources"), record.get("linear_solver")) == (made_by, solver)
    return record if same and path.with_suffix(".npy").exists() else None


def distances(records: list[dict[str, Any]], folder: Path) -> None:
    """Add the nodal distance (mean and largest, µm) from the case's default answer."""
    for record in records:
        default = folder / f"{record['case']:02d}-default.npy"
        if not default.exists():
            continue
        own = folder / f"{record['case']:02d}-{record['variant']}.npy"
        apart = 1e3 * np.linalg.norm(np.load(own) - np.load(default), axis=1)
        record["mean_distance_um"], record["max_distance_um"] = apart.mean(), apart.max()


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=Path("deployment_benchmark"))
    parser.add_argument("--cases", type=int, default=12, help="only the first so many")
    parser.add_argument("--variants", choices=["default", "all"], default="all")
    parser.add_argument("--jobs", type=int, choices=[1, 2], default=1, help="processes at once")
    parser.add_argument("--linear-solver", default="band_cholesky")
    return parser.parse_args()


def main() -> int:
    given = arguments()
    os.environ.update(dict.fromkeys(ONE_THREAD, "1"))  # for the workers; numpy reads it on import
    given.output.mkdir(parents=True, exist_ok=True)
    made_by = fingerprint()
    cases = plan()[: given.cases]
    variants = VARIANTS if given.variants == "all" else VARIANTS[:1]
    records, wanted = [], []
    for variant in variants:
        for number in range(len(cases)):
            path = given.output / f"{number:02d}-{variant}.json"
            record = kept(path, made_by, given.linear_solver)
            if record is None:
                path.unlink(missing_ok=True)
                wanted.append((number, variant))
            else:
                records.append(record)
    crimped_state(cases[0].braid, cases[0].crimped_radius)
    begin = time.perf_counter()
    with ProcessPoolExecutor(
        given.jobs, multiprocessing.get_context("spawn"), max_tasks_per_child=1
    ) as pool:
        runs = [
            pool.submit(run, *which, given.output, made_by, given.linear_solver) for which in wanted
        ]
        for done, future in enumerate(as_completed(runs), start=1):
            record = future.result()
            records.append(record)
            print(
                f"[{done}/{len(wanted)}, {time.perf_counter() - begin:.0f} s] "
                f"case {record['case']} {record['variant']}: {record['outcome']}, "
                f"{record['cpu_seconds']:.1f} s CPU, {record['newton_iterations']} iterations"
                + ("" if record["converged"] else f", NOT CONVERGED: {record['reason']}"),
                file=sys.stderr,
                flush=True,
            )
    records.sort(key=lambda record: (record["case"], VARIANTS.index(record["variant"])))
    distances(records, given.output)
    text, held = page(records)
    print(text)
    write(given.output / "deployment.md", text)
    write(given.output / "deployment.json", json.dumps(records, indent=1))
    return 0 if held else 1


if __name__ == "__main__":
    sys.exit(main())
