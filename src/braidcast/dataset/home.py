"""Where datasets are that several commands, or later runs on the same machine, share."""

import os
from pathlib import Path

from platformdirs import user_cache_path


def data_folder() -> Path:
    """The folder of shared datasets: ``BRAIDCAST_DATA``, or by default the user's cache folder."""
    given = os.environ.get("BRAIDCAST_DATA")
    return Path(given) if given else user_cache_path("braidcast")
