"""How diagrams look: colours that the colour-blind can tell apart, and the same bytes each time."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from io import BytesIO
from typing import Any

import matplotlib
from matplotlib import ticker
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from braidcast.study.workspace import Study

# Okabe & Ito 2008
BLACK, ORANGE, SKY, GREEN, YELLOW, BLUE, VERMILLION, PURPLE = (
    *("#000000", "#E69F00", "#56B4E9", "#009E73"),
    *("#F0E442", "#0072B2", "#D55E00", "#CC79A7"),
)
CYCLE = (BLUE, VERMILLION, GREEN, ORANGE, PURPLE, SKY, BLACK)

OURS, PAPER, PUBLISHED = BLUE, VERMILLION, BLACK
"""Of our recipe, of the paper's on our simulations, and of what the paper printed."""

Plot = Callable[..., list[str]]

WIDTH = 7.2
"""Of a diagram, inches."""

_SETTINGS: dict[Any, Any] = {
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#dddddd",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "legend.frameon": False,
    "legend.fontsize": 8.0,
    "lines.linewidth": 1.6,
    "lines.markersize": 5.0,
    "svg.fonttype": "path",
    "svg.hashsalt": "braidcast",
}


def drawn(plot: Plot) -> Plot:
    """The function ``plot``, what it draws in our style."""

    @wraps(plot)
    def inside(*args: Any, **options: Any) -> list[str]:
        with matplotlib.rc_context(_SETTINGS):
            return plot(*args, **options)

    return inside


def panels(columns: int, rows: int = 1, height: float = 2.9) -> tuple[Figure, list[Axes]]:
    """A figure of panels, ``height`` inches each, and the panels row by row, lettered A, B, ..."""
    figure = Figure(figsize=(WIDTH, height * rows), layout="constrained")
    axes = list(figure.subplots(rows, columns, squeeze=False).flat)
    if len(axes) > 1:
        for letter, axis in zip("ABCDEFGHIJKL", axes, strict=False):
            axis.set_title(bold(letter))
    return figure, axes


def bold(text: str) -> str:
    """A word in bold within a line of text."""
    return rf"$\bf{{{text}}}$"


def titled(axis: Axes, title: str) -> None:
    """A title after the panel's letter."""
    axis.set_title(f"{axis.get_title(loc='left')}  {title}".strip())


def save(study: Study, figure: Figure, name: str) -> str:
    """Write ``figures/name.svg``; returns where."""
    stream = BytesIO()
    figure.savefig(stream, format="svg", metadata={"Date": None, "Creator": None})
    return study.write(f"figures/{name}.svg", stream.getvalue())


def percent() -> ticker.Formatter:
    """Shares as percents."""
    return ticker.PercentFormatter(1.0, decimals=0)
