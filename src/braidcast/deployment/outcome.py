"""Did it succeed: where the two ends of the deployed braid lie (errata row 16)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from braidcast.case import Case
from braidcast.case_tables import VesselFile
from braidcast.mechanics.rotations import Array

APPOSED = 0.1
"""An end farther than this from the wall, mm, is not apposed (clinical label)."""

NOT_ASSESSED = "not assessed"


@dataclass(frozen=True)
class Outcome:
    """Both labels, "success", "failure" or "not assessed", and the end nodes found in the sac."""

    label: str
    clinical_label: str
    end_nodes_in_sac: int


def outcome(case: Case, positions: Array, wire_distance: Array) -> Outcome:
    """Labels of a deployed shape (N, 3), its free space to the wall (N,) given, mm.

    The paper's failure: a node of an end ring lies in the sac, R_a - |C_a - x| - r_w >= 0. The
    clinical one: such a node is also off the wall of the parent vessel, or a whole end ring stands
    off the wall on average. In a vessel from a surface they are not assessed unless it is said
    what its sac is.
    """
    if case.aneurysm is None and isinstance(case.vessel, VesselFile):
        return Outcome(NOT_ASSESSED, NOT_ASSESSED, 0)
    braid = case.braid
    ends = np.array(braid.end_nodes)
    in_sac = np.isin(ends, end_nodes_in_sac(case, positions))
    parent = case.vessel_geometry.parent_distance(positions[ends])
    off_parent = np.abs(parent + braid.wire_radius) > APPOSED
    rings = np.array(braid.rings)[ends]
    standing_off = any(
        wire_distance[ends[rings == ring]].mean() > APPOSED for ring in np.unique(rings)
    )
    failed = bool(in_sac.any())
    failed_clinically = bool((in_sac & off_parent).any()) or standing_off
    return Outcome(_word(failed), _word(failed_clinically), int(in_sac.sum()))


def end_nodes_in_sac(case: Case, positions: Array) -> NDArray[np.int64]:
    """Nodes (k,) of the end rings that lie in the sac, of a deployed shape (N, 3) mm."""
    ends, sac = np.array(case.braid.end_nodes), case.vessel_geometry.aneurysm
    if sac is None:
        return ends[:0]
    return ends[sac.depth(positions[ends]) - case.braid.wire_radius >= 0.0]


def _word(failed: bool) -> str:
    return "failure" if failed else "success"
