"""Shared by the tests: a case, a deployment made up from geometry alone, the command, a dataset."""

import os
import shutil
import signal
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from braidcast import cli
from braidcast.case import Case
from braidcast.dataset.folder import DatasetFolder
from braidcast.dataset.hypercube import nested_hypercube
from braidcast.dataset.plan import Plan
from braidcast.dataset.work import Job, do_case
from braidcast.deployment.result import Deployment
from braidcast.deployment.simulate import simulate
from braidcast.surrogate.model import SurrogateModel
from braidcast.surrogate.placed_braid import placed_braid
from braidcast.surrogate.predictors import end_depths
from braidcast.surrogate.recipes import RECIPES
from braidcast.surrogate.train import train_and_test
from braidcast.surrogate.training_set import Simulations

_cache = pytest.StashKey[str]()


def pytest_configure(config: pytest.Config) -> None:
    """Give all workers one new cache; compile before they start, for two at once can collide."""
    if hasattr(config, "workerinput"):
        return
    config.stash[_cache] = tempfile.mkdtemp(prefix="braidcast-tests-")
    os.environ["BRAIDCAST_CACHE"] = config.stash[_cache]
    if getattr(config.option, "numprocesses", None):
        simulate(Case.from_dict(plain_tables()))
        nested_hypercube(2, 1, (), 0, seed=0)


def pytest_unconfigure(config: pytest.Config) -> None:
    if _cache in config.stash:
        shutil.rmtree(config.stash[_cache], ignore_errors=True)


@pytest.fixture
def tables() -> dict[str, Any]:
    """The tables of a valid case, for a test to spoil."""
    return plain_tables()


def plain_tables() -> dict[str, Any]:
    return {
        "title": "A case",
        "vessel": {"P1": [0.0, 15.0, 25.0], "diameter": 3.0},
        "aneurysm": {"diameter": 7.0, "protrusion": 0.5},
        "device": {"wires": 12, "segments": 24},
        "site": {"eta": 0.5},
    }


@pytest.fixture
def case(tables: dict[str, Any]) -> Case:
    return Case.from_dict(tables)


@pytest.fixture
def deployment(case: Case) -> Deployment:
    """The braid bent along the centreline, just inside the vessel: no mechanics."""
    return bent_along_vessel(case)


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Callable[..., int]:
    """Run the command in ``tmp_path`` and return its exit code."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(signal, "signal", lambda *_: signal.SIG_DFL)

    def run(*arguments: str | Path) -> int:
        monkeypatch.setattr(sys, "argv", ["braidcast", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        return ended.value.code if isinstance(ended.value.code, int) else 0

    return run


def bent_along_vessel(case: Case) -> Deployment:
    braid, centreline = case.braid, case.centreline
    radius = case.vessel_radius - 2.0 * braid.wire_radius
    length = braid.crimped_length(radius)
    straight = braid.positions_on_cylinder(radius, length)
    along = case.start_arc_length + straight[:, 2]
    across = np.array([1.0, 0.0, 0.0])
    beside = np.cross(centreline.tangent_at_arc_length(along), across)
    positions = (
        centreline.at_arc_length(along) + straight[:, :1] * across + straight[:, 1:2] * beside
    )
    return Deployment(
        case=case,
        positions=positions,
        rotations=np.tile(np.eye(3), (len(positions), 1, 1)),
        elements=braid.elements,
        crossings=braid.crossings,
        wire_distance=-case.vessel_geometry.distance(positions) - braid.wire_radius,
        contact_force=np.linspace(0.0, 1e-3, len(positions)),
        positioned_centreline=centreline.at_arc_length(
            case.start_arc_length + np.linspace(0.0, case.crimped_length, braid.segments + 1)
        ),
        outcome="success",
        clinical_outcome="success",
        converged=True,
        reason="equilibrium",
        newton_iterations=70,
        residual_N=1e-6,
        residual_relative=1e-5,
        strain_energy_mJ=1.5,
        max_penetration_mm=0.002,
        crimped_length_mm=case.crimped_length,
        deployed_length_mm=length,
        free_length_mm=braid.length,
        end_nodes_in_sac=0,
        wall_seconds=6.0,
        cpu_seconds=5.9,
        frames=[("crimp", braid.positions), ("release <&>", positions)],
    )


LAW_PLAN = """\
seed = 3
cases = 90
subsets = [40]
tests = 24
[case.vessel]
P1 = [0.0, { min = 10.0, max = 25.0 }, { min = 20.0, max = 30.0 }]
diameter = { min = 2.5, max = 3.5 }
[case.aneurysm]
diameter = { min = 6.0, max = 8.0 }
protrusion = 0.5
[case.device]
wires = 12
segments = 20
length = 8.0
[case.site]
eta = { min = 0.0, max = 1.0 }
"""


def bulged(case: Case) -> np.ndarray:
    """Nodes (N, 3) mm: the placed braid, bulged into the sac by a tenth of a millimetre or two."""
    placed = placed_braid(case)
    assert case.aneurysm is not None and case.aneurysm_centre is not None
    away = np.linalg.norm(placed.positions - case.aneurysm_centre, axis=1)
    bulge = 0.4 * np.exp(-((away / case.aneurysm.diameter) ** 2)) * case.vessel_radius
    departure = np.zeros_like(placed.positions)
    departure[:, 1] = bulge
    return placed.moved(departure)


def pretend(case: Case, crimped: Path) -> Deployment:
    """A deployment by that law, without mechanics."""
    braid, positions, placed = case.braid, bulged(case), placed_braid(case)
    zeros = np.zeros(braid.node_count)
    outcome = "failure" if end_depths(case, placed.positions).max() > 0.0 else "success"
    return Deployment(
        case=case,
        positions=positions,
        rotations=np.tile(np.eye(3), (braid.node_count, 1, 1)),
        elements=braid.elements,
        crossings=braid.crossings,
        wire_distance=zeros,
        contact_force=zeros,
        positioned_centreline=np.zeros((braid.segments + 1, 3)),
        outcome=outcome,
        clinical_outcome=outcome,
        converged=True,
        reason="equilibrium",
        newton_iterations=1,
        residual_N=0.0,
        residual_relative=0.0,
        strain_energy_mJ=0.0,
        max_penetration_mm=0.0,
        crimped_length_mm=case.crimped_length,
        deployed_length_mm=placed.length,
        free_length_mm=braid.length,
        end_nodes_in_sac=0,
        wall_seconds=0.0,
        cpu_seconds=0.0,
    )


@pytest.fixture(scope="session")
def store(tmp_path_factory: pytest.TempPathFactory) -> DatasetFolder:
    """All cases of the plan, finished."""
    folder = DatasetFolder.create(
        Plan.from_text(LAW_PLAN), tmp_path_factory.mktemp("store") / "data"
    )
    folder.cases_folder.mkdir()
    for index in range(len(folder)):
        assert do_case(Job(folder.path, folder.plan_id, pretend), index).finished
    return folder


@pytest.fixture(scope="session")
def simulations(store: DatasetFolder) -> Simulations:
    return Simulations.of(store)


@pytest.fixture(scope="session")
def model(simulations: Simulations) -> SurrogateModel:
    return train_and_test(simulations, RECIPES["ours"])[0]
