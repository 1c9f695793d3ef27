"""The problem of ``braid_in_tube`` in braidcast; prints the results as one line of JSON."""

import argparse
import json
import time
from typing import Any

import braid_in_tube as given
import numpy as np

from braidcast import __version__
from braidcast.devices import catalogue
from braidcast.mechanics import (
    BeamNet,
    Contact,
    Cylinder,
    Equilibrium,
    Joints,
    NewtonOptions,
    Problem,
    Section,
    Supports,
    follow_path,
)

THRESHOLD = 1e-6
"""Regularised depth of the wall's law, mm: so thin that the law is a spring that only pushes."""


class Braid:
    """The net with its joints; every stage has its own supports."""

    def __init__(self, mesh: given.Mesh) -> None:
        self.mesh = mesh
        section = Section.circular(given.WIRE_RADIUS, given.YOUNG_MODULUS, given.POISSON_RATIO)
        self.net = BeamNet(mesh.nodes, mesh.elements, section)
        cos, sin, zero = np.cos(mesh.angle), np.sin(mesh.angle), np.zeros(len(mesh.angle))
        radial, around = np.stack([cos, sin, zero], 1), np.stack([-sin, cos, zero], 1)
        self.axes = np.stack([radial, around, np.cross(radial, around)], axis=2)

    def _supports(self, radial_motion: float | None) -> Supports:
        count = len(self.mesh.nodes)
        fixed, motion = np.zeros((count, 6), dtype=bool), np.zeros((count, 6))
        fixed[:, 1] = True
        fixed[self.mesh.ring == 0, 2] = True
        if radial_motion is not None:
            fixed[:, 0] = True
            motion[:, 0] = radial_motion
        return Supports(fixed, motion, self.axes)

    def solve(self, last: Equilibrium | None, radial_motion: float | None) -> Equilibrium:
        """Next equilibrium: all nodes moved along their radii, or (None) let go in the tube.

        One load step, which is cut where it fails.
        """
        tube = Contact(
            Cylinder(given.TUBE_RADIUS),
            wire_radius=given.WIRE_RADIUS,
            stiffness=given.WALL_STIFFNESS,
            threshold=THRESHOLD,
            points=2,  # Gauss-Lobatto: the nodes
        )
        problem = Problem(
            self.net,
            joints=Joints(self.mesh.crossings),
            supports=self._supports(radial_motion),
            contacts=(tube,) if radial_motion is None else (),
            levels=self.mesh.ring,
        )
        options = NewtonOptions(tolerance=given.TOLERANCE, iterations=40)
        result = follow_path(problem, last.state if last else None, steps=1, options=options)
        if not result.converged:
            raise SystemExit(f"no equilibrium: {result.reason}")
        return result


def run(mesh: given.Mesh) -> dict[str, Any]:
    start = time.process_time()
    braid = Braid(mesh)
    result: dict[str, Any] = {
        "version": f"braidcast {__version__}",
        "build_seconds": time.process_time() - start,
    }
    last = None
    for stage, motion in (
        ("crimped", given.CRIMPED_RADIUS - given.FREE_RADIUS),
        ("opened", given.OPENED_RADIUS - given.CRIMPED_RADIUS),
        ("released", None),
    ):
        start = time.process_time()
        last = braid.solve(last, motion)
        result[stage] = {
            "iterations": last.iterations,
            "seconds": time.process_time() - start,
            "length_mm": mesh.length(last.state.positions),
            "strain_energy_mJ": last.evaluation.strain_energy,
        }
    assert last is not None
    result["wall_force_N"] = last.evaluation.contacts[0].total
    result["peak_radius_mm"] = float(np.hypot(*last.state.positions[:, :2].T).max())
    return result


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--refinement", type=int, default=1, help="elements between crossings")
    refinement = parser.parse_args().refinement
    assert np.allclose(given.mesh().nodes, catalogue["paper"].positions, atol=1e-12)
    run(given.mesh(rows=2))  # loads the compiled loops
    print(json.dumps(run(given.mesh(refinement))))


if __name__ == "__main__":
    main()
