"""Pictures of braids in their vessels, several in a figure (paper, Figures 2, 4, 11, 12)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.image import imread
from numpy.typing import NDArray

from braidcast.atomic import write_atomically
from braidcast.case import Case
from braidcast.deployment.picture import Drawer, Scene, Surface, scene
from braidcast.vessels.surface import vessel_surface

Array = NDArray[np.float64]

NOTHING: Surface = (np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))
"""No vessel."""

DOTS = 170
"""Dots an inch."""

_WIDTH, _ASPECT = 7.2, 0.625


@dataclass(frozen=True, eq=False)
class Panel:
    """Nodes (N, 3) mm of the case's braid in its vessel; ``values`` (N,) give the colour.

    ``mark`` (k,): nodes drawn as balls.
    """

    case: Case
    positions: Array
    title: str
    values: Array | None = None
    mark: NDArray[np.int64] | None = None


def braids_figure(
    path: Path,
    panels: Sequence[Panel],
    *,
    legend: str = "",
    limits: tuple[float, float] = (0.0, 1.0),
    columns: int = 2,
) -> None:
    """Write a PNG of braids, each seen with its sac upwards and with a ruler of its own.

    ``legend`` and ``limits`` of the colours, if there are values. ``PictureError`` if this machine
    cannot draw.
    """
    scenes = [
        replace(
            _scene(p.case, p.positions, p.values, limits),
            surface=vessel_surface(p.case.vessel_geometry),
            marked=p.mark,
        )
        for p in panels
    ]
    figure, axes = _panels(len(scenes), columns)
    _fill(axes, scenes, [p.title for p in panels])
    if legend:
        colours = ScalarMappable(Normalize(*limits), "viridis")
        bar = figure.colorbar(
            colours, ax=axes, location="bottom", shrink=0.6, aspect=40, extend="max", pad=0.02
        )
        bar.set_label(legend)
    _save(figure, path)


def strategy_figure(
    path: Path,
    case: Case,
    *,
    free: Array,
    crimped: Array,
    positioned: Array,
    deployed: Array,
    centrelines: Array,
) -> None:
    """Write a PNG of the deployment strategy (paper, Figure 2).

    Nodes (N, 3) mm in four states; ``centrelines`` (k, rings, 3) from C_0 to C_T. ``PictureError``
    if this machine cannot draw.
    """
    surface = vessel_surface(case.vessel_geometry)
    straight = crimped + centrelines[0, 0] - np.array([0.0, 0.0, crimped[:, 2].min()])
    beside = free + np.array([0.0, -5.0, 0.0])
    both = np.concatenate([crimped, beside])
    whole = _scene(case, positioned, None, (0.0, 1.0))
    wires = whole.wires
    states = (
        ("free (below) and crimped stent", both, NOTHING, ()),
        ("crimped stent on C_0", straight, surface, (centrelines[0],)),
        ("centreline C_T in the vessel", None, surface, (centrelines[-1],)),
        ("intermediate centrelines C_t", None, surface, tuple(centrelines)),
        ("positioned stent", positioned, surface, ()),
        ("deployed stent", deployed, surface, ()),
    )
    scenes = []
    for _, positions, vessel, curves in states:
        shown = positioned if positions is None else positions
        count = len(shown) // len(positioned)
        drawn = wires if positions is not None else wires[:0]
        drawn = np.concatenate([drawn + i * len(positioned) for i in range(count)])
        scenes.append(
            replace(
                whole,
                positions=shown,
                wires=drawn,
                values=np.zeros(len(shown)),
                surface=vessel,
                curves=curves,
                sac=whole.sac if len(vessel[0]) else None,
            )
        )
    figure, axes = _panels(len(scenes), 2)
    _fill(axes, scenes, [title for title, *_ in states])
    _save(figure, path)


def _scene(
    case: Case, positions: Array, values: Array | None, limits: tuple[float, float]
) -> Scene:
    given = np.zeros(len(positions)) if values is None else values
    found = scene(case, positions, given, "", limits, ())
    return replace(found, bare=True)


def _panels(count: int, columns: int) -> tuple[Figure, list[Axes]]:
    rows = -(-count // columns)
    width = _WIDTH / columns
    figure = Figure(figsize=(_WIDTH, rows * (width * _ASPECT + 0.35) + 0.5), layout="constrained")
    axes = list(figure.subplots(rows, columns, squeeze=False).flat)
    for axis in axes:
        axis.set_axis_off()
    return figure, axes[:count]


def _fill(axes: Sequence[Axes], scenes: Sequence[Scene], titles: Sequence[str]) -> None:
    with Drawer() as drawer:
        drawn = drawer.draw(list(scenes), NOTHING)
    for letter, axis, png, title in zip("ABCDEFGHIJ", axes, drawn, titles, strict=False):
        axis.imshow(imread(BytesIO(png)), interpolation="antialiased")
        axis.set_title(rf"$\bf{{{letter}}}$  {title}", loc="left", fontsize=8.5)


def _save(figure: Figure, path: Path) -> None:
    from PIL import Image

    stream = BytesIO()
    figure.savefig(stream, format="png", dpi=DOTS)
    image = Image.open(stream).convert("RGB").quantize(256, Image.Quantize.MEDIANCUT)
    smaller = BytesIO()
    image.save(smaller, format="PNG", optimize=True)
    write_atomically(path, smaller.getvalue())
