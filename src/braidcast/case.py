"""One case: a vessel, its aneurysm, a device and where it is put. What a user may set."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from braidcast import feasibility
from braidcast.case_errors import one_sentence
from braidcast.case_toml import toml_text
from braidcast.devices import Braid, catalogue
from braidcast.errors import InputError
from braidcast.toml_file import parse, read_text
from braidcast.vessels import QuadraticBezier, SaccularVessel, Sphere, Tube

Number = Annotated[float, Field(allow_inf_nan=False)]
# TOML has arrays where Python has tuples: the array may be converted, its numbers may not.
Point = Annotated[
    tuple[
        Annotated[Number, Field(ge=-1000.0, le=1000.0)],
        Annotated[Number, Field(ge=-1000.0, le=1000.0)],
        Annotated[Number, Field(ge=-1000.0, le=1000.0)],
    ],
    Field(strict=False),
]


def _point(default: Any = ...) -> Any:
    return Field(default=default, description="three numbers of mm, each from -1000 to 1000")


class Table(BaseModel):
    """A table of a user's file: every key known, every value of its own type, nothing changed."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)


class Vessel(Table):
    """Parent vessel: a round tube about the quadratic Bézier curve P0, P1, P2, all in mm."""

    P0: Point = _point((0.0, 0.0, 0.0))
    P1: Point = _point()
    P2: Point = _point((0.0, 0.0, 50.0))
    diameter: Number = Field(gt=0.0, le=50.0, description="a number of mm above 0, at most 50")


class Aneurysm(Table):
    """Spherical sac of ``diameter`` mm, placed by exactly one of ``protrusion`` and ``centre``.

    ``protrusion`` f puts the centre at R_v + f R_a above (+y) the middle of the centreline by arc
    length; ``centre`` is a point in mm. ``neck_fillet`` mm rounds the edge of the neck.
    """

    diameter: Number = Field(gt=0.0, le=100.0, description="a number of mm above 0, at most 100")
    protrusion: Number | None = Field(
        default=None, gt=0.0, lt=1.0, description="a number between 0 and 1, both excluded"
    )
    centre: Point | None = _point(None)
    neck_fillet: Number = Field(
        default=0.2, gt=0.0, le=1.0, description="a number of mm above 0, at most 1"
    )

    @model_validator(mode="after")
    def _placed_once(self) -> Self:
        if (self.protrusion is None) == (self.centre is None):
            given = "neither" if self.protrusion is None else "both"
            raise InputError(
                f"aneurysm.protrusion and aneurysm.centre: {given} given, must be exactly one "
                "of the two"
            )
        return self


class Device(Table):
    """A braid of the catalogue, by ``name``; every other key given replaces that braid's value.

    Lengths in mm, ``young_modulus`` in MPa.
    """

    name: str = Field(default="paper", description=f"one of: {', '.join(sorted(catalogue))}")
    wires: int | None = Field(
        default=None, ge=4, le=400, description="an even whole number from 4 to 400"
    )
    radius: Number | None = Field(
        default=None, gt=0.0, le=50.0, description="a number of mm above 0, at most 50"
    )
    length: Number | None = Field(
        default=None, gt=0.0, le=500.0, description="a number of mm above 0, at most 500"
    )
    segments: int | None = Field(
        default=None, ge=2, le=2000, description="a whole number from 2 to 2000"
    )
    wire_radius: Number | None = Field(
        default=None, gt=0.0, le=1.0, description="a number of mm above 0, at most 1"
    )
    young_modulus: Number | None = Field(
        default=None, gt=0.0, le=1e7, description="a number of MPa above 0, at most 1e7"
    )
    poisson_ratio: Number | None = Field(
        default=None, gt=-1.0, le=0.5, description="a number above -1, at most 0.5"
    )
    literal_angle: bool | None = Field(default=None, description="true or false")

    @cached_property
    def braid(self) -> Braid:
        """The braid that these keys describe."""
        if self.name not in catalogue:
            known = ", ".join(sorted(catalogue))
            raise InputError(f"device.name = {self.name!r} must be one of: {known}")
        try:
            return replace(
                catalogue[self.name], **self.model_dump(exclude={"name"}, exclude_none=True)
            )
        except InputError as error:
            raise InputError(f"device.{error}") from None

    @model_validator(mode="after")
    def _is_a_braid(self) -> Self:
        _ = self.braid
        return self


