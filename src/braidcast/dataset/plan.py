"""A plan of many cases: a case file in which numbers may be ranges, and how many cases to draw."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Self, get_args

from pydantic import Field, ValidationError

from braidcast.case import Case
from braidcast.case_errors import field_at, one_sentence, shown
from braidcast.case_tables import FILE_KEYS, Table
from braidcast.errors import InputError
from braidcast.toml_file import parse, read_text

MOST_CASES = 100_000

_Count = Annotated[int, Field(ge=1, le=MOST_CASES)]
_Place = tuple[str | int, ...]


class _PlanFile(Table):
    """The keys of a plan file."""

    title: str = Field(default="", max_length=200, description="a text of at most 200 characters")
    seed: int = Field(
        default=0, ge=0, le=2**63 - 1, description="a whole number from 0 to 2^63 - 1"
    )
    cases: _Count = Field(description=f"a whole number from 1 to {MOST_CASES}")
    subsets: Annotated[tuple[_Count, ...], Field(strict=False)] = Field(
        default=(), description="an array of whole numbers above 0"
    )
    tests: int = Field(default=0, ge=0, description="a whole number from 0")
    case: dict[str, Any] = Field(description="the tables of a case, [case.vessel] and so on")


@dataclass(frozen=True)
class Range:
    """A parameter of the case that differs from case to case, from ``low`` to ``high``."""

    path: _Place
    """Where it stands in the case: ("vessel", "P1", 1)."""
    low: float
    high: float
    unit: str
    """ "mm", "MPa" or "" for a pure number."""

    @property
    def name(self) -> str:
        """Its name in data: "vessel_P1_y"."""
        return "_".join("xyz"[key] if isinstance(key, int) else key for key in self.path)

    @property
    def column(self) -> str:
        """Its name in tables, with the unit: "vessel_P1_y_mm"."""
        return f"{self.name}_{self.unit}" if self.unit else self.name


@dataclass(frozen=True)
class Plan:
    """Cases to draw, from a text that is kept as it was given.

    Case k belongs to each subset of more than k cases, so that subsets are nested. The first
    ``tests`` cases are the test set: in every subset, in no training set.
    """

    text: str
    title: str
    seed: int
    cases: int
    subsets: tuple[int, ...]
    """Sizes of the subsets, increasing, all of them below ``cases``."""
    tests: int
    ranges: tuple[Range, ...]
    _tables: Mapping[str, Any] = field(repr=False, compare=False)

    @classmethod
    def from_toml(cls, path: str | Path) -> Self:
        """Read the plan at ``path``; ``InputError`` names the file and what is wrong in it."""
        try:
            text = read_text(Path(path), "plan file", "cases and the tables of [case]")
        except InputError as error:
            raise InputError(f"{path}: {error}") from None
        return cls.from_text(text, str(path))

    @classmethod
    def from_text(cls, text: str, name: str = "plan") -> Self:
        """The plan of a TOML text; ``InputError`` begins with ``name``."""
        try:
            return cls._read(text)
        except InputError as error:
            raise InputError(f"{name}: {error}") from None

    @classmethod
    def _read(cls, text: str) -> Self:
        data = parse(text, "plan file")
        try:
            given = _PlanFile.model_validate(data)
        except ValidationError as error:
            raise InputError(one_sentence(error, _PlanFile, data, "a plan")) from None
        try:
            _check_files(given.case)
            ranges = _ranges(given.case)
        except InputError as error:
            raise InputError(f"[case] {error}") from None
        _check_counts(given, ranges)
        return cls(
            text=text,
            title=given.title,
            seed=given.seed,
            cases=given.cases,
            subsets=tuple(size for size in given.subsets if size < given.cases),
            tests=given.tests,
            ranges=ranges,
            _tables=given.case,
        )

    def case(self, values: Sequence[float]) -> Case:
        """The case with these values of ``ranges``, in their order.

        ``InputError`` if vessel, aneurysm, device and site do not go together.
        """
        places = (parameter.path for parameter in self.ranges)
        numbers = (float(value) for value in values)
        return Case.from_dict(_filled(self._tables, dict(zip(places, numbers, strict=True))))


def _check_counts(given: _PlanFile, ranges: tuple[Range, ...]) -> None:
    subsets, smallest = list(given.subsets), min((*given.subsets, given.cases))
    if subsets != sorted(set(subsets)):
        raise InputError(f"subsets = {subsets} must increase from each to the next")
    if subsets and subsets[-1] > given.cases:
        raise InputError(f"subsets = {subsets} must be at most cases = {given.cases}")
    if given.tests > smallest:
        raise InputError(
            f"tests = {given.tests} must be at most {smallest}, the size of the smallest subset"
        )
    if not ranges and given.cases > 1:
        raise InputError(
            f"cases = {given.cases} must be 1 where no number of [case] is a range "
            "{ min = ..., max = ... }, or all cases are the same"
        )


def _ranges(tables: Mapping[str, Any]) -> tuple[Range, ...]:
    """The ranges in the tables of a case, checked: both their ends are allowed values."""
    found = {place: _ends(place, value) for place, value in _found(tables, ())}
    for end in (0, 1):
        _check_fields(_filled(tables, {place: ends[end] for place, ends in found.items()}))
    return tuple(Range(place, *ends, _unit(place)) for place, ends in found.items())


def _found(value: Any, place: _Place) -> Iterator[tuple[_Place, Mapping[str, Any]]]:
    """Where the ranges are, in the order of the text."""
    if isinstance(value, Mapping):
        if "min" in value or "max" in value:
            yield place, value
            return
        for key, inner in value.items():
            yield from _found(inner, (*place, key))
    elif isinstance(value, list):
        for index, inner in enumerate(value):
            yield from _found(inner, (*place, index))


def _ends(place: _Place, value: Mapping[str, Any]) -> tuple[float, float]:
    name = _dotted(place)
    known = field_at(_keys(place), Case) if place else None
    if not place:
        raise InputError("cannot be a range, must be the tables of a case")
    if known is not None and float not in set(_types(known.annotation)):
        raise InputError(f"{name} cannot be a range, must be {known.description}")
    if set(value) != {"min", "max"}:
        raise InputError(f"{name} = {shown(dict(value))} must have min and max and no other key")
    for end, number in value.items():
        # Beyond this limit no field of a case goes, and below it every whole number is a float.
        if type(number) not in (int, float) or not abs(number) < 1e15:
            raise InputError(f"{name}: {end} = {shown(number)} must be a finite number")
    low, high = float(value["min"]), float(value["max"])
    if not low < high:
        raise InputError(f"{name}: min = {low:.17g} must be below max = {high:.17g}")
    return low, high


#: Tables whose keys go together or not whatever the values are.
_WHOLE = (("vessel",), ("aneurysm",), ("site",))


def _check_files(tables: Mapping[str, Any]) -> None:
    for table, key in FILE_KEYS:
        values = tables.get(table)
        name = values.get(key) if isinstance(values, Mapping) else None
        if isinstance(name, str) and not Path(name).is_absolute():
            raise InputError(
                f"{table}.{key} = {name} must be an absolute path in a plan, whose cases may be "
                "run from anywhere"
            )


def _check_fields(tables: Mapping[str, Any]) -> None:
    """Check each field by itself; whether they go together is another question in each case."""
    try:
        Case.model_validate(tables)
    except ValidationError as error:
        mistakes = error.errors(include_url=False)
        if any(m["type"] != "value_error" or m["loc"][:1] in _WHOLE for m in mistakes):
            raise InputError(one_sentence(error, Case, tables)) from None


def _filled(value: Any, numbers: Mapping[_Place, float], place: _Place = ()) -> Any:
    """``value`` with ``numbers`` in the places of its ranges."""
    if place in numbers:
        return numbers[place]
    if isinstance(value, Mapping):
        return {key: _filled(inner, numbers, (*place, key)) for key, inner in value.items()}
    if isinstance(value, list):
        return [_filled(inner, numbers, (*place, index)) for index, inner in enumerate(value)]
    return value


def _unit(place: _Place) -> str:
    known = field_at(_keys(place), Case)
    named = re.search(r"\bof (mm|MPa)\b", known.description or "") if known else None
    return named[1] if named else ""


def _types(annotation: Any) -> Iterator[Any]:
    """All types that an annotation is made of."""
    yield annotation
    for inner in get_args(annotation):
        yield from _types(inner)


def _keys(place: _Place) -> list[str]:
    return [key for key in place if isinstance(key, str)]


def _dotted(place: _Place) -> str:
    """The place as people write it: vessel.P1[1]."""
    return "".join(f"[{k}]" if isinstance(k, int) else f".{k}" for k in place).lstrip(".")
