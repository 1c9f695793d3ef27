"""Sphinx: the site is built by ``make docs``."""

from docutils import nodes
from docutils.parsers.rst import Directive
from sphinx.application import Sphinx
from typer.main import get_command
from typer.testing import CliRunner

import braidcast
from braidcast.cli import app

project = "braidcast"
author = "The braidcast authors"
copyright = "the braidcast authors, MIT licence"
version = release = braidcast.__version__

extensions = ["myst_parser", "sphinx.ext.autodoc"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
exclude_patterns = ["_build"]

html_theme = "furo"
html_title = f"braidcast {release}"
html_copy_source = False

autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True


class CommandLine(Directive):
    """The ``--help`` of every command of braidcast, so that the page cannot be behind it."""

    def run(self) -> list[nodes.Node]:
        return [self._section(path) for path in _commands(get_command(app), ())]

    def _section(self, path: tuple[str, ...]) -> nodes.Node:
        name = " ".join(("braidcast", *path))
        shown = CliRunner().invoke(app, [*path, "--help"], prog_name="braidcast", color=False)
        section = nodes.section(ids=[name.replace(" ", "-")], names=[name])
        section += nodes.title(text=name)
        section += nodes.literal_block(text=shown.output.strip(), language="text")
        self.state.document.note_explicit_target(section)
        return section


def _commands(command: object, path: tuple[str, ...]) -> list[tuple[str, ...]]:
    inner = getattr(command, "commands", {})
    return [path, *(p for name in inner for p in _commands(inner[name], (*path, name)))]


def _bars(*arguments: object) -> None:
    """Docstrings have |x| for a length, which reStructuredText takes for a substitution."""
    lines = arguments[-1]
    assert isinstance(lines, list)
    lines[:] = [line if line.startswith("    ") else line.replace("|", "\\|") for line in lines]


def setup(app: Sphinx) -> None:
    app.connect("autodoc-process-docstring", _bars)
    app.add_directive("command-line", CommandLine)
