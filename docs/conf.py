"""Sphinx: the site is built by ``make docs``."""

import numpy as np
from docutils import nodes
from docutils.parsers.rst import Directive
from docutils.statemachine import StringList
from numpy.typing import ArrayLike, NDArray
from sphinx.application import Sphinx
from sphinx.util.typing import stringify_annotation
from typer.main import get_command
from typer.testing import CliRunner

import braidcast
from braidcast.cli import app
from braidcast.surrogate.model_card import model_card

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
autodoc_type_aliases = {"Array": "Array"}


class CommandLine(Directive):
    """What every command says of itself, so that the page cannot be behind the program."""

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


class ModelCard(Directive):
    """The card of the model that ships, of the model itself."""

    def run(self) -> list[nodes.Node]:
        _, *lines = model_card(braidcast.load_model()).splitlines()
        page = nodes.section()
        self.state.nested_parse(StringList(lines, "model card"), 0, page, match_titles=True)
        return list(page.children)


def _commands(command: object, path: tuple[str, ...]) -> list[tuple[str, ...]]:
    inner = getattr(command, "commands", {})
    return [path, *(p for name in inner for p in _commands(inner[name], (*path, name)))]


LONG = {
    stringify_annotation(kind, "smart"): name
    for kind, name in (
        (ArrayLike, "ArrayLike"),
        (NDArray[np.float64], "NDArray[float64]"),
        (NDArray[np.int64], "NDArray[int64]"),
    )
}


def _signature(
    app: Sphinx, what: str, name: str, thing: object, options: object, *texts: str | None
) -> tuple[str | None, ...]:
    """NumPy's types under the names that the sources give them, not all that they stand for."""
    for long, short in LONG.items():
        texts = tuple(text and text.replace(long, short) for text in texts)
    return texts


def _docstring(
    app: Sphinx, what: str, name: str, thing: object, options: object, lines: list[str]
) -> None:
    """A page introduces its modules; |x| is a length, and no substitution of reStructuredText."""
    if what == "module":
        lines.clear()
    lines[:] = [line if line.startswith("    ") else line.replace("|", "\\|") for line in lines]


def setup(app: Sphinx) -> None:
    app.connect("autodoc-process-signature", _signature)
    app.connect("autodoc-process-docstring", _docstring)
    app.add_directive("command-line", CommandLine)
    app.add_directive("model-card", ModelCard)
