"""Progress bars on standard error."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager


class Bars:
    """One progress bar for each stage, made when the stage begins; shown after ``delay`` s."""

    def __init__(self, delay: float) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

        self.display = Progress(
            TextColumn("{task.description:<10}"),
            BarColumn(),
            TextColumn("{task.percentage:>3.0f} %"),
            TimeElapsedColumn(),
            console=Console(stderr=True),
        )
        self._bars: dict[str, TaskID] = {}
        self._show_at = time.monotonic() + delay

    def __call__(self, stage: str, fraction: float) -> None:
        if stage not in self._bars:
            self._bars[stage] = self.display.add_task(stage, total=1.0)
        self.display.update(self._bars[stage], completed=min(max(fraction, 0.0), 1.0))
        if time.monotonic() >= self._show_at:
            self.display.start()

    def close(self) -> None:
        """Take the bars down, if they are up."""
        if self.display.live.is_started:
            self.display.stop()


@contextmanager
def bars(first: str, delay: float = 0.0) -> Iterator[Bars]:
    """Bars, of which that of the stage ``first`` is there from the beginning."""
    shown = Bars(delay)
    try:
        shown(first, 0.0)
        yield shown
    finally:
        shown.close()
