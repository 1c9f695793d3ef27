"""The parametric vessel and a section of its signed distance field (paper, Figure 3)."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from braidcast.case import Case
from braidcast.study.plots import style
from braidcast.study.workspace import Study, case_of

Array = NDArray[np.float64]

_STEP = 0.2  # mm of the grid
_MARGIN = 1.5  # mm around the vessel


@style.drawn
def vessel(study: Study) -> list[str]:
    """Vessel of the example case with its parameters, and its distance field, in the y-z plane."""
    case = case_of(study.arrays("strategy")["case"])
    z, y, distance = _section(case)
    figure, axes = style.panels(1, 2, 3.4)
    for axis in axes:
        axis.set_aspect("equal")
        axis.set_ylabel("y (mm)")
        axis.grid(False)
        axis.contour(z, y, distance, [0.0], colors="black", linewidths=1.8)
    _parameters(axes[0], case, distance, z, y)
    axes[0].set_ylim(y[0], max(y[-1], case.bezier.P1[1] + _MARGIN))
    levels = np.arange(np.floor(2.0 * distance.min()) / 2.0, 2.01, 0.5)
    reach = max(abs(levels[0]), levels[-1])
    filled = axes[1].contourf(z, y, distance, levels, cmap="RdBu", vmin=-reach, vmax=reach)
    axes[1].contour(z, y, distance, levels, colors="#444444", linewidths=0.4, linestyles="solid")
    figure.colorbar(filled, ax=axes[1], label="signed distance (mm)", shrink=0.9)
    axes[1].set_xlabel("z (mm)")
    style.titled(axes[0], "parameters of the vessel")
    style.titled(axes[1], "signed distance, negative inside")
    return [style.save(study, figure, "vessel")]


def _section(case: Case) -> tuple[Array, Array, Array]:
    """z (n,), y (m,) and the distance (m, n), mm."""
    line, sac = case.bezier, case.vessel_geometry.aneurysm
    points = line.at_arc_length(np.linspace(0.0, line.length, 200))
    centres = points if sac is None else np.vstack([points, sac.centre])
    reach = np.full(len(centres), case.vessel_radius)
    if sac is not None:
        reach[-1] = sac.radius
    low = (centres - reach[:, None]).min(axis=0) - _MARGIN
    high = (centres + reach[:, None]).max(axis=0) + _MARGIN
    y, z = (np.arange(low[k], high[k], _STEP) for k in (1, 2))
    grid = np.stack(np.broadcast_arrays(0.0, y[:, None], z), axis=-1).reshape(-1, 3)
    return z, y, case.vessel_geometry.distance(grid).reshape(len(y), len(z))


def _parameters(axis: Axes, case: Case, distance: Array, z: Array, y: Array) -> None:
    axis.contourf(z, y, distance, [-1e3, 0.0], colors=["#f3e0d8"])
    line, sac = case.bezier, case.vessel_geometry.aneurysm
    points = line.at_arc_length(np.linspace(0.0, line.length, 200))
    axis.plot(points[:, 2], points[:, 1], color=style.BLUE, lw=1.2)
    control = np.array([line.P0, line.P1, line.P2])
    axis.plot(control[:, 2], control[:, 1], "o--", color=style.VERMILLION, lw=0.9)
    for name, point in zip(("$P_0$", "$P_1$", "$P_2$"), control, strict=True):
        axis.annotate(name, (point[2], point[1]), (-4, -13), textcoords="offset points")
    where = line.at_arc_length(0.15 * line.length)[0]
    along = line.tangent_at_arc_length(0.15 * line.length)[0]
    across = np.array([0.0, along[2], -along[1]]) * case.vessel_radius
    _measure(axis, where - across, where + across, "$D_v$")
    if sac is not None:
        side = np.array([0.0, 0.0, sac.radius])
        _measure(axis, sac.centre - side, sac.centre + side, "$D_a$")
        axis.plot(sac.centre[2], sac.centre[1], "o", color="black", ms=3)
        axis.annotate("$C_a$", _zy(sac.centre), (4, -11), textcoords="offset points")


def _measure(axis: Axes, start: Array, end: Array, name: str) -> None:
    """An arrow with two heads from place to place, with a name."""
    arrow = {"arrowstyle": "<->", "shrinkA": 0, "shrinkB": 0, "lw": 0.9}
    axis.annotate("", _zy(start), _zy(end), arrowprops=arrow)
    beyond = _zy(10.0 * (end - start) / np.linalg.norm(end - start))
    axis.annotate(name, _zy(end), beyond, textcoords="offset points", ha="center", va="center")


def _zy(point: Array) -> tuple[float, float]:
    return float(point[2]), float(point[1])
