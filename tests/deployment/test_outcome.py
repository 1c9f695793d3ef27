"""Both labels on positions made by hand (errata row 16)."""

from typing import Any

import numpy as np
import pytest

from braidcast.case import Case
from braidcast.deployment.outcome import Outcome, outcome
from braidcast.deployment.result import Deployment


def labels(deployment: Deployment, moved: dict[int, Any], off_wall: float = 0.0) -> Outcome:
    """Labels with some nodes moved, and the first ring's distance from the wall raised."""
    positions = deployment.positions.copy()
    distance = np.zeros(len(positions))
    for node, place in moved.items():
        positions[node] = place
    distance[deployment.case.braid.rings == 0] = off_wall
    return outcome(deployment.case, positions, distance)


def at_depth(case: Case, depth: float) -> np.ndarray:
    """A point so deep inside the sphere, on its far side from the vessel."""
    assert case.aneurysm is not None and case.aneurysm_centre is not None
    return case.aneurysm_centre + [0.0, case.aneurysm.diameter / 2.0 - depth, 0.0]


def test_both_ends_in_the_vessel_is_success(deployment: Deployment) -> None:
    assert labels(deployment, {}) == Outcome("success", "success", 0)


@pytest.mark.parametrize("ring", [0, 24])
def test_an_end_node_in_the_sac_is_failure(deployment: Deployment, ring: int) -> None:
    inside = at_depth(deployment.case, 2.0)
    assert labels(deployment, {ring: inside}) == Outcome("failure", "failure", 1)


def test_the_wire_must_be_in_the_sac_with_all_its_width(deployment: Deployment) -> None:
    width = deployment.case.braid.wire_radius
    assert labels(deployment, {0: at_depth(deployment.case, width + 1e-9)}).label == "failure"
    assert labels(deployment, {0: at_depth(deployment.case, width - 1e-9)}).label == "success"


def test_nodes_between_the_ends_may_bulge(deployment: Deployment) -> None:
    inside = at_depth(deployment.case, 2.0)
    assert labels(deployment, {10: inside, 23: inside}).label == "success"


def test_every_end_node_is_counted(deployment: Deployment) -> None:
    inside = at_depth(deployment.case, 2.0)
    ends = deployment.case.braid.end_nodes
    assert labels(deployment, dict.fromkeys(ends, inside)).end_nodes_in_sac == len(ends) == 24


def test_an_end_on_the_parent_wall_at_the_neck_is_no_clinical_failure(
    deployment: Deployment,
) -> None:
    case = deployment.case
    middle = case.centreline.at_arc_length(case.centreline.length / 2.0)[0]
    on_wall = middle + [0.0, case.vessel_radius - case.braid.wire_radius, 0.0]
    assert labels(deployment, {0: on_wall}) == Outcome("failure", "success", 1)


def test_an_end_ring_off_the_wall_is_a_clinical_failure_only(deployment: Deployment) -> None:
    assert labels(deployment, {}, off_wall=0.11) == Outcome("success", "failure", 0)
    assert labels(deployment, {}, off_wall=0.09) == Outcome("success", "success", 0)


def test_without_an_aneurysm_no_end_can_be_in_it(tables: dict[str, Any]) -> None:
    del tables["aneurysm"]
    case = Case.from_dict(tables)
    positions = np.array(case.braid.positions)
    assert outcome(case, positions, np.zeros(len(positions))).label == "success"
