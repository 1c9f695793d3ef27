"""A hundred cases, run, killed and run again: python benchmarks/dataset.py -o DIR

The plan is the study's with ``--cases`` cases. Measured are: the run as it is; the same plan killed
five times with all its processes at random moments and then finished; half of it on one worker
and on two; every case once more with half the largest step. Then the finished store of the study,
if it is there (BRAIDCAST_DATA): its size, and how long it takes to open and read one field.

DIR/dataset.md is the table. What is in DIR is not done again. Ends with 1 if a bar is missed.
"""

import argparse
import json
import os
import random
import re
import signal
import subprocess
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

import braidcast
from braidcast.dataset.folder import DatasetFolder
from braidcast.dataset.home import data_folder
from braidcast.dataset.ledger import Ledger
from braidcast.deployment.release import ReleaseOptions
from braidcast.deployment.simulate import simulate
from braidcast.study import PLAN
from deployment import ONE_THREAD, cholesky_seconds

KILLS = 5
COMMAND = [sys.executable, "-m", "braidcast", "dataset"]

Row = tuple[str, str, str, bool]


def planned(name: str, cases: int, home: Path) -> Path:
    """A dataset folder of the study's plan with fewer cases."""
    folder, plan = home / name, home / f"{name}.toml"
    if not folder.exists():
        text = re.sub(r"(?m)^cases = .*$", f"cases = {cases}", PLAN.read_text(encoding="utf-8"))
        text = re.sub(r"(?m)^(subsets|tests) = .*\n", "", text)
        plan.write_text(text, encoding="utf-8")
        subprocess.run([*COMMAND, "create", str(plan), "-o", str(folder)], check=True)
    return folder


def timed_run(folder: Path, workers: int) -> dict[str, float]:
    """Run to the end; wall seconds, CPU seconds of the cases, and workers."""
    kept = folder.with_suffix(".json")
    if not kept.exists():
        begin = time.perf_counter()
        command = [*COMMAND, "run", str(folder), "--workers", str(workers)]
        subprocess.run(command, check=True, env=os.environ | dict.fromkeys(ONE_THREAD, "1"))
        wall = time.perf_counter() - begin
        dataset = braidcast.open_dataset(folder)
        cpu = float(dataset.cpu_seconds.sum())
        kept.write_text(json.dumps({"wall": wall, "cpu": cpu, "workers": workers}))
    return json.loads(kept.read_text())


def killed_run(folder: Path, seconds: float, seed: int) -> tuple[int, int]:
    """Kill the run and all its processes ``KILLS`` times, then let it end.

    Returns how many finished cases there were at the kills, and how many of them were done again.
    """
    chance = random.Random(seed)
    moments = sorted(chance.uniform(0.05, 0.85) * seconds for _ in range(KILLS))
    spans = np.diff([0.0, *moments])
    seen: dict[Path, tuple[int, int]] = {}
    for span in spans:
        command = [*COMMAND, "run", str(folder)]
        run = subprocess.Popen(
            command, start_new_session=True, env=os.environ | dict.fromkeys(ONE_THREAD, "1")
        )
        time.sleep(float(span) + 8.0)  # what it takes to start anew
        os.killpg(run.pid, signal.SIGKILL)
        run.wait()
        time.sleep(1.0)
        finished = Ledger.read(DatasetFolder.open(folder)).finished
        print(f"killed; {len(finished)} finished", file=sys.stderr)
        for record in finished:
            path = DatasetFolder.open(folder).case_file(record.index)
            seen.setdefault(path, (path.stat().st_ino, path.stat().st_mtime_ns))
    subprocess.run(
        [*COMMAND, "run", str(folder)], check=True, env=os.environ | dict.fromkeys(ONE_THREAD, "1")
    )
    again = sum((p.stat().st_ino, p.stat().st_mtime_ns) != mark for p, mark in seen.items())
    return len(seen), again


def half_step(task: tuple[Path, int, Path]) -> tuple[float, float, str]:
    """Mean and largest distance, µm, from the stored result; outcome."""
    path, index, home = task
    kept = home / f"half-step-{index:03d}.json"
    if not kept.exists():
        folder = DatasetFolder.open(path)
        options = ReleaseOptions()
        options = replace(options, move=options.move / 2)
        result = simulate(folder.case(index), options=options, cache=folder.crimped)
        stored = braidcast.open_dataset(path).positions[index].values
        apart = 1e3 * np.linalg.norm(result.positions - stored, axis=1)
        kept.write_text(json.dumps([apart.mean(), apart.max(), result.outcome]))
    mean, largest, outcome = json.loads(kept.read_text())
    return mean, largest, outcome


def hundred(home: Path, cases: int) -> list[Row]:
    """The run as it is: equilibrium, cost, overhead."""
    folder = planned("whole", cases, home)
    spent = timed_run(folder, 2)
    dataset = braidcast.open_dataset(folder)
    finished = int((dataset.status == "finished").sum())
    residual, deep = float(dataset.residual_relative.max()), float(dataset.max_penetration.max())
    median, slow = np.percentile(dataset.cpu_seconds.values, [50, 95])
    with threadpool_limits(1, "blas"):
        ref = float(np.median(cholesky_seconds(7)))
    overhead = spent["wall"] * 2 / spent["cpu"]
    return [
        ("cases that converge", f"{finished} of {cases}", f"{cases}", finished == cases),
        ("residual over contact forces, worst", f"{residual:.1e}", "1e-4", residual <= 1e-4),
        ("penetration, worst", f"{1e3 * deep:.2f} µm", "3.5 µm", deep <= 3.5e-3),
        (
            "CPU of a case, median",
            f"{median:.2f} s, {median / ref:.1f} ref of {ref:.3f} s",
            "4 s (9 ref)",
            median <= max(4.0, 9.0 * ref),
        ),
        ("CPU of a case, 95th percentile", f"{slow:.2f} s", "8 s", slow <= 8.0),
        ("wall x workers / CPU of the cases", f"{overhead:.3f}", "1.1", overhead <= 1.1),
    ]


