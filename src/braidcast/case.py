"""One case: a vessel, its aneurysm, a device and where it is put."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, ValidationError, ValidationInfo, model_validator

from braidcast import feasibility
from braidcast.case_errors import one_sentence
from braidcast.case_tables import (
    FILE_KEYS,
    Aneurysm,
    AnyAneurysm,
    AnyVessel,
    Device,
    Site,
    Table,
    Vessel,
    VesselFile,
    Wall,
)
from braidcast.case_toml import toml_text
from braidcast.devices import Braid
from braidcast.errors import InputError
from braidcast.toml_file import parse, read_text
from braidcast.vessels import QuadraticBezier, SaccularVessel, Sphere, Tube

if TYPE_CHECKING:
    from braidcast.vessels.polyline import Polyline
    from braidcast.vessels.sacs import Sac
    from braidcast.vessels.surface_vessel import SurfaceVessel

Progress = Callable[[str, float], None]
"""Called with a stage of reading a vessel's surface, and the share of it that is done."""


class Case(Table):
    """Everything a deployment depends on. Build it with ``from_toml`` or ``from_dict``."""

    title: str = Field(default="", max_length=200, description="a text of at most 200 characters")
    vessel: AnyVessel = Field(description="a table with P1 and diameter, or with surface")
    aneurysm: AnyAneurysm | None = Field(
        default=None,
        description="a table with diameter, and protrusion or centre; with neck and neck_radius; "
        "or with surface",
    )
    device: Device = Field(default_factory=Device, description="a table")
    site: Site = Field(description="a table with eta")
    wall: Wall = Field(default_factory=Wall, description="a table")

    @model_validator(mode="after")
    def _is_feasible(self, info: ValidationInfo) -> Self:
        if isinstance(self.vessel, VesselFile):
            self._read(info.context)
        feasibility.check(self)
        return self

    @classmethod
    def from_toml(cls, path: str | Path, progress: Progress | None = None) -> Self:
        """Read the case file at ``path``; ``InputError`` names the file and what is wrong in it.

        Files that it names are looked for beside it. Reading a vessel's surface for the first time
        takes some seconds, of which ``progress`` is told.
        """
        try:
            text = read_text(Path(path), "case file", "the tables [vessel] and [site]")
            return cls.from_dict(beside(Path(path).parent, parse(text, "case file")), progress)
        except InputError as error:
            raise InputError(f"{path}: {error}") from None

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], progress: Progress | None = None) -> Self:
        """Build the case from the tables of a case file; ``InputError`` says what is wrong.

        Files that they name are looked for in the current folder.
        """
        if not isinstance(data, Mapping):
            raise InputError(f"a case must be a mapping of tables, not {type(data).__name__}")
        try:
            return cls.model_validate(dict(data), context=progress)
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

    @property
    def tube(self) -> Vessel:
        """The table of a vessel about a Bézier curve; ``InputError`` for one from a surface."""
        if isinstance(self.vessel, VesselFile):
            raise InputError(
                f"vessel.surface = {self.vessel.surface} is a vessel of its own shape, must be one "
                "with P1 and diameter here: a surrogate knows no other"
            )
        return self.vessel

    @property
    def sac(self) -> Aneurysm:
        """The table of a spherical aneurysm; ``InputError`` without one."""
        if not isinstance(self.aneurysm, Aneurysm):
            raise InputError("aneurysm is missing; the surrogate needs one, with a diameter")
        return self.aneurysm

    @cached_property
    def bezier(self) -> QuadraticBezier:
        """Centreline of a vessel about a Bézier curve; ``InputError`` for one from a surface."""
        points = (np.array(point) for point in (self.tube.P0, self.tube.P1, self.tube.P2))
        try:
            return QuadraticBezier(*points)
        except InputError as error:
            raise InputError(f"vessel.{error}") from None

    @property
    def vessel_radius(self) -> float:
        """R_v, mm; ``InputError`` for a vessel from a surface, whose radius varies."""
        return self.tube.diameter / 2.0

    @property
    def centreline(self) -> QuadraticBezier | Polyline:
        """Centreline of the parent vessel."""
        if isinstance(self.vessel, VesselFile):
            return self._loaded.centreline
        return self.bezier

    @cached_property
    def surface_geometry(self) -> SurfaceVessel:
        """The lumen within the surface of ``[vessel]``; ``InputError`` if there is none."""
        if not isinstance(self.vessel, VesselFile):
            raise InputError("vessel.surface is missing, must be the name of a surface's file")
        return self._loaded.with_aneurysm(self._region())

    @property
    def remarks(self) -> tuple[str, ...]:
        """What was noticed, and mended, while the vessel's files were read; a sentence each."""
        return self._loaded.remarks if isinstance(self.vessel, VesselFile) else ()

    @cached_property
    def vessel_geometry(self) -> SaccularVessel | SurfaceVessel:
        """The lumen: tube and, if there is one, aneurysm; or that of the surface."""
        if isinstance(self.vessel, VesselFile):
            return self.surface_geometry
        tube = Tube(self.bezier, self.vessel_radius)
        if not isinstance(self.aneurysm, Aneurysm) or self.aneurysm_centre is None:
            return SaccularVessel(tube)
        sphere = Sphere(self.aneurysm_centre, self.aneurysm.diameter / 2.0)
        return SaccularVessel(tube, sphere, self.aneurysm.neck_fillet)

    @cached_property
    def _loaded(self) -> SurfaceVessel:
        """What was read: files that change later are of another case."""
        return self._read()

    def _read(self, progress: Progress | None = None) -> SurfaceVessel:
        # Not at the top: vessels about Bézier curves need none of it.
        from braidcast.vessels.surface_vessel import SurfaceSource, load_vessel

        table = self.vessel
        assert isinstance(table, VesselFile)
        source = SurfaceSource(
            table.surface,
            table.units,
            table.centreline,
            table.ends,
            table.distance_spacing,
            self.braid.wire_radius,
        )
        try:
            return load_vessel(source, progress)
        except InputError as error:
            raise InputError(f"vessel.{error}") from None

    def _region(self) -> Sac | None:
        """What counts as the sac of a vessel from a surface."""
        from braidcast.vessels.sacs import ClosedSac, NeckSac

        if isinstance(self.aneurysm, Aneurysm):
            if self.aneurysm.centre is None:
                raise InputError(
                    f"aneurysm.protrusion = {self.aneurysm.protrusion} is for a vessel about a "
                    "Bézier curve, must be centre in one from a surface"
                )
            if self.aneurysm.neck_fillet != Aneurysm.model_fields["neck_fillet"].default:
                raise InputError(
                    f"aneurysm.neck_fillet = {self.aneurysm.neck_fillet} is for a vessel about a "
                    "Bézier curve, must be left out in one from a surface, whose neck is as it is"
                )
            return Sphere(np.array(self.aneurysm.centre), self.aneurysm.diameter / 2.0)
        if self.aneurysm is None:
            return None
        if self.aneurysm.surface is None:
            line = self._loaded.centreline
            assert self.aneurysm.neck is not None and self.aneurysm.neck_radius is not None
            return NeckSac(np.array(self.aneurysm.neck), self.aneurysm.neck_radius, line)
        try:
            assert isinstance(self.vessel, VesselFile)
            return ClosedSac.read(self.aneurysm.surface, self.vessel.units)
        except InputError as error:
            raise InputError(f"aneurysm.{error}") from None

    @cached_property
    def aneurysm_centre(self) -> NDArray[np.float64] | None:
        """Centre C_a of a spherical sac, (3,) mm; None without one."""
        if not isinstance(self.aneurysm, Aneurysm):
            return None
        if self.aneurysm.centre is not None:
            return np.array(self.aneurysm.centre)
        middle = self.bezier.at_arc_length(self.bezier.length / 2.0)[0]
        assert self.aneurysm.protrusion is not None
        height = self.vessel_radius + self.aneurysm.protrusion * self.aneurysm.diameter / 2.0
        return middle + np.array([0.0, height, 0.0])

    @property
    def crimped_radius(self) -> float:
        """Radius of the wire axes when the device is crimped, mm."""
        given = self.site.crimped_radius
        return self.braid.usual_crimped_radius if given is None else given

    @property
    def crimped_length(self) -> float:
        """Length of the crimped device, mm."""
        return self.braid.crimped_length(self.crimped_radius)

    @property
    def spare_length(self) -> float:
        """Length of the centreline beyond the crimped device and what must stay free, mm."""
        return self.centreline.length - self.crimped_length - feasibility.MARGIN

    @cached_property
    def start_arc_length(self) -> float:
        """Arc length at which ring 0 of the crimped device is put, mm."""
        site = self.site
        if site.proximal_end_mm is not None:
            return site.proximal_end_mm
        if site.distal_end_mm is not None:
            return site.distal_end_mm - self.crimped_length
        if site.point is not None:
            return float(self.centreline.closest(site.point)[1][0]) - 0.5 * self.crimped_length
        assert site.eta is not None
        return site.eta * self.spare_length

    @property
    def eta(self) -> float:
        """η of the site, however it was given."""
        if self.site.eta is not None:
            return self.site.eta
        return self.start_arc_length / self.spare_length if self.spare_length > 0.0 else 0.0


def beside(folder: Path, tables: Mapping[str, Any]) -> dict[str, Any]:
    """The tables of a case, the files that they name looked for in ``folder``."""
    found = dict(tables)
    for table, key in FILE_KEYS:
        values = found.get(table)
        if isinstance(values, Mapping) and isinstance(values.get(key), str):
            found[table] = {**values, key: str(folder / values[key])}
    return found
