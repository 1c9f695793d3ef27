"""braidcast and OpenSees on the same braid, side by side; see README.md.

python benchmarks/peers/compare.py [--xara PYTHON] [--openseespy PYTHON] [-o FILE]

Prints a page in Markdown. Ends with 1 if a bar is missed, with 2 if a code found no equilibrium.
"""

import argparse
import json
import os
import platform
import resource
import subprocess
import sys
import tempfile
from datetime import date
from pathlib import Path
from statistics import median
from typing import Any

HERE = Path(__file__).parent

TIME_LIMIT = 1500.0
"""Seconds a process may take by the clock."""

ENGINES = ("xara", "openseespy")

SPARSE = ("--steps", "3", "1", "--numberer", "AMD", "--system", "UmfPack")
SPRING_JOINTS = ("--joints", "spring", "--handler", "Plain")

OPTIONS = {
    ("xara", "tuned"): ("--steps", "2", "1"),
    ("xara", "sparse"): SPARSE,
    ("openseespy", "tuned"): (*SPRING_JOINTS, "--steps", "2", "1"),
    ("openseespy", "sparse"): (*SPRING_JOINTS, *SPARSE),
}
"""Tuned: the fastest we found for this braid. Sparse: OpenSees's own numbering and sparse solver,
in the fewest increments that converge."""

RATIO_BAR = 15.0

STAGES = ("crimped", "opened", "released")

Result = dict[str, Any]

QUANTITIES: tuple[tuple[str, tuple[str, ...], float], ...] = (
    ("crimped length, mm", ("crimped", "length_mm"), 1e-5),
    ("deployed length, mm", ("released", "length_mm"), 1e-3),
    ("strain energy deployed, mJ", ("released", "strain_energy_mJ"), 1e-3),
    ("wall force, N", ("wall_force_N",), 2e-2),
    ("strain energy crimped, mJ", ("crimped", "strain_energy_mJ"), 1e-3),
)
"""Name, place in a result, bar of the relative difference."""


class Failed(Exception):
    """A solver ended without a result."""


def run(command: list[str]) -> Result:
    """Result of a script, with the CPU seconds of its whole process; one thread, low priority."""
    environment = os.environ | {
        f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL", "NUMBA")
    }
    before = _children_seconds()
    try:
        done = subprocess.run(
            ["nice", *command],
            env=environment,
            capture_output=True,
            text=True,
            timeout=TIME_LIMIT,
            check=True,
        )
    except subprocess.TimeoutExpired:
        raise Failed(f"{' '.join(command)}: stopped after {TIME_LIMIT:.0f} s") from None
    except subprocess.CalledProcessError as error:
        reason = (error.stderr.strip().splitlines() or ["no message"])[-1]
        raise Failed(f"{' '.join(command)}: {reason}") from None
    # OpenSees may write before and after
    line = next(line for line in done.stdout.splitlines() if line.startswith('{"'))
    return json.loads(line) | {"process_seconds": _children_seconds() - before}


def _children_seconds() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def solve_seconds(result: Result) -> float:
    return sum(float(result[stage]["seconds"]) for stage in STAGES)


def at(result: Result, place: tuple[str, ...]) -> float:
    value: Any = result
    for key in place:
        value = value[key]
    return float(value)


