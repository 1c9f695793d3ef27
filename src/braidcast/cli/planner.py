"""braidcast planner: the page in the browser."""

from __future__ import annotations

import os
import sys
import threading
import webbrowser
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from braidcast.cli.messages import naming, say, told
from braidcast.cli.progress import bars

if TYPE_CHECKING:
    from braidcast.planner.contents import Contents
    from braidcast.surrogate.model import SurrogateModel

_LOOPBACK = ("127.0.0.1", "localhost", "::1")


def planner(
    case: Annotated[
        Path | None,
        typer.Argument(
            metavar="CASE.toml",
            help="The case to open with. Default: a stent across the neck of an aneurysm.",
            show_default=False,
        ),
    ] = None,
    model: Annotated[
        Path | None,
        typer.Option(
            "--model", "-m", metavar="MODEL", help="A model file. Default: braidcast's own."
        ),
    ] = None,
    port: Annotated[
        int | None,
        typer.Option("--port", min=1, max=65535, metavar="N", help="Default: 8765, or a free one."),
    ] = None,
    host: Annotated[
        str,
        typer.Option("--host", help="Address to listen at; by default only this machine's own."),
    ] = _LOOPBACK[0],
    no_browser: Annotated[
        bool, typer.Option("--no-browser", help="Only print the address.")
    ] = False,
    export: Annotated[
        Path | None,
        typer.Option(
            "--export",
            metavar="FILE.html",
            help="Write the planner with its model to one file that opens without a server.",
        ),
    ] = None,
) -> None:
    """Slide the device along the vessel, in the browser, and see where every wire ends up.

    Serves one page to this machine until Ctrl-C. The model is evaluated in the page, simulations
    run here. A vessel from a surface is simulated only.

    Exit codes: 0 done; 1 the file could not be written; 2 bad input; 130 interrupted.
    """
    with told():
        if export is not None:
            _export(_contents(case, model), export)
            return
        _serve(case, model, port, host, not no_browser)


def _serve(
    case: Path | None, model: Path | None, port: int | None, host: str, browser: bool
) -> None:
    from braidcast.planner.serve import check_installed, listening, serve, url

    check_installed()
    # The address comes first: if it cannot be had, nobody waits to hear it.
    with listening(host, port) as opened:
        contents = _contents(case, model)
        from braidcast.planner.server import application

        app = application(contents, any_host=host not in _LOOPBACK)
        typer.echo(f"braidcast planner at {url(opened)} until Ctrl-C")
        if host not in _LOOPBACK:
            say(f"whoever reaches this machine as {host} can use the planner")
        if browser:
            # The socket listens already: a browser that is quicker than the server waits.
            threading.Thread(target=_show, args=(url(opened),), daemon=True).start()
        serve(app, opened)


def _contents(case: Path | None, model: Path | None) -> Contents:
    """What the page is handed; reads a case and a model that were named, or says what is wrong."""
    from braidcast.planner.contents import Contents
    from braidcast.planner.opened_case import OpenedCase

    if case is None:
        opened = OpenedCase.default()
    else:
        with bars("surface", delay=1.0) as progress:
            opened = OpenedCase.from_toml(case, progress)
    contents = Contents(opened, partial(_load, model))
    if model is not None:
        _ = contents.model
    return contents


def _load(model: Path | None) -> SurrogateModel:
    from braidcast.surrogate.model_file import load_model

    return load_model(model)


def _show(address: str) -> None:
    """Open the page, unless the browser would be one of text in this very terminal."""
    screen = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    if screen or not sys.platform.startswith("linux"):
        webbrowser.open(address)


def _export(contents: Contents, path: Path) -> None:
    from braidcast.atomic import write_atomically
    from braidcast.errors import InputError
    from braidcast.planner.pages import single_file
    from braidcast.results_folder import check_file

    check_file(path)
    if contents.without_model is not None:
        raise InputError(f"--export = {path} needs a case with a model: {contents.without_model}")
    with naming(str(path)):
        write_atomically(path, single_file(contents).encode())
    typer.echo(f"{path}, {path.stat().st_size / 1e6:.1f} MB: opens in a browser, without a server")
