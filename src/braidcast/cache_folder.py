"""Where what takes long to compute is kept for the next time."""

import os
from pathlib import Path

from platformdirs import user_cache_path


def cache_folder() -> Path:
    """``BRAIDCAST_CACHE``, or by default the user's cache folder; it may not exist yet."""
    folder = os.environ.get("BRAIDCAST_CACHE")
    return Path(folder) if folder else user_cache_path("braidcast")
