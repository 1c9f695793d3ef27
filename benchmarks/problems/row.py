"""One measured line of the table of verification."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Row:
    """``error`` must not be above ``bar``; ``reference`` and ``ours`` are texts for the table."""

    problem: str
    source: str
    reference: str
    ours: str
    error: float
    bar: float

    @property
    def holds(self) -> bool:
        return self.error <= self.bar


def relative(ours: float, reference: float) -> float:
    """|ours - reference| / |reference|."""
    return abs(ours - reference) / abs(reference)
