"""Running a case in a process of its own, from the side of the server."""

from __future__ import annotations

import asyncio
import json
import signal
import sys
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import asynccontextmanager, suppress
from typing import Any

#: -P: a file beside the user's case that has a module's name is not that module.
COMMAND = (sys.executable, "-P", "-m", "braidcast.planner.simulation_process")

#: Longer than any case of a device that the planner takes, s.
LONGEST = 1800.0

_MOST_BYTES = 2**24


class SimulationFailed(Exception):
    """A simulation without a result; one sentence says why."""


async def simulate_apart(
    tables: Mapping[str, Any],
    report: Callable[[str, float], None],
    command: tuple[str, ...] = COMMAND,
) -> bytes:
    """The result of a case's tables, see ``simulation_process``; cancelling ends the process."""
    async with _process(command) as process:
        assert process.stdin and process.stdout and process.stderr
        last_words = asyncio.create_task(_last_line(process.stderr))
        try:
            async with asyncio.timeout(LONGEST):
                with suppress(ConnectionError):  # it has ended already, and says why
                    process.stdin.write(json.dumps(tables).encode() + b"\n")
                    await process.stdin.drain()
                while line := await process.stdout.readline():
                    message = json.loads(line)
                    if "failed" in message:
                        raise SimulationFailed(message["failed"])
                    if "bytes" in message:
                        return await process.stdout.readexactly(message["bytes"])
                    report(message["stage"], message["fraction"])
                raise SimulationFailed(_why(await process.wait(), await last_words))
        except TimeoutError:
            raise SimulationFailed(
                f"the simulation took longer than {LONGEST / 60:.0f} minutes and was ended"
            ) from None
        except asyncio.IncompleteReadError:
            raise SimulationFailed(_why(await process.wait(), await last_words)) from None
        finally:
            last_words.cancel()


@asynccontextmanager
async def _process(command: tuple[str, ...]) -> AsyncIterator[asyncio.subprocess.Process]:
    pipe = asyncio.subprocess.PIPE
    # In a session of its own Ctrl-C reaches the server alone, which ends the process.
    # Below its limit a pipe is always read on, without which a killed process is waited for.
    process = await asyncio.create_subprocess_exec(
        *command,
        stdin=pipe,
        stdout=pipe,
        stderr=pipe,
        limit=_MOST_BYTES,
        start_new_session=True,
    )
    try:
        yield process
    finally:
        if process.returncode is None:
            with suppress(ProcessLookupError):
                process.kill()
        await process.wait()
        assert process.stdin
        process.stdin.close()
        with suppress(ConnectionError):
            await process.stdin.wait_closed()


async def _last_line(stream: asyncio.StreamReader) -> str:
    last = ""
    while line := await stream.readline():
        last = line.decode(errors="replace").strip() or last
    return last[:300]


def _why(code: int, last_words: str) -> str:
    if code < 0:
        with suppress(ValueError):
            return f"the simulation's process was ended by {signal.Signals(-code).name}"
    said = f": {last_words}" if last_words else ""
    return f"the simulation's process ended with code {code}{said}"
