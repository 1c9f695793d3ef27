"""Runs the code of a page as a reader would: its blocks in order, in one folder, in one session."""

import contextlib
import io
import math
import os
import re
import shlex
import shutil
import signal
import socket
import subprocess
import sys
import time
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from markdown_it import MarkdownIt
from markdown_it.token import Token

from braidcast.case import Case
from braidcast.dataset.plan import Plan

ROOT = Path(__file__).parents[2]
BIN = Path(sys.executable).parent
EXTRAS = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
TARGETS = re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(), flags=re.MULTILINE)

#: What Sphinx makes of it is Sphinx's to check.
DIRECTIVES = {"{toctree}", "{include}", "{eval-rst}", "{command-line}", "{model-card}"}

#: The examples' plan is for minutes; what a page does with it is the same with a few coarse stents.
THINNED = {
    "cases = 60": "cases = 4",
    "subsets = [30]": "subsets = [2]",
    "tests = 10": "tests = 1",
    "[case.site]": "[case.device]\nwires = 12\nsegments = 20\nlength = 8.0\n\n[case.site]",
}

TOKEN = re.compile(r"(\d+(?:\.\d+)?(?:e[+-]?\d+)?)|\.\.\.|[^\s\d.]+|\.")


class Page:
    """A page that is being followed."""

    def __init__(self, path: Path, folder: Path, environment: dict[str, str]) -> None:
        self.path, self.folder, self.environment = path, folder, environment
        self.names: dict[str, Any] = {"__name__": "__main__"}
        self.written: set[str] = set()
        self.shown: tuple[str, ...] | None = None
        self.complaint = ""
        self.servers: list[subprocess.Popen[bytes]] = []
        self.port = str(_free_port())

    def follow(self) -> int:
        """Do the blocks of the page and return how many there are."""
        blocks = fences(self.path.read_text(encoding="utf-8"))
        try:
            for token in blocks:
                try:
                    self._do(token)
                except Exception as error:
                    line = (token.map or [0])[0] + 1
                    error.add_note(f"in the block at line {line} of {self.path}")
                    raise
            assert not self.complaint, f"a command failed: {self.complaint}"
            assert not self.written, f"written and never used: {self.written}"
        finally:
            for server in self.servers:
                os.killpg(server.pid, signal.SIGTERM)
                server.wait(20)
        return len(blocks)

    def _do(self, token: Token) -> None:
        kind, code = token.info.strip(), token.content
        if kind.split(" ")[0] in DIRECTIVES:
            return
        if kind != "text":
            assert not self.complaint, f"a command failed: {self.complaint}"
        if kind == "toml":
            given = tomllib.loads(code)
            Plan.from_text(code) if "case" in given else Case.from_dict(given)
            self._write(code)
        elif kind == "python" and self._write(code):
            pass
        elif kind == "python":
            self._python(code, (token.map or [0])[0] + 1)
        elif kind == "sh":
            self._shell(code.replace("head:8786", f"127.0.0.1:{self.port}"))
        elif kind == "text":
            self._compare(code)
        else:
            raise AssertionError(f"a block of the kind {kind!r}: nothing here would check it")

    def _write(self, code: str) -> bool:
        """Keep the block as the file that its first line names, if it does."""
        named = re.match(r"# (\w+\.(?:toml|py))$", code, flags=re.MULTILINE)
        if named is None:
            return False
        (self.folder / named[1]).write_text(code, encoding="utf-8")
        self.written.add(named[1])
        return True

    def _python(self, code: str, line: int) -> None:
        self.written = {name for name in self.written if name not in code}
        out = io.StringIO()
        with contextlib.redirect_stdout(out):
            exec(compile("\n" * line + code, str(self.path), "exec"), self.names)
        self.shown = (out.getvalue(),)

    def _shell(self, code: str) -> None:
        self.written = {name for name in self.written if name not in code}
        commands = [
            line for line in code.replace("\\\n", " ").splitlines() if not self._known(line)
        ]
        done = subprocess.run(
            ["bash", "-e", "-o", "pipefail", "-c", "\n".join(commands)],
            cwd=self.folder,
            env=self.environment,
            capture_output=True,
            text=True,
            timeout=300,
        )
        self.shown = (done.stdout, done.stderr)
        self.complaint = f"{done.stdout}\n{done.stderr}" if done.returncode else ""

    def _known(self, line: str) -> bool:
        """Whether a command is only looked at, or goes on in the background."""
        words = shlex.split(line, comments=True)
        if words[:1] == ["make"]:
            assert set(words[1:]) <= set(TARGETS), f"{line}: not in the Makefile"
        elif words[:2] == ["pip", "install"]:
            extra = re.fullmatch(r"braidcast\[(\w+)\]", words[2])
            assert extra is not None and extra[1] in EXTRAS, f"{line}: not in pyproject.toml"
        elif words[:2] in (["dask", "scheduler"], ["dask", "worker"]):
            self._serve([word.replace("8786", self.port) for word in words])
        elif words[:2] == ["braidcast", "planner"] and "--export" not in words:
            self._open_planner(words)
        else:
            return False
        return True

    def _open_planner(self, words: list[str]) -> None:
        """Start it as the page says, but for the browser; it must print where it is."""
        planner = subprocess.Popen(
            [*words, "--no-browser", "--port", self.port],
            cwd=self.folder,
            env=self.environment,
            stdout=subprocess.PIPE,
            start_new_session=True,
            executable=BIN / words[0],
        )
        assert planner.stdout is not None
        with planner.stdout:
            assert f"http://127.0.0.1:{self.port}" in planner.stdout.readline().decode()
            os.killpg(planner.pid, signal.SIGTERM)
            # As it is told to end before it serves, or after.
            assert planner.wait(20) in (0, 128 + signal.SIGTERM)

    def _serve(self, words: list[str]) -> None:
        if words[1] == "scheduler":
            words += ["--dashboard-address", "127.0.0.1:0"]
        self.servers.append(
            subprocess.Popen(
                words,
                cwd=self.folder,
                env=self.environment,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                start_new_session=True,
                executable=BIN / words[0],
            )
        )
        deadline = time.monotonic() + 60.0
        while words[1] == "scheduler" and not _listening(int(self.port)):
            assert time.monotonic() < deadline, "no scheduler"
            time.sleep(0.1)

    def _compare(self, expected: str) -> None:
        assert self.shown is not None, "a block of text must show what the block before it writes"
        if self.complaint:
            # A page shows what a command that fails has to say.
            starts = ("braidcast: ", "...\nbraidcast: ")
            assert expected.startswith(starts), self.complaint
        written = "\n--- and to standard error:\n".join(self.shown)
        assert any(same(expected, out) for out in self.shown), (
            f"the page shows\n{expected}\nbut there was\n{written}"
        )
        self.complaint, self.shown = "", None


