"""A dataset to learn from: coarse braids that leave their places by a law that is known."""

from pathlib import Path

import numpy as np
import pytest

from braidcast import Case, Deployment
from braidcast.dataset.folder import DatasetFolder
from braidcast.dataset.plan import Plan
from braidcast.dataset.work import Job, do_case
from braidcast.surrogate.model import SurrogateModel
from braidcast.surrogate.placed_braid import placed_braid
from braidcast.surrogate.predictors import end_depths
from braidcast.surrogate.recipes import RECIPES
from braidcast.surrogate.train import train_and_test
from braidcast.surrogate.training_set import Simulations

PLAN = """\
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
    folder = DatasetFolder.create(Plan.from_text(PLAN), tmp_path_factory.mktemp("store") / "data")
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
