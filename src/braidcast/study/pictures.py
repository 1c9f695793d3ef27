"""Pictures of braids in their vessels, several in a figure (paper, Figures 2, 4, 10, 11)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.image import imread
from numpy.typing import NDArray

from braidcast.atomic import write_atomically
from braidcast.case import Case
from braidcast.deployment.picture import Drawer, Scene, Surface, scene
from braidcast.study.plots import style
from braidcast.vessels.surface import vessel_surface

Array = NDArray[np.float64]

NOTHING: Surface = (np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))
"""No vessel."""

DOTS = 170
"""Dots an inch."""

_ASPECT = 0.625


STATES = ("free", "crimped", "straight", "positioned", "deployed")
"""Nodes that ``strategy_figure`` needs."""


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
    decades: tuple[float, float] = (1.0, 10.0),
) -> None:
    """Write a PNG of braids, each seen with its sac upwards and with a ruler of its own.

    Values are decimal logarithms; ``legend`` and the ends ``decades`` of their scale, if there are
    any. ``PictureError`` if this machine cannot draw.
    """
    limits = float(np.log10(decades[0])), float(np.log10(decades[1]))
    scenes = [
        replace(
            _scene(p.case, p.positions, p.values, limits),
            surface=vessel_surface(p.case.vessel_geometry),
            marked=p.mark,
        )
        for p in panels
    ]
    titles = [p.title for p in panels]
    figure, axes = _figure(titles, 0.55 if legend else 0.0)
    _fill(axes, scenes, titles)
    if legend:
        colours = ScalarMappable(LogNorm(*decades), "viridis")
        bar = figure.colorbar(
            colours, ax=axes, location="bottom", shrink=0.6, aspect=40, extend="both", pad=0.02
        )
        bar.set_label(legend)
    _save(figure, path)


def strategy_figure(
    path: Path,
    case: Case,
    *,
    free: Array,
    crimped: Array,
    straight: Array,
    positioned: Array,
    deployed: Array,
    centrelines: Array,
) -> None:
    """Write a PNG of the deployment strategy (paper, Figure 2).

    Nodes (N, 3) mm in five states; ``centrelines`` (k, rings, 3) from C_0 to C_T. ``PictureError``
    if this machine cannot draw.
    """
    surface = vessel_surface(case.vessel_geometry)
    both = np.concatenate([crimped, free + np.array([0.0, -5.0, 0.0])])
    whole = _scene(case, positioned, None, (0.0, 1.0))
    states = (
        ("free (below) and crimped stent", both, 2, NOTHING, ()),
        ("crimped stent on $C_0$ at the site", straight, 1, surface, (centrelines[0],)),
        ("centreline $C_T$ in the vessel", positioned, 0, surface, (centrelines[-1],)),
        ("intermediate centrelines $C_t$", straight, 0, surface, tuple(centrelines)),
        ("positioned stent", positioned, 1, surface, ()),
        ("deployed stent", deployed, 1, surface, ()),
    )
    scenes = [
        replace(
            whole,
            positions=positions,
            # Without wires the nodes still say what is to be seen.
            wires=np.concatenate([whole.wires[:0], *(whole.wires + i * count for i in range(n))]),
            values=np.zeros(len(positions)),
            surface=vessel,
            curves=curves,
            sac=whole.sac if len(vessel[0]) else None,
        )
        for count in [len(positioned)]
        for _, positions, n, vessel, curves in states
    ]
    titles = [title for title, *_ in states]
    figure, axes = _figure(titles)
    _fill(axes, scenes, titles)
    _save(figure, path)


def _scene(
    case: Case, positions: Array, values: Array | None, limits: tuple[float, float]
) -> Scene:
    given = np.zeros(len(positions)) if values is None else values
    found = scene(case, positions, given, "", limits, ())
    return replace(found, bare=True)


def _figure(titles: Sequence[str], below: float = 0.0) -> tuple[Figure, list[Axes]]:
    """Two columns of panels as high as their pictures, titles above, ``below`` inches left free."""
    rows = -(-len(titles) // 2)
    lines = max(title.count("\n") + 1 for title in titles)
    height = 0.5 * style.WIDTH * _ASPECT + 0.1 + 0.16 * lines
    figure = Figure(figsize=(style.WIDTH, rows * height + below), layout="constrained")
    axes = list(figure.subplots(rows, 2, squeeze=False).flat)
    for axis in axes:
        axis.set_axis_off()
    return figure, axes[: len(titles)]


def _fill(axes: Sequence[Axes], scenes: Sequence[Scene], titles: Sequence[str]) -> None:
    with Drawer() as drawer:
        drawn = drawer.draw(list(scenes), NOTHING)
    for letter, axis, png, title in zip("ABCDEFGHIJ", axes, drawn, titles, strict=False):
        axis.imshow(imread(BytesIO(png)), interpolation="antialiased")
        axis.set_title(f"{style.bold(letter)}  {title}", loc="left", fontsize=8.5)


def _save(figure: Figure, path: Path) -> None:
    stream = BytesIO()
    figure.savefig(stream, format="png", dpi=DOTS, metadata={"Software": None})
    write_atomically(path, stream.getvalue())
