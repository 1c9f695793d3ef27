"""The workers of a run: processes of this machine, or a Dask cluster that is there already."""

from __future__ import annotations

import asyncio
import logging
import os
import signal
from collections.abc import Iterator
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from importlib.util import find_spec
from multiprocessing import resource_tracker

import dask
from distributed import Client, LocalCluster
from distributed.comm import CommClosedError, get_address_host_port

from braidcast.errors import InputError

#: For a cluster of our own: one case at a worker at a time, so that a case that kills its worker
#: takes no other down with it, and the first death is reported.
_SETTINGS = {
    "distributed.scheduler.worker-saturation": 1.0,
    "distributed.scheduler.allowed-failures": 0,
    "distributed.worker.profile.enabled": False,
    # Dask makes the C library give back memory at once, to take it again page by page at the next
    # Newton iteration: half of the time of a simulation. BLAS is held to one thread elsewhere.
    "distributed.nanny.pre-spawn-environ": {"OMP_NUM_THREADS": 1},
}
_PATIENCE = 10.0  # s to reach a scheduler
_GRACE = 0.5  # s that a busy worker has to end by itself


class RunStopped(Exception):
    """The run cannot go on, in one sentence; what was finished is kept, and a next run goes on."""


def available_cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextmanager
def connected(workers: int | None, scheduler: str | None) -> Iterator[tuple[Client, str]]:
    """A client, and the address of its dashboard or "".

    Of ``workers`` new processes, one thread each, by default one a core, which end with the
    context; or of the cluster whose ``scheduler`` is at this address. A connection that is lost
    inside the context becomes ``RunStopped``.
    """
    if workers is not None and scheduler is not None:
        raise InputError("workers and scheduler: both given, must be at most one of the two")
    if workers is not None and workers < 1:
        raise InputError(f"workers = {workers} must be a whole number above 0")
    try:
        with _quiet():
            if scheduler is not None:
                with _remote(scheduler) as client:
                    yield client, client.dashboard_link or ""
            else:
                with _local(workers or available_cores()) as client:
                    yield client, client.dashboard_link if _has_dashboard() else ""
    except (CommClosedError, CancelledError):
        raise RunStopped(
            "the scheduler or the connection to it is gone; run again to go on with what is "
            "not finished"
        ) from None


@contextmanager
def _local(workers: int) -> Iterator[Client]:
    """Processes of our own; they end at once with the context, and so does what they work on."""
    cluster = None
    try:
        with dask.config.set(_SETTINGS):
            with _interrupts_held():
                cluster = _started(workers)
            with Client(cluster, set_as_default=False) as client:
                yield client
    finally:
        if cluster is not None:
            with _interrupts_held():
                _end(cluster)


def _started(workers: int) -> LocalCluster:
    try:
        return LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            # A case takes what it takes: Dask would kill what the system still bears.
            memory_limit=None,
            dashboard_address="127.0.0.1:0",  # any free port
            silence_logs=logging.CRITICAL,
        )
    except (RuntimeError, OSError) as error:
        raise RunStopped(f"{workers} workers could not be started: {error}") from None


@contextmanager
def _remote(address: str) -> Iterator[Client]:
    """The cluster of the scheduler at ``address``; ``InputError`` if there is none."""
    try:
        get_address_host_port(address)  # before a client that is half made waits for nothing
        client = Client(address, timeout=_PATIENCE, set_as_default=False)
    except (OSError, ValueError) as error:
        raise InputError(
            f"scheduler = {address} must be the address of a running Dask scheduler: {error}"
        ) from None
    with client:
        yield client


def _has_dashboard() -> bool:
    return find_spec("bokeh") is not None


def _end(cluster: LocalCluster) -> None:
    async def end() -> None:
        # The nannies first: they would start workers that end under their eyes once more.
        nannies = cluster.workers.values()
        await asyncio.gather(*(n.close(timeout=_GRACE) for n in nannies), return_exceptions=True)

    with suppress(Exception):  # whatever is left ends with this process
        cluster.sync(end)
        cluster.close()


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep to ourselves what Dask logs of workers that come and go; the run says what matters."""
    loggers = [logging.getLogger(name) for name in ("distributed", "tornado", "bokeh", "asyncio")]
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)


@contextmanager
def _interrupts_held() -> Iterator[None]:
    """Let Ctrl-C wait; threads and processes that begin here never get it.

    A terminal sends it to all processes at once, but what becomes of workers is for us to say.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    resource_tracker.ensure_running()  # whoever starts it has SIGINT unblocked afterwards
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
