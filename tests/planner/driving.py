"""What a user does with the planner's page, for the tests that do it."""

from pathlib import Path

from playwright.sync_api import Page

READY = 30_000.0  # ms; the standard deviations are prepared on however few cores there are


def opened(page: Page, url: str, hash: str = "") -> Page:
    page.goto(url + hash)
    page.wait_for_selector("body[data-ready]", timeout=READY)
    return page


def complete(page: Page) -> None:
    """Wait for the standard deviations, which are prepared behind the usable page."""
    page.wait_for_selector("body[data-ready=all]", timeout=READY)


def reloaded(page: Page) -> None:
    page.reload()
    page.wait_for_selector("body[data-ready]", timeout=READY)


def readout(page: Page, key: str) -> str:
    return page.locator(f'[data-key="{key}"]').inner_text()


def settled(page: Page) -> None:
    """Wait until what was changed is shown, and kept in the address."""
    page.evaluate(
        """() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() =>
            setTimeout(done, 400))))"""
    )


def tables(page: Page) -> dict:
    return page.evaluate("() => planner.state.tables")


def slide(page: Page, name: str, value: float, committed: bool = True) -> None:
    """Move a number's slider as a hand does, by events."""
    page.evaluate(
        """([name, value, committed]) => {
            const typed = document.getElementById(`number-${name}`);
            const control = typed.closest(".control, .site-control");
            const slider = control.querySelector("input[type=range]");
            slider.value = value;
            slider.dispatchEvent(new Event("input", { bubbles: true }));
            if (committed) slider.dispatchEvent(new Event("change", { bubbles: true }));
            return new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
        }""",
        [name, value, committed],
    )


def type_into(page: Page, name: str, text: str) -> None:
    page.fill(f"#number-{name}", text)
    page.press(f"#number-{name}", "Enter")


def downloaded(page: Page, kind: str) -> Path:
    with page.expect_download() as download:
        page.click(f"#download-{kind}")
    assert download.value.suggested_filename == f"success_in_a_gently_curved_vessel.{kind}"
    return Path(download.value.path())
