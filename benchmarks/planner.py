"""The planner in a real browser: python benchmarks/planner.py [FILE.md]

Start-up, transfer, slider moves, frames, a thousand random moves, ten sessions with three
simulations queued. Headless Chromium, drawn by the processor. Ends with 1 if a bar is missed.
"""

import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from statistics import median, quantiles

from playwright.sync_api import Browser, Page, TimeoutError, sync_playwright

from deployment import cholesky_seconds
from report import Bar, table_of_bars

DRAWN_BY_THE_PROCESSOR = (
    *("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"),
    *("--no-sandbox", "--disable-dev-shm-usage"),
)

MOVE = """async (count) => {
  const times = [];
  const seen = new PerformanceObserver((list) =>
    times.push(...list.getEntriesByName("planner-move").map((entry) => entry.duration)));
  seen.observe({ entryTypes: ["measure"] });
  const sliders = [...document.querySelectorAll("input[type=range]")];
  const frames = [], scripts = [];
  for (let move = 0; move < count; move++) {
    const slider = sliders[Math.floor(Math.random() * sliders.length)];
    slider.value = Number(slider.min) + Math.random() * (slider.max - slider.min);
    slider.dispatchEvent(new Event("input"));
    await new Promise(requestAnimationFrame);
    const begin = performance.now();
    await new Promise((done) => requestAnimationFrame(() => setTimeout(done)));
    frames.push(performance.now() - begin);
    scripts.push(planner.pictures[0].view.frameMilliseconds);
  }
  await new Promise((done) => setTimeout(done, 200));
  seen.disconnect();
  return { times, frames, scripts };
}"""


@contextmanager
def planner() -> Iterator[tuple[subprocess.Popen[str], str]]:
    """A planner's process and its address."""
    command = [sys.executable, "-m", "braidcast", "planner", "--no-browser", "--port", "8791"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    try:
        assert process.stdout is not None
        for line in process.stdout:
            if found := re.search(r"http://\S+", line):
                yield process, found[0]
                break
    finally:
        process.terminate()
        process.wait()


def opened(browser: Browser, address: str, troubles: list[str]) -> Page:
    """A page that is ready, whose complaints are kept."""
    page = browser.new_context(viewport={"width": 1280, "height": 720}).new_page()
    page.on(
        "console",
        lambda m: (
            troubles.append(m.text)
            if m.type in ("error", "warning") and "GPU stall" not in m.text
            else None
        ),
    )
    page.on("pageerror", lambda error: troubles.append(str(error)))
    page.goto(address)
    page.wait_for_selector("body[data-ready]", timeout=60_000)
    return page


def chromium() -> str | None:
    """The system's browser; Playwright's own if there is none."""
    return next(filter(None, map(shutil.which, ("chromium", "google-chrome"))), None)


def memory(process: subprocess.Popen[str]) -> float:
    """Resident size of a process, MB."""
    for line in Path(f"/proc/{process.pid}/status").read_text().splitlines():
        if line.startswith("VmRSS"):
            return int(line.split()[1]) / 1e3
    return 0.0


def start_up(browser: Browser) -> list[Bar]:
    """From the command to a page that answers, and what crossed the line meanwhile."""
    begin = time.perf_counter()
    with planner() as (_, address):
        page = opened(browser, address, [])
        usable = time.perf_counter() - begin
        page.wait_for_selector("body[data-ready=all]", timeout=60_000)
        certain = time.perf_counter() - begin
        size = page.evaluate(
            "() => performance.getEntriesByType('resource').concat("
            "performance.getEntriesByType('navigation'))"
            ".reduce((sum, entry) => sum + entry.transferSize, 0)"
        )
        page.context.close()
    return [
        ("from the command to a usable page", usable, 5.0, "s"),
        ("from the command to the first standard deviations", certain, 10.0, "s"),
        ("page with model, compressed transfer", size / 1e6, 5.0, "MB"),
    ]


def moves(browser: Browser, address: str) -> list[Bar]:
    """A thousand random slider moves, back and forward, a reload and another size."""
    troubles: list[str] = []
    page = opened(browser, address, troubles)
    page.wait_for_selector("body[data-ready=all]", timeout=60_000)
    page.evaluate(MOVE, 100)
    found = page.evaluate(MOVE, 1000)
    for _ in range(3):
        page.go_back()
        page.go_forward()
        page.set_viewport_size({"width": 900, "height": 1100})
        page.set_viewport_size({"width": 1280, "height": 720})
        page.reload()
        page.wait_for_selector("body[data-ready]", timeout=60_000)
    page.context.close()
    twentieths = quantiles(found["times"], n=20)
    return [
        ("slider moved, script time, median", median(found["times"]), 15.0, "ms"),
        ("slider moved, script time, 95th percentile", twentieths[-1], 30.0, "ms"),
        ("frame in software, 95th percentile", quantiles(found["frames"], n=20)[-1], 700.0, "ms"),
        ("of it ours, largest of 1000", max(found["scripts"]), 16.0, "ms"),
        ("complaints of the console in 1000 moves, reloads, sizes", len(troubles), 0, ""),
    ]


def sessions(browser: Browser, process: subprocess.Popen[str], address: str) -> list[Bar]:
    """Ten pages at once, three of which simulate another site each."""
    troubles: list[str] = []
    pages = [opened(browser, address, troubles) for _ in range(10)]
    before = memory(process)
    sites = (0.45, 0.5, 0.55)
    for page, eta in zip(pages, sites, strict=False):
        page.fill("#number-site_eta", str(eta))
        page.press("#number-site_eta", "Enter")
        page.click("#simulate")
    waited = 0
    for page in pages[1:3]:
        with suppress(TimeoutError):
            page.get_by_text("waiting for").wait_for(timeout=10_000)
            waited += 1
    for page in pages[3:]:
        page.evaluate(MOVE, 20)
    wrong = 0
    for page, eta in zip(pages, sites, strict=False):
        page.wait_for_selector("#simulation-rows dt", timeout=300_000)
        tables = page.evaluate("() => planner.state.tables.site.eta")
        wrong += abs(tables - eta) > 1e-9
    for page in pages[3:]:
        wrong += page.query_selector("#simulation-rows dt") is not None
    after = memory(process)
    for page in pages:
        page.context.close()
    return [
        ("ten sessions: complaints of their consoles", len(troubles), 0, ""),
        ("ten sessions: results at the wrong page, or missing", wrong, 0, ""),
        ("ten sessions: pages that were told that they wait, of two", 2 - waited, 0, "less"),
        ("ten sessions: memory of the server grew by", after - before, 60.0, "MB"),
    ]


def main() -> int:
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=chromium(), args=DRAWN_BY_THE_PROCESSOR
        )
        start_up(browser)  # warm
        rows = start_up(browser)
        with planner() as (process, address):
            rows += moves(browser, address)
            rows += sessions(browser, process, address)
        version = browser.version
        browser.close()
    lines = [
        f"Chromium {version}, ref = {median(cholesky_seconds(3)):.3f} s, load "
        f"{os.getloadavg()[0]:.1f}",
        "",
        *table_of_bars(rows),
    ]
    print("\n".join(lines))
    if sys.argv[1:]:
        Path(sys.argv[1]).write_text("\n".join(lines) + "\n", encoding="utf-8")
    return 0 if all(ours <= bar for _, ours, bar, _ in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
