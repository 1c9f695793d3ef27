"""An address for the planner, and a server at it until it is told to stop."""

from __future__ import annotations

import errno
import os
import socket
from contextlib import suppress
from importlib.util import find_spec
from typing import TYPE_CHECKING

from braidcast.errors import InputError

if TYPE_CHECKING:
    import uvicorn
    from starlette.applications import Starlette

LOOPBACK = "127.0.0.1"
USUAL_PORT = 8765


def check_installed() -> None:
    """``InputError`` without the packages that serve the page."""
    missing = [name for name in ("starlette", "uvicorn") if find_spec(name) is None]
    if missing:
        raise InputError(
            f"{' and '.join(missing)} must be installed for the planner: "
            "pip install 'braidcast[planner]'"
        )


def listening(host: str, port: int | None) -> socket.socket:
    """A socket that listens; the usual port or a free one for None.

    ``InputError`` if there is no such host here, or the port is taken or not ours to take.
    """
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(
            host, 0, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
    except (OSError, UnicodeError):
        raise InputError(f"--host = {host} is not known, must be this machine's") from None
    for candidate in (USUAL_PORT, 0) if port is None else (port,):
        opened = socket.socket(family, kind, protocol)
        try:
            if os.name == "posix":  # elsewhere this would share a port that is in use
                opened.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            opened.bind((address[0], candidate, *address[2:]))
            opened.listen(128)
            return opened
        except OSError as error:
            opened.close()
            if error.errno == errno.EADDRNOTAVAIL:
                raise InputError(f"--host = {host} is not this machine's, must be") from None
            reason = "is taken by another program" if error.errno == errno.EADDRINUSE else None
            taken = InputError(
                f"--port = {candidate} {reason or f'cannot be used: {error.strerror}'}; "
                "without --port a free one is used"
            )
    raise taken


def url(opened: socket.socket) -> str:
    """Where the page is."""
    host, port = opened.getsockname()[:2]
    host = {"0.0.0.0": LOOPBACK, "::": "::1"}.get(host, host)
    return f"http://[{host}]:{port}/" if ":" in host else f"http://{host}:{port}/"


def server_of(app: Starlette) -> uvicorn.Server:
    """What serves the planner; ``run(sockets=[…])`` starts it."""
    import uvicorn

    config = uvicorn.Config(
        app,
        loop="asyncio",
        http="h11",
        ws="none",
        lifespan="on",
        log_level="warning",
        access_log=False,
        server_header=False,
        timeout_graceful_shutdown=2,
    )
    return uvicorn.Server(config)


def serve(app: Starlette, opened: socket.socket) -> None:
    """Serve at a socket until Ctrl-C or SIGTERM; simulations under way end with it."""
    # uvicorn raises the signal again once everything has ended: what was asked for is done.
    with suppress(KeyboardInterrupt, SystemExit):
        server_of(app).run(sockets=[opened])
