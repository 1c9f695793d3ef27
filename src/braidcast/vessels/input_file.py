"""A file that a user names: whether it can be read, before it is."""

from __future__ import annotations

import os
import stat
from collections.abc import Collection
from pathlib import Path

from braidcast.errors import InputError

#: Ten million triangles; a vessel has a hundred thousand.
LARGEST_BYTES = 1_000_000_000


def checked_ending(path: str | os.PathLike[str], field: str, endings: Collection[str]) -> str:
    """The ending, lower case, of a file that is there and not too large.

    ``InputError``, which names ``field``, for a path of another ending, for what is no file, such
    as a folder or a device, and for an empty file or one of more than 1 GB.
    """
    where = f"{field} = {os.fspath(path)}"
    if (ending := Path(path).suffix.lower()) not in endings:
        raise InputError(f"{where} must end in one of {', '.join(endings)}")
    try:
        status = os.stat(path)
    except (OSError, ValueError) as error:  # ValueError for a null character
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{where} cannot be read: {reason}") from None
    if not stat.S_ISREG(status.st_mode):
        raise InputError(f"{where} is no file")
    if status.st_size == 0:
        raise InputError(f"{where} is an empty file")
    if status.st_size > LARGEST_BYTES:
        raise InputError(
            f"{where} has {status.st_size / 1e9:.1f} GB, where at most {LARGEST_BYTES / 1e9:g} GB "
            "is read: reduce the number of its triangles or points"
        )
    return ending
