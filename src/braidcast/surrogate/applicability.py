"""What a surrogate was trained for: one device, and a range of every other number of a case."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from braidcast.case import Case
from braidcast.errors import InputError

ROUNDING = 1e-9


@dataclass(frozen=True)
class Applicability:
    """``device``: the braid's values by name; ``limits``: from and to of each field of a case."""

    device: Mapping[str, Any]
    limits: Mapping[str, tuple[float, float]]

    @classmethod
    def of(cls, case: Case, ranges: Mapping[str, tuple[float, float]]) -> "Applicability":
        """That of cases like ``case`` whose fields vary in ``ranges``."""
        fixed = {name: (value, value) for name, value in fields(case).items()}
        return cls(_device(case), fixed | {k: v for k, v in ranges.items() if k in fixed})

    def check_device(self, case: Case) -> None:
        """``InputError`` if the case has another device than the model."""
        for name, value in _device(case).items():
            if value != self.device.get(name):
                raise InputError(
                    f"device.{name} = {value} must be {self.device.get(name)}, that of the device "
                    "the model was trained for"
                )

    def outside(self, case: Case) -> tuple[str, ...]:
        """A phrase for each field of the case that lies outside what was trained."""
        phrases = []
        for name, value in fields(case).items():
            low, high = self.limits[name]
            slack = ROUNDING * max(1.0, abs(low), abs(high))
            if not low - slack <= value <= high + slack:
                trained = f"at {low:g}" if low == high else f"from {low:g} to {high:g}"
                phrases.append(f"{name} = {value:.4g}{unit(name)}, trained {trained}{unit(name)}")
        return tuple(phrases)


def unit(name: str) -> str:
    """ " mm" or "", as the field is a length or a pure number."""
    return "" if name in ("aneurysm_protrusion", "site_eta", "wall_friction") else " mm"


def column(name: str) -> str:
    """The field's name in tables, with its unit: "vessel_diameter_mm", "site_eta"."""
    return name + unit(name).replace(" ", "_")


def fields(case: Case) -> dict[str, float]:
    """The numbers of a case but those of its device, by name; mm and pure numbers.

    A sac given by its centre has the protrusion that would put it there, and lies aside by
    ``aneurysm_aside`` from where a protrusion can put it.
    """
    points = {
        f"vessel_{point}_{axis}": float(value)
        for point in ("P0", "P1", "P2")
        for axis, value in zip("xyz", getattr(case.tube, point), strict=True)
    }
    sac, centre = case.sac, case.aneurysm_centre
    middle = case.centreline.at_arc_length(0.5 * case.centreline.length)[0]
    away = centre - middle
    return points | {
        "vessel_diameter": case.tube.diameter,
        "aneurysm_diameter": sac.diameter,
        "aneurysm_protrusion": 2.0 * (away[1] - case.vessel_radius) / sac.diameter,
        "aneurysm_aside": float(np.hypot(away[0], away[2])),
        "aneurysm_neck_fillet": sac.neck_fillet,
        "site_eta": case.eta,
        "site_crimped_radius": case.crimped_radius,
        "wall_friction": case.wall.friction,
    }


def _device(case: Case) -> dict[str, Any]:
    return {name: getattr(case.braid, name) for name in type(case.braid).__dataclass_fields__}
