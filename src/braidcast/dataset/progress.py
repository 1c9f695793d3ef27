"""How far a run is, and what it did."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

from braidcast.dataset.work import Done


@dataclass(frozen=True)
class Progress:
    """How far a run is, in numbers of cases; ``done``, ``to_do`` and ``seconds`` of this run."""

    cases: int
    finished: int
    failed: int
    done: int
    to_do: int
    seconds: float
    """Since the first case was handed out."""
    workers: int
    """How many there are now."""

    @property
    def rate(self) -> float:
        """Cases per hour."""
        return 3600.0 * self.done / self.seconds if self.seconds > 0.0 else 0.0

    @property
    def seconds_left(self) -> float | None:
        """Expected time to the end, s; None as long as nothing tells."""
        return (self.to_do - self.done) * self.seconds / self.done if self.done else None


@dataclass(frozen=True)
class RunReport:
    """What a run did: its cases, the seconds from its beginning to its end, on how many workers."""

    done: tuple[Done, ...]
    wall_seconds: float
    workers: int

    @property
    def overhead(self) -> float:
        """Wall time times workers over the processor time of the cases; NaN if there were none."""
        cpu = sum(done.cpu_seconds for done in self.done)
        return self.wall_seconds * self.workers / cpu if cpu > 0.0 else float("nan")


@dataclass
class Count:
    """Counts the cases of a run as they are done."""

    cases: int
    finished: int
    """Cases finished so far, by this run and those before it."""
    failed: int
    to_do: int
    done: list[Done] = field(default_factory=list)
    workers: int = 0
    """The most there were."""
    _start: float = field(default_factory=time.perf_counter)

    def add(self, done: Done) -> None:
        self.done.append(done)
        self.finished += done.finished
        self.failed += not done.finished

    def progress(self, workers: int) -> Progress:
        self.workers = max(self.workers, workers)
        seconds = time.perf_counter() - self._start
        return Progress(
            self.cases, self.finished, self.failed, len(self.done), self.to_do, seconds, workers
        )
