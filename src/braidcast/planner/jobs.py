"""Simulations that pages have asked for: one runs, the others wait their turn."""

from __future__ import annotations

import asyncio
import secrets
from collections import deque
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from braidcast.planner.simulation import SimulationFailed, simulate_apart

Simulate = Callable[[Mapping[str, Any], Callable[[str, float], None]], Awaitable[bytes]]
"""From the tables of a case to its result, telling of stages; cancelled, it stops."""

MOST_QUEUED = 20
MOST_OF_A_SESSION = 5
MOST_KEPT = 50


class TooMany(Exception):
    """A simulation that cannot be queued; one sentence says why."""


@dataclass(eq=False)
class Job:
    """One simulation. ``state``: queued, running, done, failed or cancelled."""

    session: str
    tables: Mapping[str, Any]
    id: str = field(default_factory=lambda: secrets.token_hex(12))
    state: str = "queued"
    stage: str = ""
    fraction: float = 0.0
    message: str = ""
    result: bytes | None = None

    def advance(self, stage: str, fraction: float) -> None:
        self.stage, self.fraction = stage, fraction


class Jobs:
    """All jobs of a server, in the order they came; used from its event loop alone."""

    def __init__(self, simulate: Simulate = simulate_apart) -> None:
        self._simulate = simulate
        self._queued: deque[Job] = deque()
        self._running: Job | None = None
        self._task: asyncio.Task[bytes] | None = None
        self._ended: deque[Job] = deque(maxlen=MOST_KEPT)
        self._added = asyncio.Event()

    def add(self, session: str, tables: Mapping[str, Any]) -> Job:
        """Queue a case; ``TooMany`` if the session or all together have enough under way."""
        under_way = sum(job.session == session for job in self._under_way)
        if under_way >= MOST_OF_A_SESSION:
            raise TooMany(
                f"{under_way} simulations of this page are under way, must be below "
                f"{MOST_OF_A_SESSION} to start another: wait for one, or cancel it"
            )
        if len(self._queued) >= MOST_QUEUED:
            raise TooMany(
                f"{len(self._queued)} simulations are queued, must be below {MOST_QUEUED} to start "
                "another: wait for one"
            )
        job = Job(session, tables)
        self._queued.append(job)
        self._added.set()
        return job

    def find(self, session: str, identity: str) -> Job | None:
        """The job of that session, if it is under way or kept."""
        for job in (*self._under_way, *self._ended):
            if (job.id, job.session) == (identity, session):
                return job
        return None

    def status(self, job: Job) -> dict[str, Any]:
        """What is said of a job; ``position`` is the number of simulations before it."""
        waiting = job.state == "queued"
        return {
            "id": job.id,
            "state": job.state,
            "position": self._under_way.index(job) if waiting else 0,
            "stage": job.stage,
            "fraction": job.fraction,
            "message": job.message,
        }

    def cancel(self, job: Job) -> None:
        """Take a job out of the queue, or end it; one that has ended stays what it is."""
        if job is self._running and self._task is not None:
            self._task.cancel()
            job.state = "cancelled"
        elif job.state == "queued":
            self._queued.remove(job)
            self._end(job, "cancelled")

    async def work(self) -> None:
        """Simulate what is queued, one after the other, until this is cancelled."""
        while True:
            while not self._queued:
                self._added.clear()
                await self._added.wait()
            job = self._running = self._queued.popleft()
            job.state = "running"
            self._task = asyncio.ensure_future(self._simulate(job.tables, job.advance))
            try:
                await asyncio.wait([self._task])
            finally:
                self._task.cancel()
                await asyncio.wait([self._task])
                self._running = None
                self._take(job, self._task)

    def _take(self, job: Job, task: asyncio.Task[bytes]) -> None:
        """What has become of a job."""
        if job.state == "cancelled" or task.cancelled():
            self._end(job, "cancelled")
        elif error := task.exception():
            known = isinstance(error, SimulationFailed)
            self._end(job, "failed", str(error) if known else f"{type(error).__name__}: {error}")
        else:
            job.result, job.fraction = task.result(), 1.0
            self._end(job, "done")

    def _end(self, job: Job, state: str, message: str = "") -> None:
        job.state, job.message = state, message
        self._ended.append(job)

    @property
    def _under_way(self) -> list[Job]:
        running = [] if self._running is None else [self._running]
        return [*running, *self._queued]
