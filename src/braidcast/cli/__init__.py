"""The command line. Exit codes: 0 done, 1 results could not be written, 2 bad input,
3 not converged, 130 interrupted."""

from __future__ import annotations

import signal
import sys
from typing import Annotated

import typer

from braidcast import __version__
from braidcast.cli import dataset
from braidcast.cli.messages import told
from braidcast.cli.planner import planner
from braidcast.cli.predict import predict
from braidcast.cli.simulate import simulate
from braidcast.cli.study import study
from braidcast.cli.train import card, evaluate, train
from braidcast.cli.vessel import vessel

app = typer.Typer(
    name="braidcast",
    help="Deployment of braided stents in vessels with an aneurysm.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # plain help appears in a tenth of a second, a decorated one in a half
)


def main() -> None:
    """Entry point of the ``braidcast`` command."""
    # A job that is ended cleans up after itself as one that is interrupted does.
    signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(128 + number))
    with told():
        app()


def _version(asked: bool) -> None:
    if asked:
        typer.echo(f"braidcast {__version__}")
        raise typer.Exit()


@app.callback()
def _options(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_version, is_eager=True, help="Show the version."),
    ] = False,
) -> None:
    pass


app.command(epilog="Example:  braidcast simulate examples/success.toml -o demo")(simulate)
app.command(epilog="Example:  braidcast vessel artery.stl -o artery")(vessel)
app.command(epilog="Example:  braidcast predict examples/success.toml -o predicted")(predict)
app.command(epilog="Example:  braidcast planner examples/success.toml")(planner)
app.command(epilog="Example:  braidcast train sixty -o sixty.npz")(train)
app.command(epilog="Example:  braidcast evaluate sixty.npz sixty -o tested")(evaluate)
app.command(epilog="Example:  braidcast card > model_card.md")(card)
app.command(epilog="Example:  braidcast study --samples 150 -o report")(study)
app.add_typer(dataset.app, name="dataset")
