"""A dataset in one file, for whoever has xarray but not braidcast."""

from __future__ import annotations

from pathlib import Path

from braidcast.atomic import write_atomically
from braidcast.dataset.folder import DatasetFolder
from braidcast.dataset.ledger import Ledger
from braidcast.dataset.store import dataset
from braidcast.errors import InputError


def collect(folder: DatasetFolder, path: str | Path) -> Ledger:
    """Write all planned cases to the netCDF-3 file ``path``, whole or not at all.

    ``xarray.open_dataset(path)`` gives what ``braidcast.open_dataset`` gives of the folder. The
    file is put together in memory. Returns the ledger of what is in it; ``InputError`` if
    ``path`` cannot be a file, ``OSError`` if it cannot be written.
    """
    path = Path(path)
    check_file(path)
    ledger = Ledger.read(folder)
    found = dataset(folder, ledger)
    write_atomically(path, bytes(found.to_netcdf(engine="scipy", format="NETCDF3_64BIT")))
    return ledger


def check_file(path: Path) -> None:
    """Raise ``InputError`` if ``path`` is a folder, or in no folder."""
    if path.is_dir():
        raise InputError(f"output = {path} is a folder, must be a file or a new name")
    if not path.parent.is_dir():
        raise InputError(f"output = {path} must be in a folder that exists, {path.parent} does not")
