"""The problem of ``braid_in_tube`` in OpenSees; prints the results as one line of JSON.

Elastic beam elements with the corotational transformation. Prescribed motion is by stiff springs
and the loads that stretch them (``--drive spring``) or by ``sp`` constraints (``--drive sp``).
The wall's springs are there from the start without stiffness; the release removes the motion and
gives them theirs.
"""

import argparse
import importlib
import json
import math
import time
from importlib.metadata import version
from typing import Any

import braid_in_tube as given
import numpy as np

DRIVE_STIFFNESS = 1e4
"""Of the springs that move and hold nodes, N/mm: radii are met to 1e-6 mm."""

JOINT_STIFFNESS = 1e4
"""Of joints by springs, N/mm: ten times the paper's."""

DRIVE, HOLD, WALL, WALL_AT, JOINT = range(1, 6)
"""Materials."""

MODULES = {"xara": "opensees.openseespy", "openseespy": "openseespy.opensees"}


class NotConverged(Exception):
    """OpenSees found no equilibrium."""


class Braid:
    """The model in OpenSees; nodes are numbered ring by ring for a narrow band."""

    def __init__(self, ops: Any, mesh: given.Mesh, options: argparse.Namespace) -> None:
        self.ops, self.mesh, self.options = ops, mesh, options
        count = len(mesh.nodes)
        # within a ring from angle 0 both ways, which halves the band
        away = np.abs((mesh.angle + np.pi) % (2.0 * np.pi) - np.pi)
        order = np.lexsort((np.round(away, 9), mesh.ring))
        self.tags = np.empty(count, dtype=int)
        self.tags[order] = np.arange(1, count + 1)
        ops.wipe()
        ops.model("basic", "-ndm", 3, "-ndf", 6)
        for node in order:
            ops.node(int(self.tags[node]), *mesh.nodes[node].tolist())
        self._add_wires()
        self._add_springs()

    def _add_wires(self) -> None:
        ops, mesh = self.ops, self.mesh
        section = (
            float(given.AREA),
            given.YOUNG_MODULUS,
            given.SHEAR_MODULUS,
            float(given.POLAR_INERTIA),
            float(given.INERTIA),
            float(given.INERTIA),
        )
        for number, (first, second) in enumerate(mesh.elements, start=1):
            outward = (mesh.nodes[first] + mesh.nodes[second]) * [1.0, 1.0, 0.0]
            ops.geomTransf("Corotational", number, *(outward / np.linalg.norm(outward)).tolist())
            ends = int(self.tags[first]), int(self.tags[second])
            ops.element("elasticBeamColumn", number, *ends, *section, number)
        self.next_element = len(mesh.elements) + 1
        ops.uniaxialMaterial("Elastic", JOINT, JOINT_STIFFNESS)
        for first, second in mesh.crossings:
            ends = int(self.tags[first]), int(self.tags[second])
            if self.options.joints == "equalDOF":
                ops.equalDOF(*ends, 1, 2, 3)
            else:
                self._spring(*ends, (JOINT, JOINT, JOINT), (1, 2, 3), mesh.angle[first])

    def _add_springs(self) -> None:
        """Springs to the ground at every node that has translations of its own."""
        ops, mesh = self.ops, self.mesh
        share = mesh.wire_length.copy()
        np.add.at(share, mesh.crossings[:, 0], mesh.wire_length[mesh.crossings[:, 1]])
        own = np.ones(len(share), dtype=bool)
        if self.options.joints == "equalDOF":
            own[mesh.crossings[:, 1]] = False
        else:
            share = mesh.wire_length
        self.own = np.flatnonzero(own)
        touch = given.FREE_RADIUS - (given.TUBE_RADIUS - given.WIRE_RADIUS)
        ops.uniaxialMaterial("Elastic", DRIVE, DRIVE_STIFFNESS)
        ops.uniaxialMaterial("Elastic", HOLD, DRIVE_STIFFNESS)
        ops.uniaxialMaterial("ENT", WALL, 1e-12)
        ops.uniaxialMaterial("InitStrainMaterial", WALL_AT, WALL, -touch)
        self.drives: list[int] = []
        self.walls: list[tuple[int, float]] = []
        for node in self.own:
            tag, angle = int(self.tags[node]), mesh.angle[node]
            ground = len(self.tags) + tag
            ops.node(ground, *mesh.nodes[node].tolist())
            ops.fix(ground, 1, 1, 1, 1, 1, 1)
            if mesh.ring[node] == 0:
                ops.fix(tag, 0, 0, 1, 0, 0, 0)
            # the first local axis points to the axis of the braid: a wall that is met shortens it
            self.drives.append(self._spring(ground, tag, (DRIVE, HOLD), (1, 2), angle))
            wall = self._spring(ground, tag, (WALL_AT,), (1,), angle)
            self.walls.append((wall, given.WALL_STIFFNESS * float(share[node])))

    def _spring(
        self, first: int, second: int, materials: tuple[int, ...], axes: tuple[int, ...], at: float
    ) -> int:
        number = self.next_element
        self.next_element += 1
        inward = -math.cos(at), -math.sin(at), 0.0
        around = math.sin(at), -math.cos(at), 0.0
        self.ops.element(
            *("zeroLength", number, first, second, "-mat", *materials, "-dir", *axes),
            *("-orient", *inward, *around),
        )
        return number

    def prescribe(self) -> None:
        """Radial motion of all nodes: crimped at time 1, opened at time 2."""
        ops = self.ops
        radii = (given.FREE_RADIUS, given.CRIMPED_RADIUS, given.OPENED_RADIUS)
        way = [radius - given.FREE_RADIUS for radius in radii]
        ops.timeSeries("Path", 1, "-time", 0.0, 1.0, 2.0, "-values", *way)
        ops.pattern("Plain", 1, 1)
        for node in self.own:
            tag, angle = int(self.tags[node]), self.mesh.angle[node]
            if self.options.drive == "sp":
                ops.sp(tag, 1, math.cos(angle))
                ops.sp(tag, 2, math.sin(angle))
            else:
                pull = DRIVE_STIFFNESS * math.cos(angle), DRIVE_STIFFNESS * math.sin(angle)
                ops.load(tag, *pull, 0.0, 0.0, 0.0, 0.0)

    def release(self) -> None:
        """Drop the radial motion; put the wall in its place."""
        ops = self.ops
        ops.remove("loadPattern", 1)
        for number in self.drives:
            ops.parameter(number, "element", number, "material", DRIVE, "E")
            ops.updateParameter(number, 0.0)
        for number, stiffness in self.walls:
            ops.parameter(number, "element", number, "E")
            ops.updateParameter(number, stiffness)

    def analyse(self) -> None:
        """Set up the analysis, once for all stages."""
        ops, options = self.ops, self.options
        strength = (1e8, 1e8) if options.handler == "Penalty" else ()
        ops.constraints(options.handler, *strength)
        ops.numberer(options.numberer)
        ops.system(options.system)
        # penalties leave large unbalanced forces on what they join
        test = "NormDispIncr" if options.handler == "Penalty" else "NormUnbalance"
        ops.test(test, given.TOLERANCE, options.iterations, 0)
        ops.algorithm(options.algorithm)
        ops.integrator("LoadControl", 0.0)
        ops.analysis("Static")

    def solve(self, steps: int, increment: float) -> int:
        """Newton iterations of ``steps`` equilibria, time raised by ``increment`` each.

        Raises NotConverged.
        """
        self.ops.integrator("LoadControl", increment)
        iterations = 0
        for step in range(steps):
            failed = self.ops.analyze(1)
            iterations += int(self.ops.testIter())
            if failed:
                raise NotConverged(f"step {step + 1} of {steps}, {iterations} iterations")
        return iterations

    def positions(self) -> Any:
        """Nodes (N, 3), mm."""
        moved = [[self.ops.nodeDisp(int(tag), axis) for axis in (1, 2, 3)] for tag in self.tags]
        return self.mesh.nodes + np.array(moved)

    def strain_energy(self) -> float:
        """Energy of the beams, mJ, exact for forces linear along them: 1/2 q^T f q, by element."""
        mesh = self.mesh
        lengths = np.linalg.norm(np.diff(mesh.nodes[mesh.elements], axis=1)[:, 0], axis=1)
        forces = np.array(
            [self.ops.eleResponse(n, "basicForce") for n in range(1, len(lengths) + 1)]
        )
        axial, z1, z2, y1, y2, torque = forces.T
        bending = z1 * z1 - z1 * z2 + z2 * z2 + y1 * y1 - y1 * y2 + y2 * y2
        energy = (
            axial**2 / (2.0 * given.YOUNG_MODULUS * given.AREA)
            + torque**2 / (2.0 * given.SHEAR_MODULUS * given.POLAR_INERTIA)
            + bending / (6.0 * given.YOUNG_MODULUS * given.INERTIA)
        )
        return float((lengths * energy).sum())

    def wall_force(self) -> float:
        """Sum over the nodes of what the wall pushes, N."""
        forces = [self.ops.eleResponse(wall, "localForce") for wall, _ in self.walls]
        return -float(np.sum(forces))


