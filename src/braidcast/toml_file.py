"""Reading short TOML files that a user wrote: whatever is wrong becomes one sentence."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from braidcast.errors import InputError

#: Such a file is a page of text; whatever is larger was not meant for us.
_LARGEST_FILE = 1_000_000


def read_text(path: Path, kind: str, needs: str) -> str:
    """The text of the file at ``path``; ``InputError`` without the path if it is no such text.

    ``kind`` is what the file is called in complaints, ``needs`` what an empty one lacks.
    """
    try:
        with path.open("rb") as stream:
            content = stream.read(_LARGEST_FILE + 1)
    except FileNotFoundError:
        raise InputError(f"there is no such {kind}") from None
    except IsADirectoryError:
        raise InputError(f"is a folder, must be a {kind}") from None
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise InputError(f"cannot be read: {reason}") from None
    if len(content) > _LARGEST_FILE:
        raise InputError(f"is longer than {_LARGEST_FILE} bytes, must be a short text in TOML")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f"is not text in UTF-8, must be a {kind} in TOML") from None
    if not text.strip():
        raise InputError(f"is empty, must have {needs}")
    return text


def parse(text: str, kind: str) -> dict[str, Any]:
    """The tables of a TOML text; ``InputError`` if it is not TOML."""
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise InputError(f"is not a {kind}: its values are nested too deeply") from None
    except ValueError as error:
        raise InputError(f"is not valid TOML: {error}") from None
