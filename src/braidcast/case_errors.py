"""What is wrong in a case, in one sentence, from what pydantic found."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from datetime import date, time
from difflib import get_close_matches
from typing import Any, get_args

from pydantic import BaseModel, ValidationError
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
    keys = [str(key) for key in mistake["loc"] if isinstance(key, str)]
    name = ".".join(keys)
    if mistake["type"] == "extra_forbidden":
        return f"{name} is not a known key; {_suggestion(keys, model, whole)}"
    rule = _rule(keys, model)
    value = _value(keys, data)
    if value is _missing:
        return f"{name} is missing, must be {rule}"
    return f"{name} = {shown(value)} must be {rule}"


def _suggestion(keys: list[str], model: type[BaseModel], whole: str) -> str:
    """The known key that was probably meant, or the keys that are allowed there."""
    *table, key = keys
    known = {".".join(path): path for path in _paths(model)}
    for name, path in known.items():
        if path[-1].lower() == key.lower():
            return f"did you mean {name}?"
    here = _model_at(table, model)
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
        table = _table(model, name)
        if table is not None:
            yield from ((name, *path) for path in _paths(table))


def _table(model: type[BaseModel], name: str) -> type[BaseModel] | None:
    """The model behind a field that is a table, or None."""
    annotation = model.model_fields[name].annotation
    for kind in (annotation, *get_args(annotation)):
        if isinstance(kind, type) and issubclass(kind, BaseModel):
            return kind
    return None


def _model_at(keys: list[str], model: type[BaseModel]) -> type[BaseModel]:
    for key in keys:
        model = _table(model, key) or model
    return model


def field_at(keys: Sequence[str], model: type[BaseModel]) -> FieldInfo | None:
    """The field of ``model`` at ``keys``, or None if there is no such field."""
    for key in keys[:-1]:
        table = _table(model, key) if key in model.model_fields else None
        if table is None:
            return None
        model = table
    return model.model_fields.get(keys[-1])


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