class Site(Table):
    """Where the device is released.

    ``eta`` puts ring 0 of the crimped stent at the arc length η (L_centreline − L_crimped −
    0.5 mm); ``crimped_radius`` is that of the wire axes in mm, 0.3 (radius + wire_radius) if not
    given.
    """

    eta: Number = Field(ge=0.0, le=1.0, description="a number from 0 to 1")
    crimped_radius: Number | None = Field(
        default=None, gt=0.0, le=50.0, description="a number of mm above 0, at most 50"
    )


class Wall(Table):
    """Contact of wires and wall: Coulomb's coefficient of friction, 0 allowed."""

    friction: Number = Field(default=0.1, ge=0.0, le=2.0, description="a number from 0 to 2")


class Case(Table):
    """Everything a deployment depends on. Build it with ``from_toml`` or ``from_dict``."""

    title: str = Field(default="", max_length=200, description="a text of at most 200 characters")
    vessel: Vessel = Field(description="a table with P1 and diameter")
    aneurysm: Aneurysm | None = Field(
        default=None, description="a table with diameter, and protrusion or centre"
    )
    device: Device = Field(default_factory=Device, description="a table")
    site: Site = Field(description="a table with eta")
    wall: Wall = Field(default_factory=Wall, description="a table")

    @model_validator(mode="after")
    def _is_feasible(self) -> Self:
        feasibility.check(self)
        return self

    @classmethod
    def from_toml(cls, path: str | Path) -> Self:
        """Read the case file at ``path``; ``InputError`` names the file and what is wrong in it."""
        try:
            text = read_text(Path(path), "case file", "the tables [vessel] and [site]")
            return cls.from_dict(parse(text, "case file"))
        except InputError as error:
            raise InputError(f"{path}: {error}") from None

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Self:
        """Build the case from the tables of a case file; ``InputError`` says what is wrong."""
        if not isinstance(data, Mapping):
            raise InputError(f"a case must be a mapping of tables, not {type(data).__name__}")
        try:
            return cls.model_validate(dict(data))
        except ValidationError as error:
            raise InputError(one_sentence(error, cls, data)) from None

    def to_dict(self) -> dict[str, Any]:
        """The tables of the case file, keys that were left open left out."""
        return self.model_dump(exclude_none=True)

    def to_toml(self) -> str:
        """The text of a case file that ``from_toml`` reads back as an equal case."""
        return toml_text(self.to_dict())

    @property
    def braid(self) -> Braid:
        """The device, free of load."""
        return self.device.braid

    @cached_property
    def centreline(self) -> QuadraticBezier:
        """Centreline of the parent vessel."""
        points = (np.array(point) for point in (self.vessel.P0, self.vessel.P1, self.vessel.P2))
        try:
            return QuadraticBezier(*points)
        except InputError as error:
            raise InputError(f"vessel.{error}") from None

    @cached_property
    def vessel_geometry(self) -> SaccularVessel:
        """The lumen: tube and, if there is one, aneurysm."""
        tube = Tube(self.centreline, self.vessel_radius)
        if self.aneurysm is None or self.aneurysm_centre is None:
            return SaccularVessel(tube)
        sphere = Sphere(self.aneurysm_centre, self.aneurysm.diameter / 2.0)
        return SaccularVessel(tube, sphere, self.aneurysm.neck_fillet)

    @property
    def vessel_radius(self) -> float:
        """R_v, mm."""
        return self.vessel.diameter / 2.0

    @cached_property
    def aneurysm_centre(self) -> NDArray[np.float64] | None:
        """Centre C_a of the sac, (3,) mm; None without an aneurysm."""
        if self.aneurysm is None:
            return None
        if self.aneurysm.centre is not None:
            return np.array(self.aneurysm.centre)
        middle = self.centreline.at_arc_length(self.centreline.length / 2.0)[0]
        assert self.aneurysm.protrusion is not None
        height = self.vessel_radius + self.aneurysm.protrusion * self.aneurysm.diameter / 2.0
        return middle + np.array([0.0, height, 0.0])

    @property
    def crimped_radius(self) -> float:
        """Radius of the wire axes when the device is crimped, mm."""
        given = self.site.crimped_radius
        return 0.3 * self.braid.axis_radius if given is None else given

    @property
    def crimped_length(self) -> float:
        """Length of the crimped device, mm."""
        return self.braid.crimped_length(self.crimped_radius)

    @property
    def start_arc_length(self) -> float:
        """Arc length from P0 at which ring 0 of the crimped device is put, mm."""
        spare = self.centreline.length - self.crimped_length - feasibility.MARGIN
        return self.site.eta * spare
