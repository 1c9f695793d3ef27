"""What is wrong in a case, in one sentence, from what pydantic found."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from datetime import date, time
from difflib import get_close_matches
from itertools import pairwise
from typing import Any, get_args

from pydantic import BaseModel, Tag, ValidationError
from pydantic.fields import FieldInfo

from braidcast.errors import InputError

_LONGEST_VALUE = 60


def one_sentence(
    error: ValidationError, model: type[BaseModel], data: Mapping[str, Any], whole: str = "a case"
) -> str:
    """Name the field as in the TOML, its value, and what is allowed, for the first mistake.

    ``model`` is the model of the ``whole`` file and ``data`` what it was given. An unknown key goes
    first: a misspelt key is also missed where it should be, and the misspelling is what to mend.
    """
    mistakes = error.errors(include_url=False)
    mistake = next((m for m in mistakes if m["type"] == "extra_forbidden"), mistakes[0])
    cause = mistake.get("ctx", {}).get("error")
    if isinstance(cause, InputError):
        return str(cause)
    place = [key for key in mistake["loc"] if isinstance(key, str)]
    keys = [key for key in place if not key.startswith("<")]
    name = ".".join(keys)
    if mistake["type"] == "extra_forbidden":
        here = _model_at(place[:-1], model)
        return f"{name} is not a known key; {_suggestion(keys, here, model, whole)}"
    rule = _rule(keys, model)
    value = _value(keys, data)
    if value is _missing:
        return f"{name} is missing, must be {rule}"
    return f"{name} = {shown(value)} must be {rule}"


def _suggestion(keys: list[str], here: type[BaseModel], model: type[BaseModel], whole: str) -> str:
    """The known key that was probably meant, or the keys that are allowed there, in ``here``."""
    *table, key = keys
    known = {".".join(path): path for path in _paths(model)}
    if ".".join(keys) in known:  # in another kind of the same table
        return f"[{'.'.join(table)}] takes {', '.join(here.model_fields)} here"
    for name, path in known.items():
        if path[-1].lower() == key.lower():
            return f"did you mean {name}?"
    near = get_close_matches(key, here.model_fields, n=1)
    if near:
        return f"did you mean {'.'.join([*table, near[0]])}?"
    near = get_close_matches(".".join(keys), known, n=1, cutoff=0.8)
    if near:
        return f"did you mean {near[0]}?"
    where = f"[{'.'.join(table)}]" if table else whole
    return f"{where} takes {', '.join(here.model_fields)}"


def _paths(model: type[BaseModel]) -> Iterator[tuple[str, ...]]:
    for name in model.model_fields:
        yield (name,)
        for _, table in _tables(model, name):
            yield from ((name, *path) for path in _paths(table))


def _tables(model: type[BaseModel], name: str) -> list[tuple[str, type[BaseModel]]]:
    """The models behind a field that is a table, each with its tag; none for another field."""
    field = model.model_fields.get(name)
    return list(_tagged(field.annotation)) if field else []


def _tagged(annotation: Any, tag: str = "") -> Iterator[tuple[str, type[BaseModel]]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield tag, annotation
    for note in getattr(annotation, "__metadata__", ()):
        tag = note.tag if isinstance(note, Tag) else tag
    for kind in get_args(annotation):
        yield from _tagged(kind, tag)


def _model_at(place: Sequence[str], model: type[BaseModel]) -> type[BaseModel]:
    """The model at a place of pydantic's, in which a kind's tag follows the key of its table."""
    for key, following in pairwise([*place, ""]):
        tables = _tables(model, key)
        model = next((table for tag, table in tables if tag in ("", following)), model)
    return model


def field_at(keys: Sequence[str], model: type[BaseModel]) -> FieldInfo | None:
    """The field of ``model`` at ``keys``, or None if there is no such field."""
    first, *others = keys
    if not others:
        return model.model_fields.get(first)
    found = (field_at(others, table) for _, table in _tables(model, first))
    return next((field for field in found if field is not None), None)


def _rule(keys: list[str], model: type[BaseModel]) -> str:
    """What the field at ``keys`` may be; its description in the model."""
    field = field_at(keys, model)
    return field.description or "valid" if field else "valid"


_missing = object()


def _value(keys: list[str], data: Any) -> Any:
    for key in keys:
        if not isinstance(data, Mapping) or key not in data:
            return _missing
        data = data[key]
    return data


def shown(value: Any) -> str:
    """The value as the file has it, cut if it is long."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, (date, time)):
        return value.isoformat()
    try:
        text = repr(value)
    except ValueError:  # an integer of more digits than Python agrees to print
        return "a huge number"
    return text if len(text) <= _LONGEST_VALUE else text[: _LONGEST_VALUE - 3] + "..."
