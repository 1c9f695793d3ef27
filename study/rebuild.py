"""Simulate the study, or what of it is missing, and compare it with cases.csv beside this file.

    python study/rebuild.py            # 35 minutes on two cores; end and start it as you like
    python study/rebuild.py --write    # take what was found as the new cases.csv

The dataset goes to ``study`` in BRAIDCAST_DATA, by default in the user's cache folder.
Ends with 1 if a case is missing, or came out otherwise.
"""

import argparse
import csv
import subprocess
import sys
from pathlib import Path

import braidcast
from braidcast.dataset.home import data_folder
from braidcast.study import PLAN

HERE = Path(__file__).parent
CASES = HERE / "cases.csv"
COLUMNS = ("test", "subset", "status", "outcome", "clinical_outcome", "checksum")


def rows() -> list[list[str]]:
    """What is kept in the repository of every case, the header first."""
    dataset = braidcast.open_dataset(data_folder() / "study")
    parameters = [
        name for name in dataset.coords if name.startswith(("vessel", "aneurysm", "site"))
    ]
    columns = {name: dataset[name].values for name in (*parameters, *COLUMNS)}
    table = [["case", *columns]]
    for case in range(dataset.sizes["case"]):
        table.append([str(case), *(str(values[case]) for values in columns.values())])
    return table


def simulate() -> int:
    """Create and run the dataset with the commands a user would give; returns the exit code."""
    folder = data_folder()
    folder.mkdir(parents=True, exist_ok=True)
    command = [sys.executable, "-m", "braidcast", "dataset"]
    create = [*command, "create", str(PLAN), "-o", str(folder / "study")]
    run = [*command, "run", str(folder / "study")]
    return subprocess.run(create).returncode or subprocess.run(run).returncode


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--write", action="store_true", help="write cases.csv anew")
    write = parser.parse_args().write
    failed = simulate()
    if failed:
        return failed
    found = rows()
    if write:
        with CASES.open("w", newline="", encoding="utf-8") as file:
            csv.writer(file, lineterminator="\n").writerows(found)
        print(f"{CASES}: {len(found) - 1} cases")
        return 0
    with CASES.open(newline="", encoding="utf-8") as file:
        expected = list(csv.reader(file))
    pairs = list(zip(found, expected, strict=False))
    label = found[0].index("outcome") + 1
    same = sum(ours == theirs for ours, theirs in pairs)
    labels = sum(ours[:label] == theirs[:label] for ours, theirs in pairs)
    total = len(expected) - 1
    print(
        f"cases of {total}: {same - 1} the same to the last bit, {labels - 1} of the same outcome"
    )
    return int(labels != len(expected))


if __name__ == "__main__":
    sys.exit(main())
