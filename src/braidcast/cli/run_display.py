"""How a run of many cases shows how far it is, on standard error."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import datetime, timedelta
from typing import TYPE_CHECKING

from braidcast.cli.messages import say

if TYPE_CHECKING:
    from braidcast.dataset.progress import Progress
    from braidcast.study.stages import Done

#: Seconds between two lines where there is no terminal.
_EVERY = 30.0


class RunDisplay:
    """One line that changes on a terminal; elsewhere a plain line now and then."""

    def __init__(self, terminal: bool) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn
        from rich.progress import Progress as Bars

        self.bars = Bars(
            MofNCompleteColumn(),
            BarColumn(bar_width=None),
            TextColumn("{task.description}"),
            TimeElapsedColumn(),
            console=Console(stderr=True),
            disable=not terminal,
        )
        self._terminal = terminal
        self._bar = self.bars.add_task("waiting for workers", total=None)
        self._last = -_EVERY

    def __call__(self, progress: Progress) -> None:
        text = _line(progress)
        reached = progress.finished + progress.failed
        if self._terminal:
            self.bars.update(self._bar, description=text, completed=reached, total=progress.cases)
        elif time.monotonic() - self._last >= _EVERY or progress.done == progress.to_do:
            self._last = time.monotonic()
            say(f"{reached}/{progress.cases}, {text}")

    def say(self, sentence: str) -> None:
        """A sentence above the line."""
        if self._terminal:
            self.bars.console.print(f"braidcast: {sentence}", markup=False, highlight=False)
        else:
            say(sentence)


@contextmanager
def run_display() -> Iterator[RunDisplay]:
    """A display, on the screen as long as the context lasts."""
    shown = RunDisplay(sys.stderr.isatty())
    with shown.bars:
        yield shown


class StageDisplay(RunDisplay):
    """The same for the stages of a study: one line on a terminal, elsewhere one a stage."""

    def __init__(self, terminal: bool, stages: int) -> None:
        super().__init__(terminal)
        self.bars.update(self._bar, description="stages", total=stages)
        self._stages = stages

    def show(self, done: Done, left: int) -> None:
        """A stage is done, ``left`` are not."""
        reached = self._stages - left
        if self._terminal:
            self.bars.update(self._bar, description=done.name, completed=reached)
        elif done.again:
            say(f"{reached}/{self._stages}, {done.name}: {done.wall_seconds:.1f} s")


@contextmanager
def stage_display(stages: int) -> Iterator[Callable[[Done, int], None]]:
    """What is to be told of every stage that is done, on the screen as long as it lasts."""
    shown = StageDisplay(sys.stderr.isatty(), stages)
    with shown.bars:
        yield shown.show


def _line(progress: Progress) -> str:
    parts = [f"{progress.failed} failed", f"{progress.workers} workers"]
    left = progress.seconds_left
    if left is not None:
        end = datetime.now() + timedelta(seconds=left)
        day = "%H:%M" if left < 43200.0 else "%a %H:%M"
        parts += [f"{progress.rate:.0f} cases/h", f"ends {end.strftime(day)}"]
    return ", ".join(parts)
