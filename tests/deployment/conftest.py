"""Deployments at full size, each computed once for all tests and all test workers."""

import fcntl
import os
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from braidcast.case import Case
from braidcast.deployment.result import Deployment
from braidcast.deployment.simulate import simulate

EXAMPLES = Path(__file__).parents[2] / "examples"
Once = Callable[[str, Callable[[], Any]], Any]


@pytest.fixture(scope="session")
def once() -> Once:
    """once(name, compute): compute() by the first worker that asks, its result for all others."""
    folder = Path(os.environ["BRAIDCAST_CACHE"])

    def once(name: str, compute: Callable[[], Any]) -> Any:
        file = folder / f"{name}.pickle"
        with open(folder / f"{name}.lock", "w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not file.exists():
                file.write_bytes(pickle.dumps(compute()))
        return pickle.loads(file.read_bytes())

    return once


def example(name: str) -> Case:
    return Case.from_toml(EXAMPLES / f"{name}.toml")


@pytest.fixture(scope="session")
def success(once: Once) -> Deployment:
    """examples/success.toml, with its frames."""
    return once("success", lambda: simulate(example("success"), keep_frames=True))


@pytest.fixture(scope="session")
def end_in_sac(once: Once) -> Deployment:
    return once("end_in_sac", lambda: simulate(example("failure_end_in_sac")))


@pytest.fixture(scope="session")
def strongly_curved(once: Once) -> Deployment:
    return once("strongly_curved", lambda: simulate(example("strongly_curved")))


@pytest.fixture(scope="session")
def straight(once: Once) -> Callable[[float], Deployment]:
    """A function of the crimped radius, in free radii: deployed in a straight tube, R_v 1.5 mm."""

    def straight(share: float) -> Deployment:
        tables = {
            "vessel": {"P1": [0.0, 0.0, 25.0], "diameter": 3.0},
            "site": {"eta": 0.5, "crimped_radius": share * 2.614},
        }
        return once(f"straight_{share}", lambda: simulate(Case.from_dict(tables)))

    return straight
