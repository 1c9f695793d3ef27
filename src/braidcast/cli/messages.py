"""What the commands say when something goes wrong, and their exit codes."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager

import typer

from braidcast.errors import InputError

NOT_WRITTEN, BAD_INPUT, NOT_CONVERGED, INTERRUPTED = 1, 2, 3, 130


@contextmanager
def told() -> Iterator[None]:
    """Turn what can go wrong outside our control into one sentence and an exit code."""
    try:
        yield
    except InputError as error:
        say(str(error))
        sys.exit(BAD_INPUT)
    except KeyboardInterrupt:
        say("interrupted")
        sys.exit(INTERRUPTED)
    except BrokenPipeError:
        raise
    except OSError as error:
        where = f" {error.filename}:" if error.filename else ""
        say(f"the results could not be written:{where} {error.strerror or error}")
        sys.exit(NOT_WRITTEN)


@contextmanager
def naming(folder: str) -> Iterator[None]:
    """Let an ``OSError`` name the folder that was asked for, not the files inside it."""
    try:
        yield
    except OSError as error:
        raise OSError(error.errno, error.strerror or str(error), folder) from None


def say(sentence: str) -> None:
    """One sentence to standard error."""
    typer.echo(f"braidcast: {sentence}", err=True)
