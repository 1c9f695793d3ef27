"""A vessel from a surface as a picture: its outline, and the profiles along its centreline."""

from __future__ import annotations

from io import BytesIO
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from braidcast.deployment.vessel_inspection import VesselInspection

BLUE, VERMILLION, GREEN, GREY = "#0072B2", "#D55E00", "#009E73", "#666666"

_SETTINGS: dict[Any, Any] = {
    "font.size": 9.0,
    "axes.titlelocation": "left",
    "axes.titlesize": 9.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
    "legend.fontsize": 8.0,
}

TICK = 10.0
"""Between the marks along the centreline in the outline, mm."""


def vessel_picture(seen: VesselInspection) -> bytes:
    """A PNG file: the vessel from two sides, lumen radius and curvature along the centreline."""
    with matplotlib.rc_context(_SETTINGS):
        figure = Figure(figsize=(10.0, 6.4), layout="constrained", dpi=150)
        axes = figure.subplots(2, 2, width_ratios=(1.0, 1.25))
        frame = _frame(seen)
        for axis, (first, second), side in zip(
            axes[:, 0], ((0, 1), (0, 2)), ("in its plane", "from above"), strict=True
        ):
            _outline(axis, seen, frame[[first, second]])
            axis.set_title(f"{seen.vessel.name}, {side} (mm)")
        _radius(axes[0, 1], seen)
        _curvature(axes[1, 1], seen)
        stream = BytesIO()
        figure.savefig(stream, format="png")
        return stream.getvalue()


def _frame(seen: VesselInspection) -> np.ndarray:
    """Unit vectors (3, 3) of the view as rows: along the vessel, in its plane, out of it."""
    return np.linalg.svd(seen.places - seen.places.mean(axis=0), full_matrices=False)[2]


def _outline(axis: Axes, seen: VesselInspection, frame: np.ndarray) -> None:
    surface, middle = seen.vessel.surface, seen.places.mean(axis=0)
    flat = (surface.vertices - middle) @ frame.T
    axis.add_collection(
        PolyCollection(flat[surface.triangles], facecolor="#d9a08f", alpha=0.12, edgecolor="none")
    )
    line = (seen.places - middle) @ frame.T
    axis.plot(*line.T, color=BLUE, lw=1.4)
    marks = np.arange(0.0, seen.along[-1] + 1e-9, TICK)
    at = (seen.vessel.centreline.at_arc_length(marks) - middle) @ frame.T
    axis.plot(*at.T, "o", color=BLUE, ms=3.5)
    for mark, place in zip(marks, at, strict=True):
        axis.annotate(f"{mark:g}", place, (4, 3), textcoords="offset points", color=BLUE)
    axis.set_aspect("equal")
    axis.autoscale_view()


def _radius(axis: Axes, seen: VesselInspection) -> None:
    end = seen.along[-1]
    axis.plot(seen.along, seen.lumen_radius, color=BLUE, label="lumen radius")
    axis.plot(seen.along, seen.room, color=GREY, lw=0.9, label="from the centreline to the wall")
    for height, name in (
        (seen.most_radius, "free stent"),
        (seen.least_radius, "crimped stent, with room"),
    ):
        axis.axhline(height, color=VERMILLION, ls="--", lw=0.9)
        axis.annotate(
            name, (end, height), (0, 3), textcoords="offset points", ha="right", color=VERMILLION
        )
    for index, (first, last) in enumerate(seen.windows):
        label = "where the crimped stent fits" if index == 0 else None
        axis.axvspan(first, last + seen.crimped_length, color=GREEN, alpha=0.12, label=label)
    axis.set_ylim(0.0)
    axis.set_ylabel("mm")
    axis.set_title("radius along the centreline")
    axis.legend(loc="lower left")


def _curvature(axis: Axes, seen: VesselInspection) -> None:
    axis.plot(seen.along, seen.curvature, color=BLUE, label="of the centreline")
    axis.plot(seen.along, 1.0 / seen.lumen_radius, color=GREY, lw=0.9, label="1 / lumen radius")
    axis.set_ylim(0.0)
    axis.set_ylabel("1/mm")
    axis.set_xlabel("arc length from the proximal end (mm)")
    axis.set_title("curvature")
    axis.legend(loc="center left")
