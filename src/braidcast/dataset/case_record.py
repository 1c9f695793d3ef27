"""What is kept of a case that was simulated, in memory."""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib.metadata import version
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from braidcast import __version__
from braidcast.dataset.fields import RESULTS
from braidcast.dataset.netcdf3 import Place
from braidcast.dataset.plan import Range
from braidcast.deployment.result import Deployment
from braidcast.deployment.sources import fingerprint


@dataclass(frozen=True)
class Origin:
    """Which case of which plan a file belongs to."""

    plan_id: str
    index: int
    toml: str
    """The case itself, as the text of a case file."""
    parameters: tuple[tuple[Range, float], ...]


@dataclass(frozen=True, eq=False)
class CaseRecord:
    """What is known of a case that was simulated.

    ``values`` holds the fields of ``braidcast.dataset.fields`` by name: all of them if the status
    is "finished", at most what it cost if "failed". ``places`` says where in the file they came
    from.
    """

    plan_id: str
    index: int
    status: Literal["finished", "failed"]
    reason: str
    outcome: str
    clinical_outcome: str
    values: Mapping[str, NDArray[Any]]
    toml: str
    versions: str
    checksum: str
    """SHA-256 over the results, not over times and versions; empty if the case failed."""
    places: Mapping[str, Place] = field(default_factory=dict)

    @property
    def finished(self) -> bool:
        return self.status == "finished"


def record(deployment: Deployment, origin: Origin) -> CaseRecord:
    """What is kept of a deployment; one without equilibrium is a failed case."""
    costs = {
        "cpu_seconds": np.array(deployment.cpu_seconds),
        "wall_seconds": np.array(deployment.wall_seconds),
    }
    if not deployment.converged:
        return failure(origin, deployment.reason or "no equilibrium", costs)
    centre = deployment.case.aneurysm_centre
    values = {
        "positions": deployment.positions,
        "rotation_vector": Rotation.from_matrix(deployment.rotations).as_rotvec(),
        "contact_force": deployment.contact_force,
        "positioned_centreline": deployment.positioned_centreline,
        "newton_iterations": deployment.newton_iterations,
        "residual": deployment.residual_N,
        "residual_relative": deployment.residual_relative,
        "strain_energy": deployment.strain_energy_mJ,
        "deployed_length": deployment.deployed_length_mm,
        "crimped_length": deployment.crimped_length_mm,
        "max_penetration": deployment.max_penetration_mm,
        "end_nodes_in_sac": deployment.end_nodes_in_sac,
    }
    results = {f.name: np.asarray(values[f.name], dtype=f">{f.dtype}") for f in RESULTS}
    labels = (deployment.outcome, deployment.clinical_outcome)
    return CaseRecord(
        plan_id=origin.plan_id,
        index=origin.index,
        status="finished",
        reason=deployment.reason,
        outcome=labels[0],
        clinical_outcome=labels[1],
        values={
            **results,
            **costs,
            "aneurysm_centre": np.full(3, np.nan) if centre is None else centre,
        },
        toml=origin.toml,
        versions=code_versions(),
        checksum=_checksum(results, labels),
    )


def failure(
    origin: Origin, reason: str, costs: Mapping[str, NDArray[Any]] | None = None
) -> CaseRecord:
    """A case that gave no result, and why."""
    return CaseRecord(
        plan_id=origin.plan_id,
        index=origin.index,
        status="failed",
        reason=reason,
        outcome="",
        clinical_outcome="",
        values=costs or {},
        toml=origin.toml,
        versions=code_versions(),
        checksum="",
    )


def _checksum(results: Mapping[str, NDArray[Any]], labels: tuple[str, str]) -> str:
    digest = hashlib.sha256("\0".join(labels).encode())
    for name, values in results.items():
        digest.update(name.encode())
        digest.update(values.tobytes())
    return digest.hexdigest()


@cache
def code_versions() -> str:
    """What the cases of this process are made by, down to the sources of the simulation."""
    packages = ", ".join(f"{name} {version(name)}" for name in ("numpy", "scipy", "numba"))
    braidcast = f"braidcast {__version__} (sources {fingerprint()})"
    return f"{braidcast}, {packages}, python {platform.python_version()}"
