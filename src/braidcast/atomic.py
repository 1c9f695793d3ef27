"""Files that are whole or not there, whenever the writing is cut short."""

from __future__ import annotations

import os
import secrets
from contextlib import suppress
from pathlib import Path

#: Files under writing have names that begin so; those that a kill leaves behind may be removed.
TEMPORARY = ".braidcast-"


def write_atomically(path: Path, content: bytes) -> None:
    """Put ``content`` at ``path`` in one step; an ``OSError`` names ``path``."""
    temporary = path.with_name(f"{TEMPORARY}{path.name}-{secrets.token_hex(6)}")
    try:
        with temporary.open("xb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(temporary, path)
    except BaseException as error:
        with suppress(OSError):
            temporary.unlink()
        if isinstance(error, OSError):
            raise OSError(error.errno, error.strerror or str(error), str(path)) from None
        raise