def page(names: list[str], results: list[list[Result]], refinement: int) -> tuple[str, bool]:
    """Markdown for the runs of each code, ours first, and whether all bars are held."""
    first = [runs[0] for runs in results]
    versions = dict.fromkeys(result["version"] for result in first)
    finer = f"; {refinement} elements from crossing to crossing" if refinement > 1 else ""
    lines = [
        f"{platform.machine()}, {_processor()}, {os.cpu_count()} cores; {', '.join(versions)}; "
        f"{date.today().isoformat()}; {len(results[0])} runs each in turn, one thread, medians of "
        f"CPU seconds{finer}",
        "",
        _row("quantity", *names, "largest relative difference", "bar", ""),
        _rule(len(names) + 4),
    ]
    held = True
    for what, place, bar in QUANTITIES:
        values = [at(result, place) for result in first]
        worst = max(abs(value / values[0] - 1.0) for value in values[1:])
        held &= worst <= bar
        shown = [f"{value:.9g}" for value in values]
        lines.append(_row(what, *shown, f"{worst:.1e}", f"{bar:.0e}", _verdict(worst <= bar)))
    lines += ["", _row("CPU seconds", *names), _rule(len(names) + 1)]
    for stage in STAGES:
        cells = [
            f"{median(at(run, (stage, 'seconds')) for run in runs):.2f} "
            f"({runs[0][stage]['iterations']} iterations)"
            for runs in results
        ]
        lines.append(_row(stage, *cells))
    totals = [median(map(solve_seconds, runs)) for runs in results]
    processes = [median(run["process_seconds"] for run in runs) for runs in results]
    lines.append(_row("all three", *(f"{value:.2f}" for value in totals)))
    lines.append(_row("whole process", *(f"{value:.2f}" for value in processes)))
    lines += ["", _row("theirs over ours", "three stages", "whole process", "bar", ""), _rule(5)]
    for name, total, process in zip(names[1:], totals[1:], processes[1:], strict=True):
        ratio = total / totals[0]
        held &= ratio >= RATIO_BAR
        cells = [f"{ratio:.1f}", f"{process / processes[0]:.1f}", f"{RATIO_BAR:.0f}"]
        lines.append(_row(name, *cells, _verdict(ratio >= RATIO_BAR)))
    return "\n".join(lines) + "\n", held


def _row(*cells: str) -> str:
    return "| " + " | ".join(cells) + " |"


def _rule(columns: int) -> str:
    return "|" + "---|" * columns


def _verdict(held: bool) -> str:
    return "held" if held else "**missed**"


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor()
    return next((ln.split(":")[1].strip() for ln in lines if ln.startswith("model name")), "?")


def write(path: Path, text: str) -> None:
    with tempfile.NamedTemporaryFile(
        "w", dir=path.parent, prefix=path.name, delete=False, encoding="utf-8"
    ) as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
    os.chmod(file.name, 0o644)
    os.replace(file.name, path)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for engine in ENGINES:
        parser.add_argument(f"--{engine}", metavar="PYTHON", help="a Python that has it")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--tuned", action="store_true", help="leave the sparse solver out")
    parser.add_argument("--refinement", type=int, default=1, help="elements between crossings")
    parser.add_argument("-o", "--output", type=Path, metavar="FILE", help="where the page goes too")
    arguments = parser.parse_args()
    finer = ["--refinement", str(arguments.refinement)]
    commands = [[sys.executable, str(HERE / "ours.py"), *finer]]
    settings = ["braidcast"]
    for (engine, setting), options in OPTIONS.items():
        python = getattr(arguments, engine)
        if python and not (arguments.tuned and setting != "tuned"):
            script = [python, str(HERE / "theirs_opensees.py"), "--engine", engine]
            commands.append([*script, *options, *finer])
            settings.append(f"{engine} {setting}")
    if len(commands) < 2 or arguments.repeats < 1:
        parser.error("give --xara or --openseespy, and one repeat or more")
    results: list[list[Result]] = [[] for _ in commands]
    try:
        run(commands[0])  # what numba compiles is in its cache from here on
        for repeat in range(arguments.repeats):
            for name, command, runs in zip(settings, commands, results, strict=True):
                runs.append(run(command))
                seconds = solve_seconds(runs[-1])
                print(f"{repeat + 1}: {name} {seconds:.2f} s", file=sys.stderr, flush=True)
    except Failed as failure:
        print(failure, file=sys.stderr)
        return 2
    text, held = page(settings, results, arguments.refinement)
    print(text)
    if arguments.output:
        write(arguments.output, text)
    return 0 if held else 1


if __name__ == "__main__":
    sys.exit(main())
