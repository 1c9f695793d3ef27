"""Arrays kept in a file for the next time, in the first of some folders that takes it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from contextlib import suppress
from io import BytesIO
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from braidcast.atomic import write_atomically


def read_kept(folders: Iterable[Path], name: str) -> dict[str, NDArray[Any]] | None:
    """The arrays kept under ``name``; None if there are none, or they are damaged."""
    for folder in folders:
        with suppress(OSError, ValueError, KeyError, EOFError, BadZipFile):
            with (folder / name).open("rb") as kept, np.load(kept, allow_pickle=False) as stored:
                return {key: stored[key] for key in stored.files}
    return None


def keep(folders: Iterable[Path], name: str, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write the arrays whole or not at all; where no folder takes them, they are not kept."""
    content, named = BytesIO(), dict[str, Any](arrays)
    np.savez(content, **named)
    for folder in folders:
        # What cannot be kept costs time, not the result.
        with suppress(OSError):
            folder.mkdir(parents=True, exist_ok=True)
            write_atomically(folder / name, content.getvalue())
            return
