"""What is kept of a case: names, units and meanings, the same in case files and in datasets."""

from __future__ import annotations

from typing import NamedTuple


class Field(NamedTuple):
    """One quantity of a case."""

    name: str
    dimensions: tuple[str, ...]
    dtype: str
    unit: str
    """ "1" for a pure number."""
    meaning: str


#: Results at the nodes and rings, in millimetres and newtons. Single precision resolves 4 nm
#: at 50 mm, far below what the equilibrium is converged to.
ARRAYS = (
    Field("positions", ("node", "xyz"), "f4", "mm", "nodes of the released stent"),
    Field(
        "rotation_vector",
        ("node", "xyz"),
        "f4",
        "rad",
        "turn of each node from the free stent: axis times angle",
    ),
    Field("contact_force", ("node",), "f4", "N", "size of the force the wall puts on each node"),
    Field(
        "positioned_centreline",
        ("ring", "xyz"),
        "f8",
        "mm",
        "ring centres of the crimped stent laid along the vessel",
    ),
)

#: Results that are one number each; those the Deployment calls otherwise are in case_file.
NUMBERS = (
    Field("newton_iterations", (), "f8", "1", "Newton iterations of all stages"),
    Field("residual", (), "f8", "N", "norm of the unbalanced nodal forces"),
    Field("residual_relative", (), "f8", "1", "residual over the sum of the contact forces"),
    Field("strain_energy", (), "f8", "mJ", "elastic energy stored in the wires"),
    Field("deployed_length", (), "f8", "mm", "length of the line through the ring centres"),
    Field("crimped_length", (), "f8", "mm", "that length when crimped"),
    Field("max_penetration", (), "f8", "mm", "deepest overlap of a wire and the wall"),
    Field("end_nodes_in_sac", (), "f8", "1", "nodes of the two end rings that lie in the sac"),
)

RESULTS = (*ARRAYS, *NUMBERS)

#: Known of a case even if it failed.
COSTS = (
    Field("cpu_seconds", (), "f8", "s", "processor time of the simulation"),
    Field("wall_seconds", (), "f8", "s", "time from its beginning to its end"),
)

CENTRE = Field("aneurysm_centre", ("xyz",), "f8", "mm", "centre of the sac; none without a sac")

LABELS = {
    "outcome": "failure if a node of an end ring lies in the sac, else success",
    "clinical_outcome": "failure also if an end ring stands off the wall of the parent vessel",
}
