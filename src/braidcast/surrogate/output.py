"""The files of a prediction: those of a deployment, and how sure its shape is."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from braidcast import __version__
from braidcast.deployment.picture import (
    Drawer,
    Scene,
    add_pictures,
    scene,
    scene_of_gaps,
    shortened,
)
from braidcast.deployment.vtp import write_polylines
from braidcast.results_folder import (
    Written,
    check_folder,
    number,
    publish,
    workplace,
    write_summary,
)
from braidcast.surrogate.prediction import Array, Prediction
from braidcast.vessels.surface import vessel_surface, write_stl

_STD_LEGEND = "standard deviation of the node's position (mm)"
#: So many characters of small print are nearly as wide as the picture.
_LINE_LENGTH = 120


def write_prediction(
    prediction: Prediction,
    folder: str | Path,
    *,
    picture: bool = True,
    drawer: Drawer | None = None,
) -> Written:
    """Write deployed.vtp, vessel.stl, summary.json and two pictures into ``folder``.

    deployed.png shows the distance from wire to wall, deployed_std.png the standard deviation of
    the nodes. Results of an earlier run in the same folder are replaced, those of a simulation
    too. The pictures need ``braidcast[pictures]``; without it a note says so. ``drawer``: a drawing
    process started before. ``InputError`` if ``folder`` cannot be used, ``OSError`` if the disk is
    full.
    """
    check_folder(folder)
    folder = Path(folder)
    surface = vessel_surface(prediction.case.vessel_geometry)
    with workplace(folder) as work:
        write_polylines(
            work / "deployed.vtp", prediction.positions, prediction.wires, prediction.point_arrays
        )
        write_stl(work / "vessel.stl", *surface)
        write_summary(work / "summary.json", summary(prediction))
        files = publish(work, folder)
    if not picture:
        return Written(files, [])
    drawn = add_pictures(_scenes(prediction), surface, folder, drawer)
    return Written(files + drawn.files, drawn.notes)


def summary(prediction: Prediction) -> dict[str, Any]:
    """The keys and values of summary.json; each number in the unit its key ends with."""
    std = prediction.std_norm
    return {
        "title": prediction.case.title,
        "outcome": prediction.outcome,
        "success_probability": number(prediction.success_probability),
        "success_threshold": number(prediction.threshold),
        "in_range": bool(prediction.in_range),
        "out_of_range": list(prediction.out_of_range),
        "nearest_case": int(prediction.nearest_case),
        "nearest_distance": number(prediction.nearest_distance),
        "std_mean_mm": number(std.mean()),
        "std_max_mm": number(std.max()),
        "deployed_length_mm": number(prediction.deployed_length_mm),
        "free_length_mm": number(prediction.free_length_mm),
        "crimped_length_mm": number(prediction.crimped_length_mm),
        "foreshortening_percent": number(prediction.foreshortening_percent),
        "model": prediction.model,
        "wall_seconds": number(prediction.wall_seconds),
        "cpu_seconds": number(prediction.cpu_seconds),
        "version": __version__,
    }


def _scenes(prediction: Prediction) -> dict[str, Scene]:
    lines, std = _caption(prediction), prediction.std_norm
    return {
        "deployed.png": scene_of_gaps(prediction, lines),
        "deployed_std.png": scene(
            prediction.case, prediction.positions, std, _STD_LEGEND, (0.0, _scale_end(std)), lines
        ),
    }


def _caption(prediction: Prediction) -> tuple[str, ...]:
    """What a reader must know before he believes the shape."""
    lines = [_predicted(prediction)]
    if prediction.outcome == "failure":
        lines.append("the shape is that of a successful deployment: do not trust it")
    if not prediction.in_range:
        phrases = "; ".join(prediction.out_of_range)
        lines.append(shortened(f"OUTSIDE THE TRAINING DATA: {phrases}", _LINE_LENGTH))
    return tuple(lines)


def _predicted(prediction: Prediction) -> str:
    # 1.00 and 0.00 would claim to be certain.
    probability = prediction.success_probability
    shown = f"{min(max(probability, 0.01), 0.99):.2f}"
    if not 0.005 <= probability < 0.995:
        shown = f"more than {shown}" if probability > 0.5 else f"less than {shown}"
    if prediction.outcome == "success":
        return f"success predicted with probability {shown}"
    return f"failure predicted: probability of success {shown}"


def _scale_end(std: Array) -> float:
    """A round number of mm, at least 1 µm, that 99 % of the nodes do not exceed."""
    share = max(float(np.percentile(std, 99.0)), 1e-3)
    power = 10.0 ** math.floor(math.log10(share))
    return next(n * power for n in (1, 2, 3, 4, 5, 6, 8, 10) if n * power >= share * (1 - 1e-9))
