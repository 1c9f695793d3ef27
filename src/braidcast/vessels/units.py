"""Units of length of a file, and whether its size is one that a vessel or a centreline has."""

from __future__ import annotations

import math

import numpy as np

from braidcast.errors import InputError
from braidcast.vessels.edges import Array

#: mm in each unit that a surface may be given in.
MILLIMETRES = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "inch": 25.4}

#: Largest extent of a vessel model, mm: shorter, no flow diverter fits; longer, it is no artery.
SHORTEST, LONGEST = 8.0, 600.0
#: Radius of the lumen, mm: from the thinnest artery that takes a catheter to beyond any aorta.
THINNEST, WIDEST = 0.4, 30.0
#: Largest extent that most models of arteries have, mm: what a guess of the unit goes by.
USUAL = (20.0, 300.0)


def millimetres(units: str) -> float:
    """mm in one of ``units``. ``InputError`` for a unit that is none of ``MILLIMETRES``."""
    if units not in MILLIMETRES:
        known = ", ".join(f'"{unit}"' for unit in MILLIMETRES)
        raise InputError(f"units = {units!r} must be one of {known}")
    return MILLIMETRES[units]


def check_extent(size: Array, units: str) -> None:
    """Refuse a surface of the extents ``size`` (3,) mm along x, y and z that is no vessel's.

    ``InputError`` names the units with which it would be one, the likeliest first.
    """
    extent = float(max(size))
    if not SHORTEST <= extent <= LONGEST:
        raise InputError(
            f'is {_by(size)} mm with units = "{units}", where the largest must be from '
            f"{SHORTEST:g} to {LONGEST:g} mm, {_guess(extent / MILLIMETRES[units])}"
        )


def check_lumen(radius: float, extent: float, units: str) -> None:
    """Refuse a lumen of a mean ``radius`` mm that is no vessel's, as ``check_extent`` does."""
    if not THINNEST <= radius <= WIDEST:
        factor = MILLIMETRES[units]
        raise InputError(
            f'has a lumen of radius {radius:.2g} mm on average with units = "{units}", where it '
            f"must be from {THINNEST:g} to {WIDEST:g} mm, "
            f"{_guess(extent / factor, radius / factor)}"
        )


def check_centreline_extent(points: Array) -> None:
    """Refuse a centreline's points (n, 3), taken as mm, that are of another unit by their extent.

    ``InputError``, its text to follow the file's name, names that unit.
    """
    size = np.ptp(points, axis=0)
    extent = float(max(size))
    if not SHORTEST <= extent <= LONGEST:
        guesses = _fitting(extent)
        likely = f", which smells of {_NAMES[guesses[0]]}" if guesses else ""
        raise InputError(
            f"is {_by(size)} mm, where the largest must be from {SHORTEST:g} to {LONGEST:g} mm"
            f"{likely}: a centreline is given in mm, unless a .json says other coordinateUnits"
        )


def likelier_units(extent: float, radius: float, units: str) -> str | None:
    """Units other than ``units`` that make a vessel of so many mm an ordinary one, if any do."""
    factor = MILLIMETRES[units]
    return next(
        (
            unit
            for unit in _fitting(extent / factor, radius / factor)
            if unit != units and _unusual(extent / factor * MILLIMETRES[unit]) == 0.0
        ),
        None,
    )


def _fitting(extent: float, radius: float | None = None) -> list[str]:
    """The units that make a vessel of a file's numbers, the likeliest first."""
    fitting = [
        unit
        for unit, mm in MILLIMETRES.items()
        if SHORTEST <= extent * mm <= LONGEST
        and (radius is None or THINNEST <= radius * mm <= WIDEST)
    ]
    return sorted(fitting, key=lambda unit: _unusual(extent * MILLIMETRES[unit]))


def _guess(extent: float, radius: float | None = None) -> str:
    """What units the numbers of a file may be, by the largest extent and the lumen's radius."""
    guesses = _fitting(extent, radius)
    if guesses:
        said = " or ".join(f'"{unit}"' for unit in guesses)
        return f"which smells of {_NAMES[guesses[0]]}: say units = {said}"
    if SHORTEST <= extent * 1e-3 <= LONGEST:
        return "which smells of micrometres: scale it to mm"
    return "which no unit makes a vessel's"


def _by(size: Array) -> str:
    return " by ".join(f"{value:.3g}" for value in size)


_NAMES = {"mm": "millimetres", "cm": "centimetres", "m": "metres", "inch": "inches"}


def _unusual(extent: float) -> float:
    """How far, as a factor's logarithm, an extent is outside the usual ones."""
    low, high = USUAL
    return max(0.0, math.log(low / extent), math.log(extent / high))
