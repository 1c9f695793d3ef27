"""The study, run, killed and run again: python benchmarks/study.py -o DIR

Measured are: the study of the finished store (BRAIDCAST_DATA), stage by stage; the same killed
three times with all its processes at random moments and then finished; the study of 150 cases from
nothing, simulations and all; the wheel, installed where nothing of the sources is, predicting
without a network. DIR/study.md is the table. What is in DIR is not done again. Ends with 1 if a bar
is missed.
"""

import argparse
import json
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import time
import venv
from pathlib import Path

from braidcast.dataset.home import data_folder
from deployment import ONE_THREAD

KILLS = 3
SOURCES = Path(__file__).parents[1]
COMMAND = [sys.executable, "-m", "braidcast", "study"]
ENVIRONMENT = os.environ | dict.fromkeys(ONE_THREAD, "1")

Row = tuple[str, str, str, bool]


def run(arguments: list[str], kept: Path) -> dict[str, float]:
    """Run to the end, once; wall and CPU seconds."""
    if not kept.exists():
        begin, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([*COMMAND, *arguments], check=True, env=ENVIRONMENT)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        kept.write_text(json.dumps({"wall": time.perf_counter() - begin, "cpu": cpu}))
    return json.loads(kept.read_text())


def stage_times(folder: Path) -> dict[str, tuple[int, float]]:
    """Number of stages and CPU seconds by kind: the words of a stage's name before its numbers."""
    found: dict[str, tuple[int, float]] = {}
    for path in sorted((folder / "stages").glob("*.json")):
        kind = path.stem.split("_")[0] + (
            "" if "learn" not in path.stem else f" {path.stem.split('_')[1]}"
        )
        count, seconds = found.get(kind, (0, 0.0))
        found[kind] = count + 1, seconds + json.loads(path.read_text())["cpu_seconds"]
    return dict(sorted(found.items(), key=lambda item: -item[1][1]))


def whole(home: Path, samples: int) -> tuple[list[Row], str]:
    """The study of the finished store, and a table of its stages."""
    arguments = ["--samples", str(samples), "--dataset", str(data_folder() / "study")]
    spent = run([*arguments, "-o", str(home / "whole")], home / "whole.json")
    again = run([*arguments, "-o", str(home / "whole")], home / "again.json")
    rows = [
        (
            f"study of {samples} from the finished store, two workers",
            f"{spent['wall']:.0f} s, {spent['cpu']:.0f} s of CPU",
            "",
            True,
        ),
        ("the same again: nothing to do", f"{again['wall']:.1f} s", "20 s", again["wall"] < 20.0),
    ]
    lines = [
        f"| {kind} | {count} | {seconds:.1f} |"
        for kind, (count, seconds) in stage_times(home / "whole").items()
    ]
    return rows, "\n".join(["| stages | number | CPU (s) |", "|---|---|---|", *lines])


def killed(home: Path, samples: int, seed: int) -> list[Row]:
    """Killed at random moments, then finished: the same files as those never killed."""
    folder, kept = home / "killed", home / "killed.json"
    if not kept.exists():
        shutil.rmtree(folder, ignore_errors=True)
        chance = random.Random(seed)
        wall = json.loads((home / "whole.json").read_text())["wall"]
        arguments = ["--samples", str(samples), "--dataset", str(data_folder() / "study")]
        command = [*COMMAND, *arguments, "-o", str(folder)]
        done = []
        for _ in range(KILLS):
            process = subprocess.Popen(command, start_new_session=True, env=ENVIRONMENT)
            time.sleep(chance.uniform(0.05, 0.35) * wall)
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            time.sleep(1.0)
            done.append(len(list((folder / "stages").glob("*.json"))))
            print(f"killed; {done[-1]} stages done", file=sys.stderr)
        subprocess.run(command, check=True, env=ENVIRONMENT)
        kept.write_text(json.dumps(done))
    first, second = files(home / "whole"), files(folder)
    same = sum(first[name] == second.get(name) for name in first)
    report = first["report.html"] == second.get("report.html")
    done = json.loads(kept.read_text())
    return [
        (
            f"killed with {', '.join(map(str, done))} stages done: files that are the same",
            f"{same} of {len(first)}",
            "all",
            same == len(first) == len(second),
        ),
        ("the same report", "yes" if report else "no", "yes", report),
    ]


def files(folder: Path) -> dict[str, bytes]:
    """Everything but the stamps, which hold times."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file() and "stages" not in path.parts and "dataset" not in path.parts
    }


def from_nothing(home: Path) -> list[Row]:
    """150 cases, simulations and all."""
    spent = run(["--samples", "150", "-o", str(home / "nothing")], home / "nothing.json")
    return [
        (
            "150 cases from nothing, two workers",
            f"{spent['wall'] / 60:.1f} min, {spent['cpu'] / 60:.1f} min of CPU",
            "15 min",
            spent["wall"] <= 900.0,
        )
    ]


def wheel(home: Path) -> list[Row]:
    """Built from a clean copy, installed in an empty environment, predicting without a network."""
    place = home / "wheel"
    if not (place / "out/summary.json").exists():
        shutil.rmtree(place, ignore_errors=True)
        place.mkdir(parents=True)
        subprocess.run(["git", "clone", "-q", str(SOURCES), str(place / "clone")], check=True)
        venv.create(place / "venv", with_pip=True)
        python = str(place / "venv/bin/python")
        subprocess.run([python, "-m", "pip", "install", "-q", "build"], check=True)
        subprocess.run(
            [python, "-m", "build", "-q", "-o", str(place), str(place / "clone")], check=True
        )
        built = str(next(place.glob("*.whl")))
        subprocess.run([python, "-m", "pip", "install", "-q", built], check=True)
        shutil.copy(SOURCES / "examples/success.toml", place)
        shutil.rmtree(place / "clone")
        # A namespace without any network interface.
        subprocess.run(
            ["unshare", "-rn", str(place / "venv/bin/braidcast"), "predict", "success.toml"]
            + ["-o", "out"],
            check=True,
            cwd=place,
            env={"PATH": "/usr/bin:/bin", "HOME": str(place)},
        )
    size = next(place.glob("*.whl")).stat().st_size
    summary = json.loads((place / "out/summary.json").read_text())
    right = summary["outcome"] == "success" and summary["in_range"]
    return [
        ("wheel", f"{size / 1e6:.1f} MB", "", True),
        ("predicts offline, no sources about", summary["outcome"], "success", right),
    ]


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--samples", type=int, default=900)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    given.output.mkdir(parents=True, exist_ok=True)
    rows, stages = whole(given.output, given.samples)
    rows += killed(given.output, given.samples, given.seed)
    rows += from_nothing(given.output)
    rows += wheel(given.output)
    lines = [f"| {a} | {b} | {c} | {'held' if d else 'missed'} |" for a, b, c, d in rows]
    table = "\n".join(["| what | measured | bar | |", "|---|---|---|---|", *lines])
    (given.output / "study.md").write_text(f"{table}\n\n{stages}\n", encoding="utf-8")
    print(table, stages, sep="\n\n")
    sys.exit(0 if all(row[3] for row in rows) else 1)


if __name__ == "__main__":
    main()
