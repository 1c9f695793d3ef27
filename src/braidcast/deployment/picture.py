"""Pictures of a deployed braid: vessel translucent, wires coloured by a value at their nodes.

Needs ``braidcast[pictures]``. The drawing is done in a process of its own, because VTK does not
raise an error where it finds no OpenGL: it ends the process. That process waits for no solver and
no case to be imported: a scene is geometry alone.
"""

from __future__ import annotations

import pickle
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import NDArray

from braidcast.results_folder import Written, add, workplace

if TYPE_CHECKING:
    from braidcast.case import Case
    from braidcast.deployment.shape import DeployedBraid

Array = NDArray[np.float64]
Surface = tuple[Array, NDArray[np.int64]]
"""Vertices (n, 3) mm and triangles (m, 3)."""

#: The same colour means the same distance in every picture; this and more, mm, is the last one.
FARTHEST = 1.0

_PATIENCE_SECONDS = 120.0


class PictureError(RuntimeError):
    """Why there is no picture, and what would give one."""


@dataclass(frozen=True, eq=False)
class Scene:
    """A braid of N nodes as one picture shows it; mm."""

    positions: Array
    """Nodes, (N, 3) mm."""
    wires: NDArray[np.int64]
    """Nodes along each wire, (wires, segments + 1)."""
    wire_radius: float
    values: Array
    """What gives the nodes their colour, (N,)."""
    legend: str
    """What the values are, above the scale of colours."""
    limits: tuple[float, float]
    """Values of the first and the last colour."""
    title: str
    lines: tuple[str, ...]
    """Small print below the title."""
    along: Array
    """From one end to the other, of the vessel or of the part of it in view, (3,)."""
    upward: Array
    """To the side of the vessel that is shown above, (3,)."""
    sac: tuple[Array, float] | None
    """Centre (3,) and radius of the sac, shown as a whole."""
    bare: bool = False
    """Braid, vessel and ruler alone: no text, no scale, for whoever puts them around it."""
    surface: Surface | None = None
    """The vessel of this scene, if it is another than that of the others."""
    marked: NDArray[np.int64] | None = None
    """Nodes (k,) to be seen at once, drawn as balls."""
    curves: tuple[Array, ...] = ()
    """Lines (n, 3), mm, drawn over all else."""


def scene(
    case: Case,
    positions: Array,
    values: Array,
    legend: str,
    limits: tuple[float, float],
    lines: tuple[str, ...],
) -> Scene:
    """The braid of a case at nodes (N, 3) mm with values (N,), seen with the sac upwards."""
    # Not for the process that draws.
    from braidcast.case_tables import Vessel
    from braidcast.deployment.shape import nodes_of_wires

    sac, line = case.vessel_geometry.aneurysm, case.centreline
    ends = case.start_arc_length + np.array([0.0, 0.5, 1.0]) * case.crimped_length
    if isinstance(case.vessel, Vessel):
        ends = np.array([0.0, 0.5, 1.0]) * line.length
    first, middle, last = line.at_arc_length(ends)
    # Without a sac the bend itself is shown from the side.
    upward = (middle - 0.5 * (first + last)) if sac is None else sac.centre - middle
    title = " ".join(case.title.split()) or "Deployed stent"
    return Scene(
        positions=positions,
        wires=nodes_of_wires(case.braid),
        wire_radius=case.braid.wire_radius,
        values=values,
        legend=legend,
        limits=limits,
        title=shortened(title, 80),
        lines=lines,
        along=last - first,
        upward=upward,
        sac=None if sac is None else (sac.centre, sac.radius),
    )


def scene_of_gaps(braid: DeployedBraid, lines: tuple[str, ...]) -> Scene:
    """The braid coloured by the free space between wire and wall."""
    legend = f"distance from wire to wall (mm; yellow: {FARTHEST:g} mm or more)"
    return scene(braid.case, braid.positions, braid.wire_distance, legend, (0.0, FARTHEST), lines)


def shortened(text: str, length: int) -> str:
    """``text``, its end given up where it is longer than ``length``."""
    return text if len(text) <= length else text[: length - 3] + "..."


def add_pictures(
    scenes: Mapping[str, Scene], surface: Surface, folder: Path, drawer: Drawer | None = None
) -> Written:
    """Draw the files of these names into ``folder``, or say in a note why they are not there.

    ``drawer``: a drawing process started before. The results are there: a picture is not worth
    failing for.
    """
    try:
        with drawer or Drawer() as process:
            drawn = process.draw(list(scenes.values()), surface)
        with workplace(folder) as work:
            for name, png in zip(scenes, drawn, strict=True):
                (work / name).write_bytes(png)
            return Written(add(work, folder), [])
    except PictureError as error:
        reason = str(error)
    except OSError as error:
        reason = error.strerror or str(error)
    return Written([], [f"no {' and no '.join(scenes)}: {reason}"])


class Drawer:
    """The process that draws. Started before there is anything to draw, it imports VTK meanwhile.

    Use it in a ``with`` statement: it ends there, whether it has drawn or not.
    """

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._failure = ""
        if find_spec("pyvista") is None:
            self._failure = "PyVista is not installed: pip install 'braidcast[pictures]'"
            return
        command = [sys.executable, "-m", "braidcast.deployment.drawing"]
        pipe = subprocess.PIPE
        try:
            self._process = subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe)
        except OSError as error:
            self._failure = f"the drawing process failed: {error}"

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._process is not None and self._process.poll() is None:
            self._process.kill()
            self._process.communicate()

    def draw(self, scenes: list[Scene], surface: Surface) -> list[bytes]:
        """Draw each scene in the vessel's ``surface``, once; PNG bytes.

        ``PictureError`` if PyVista is not installed or finds no OpenGL on this machine.
        """
        process = self._process
        if process is None:
            raise PictureError(self._failure)
        try:
            drawn, said = process.communicate(pickle.dumps((scenes, surface)), _PATIENCE_SECONDS)
        except (OSError, subprocess.TimeoutExpired) as error:
            raise PictureError(f"the drawing process failed: {error}") from None
        if process.returncode < 0:
            raise PictureError(
                "VTK found no OpenGL here: install libegl1, or Mesa's software OpenGL"
            )
        if process.returncode or not drawn.startswith(pickle.PROTO):
            lines = said.decode(errors="replace").strip().splitlines() or ["no reason given"]
            raise PictureError(f"the picture could not be drawn: {lines[-1]}")
        return pickle.loads(drawn)
