"""Arrays kept in a file, beside another file or in the user's cache folder."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from io import BytesIO
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from braidcast.atomic import write_atomically
from braidcast.cache_folder import cache_folder


def read_kept(beside: Path, name: str) -> dict[str, NDArray[Any]] | None:
    """The arrays kept under ``name``; None if there are none, or they are damaged."""
    for folder in (beside.parent, cache_folder()):
        with suppress(OSError, ValueError, KeyError, EOFError, BadZipFile):
            with (folder / name).open("rb") as kept, np.load(kept, allow_pickle=False) as stored:
                return {key: stored[key] for key in stored.files}
    return None


def keep(beside: Path, name: str, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write the arrays whole or not at all; where neither folder takes them, they are not kept."""
    content, named = BytesIO(), dict[str, Any](arrays)
    np.savez(content, **named)
    for folder in (beside.parent, cache_folder()):
        # What cannot be kept costs time, not the result.
        with suppress(OSError):
            folder.mkdir(parents=True, exist_ok=True)
            write_atomically(folder / name, content.getvalue())
            return
