"""A planner's server, and a page of a real browser in which nothing may go wrong."""

import shutil
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import pytest
from driving import opened
from playwright.sync_api import Browser, Page, expect, sync_playwright
from starlette.applications import Starlette

from braidcast.planner.contents import Contents
from braidcast.planner.opened_case import OpenedCase
from braidcast.planner.serve import listening, server_of, url
from braidcast.planner.server import application
from braidcast.surrogate.model_file import load_model

_DRAWN_BY_THE_PROCESSOR = (
    *("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"),
    *("--no-sandbox", "--disable-dev-shm-usage"),
)


# What is expected comes at once, but not on a machine that has other work.
expect.set_options(timeout=30_000.0)


@dataclass(frozen=True)
class Served:
    """``url`` ends with "/"."""

    url: str
    app: Starlette

    @property
    def port(self) -> int:
        return int(self.url.rstrip("/").rsplit(":", 1)[1])


@contextmanager
def _serving(app: Starlette, port: int = 0) -> Iterator[Served]:
    with listening("127.0.0.1", port) as opened:
        server = server_of(app)
        thread = threading.Thread(target=server.run, args=([opened],))
        thread.start()
        try:
            while not server.started:
                assert thread.is_alive(), "the server ended at once"
                time.sleep(0.01)
            yield Served(url(opened), app)
        finally:
            server.should_exit = True
            thread.join()


@pytest.fixture(scope="session")
def serving() -> Callable[..., object]:
    """Context manager: an application on a loopback port, a free one unless one is given."""
    return _serving


@pytest.fixture(scope="session")
def contents() -> Contents:
    """The planner's default case with the shipped model."""
    return Contents(OpenedCase.default(), load_model)


@pytest.fixture(scope="session")
def server(contents: Contents) -> Iterator[Served]:
    """A planner with the default case and the shipped model."""
    with _serving(application(contents)) as served:
        yield served


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """The system's Chromium, or Playwright's; ``make browser`` installs one."""
    found = filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome")))
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=next(found, None), args=_DRAWN_BY_THE_PROCESSOR
        )
        yield browser
        browser.close()


@pytest.fixture
def troubles() -> list[str]:
    """What the browser's console has complained of; a test that means to cause some clears it."""
    return []


@pytest.fixture
def browser_page(browser: Browser, troubles: list[str]) -> Iterator[Page]:
    """An empty page, 1280 by 720; errors and warnings in its console fail the test."""
    context = browser.new_context(viewport={"width": 1280, "height": 720}, accept_downloads=True)
    page = context.new_page()

    def listen(message) -> None:
        # Reading pixels back from a canvas that the processor draws is slow, and Chromium says so.
        if message.type in ("error", "warning") and "GPU stall" not in message.text:
            troubles.append(f"{message.type}: {message.text}")

    page.on("console", listen)
    page.on("pageerror", lambda error: troubles.append(f"page error: {error}"))
    yield page
    context.close()
    assert not troubles


@pytest.fixture
def planner(browser_page: Page, server) -> Page:
    """The page with the default case."""
    return opened(browser_page, server.url)