def run(options: argparse.Namespace) -> dict[str, Any]:
    ops = importlib.import_module(MODULES[options.engine])
    start = time.process_time()
    mesh = given.mesh(options.refinement)
    braid = Braid(ops, mesh, options)
    braid.prescribe()
    package = MODULES[options.engine].split(".")[0]
    result: dict[str, Any] = {
        "version": f"{package} {version(package)}",
        "build_seconds": time.process_time() - start,
    }
    for stage in ("crimped", "opened", "released"):
        steps = {"crimped": options.steps[0], "opened": options.steps[1], "released": 1}[stage]
        start = time.process_time()
        if stage == "crimped":
            braid.analyse()
        if stage == "released":
            braid.release()
        iterations = braid.solve(steps, 0.0 if stage == "released" else 1.0 / steps)
        result[stage] = {
            "iterations": iterations,
            "seconds": time.process_time() - start,
            "length_mm": mesh.length(braid.positions()),
            "strain_energy_mJ": braid.strain_energy(),
        }
    result["wall_force_N"] = braid.wall_force()
    result["peak_radius_mm"] = float(np.hypot(*braid.positions()[:, :2].T).max())
    return result


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--engine", choices=list(MODULES), default="xara")
    parser.add_argument("--refinement", type=int, default=1, help="elements between crossings")
    parser.add_argument("--drive", choices=["spring", "sp"], default="spring")
    parser.add_argument("--joints", choices=["equalDOF", "spring"], default="equalDOF")
    parser.add_argument("--steps", type=int, nargs=2, default=[3, 1], help="to crimp, to open")
    parser.add_argument("--handler", default="Transformation")
    parser.add_argument("--numberer", default="Plain")
    parser.add_argument("--system", default="BandSPD")
    parser.add_argument("--algorithm", default="Newton")
    parser.add_argument("--iterations", type=int, default=40, help="at most, a step")
    print(json.dumps(run(parser.parse_args())))


if __name__ == "__main__":
    main()
