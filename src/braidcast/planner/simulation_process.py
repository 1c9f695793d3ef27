"""One simulation in a process of its own, so that it can be ended at any time.

The tables of a case come in as one line of JSON. Out go lines of JSON: ``{"stage", "fraction"}``,
and at the end ``{"failed": sentence}``, or ``{"bytes": n}`` and that many bytes: the summary and
the arrays ``positions`` (N, 3) and ``gaps`` (N,), mm. The process ends with its input.
"""

from __future__ import annotations

import json
import os
import sys
import threading
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any, BinaryIO

from braidcast.errors import InputError


def main() -> None:
    # Whatever a library prints must not come between the lines.
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    tables = json.loads(sys.stdin.buffer.readline())
    threading.Thread(target=_end_with_input, daemon=True).start()
    try:
        result = simulated(tables, _Reporter(out))
    except InputError as error:
        _send(out, {"failed": str(error)})
        return
    except MemoryError:
        _send(out, {"failed": "there was not enough memory for this simulation"})
        return
    _send(out, {"bytes": len(result)}, result)


def simulated(tables: Mapping[str, Any], report: _Reporter) -> bytes:
    """The case of these tables, simulated: its summary and arrays in the page's format."""
    report("start", 0.0)
    from braidcast.case import Case
    from braidcast.deployment.output import summary
    from braidcast.deployment.simulate import simulate
    from braidcast.planner.model_arrays import pack

    deployment = simulate(Case.from_dict(tables), progress=report)
    header = {**summary(deployment), "device": asdict(deployment.case.braid)}
    arrays = {"positions": deployment.positions, "gaps": deployment.wire_distance}
    return pack(header, arrays)


class _Reporter:
    """Tells of each hundredth of a stage once."""

    def __init__(self, out: BinaryIO) -> None:
        self._out = out
        self._said: tuple[str, int] | None = None

    def __call__(self, stage: str, fraction: float) -> None:
        now = (stage, int(100.0 * min(max(fraction, 0.0), 1.0)))
        if now != self._said:
            self._said = now
            _send(self._out, {"stage": stage, "fraction": now[1] / 100.0})


def _send(out: BinaryIO, message: Mapping[str, Any], content: bytes = b"") -> None:
    out.write(json.dumps(message).encode() + b"\n" + content)
    out.flush()


def _end_with_input() -> None:
    """A server that was killed closes the pipe: then nobody waits for the answer."""
    # Not by sys.stdin, whose lock this thread would hold when Python shuts down.
    while os.read(0, 1):
        pass
    os._exit(0)


if __name__ == "__main__":
    main()