def fences(text: str) -> list[Token]:
    """All blocks of code of a page, those inside lists and those that are only indented too."""
    tokens = MarkdownIt().parse(text)
    return [token for token in tokens if token.type in ("fence", "code_block")]


def same(expected: str, actual: str) -> bool:
    """Whether two texts agree word by word; ``...`` stands for anything, decimals hold to 1 %."""
    wanted = [match[0] for match in TOKEN.finditer(expected)]
    got = [match[0] for match in TOKEN.finditer(actual)]
    # reachable: how many words of ``got`` the words of ``wanted`` so far can account for
    reachable = {0}
    for word in wanted:
        if word == "...":
            reachable = set(range(min(reachable), len(got) + 1))
        else:
            reachable = {i + 1 for i in reachable if i < len(got) and _word(word, got[i])}
        if not reachable:
            return False
    return len(got) in reachable


def _word(expected: str, actual: str) -> bool:
    if "." in expected and TOKEN.fullmatch(actual) and expected[0].isdigit():
        try:
            return math.isclose(float(expected), float(actual), rel_tol=0.01)
        except ValueError:
            return False
    return expected == actual


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def _listening(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


QUEUE = {
    # The script is gone as soon as it is submitted.
    "sbatch": 'cp "$1" job.sh\nsetsid sh job.sh >> queue.log 2>&1 &\n'
    'echo "Submitted batch job $!"\n',
    "scancel": 'for job in "$@"; do kill -TERM -- "-$job" 2> /dev/null || true; done\n',
    "squeue": "echo JOBID\n",
}
"""A queue whose jobs begin at once, on this machine: the number of a job is its process group."""


@pytest.fixture
def follow(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[Path], int]]:
    """Follow a page in a folder that looks like the project's."""
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    plan = tmp_path / "examples" / "plan.toml"
    text = plan.read_text(encoding="utf-8")
    for old, new in THINNED.items():
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    plan.write_text(text, encoding="utf-8")
    (tmp_path / ".venv").mkdir()
    (tmp_path / ".venv" / "bin").symlink_to(BIN)
    queue = tmp_path / ".queue"
    queue.mkdir()
    for name, script in QUEUE.items():
        (queue / name).write_text(f"#!/bin/sh\n{script}")
        (queue / name).chmod(0o755)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATH", f"{queue}:{BIN}:{os.environ['PATH']}")
    monkeypatch.setenv("PYVISTA_OFF_SCREEN", "true")
    if "pyvista" in sys.modules:
        monkeypatch.setattr(sys.modules["pyvista"], "OFF_SCREEN", True)
    yield lambda path: Page(path, tmp_path, dict(os.environ)).follow()
