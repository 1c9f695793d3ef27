"""Which code a simulation was made by, more finely than a version number says."""

import hashlib
from functools import cache
from pathlib import Path

import braidcast


@cache
def fingerprint() -> str:
    """Sixteen hexadecimal digits that change with the sources a deployment is computed by."""
    package = Path(braidcast.__file__).parent
    files = [package / "case.py", package / "case_tables.py"]
    for layer in ("mechanics", "devices", "vessels", "deployment"):
        files += sorted((package / layer).glob("*.py"))
    digest = hashlib.sha256()
    for file in files:
        digest.update(file.name.encode() + file.read_bytes())
    return digest.hexdigest()[:16]
