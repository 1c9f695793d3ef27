"""A small dataset, and a simulation of it that takes no time."""

import sys
from collections.abc import Iterator
from pathlib import Path

import cloudpickle
import numpy as np
import pytest
from distributed import LocalCluster

from braidcast import Case, Deployment
from braidcast.dataset.folder import DatasetFolder
from braidcast.dataset.plan import Plan
from braidcast.dataset.work import Deploy

# Workers cannot import test modules.
cloudpickle.register_pickle_by_value(sys.modules[__name__])

PLAN = """\
title = "Coarse stents in few vessels"
seed = 3
cases = 6
subsets = [3]
tests = 1
[case.vessel]
P1 = [0.0, { min = 5.0, max = 20.0 }, 25.0]
diameter = 3.0
[case.aneurysm]
diameter = { min = 5.0, max = 8.0 }
protrusion = 0.5
[case.device]
wires = 12
segments = 20
length = 8.0
[case.site]
eta = { min = 0.2, max = 0.8 }
"""


@pytest.fixture
def folder(tmp_path: Path) -> DatasetFolder:
    return DatasetFolder.create(Plan.from_text(PLAN), tmp_path / "data")


@pytest.fixture
def pretended() -> Deploy:
    return pretend


def pretend(case: Case, crimped: Path) -> Deployment:
    """Different numbers for different cases, without mechanics; none are special."""
    braid, eta = case.braid, case.site.eta
    angle = np.arange(braid.node_count) * 1e-3
    turns = np.tile(np.eye(3), (braid.node_count, 1, 1))
    turns[:, 0, 0] = turns[:, 1, 1] = np.cos(angle)
    turns[:, 1, 0], turns[:, 0, 1] = np.sin(angle), -np.sin(angle)
    return Deployment(
        case=case,
        positions=braid.positions + eta,
        rotations=turns,
        elements=braid.elements,
        crossings=braid.crossings,
        wire_distance=np.zeros(braid.node_count),
        contact_force=np.full(braid.node_count, 1e-3 * eta),
        positioned_centreline=np.arange(3.0 * (braid.segments + 1)).reshape(-1, 3) + eta,
        outcome="failure" if eta > 0.6 else "success",
        clinical_outcome="failure" if eta > 0.5 else "success",
        converged=True,
        reason="equilibrium",
        newton_iterations=70,
        residual_N=1e-6 * eta,
        residual_relative=1e-5,
        strain_energy_mJ=1.5,
        max_penetration_mm=0.002,
        crimped_length_mm=27.0,
        deployed_length_mm=20.0 + eta,
        free_length_mm=braid.length,
        end_nodes_in_sac=3,
        wall_seconds=0.6,
        cpu_seconds=0.5,
    )


@pytest.fixture(scope="module")
def scheduler() -> Iterator[str]:
    """Address of a cluster that was there before; its two workers are threads of this process."""
    with LocalCluster(
        n_workers=2,
        threads_per_worker=1,
        processes=False,
        protocol="tcp://",
        memory_limit=None,
        dashboard_address="127.0.0.1:0",
        silence_logs=50,
    ) as cluster:
        yield cluster.scheduler_address
