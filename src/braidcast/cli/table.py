"""Plain-text tables on standard output."""

from __future__ import annotations

from collections.abc import Sequence


def table(rows: Sequence[tuple[str, str]]) -> str:
    """Names and what they are, a line each."""
    return "\n".join(f"{name:<22}{value}" for name, value in rows)