def survival(home: Path, cases: int) -> list[Row]:
    """Killed five times, against the run that was not."""
    whole, folder = planned("whole", cases, home), planned("killed", cases, home)
    kept = home / "killed.json"
    if not kept.exists():
        kept.write_text(json.dumps(killed_run(folder, timed_run(whole, 2)["wall"], seed=1)))
    seen, again = json.loads(kept.read_text())
    ours, theirs = braidcast.open_dataset(folder), braidcast.open_dataset(whole)
    same = int((ours.checksum == theirs.checksum).sum())
    return [
        (f"killed {KILLS} times: results the same to the last bit", f"{same} of {cases}",
         f"{cases}", same == cases),
        (f"of {seen} finished before a kill: done again", f"{again}", "0", again == 0),
    ]  # fmt: skip


def throughput(home: Path, cases: int) -> list[Row]:
    """Half of the cases on one worker and on two."""
    alone = timed_run(planned("one", cases // 2, home), 1)
    both = timed_run(planned("two", cases // 2, home), 2)
    ratio = alone["wall"] / both["wall"]
    return [("throughput of 2 workers over 1", f"{ratio:.2f}", "1.85", ratio >= 1.85)]


def repeatability(home: Path, cases: int) -> list[Row]:
    """Every case once more, with half the largest step."""
    folder = planned("whole", cases, home)
    with ProcessPoolExecutor(2) as pool:
        found = list(pool.map(half_step, [(folder, i, home) for i in range(cases)]))
    means, largest, outcomes = zip(*found, strict=True)
    stored = braidcast.open_dataset(folder).outcome.values
    changed = sum(a != b for a, b in zip(outcomes, stored, strict=True))
    beyond = sum(mean > 5.0 or most > 20.0 for mean, most in zip(means, largest, strict=True))
    return [
        (
            "half the step: mean distance, median and worst",
            f"{np.median(means):.2f}, {max(means):.2f} µm",
            "5 µm",
            max(means) <= 5.0,
        ),
        ("largest distance, worst", f"{max(largest):.2f} µm", "20 µm", max(largest) <= 20.0),
        ("cases beyond either", f"{beyond} of {cases}", "0", beyond == 0),
        ("outcomes that changed", f"{changed}", "0", changed == 0),
    ]


def finished_study() -> list[Row]:
    """The store of the study: size, opening, one field of all cases."""
    folder = data_folder() / "study"
    if not folder.exists():
        return []
    size = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file()) / 1e6
    script = (
        "import sys, time, braidcast, xarray\n"
        "import braidcast.dataset.store\n"
        "t = time.perf_counter()\n"
        "d = braidcast.open_dataset(sys.argv[1]); d.positions.values\n"
        "print(time.perf_counter() - t)"
    )
    seconds = [
        float(subprocess.run([sys.executable, "-c", script, str(folder)], check=True,
                             capture_output=True, text=True).stdout)
        for _ in range(5)
    ]  # fmt: skip
    opening = float(np.median(seconds))
    dataset = braidcast.open_dataset(folder)
    finished = dataset.status == "finished"
    share = float((dataset.outcome == "failure").sum() / finished.sum())
    count, cases = int(finished.sum()), dataset.sizes["case"]
    median, slow = np.nanpercentile(dataset.cpu_seconds.values, [50, 95])
    return [
        ("study: cases finished", f"{count} of {cases}", f"{cases}", count == cases),
        ("study: labelled failure", f"{share:.1%}", "30-36 %", 0.30 <= share <= 0.36),
        ("study: CPU of a case, median; 95 %", f"{median:.2f} s; {slow:.2f} s", "4; 8 s",
         median <= 4.0 and slow <= 8.0),
        ("study: size on disk", f"{size:.0f} MB", "150 MB", size <= 150.0),
        ("study: open, read one field of all", f"{opening:.2f} s", "2 s", opening <= 2.0),
    ]  # fmt: skip


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=Path("dataset_benchmark"))
    parser.add_argument("--cases", type=int, default=100)
    given = parser.parse_args()
    home = given.output.resolve()
    home.mkdir(parents=True, exist_ok=True)
    rows = []
    for part in (hundred, throughput, survival, repeatability):
        rows += part(home, given.cases)
    rows += finished_study()
    lines = ["| what | measured | bar | |", "|---|---|---|---|"]
    lines += [f"| {a} | {b} | {c} | {'held' if d else '**missed**'} |" for a, b, c, d in rows]
    page = "\n".join(lines) + "\n"
    (home / "dataset.md").write_text(page, encoding="utf-8")
    print(page)
    return int(not all(row[3] for row in rows))


if __name__ == "__main__":
    sys.exit(main())
