"""What the page is handed once: the case it opens with, the model, the vessel's surface."""

from __future__ import annotations

import gzip
import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from braidcast import __version__
from braidcast.errors import InputError
from braidcast.planner.opened_case import OpenedCase

if TYPE_CHECKING:
    from braidcast.surrogate.model import SurrogateModel

_ALONG = 0.25
"""Between the points of a centreline that the page is handed, mm."""

_SIMULATED_ONLY = (
    "The vessel is given by its surface, of which the model knows nothing: it is switched off, and "
    "the deployment is simulated."
)


class Packed:
    """Bytes as they are and as they travel."""

    def __init__(self, plain: bytes) -> None:
        self.plain = plain
        self.gzipped = gzip.compress(plain, compresslevel=6, mtime=0)


@dataclass(frozen=True, eq=False)
class Contents:
    """Of a planner opened with a case; ``load`` gets the model when it is first needed."""

    opened: OpenedCase
    load: Callable[[], SurrogateModel]

    @cached_property
    def _model(self) -> tuple[SurrogateModel | None, str | None]:
        """The model; or None, and one sentence that says why."""
        if self.opened.has_surface:
            return None, _SIMULATED_ONLY
        model, case = self.load(), self.opened.case
        try:
            model.applicability.check_device(case)
            _ = case.sac
        except InputError as error:
            return None, f"The model cannot predict this case: {error}."
        return model, None

    @property
    def without_model(self) -> str | None:
        """Why nothing is predicted, in one sentence; None if something is."""
        return self._model[1]

    @cached_property
    def model(self) -> Packed | None:
        """The arrays that the page predicts from; None without a model."""
        from braidcast.planner.model_arrays import model_bytes

        model, _ = self._model
        return None if model is None else Packed(model_bytes(model))

    @cached_property
    def start(self) -> Packed:
        """JSON of what there is; numbers in mm.

        ``version``; ``case``, the tables of the case; ``device``; ``modelName`` and ``card``
        (Markdown), or ``withoutModel``, a sentence; ``surface`` of a vessel that is given so.
        """
        model, without = self._model
        started: dict[str, Any] = {
            "version": __version__,
            "case": self.opened.tables,
            "device": asdict(self.opened.case.braid),
            "modelName": None if model is None else str(model.record["name"]),
            "withoutModel": without,
            "card": None if model is None else _card(model),
            "surface": self._surface(),
        }
        return Packed(json.dumps(started, allow_nan=False).encode())

    def _surface(self) -> dict[str, Any] | None:
        """Vertices and triangles one after the other, and the centreline with its arc lengths."""
        if not self.opened.has_surface:
            return None
        import numpy as np

        case = self.opened.case
        vessel = case.surface_geometry
        line, surface = vessel.centreline, vessel.surface
        along = np.linspace(0.0, line.length, max(2, round(line.length / _ALONG)))
        return {
            "name": vessel.name,
            "vertices": np.round(surface.vertices, 4).ravel().tolist(),
            "triangles": surface.triangles.ravel().tolist(),
            "centreline": np.round(line.at_arc_length(along), 4).tolist(),
            "arcLength": along.tolist(),
            "lumenRadius": line.lumen_radius(along).tolist(),
            "length": line.length,
            "crimpedLength": case.crimped_length,
            "spareLength": case.spare_length,
            "startArcLength": case.start_arc_length,
            "remarks": list(vessel.remarks),
            "device": asdict(case.braid),
        }


def _card(model: SurrogateModel) -> str:
    from braidcast.surrogate.model_card import model_card  # not where there is no model: it is slow

    return model_card(model)
