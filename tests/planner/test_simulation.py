"""A simulation's process: whatever becomes of it, the server learns it and nothing stays behind."""

import asyncio
import sys

import psutil
import pytest

from braidcast.planner import simulation
from braidcast.planner.simulation import SimulationFailed, simulate_apart

SEND = "import json, os, sys, time; say = lambda **m: print(json.dumps(m), flush=True); "
FOREVER = "time.sleep(1000)"


def result_of(program: str, told: list[tuple[str, float]] | None = None) -> bytes:
    heard = [] if told is None else told
    command = (sys.executable, "-c", SEND + program)

    async def run() -> bytes:
        return await simulate_apart({"a": 1}, lambda *said: heard.append(said), command)

    try:
        return asyncio.run(run())
    finally:
        assert not psutil.Process().children(), "a process stayed behind"


def test_it_tells_of_its_stages_and_hands_over_its_result() -> None:
    told: list[tuple[str, float]] = []
    program = (
        "case = json.loads(sys.stdin.readline()); say(stage='crimp', fraction=0.5); "
        "say(bytes=3000000); sys.stdout.write(str(case['a']) * 3000000); sys.stdout.flush(); "
    )
    assert result_of(program + FOREVER, told) == b"1" * 3_000_000
    assert told == [("crimp", 0.5)]


@pytest.mark.parametrize(
    ("program", "reason"),
    [
        ("say(failed='the stent leaves'); " + FOREVER, "^the stent leaves$"),
        ("os.kill(os.getpid(), 11)", "^the simulation's process was ended by SIGSEGV$"),
        ("os.kill(os.getpid(), 9)", "^the simulation's process was ended by SIGKILL$"),
        ("raise ValueError('a defect')", "ended with code 1: ValueError: a defect$"),
        ("sys.exit(0)", "ended with code 0$"),
        ("say(bytes=100); print('half'); sys.exit(3)", "ended with code 3$"),
        ("sys.stderr.write('x' * 5_000_000); sys.exit(4)", "ended with code 4: x{300}$"),
    ],
)
def test_one_that_dies_says_why(program: str, reason: str) -> None:
    with pytest.raises(SimulationFailed, match=reason):
        result_of(program)


def test_one_that_takes_too_long_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(simulation, "LONGEST", 0.3)
    with pytest.raises(SimulationFailed, match="took longer than"):
        result_of(FOREVER)


@pytest.mark.parametrize("seconds", [0.0, 0.3])
def test_cancelled_its_process_ends(seconds: float) -> None:
    async def run() -> None:
        half = "print('{' * 1000000, end='', flush=True); "
        command = (sys.executable, "-c", SEND + half + FOREVER)
        task = asyncio.create_task(simulate_apart({}, lambda *said: None, command))
        await asyncio.sleep(seconds)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task

    asyncio.run(run())
    assert not psutil.Process().children()
