"""braidcast planner: how it starts, and that it leaves nothing behind when it is ended."""

import json
import os
import signal
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path

import psutil
import pytest

from braidcast.planner.opened_case import DEFAULT
from braidcast.planner.serve import listening, url


def test_a_port_that_is_taken(run: Callable[..., int], capsys: pytest.CaptureFixture[str]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert run("planner", "--no-browser", "--port", f"{port}") == 2
    said = capsys.readouterr().err
    assert said.startswith(f"braidcast: --port = {port} is taken") and said.count("\n") == 1


@pytest.mark.parametrize("host", ["no.such.host.invalid", "192.0.2.1", "", "a" * 300])
def test_a_host_that_is_not_here(
    run: Callable[..., int], capsys: pytest.CaptureFixture[str], host: str
) -> None:
    assert run("planner", "--no-browser", "--host", host) == 2
    said = capsys.readouterr().err
    assert said.startswith("braidcast: --host = ") and said.count("\n") == 1


def test_a_case_or_model_that_is_none(
    run: Callable[..., int], capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    (tmp_path / "bad.toml").write_text("[vessel]\ndiameter = -1")
    for arguments in (("bad.toml",), ("missing.toml",), ("-m", "bad.toml")):
        assert run("planner", "--no-browser", *arguments) == 2
        assert capsys.readouterr().err.count("\n") == 1


def test_the_usual_port_or_another() -> None:
    with listening("127.0.0.1", None) as first, listening("127.0.0.1", None) as second:
        assert first.getsockname()[1] != second.getsockname()[1]
        assert url(first).startswith("http://127.0.0.1:")


def test_export(
    run: Callable[..., int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("planner", "--export", "planner.html") == 0
    assert capsys.readouterr().out.startswith("planner.html, ")
    assert (tmp_path / "planner.html").read_text("utf-8").startswith("<!doctype html>")
    assert os.listdir(tmp_path) == ["planner.html"]
    assert run("planner", "--export", "missing/planner.html") == 2
    (tmp_path / "other.toml").write_text(
        "[vessel]\nP1 = [0.0, 15.0, 25.0]\ndiameter = 3.0\n[site]\neta = 0.5\n"
    )
    assert run("planner", "other.toml", "--export", "other.html") == 2
    assert "needs a case with a model" in capsys.readouterr().err


@pytest.fixture
def planner(tmp_path: Path) -> Iterator[subprocess.Popen[str]]:
    """A planner of its own, its simulation under way."""
    (tmp_path / "json.py").write_text("raise SystemExit('not this one')")
    process = subprocess.Popen(
        [sys.executable, "-P", "-m", "braidcast", "planner", "--no-browser"],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout and process.stderr
    address = process.stdout.readline().split()[3]
    body = json.dumps({"case": DEFAULT}).encode()
    headers = {"X-Braidcast-Session": "somebody"}
    request = urllib.request.Request(f"{address}api/jobs", body, headers)
    with urllib.request.urlopen(request) as answer:
        assert answer.status == 202
    while not psutil.Process(process.pid).children():
        time.sleep(0.01)
    yield process
    process.kill()
    process.wait()
    process.stdout.close()
    process.stderr.close()


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_ended_it_leaves_nothing_behind(planner: subprocess.Popen[str], how: int) -> None:
    (simulation,) = psutil.Process(planner.pid).children()
    planner.send_signal(how)
    assert planner.wait(20) == (-how if how == signal.SIGKILL else 0)
    _, alive = psutil.wait_procs([simulation], 10)
    assert not alive
    assert planner.stderr and planner.stderr.read() == ""
