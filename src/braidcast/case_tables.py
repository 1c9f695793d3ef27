"""The tables of a case file: what a user may set in each, and within which limits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag, model_validator

from braidcast.devices import Braid, catalogue
from braidcast.errors import InputError

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


class VesselFile(Table):
    """A vessel given by the file of its wall, and by what its centreline runs between.

    ``centreline``: a file with it; without one it is found. ``ends``: the two places, of the file's
    or the vessel's ends, between which it runs, from proximal to distal; they may be left out if
    there are just two. ``distance_spacing`` mm: of the grid of the signed distance.
    """

    surface: str = Field(description="the name of an STL, VTP, PLY or OBJ file")
    units: Literal["mm", "cm", "m", "inch"] = Field(
        default="mm", description='one of "mm", "cm", "m" and "inch"'
    )
    centreline: str | None = Field(
        default=None, description="the name of a VTP, VTK, JSON or CSV file"
    )
    ends: Annotated[tuple[Point, Point], Field(strict=False)] | None = Field(
        default=None, description="two points, each of three numbers of mm from -1000 to 1000"
    )
    distance_spacing: Number | None = Field(
        default=None, ge=0.02, le=0.2, description="a number of mm from 0.02 to 0.2"
    )


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


class SacRegion(Table):
    """The sac of a vessel given by its surface: by its neck, or by a closed ``surface`` around it.

    ``neck``: the middle of the neck, mm, of the radius ``neck_radius``: what lies beyond the parent
    vessel there is the sac.
    """

    neck: Point | None = _point(None)
    neck_radius: Number | None = Field(
        default=None, gt=0.0, le=50.0, description="a number of mm above 0, at most 50"
    )
    surface: str | None = Field(
        default=None, description="the name of an STL, VTP, PLY or OBJ file"
    )

    @model_validator(mode="after")
    def _given_once(self) -> Self:
        if self.surface is not None and (self.neck, self.neck_radius) != (None, None):
            raise InputError(
                f"aneurysm.surface = {self.surface!r} and aneurysm.neck: both given, must be "
                "exactly one of the two"
            )
        for name in ("neck", "neck_radius"):
            if self.surface is None and getattr(self, name) is None:
                raise InputError(
                    f"aneurysm.{name} is missing, must be given with the other of "
                    "aneurysm.neck and aneurysm.neck_radius"
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
    """Where the device is released, by exactly one of four.

    ``eta`` puts ring 0 of the crimped stent at the arc length η (L_centreline − L_crimped −
    0.5 mm), ``proximal_end_mm`` at this arc length; ``distal_end_mm`` is that of the last ring;
    ``point`` (mm) has the middle of the crimped stent at the nearest place of the centreline.
    ``crimped_radius`` is that of the wire axes in mm, 0.3 (radius + wire_radius) if not given.
    """

    eta: Number | None = Field(default=None, ge=0.0, le=1.0, description="a number from 0 to 1")
    proximal_end_mm: Number | None = Field(
        default=None, ge=0.0, le=1000.0, description="a number of mm from 0 to 1000"
    )
    distal_end_mm: Number | None = Field(
        default=None, ge=0.0, le=1000.0, description="a number of mm from 0 to 1000"
    )
    point: Point | None = _point(None)
    crimped_radius: Number | None = Field(
        default=None, gt=0.0, le=50.0, description="a number of mm above 0, at most 50"
    )

    @model_validator(mode="after")
    def _given_once(self) -> Self:
        names = ("eta", "proximal_end_mm", "distal_end_mm", "point")
        given = [f"site.{name}" for name in names if getattr(self, name) is not None]
        if not given:
            raise InputError(
                "site.eta is missing, must be a number from 0 to 1, or in its place "
                "site.proximal_end_mm, site.distal_end_mm or site.point must be given"
            )
        if len(given) > 1:
            raise InputError(f"{' and '.join(given)}: {len(given)} given, must be exactly one")
        return self


class Wall(Table):
    """Contact of wires and wall: Coulomb's coefficient of friction, 0 allowed."""

    friction: Number = Field(default=0.1, ge=0.0, le=2.0, description="a number from 0 to 2")


# Tags of the kinds that a table may be of; complaints leave them out of a field's name.
TUBE, SURFACE, SPHERE, REGION = "<tube>", "<surface>", "<sphere>", "<region>"

#: Keys that name files, with their tables.
FILE_KEYS = (("vessel", "surface"), ("vessel", "centreline"), ("aneurysm", "surface"))


def _vessel_kind(value: Any) -> str:
    return SURFACE if "surface" in _keys(value) else TUBE


def _sac_kind(value: Any) -> str:
    return REGION if {"surface", "neck", "neck_radius"} & _keys(value) else SPHERE


def _keys(value: Any) -> set[Any]:
    if isinstance(value, Mapping):
        return set(value)
    return set(type(value).model_fields) if isinstance(value, BaseModel) else set()


AnyVessel = Annotated[
    Annotated[Vessel, Tag(TUBE)] | Annotated[VesselFile, Tag(SURFACE)],
    Discriminator(_vessel_kind),
]
AnyAneurysm = Annotated[
    Annotated[Aneurysm, Tag(SPHERE)] | Annotated[SacRegion, Tag(REGION)], Discriminator(_sac_kind)
]
