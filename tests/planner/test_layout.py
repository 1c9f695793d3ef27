"""The planner's page in windows of every size, and its report on paper."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from driving import complete, downloaded, opened, settled, slide
from playwright.sync_api import Page

OUTSIDE = "#vessel_diameter=4.9&vessel_P1_y=60&vessel_P1_z=40"

#: What of a page cannot be brought into the window, as a hand would, by scrolling.
UNREACHABLE = """() => {
    const parts = "input, select, button, canvas, dt, dd, td, th, #strip, #legend, footer span";
    return [...document.querySelectorAll(parts)].filter((part) => {
        if (!part.checkVisibility() || part.ariaHidden) return false;
        part.scrollIntoView({ block: "center" });
        const { left, right, top, bottom } = part.getBoundingClientRect();
        if (Math.min(left, top, innerWidth - right, innerHeight - bottom) < -1) return true;
        if (getComputedStyle(part).pointerEvents === "none") return false; // as the legend
        const hit = document.elementFromPoint((left + right) / 2, (top + bottom) / 2);
        return !part.contains(hit) && !hit?.contains(part);
    }).map((part) => part.outerHTML.slice(0, 80));
}"""

#: Top and bottom of an element.
BOX = """(selector) => {
    const box = document.querySelector(selector).getBoundingClientRect();
    return [box.top, box.bottom];
}"""


@pytest.fixture
def window(browser_page: Page, server) -> Callable[..., Page]:
    """A page of a width, a height and an address."""

    def sized(width: int, height: int, hash: str = "") -> Page:
        browser_page.set_viewport_size({"width": width, "height": height})
        return opened(browser_page, server.url, hash)

    return sized


@pytest.mark.parametrize(
    "size", [(320, 480), (390, 844), (700, 700), (768, 432), (844, 390), (1280, 400)]
)
def test_everything_is_reachable_in_a_small_window(window, size: tuple[int, int]) -> None:
    page = window(*size)
    page.click("#pin")
    slide(page, "site_eta", 0.1)
    assert page.evaluate("() => document.documentElement.scrollWidth") == size[0]
    assert page.evaluate(UNREACHABLE) == []
    low = "() => [...document.querySelectorAll('canvas')].map((each) => each.clientHeight)"
    assert min(page.evaluate(low)) >= 140
    # Where the panel scrolls there is room to.
    assert page.evaluate("() => document.getElementById('panel').clientHeight") >= 300


@pytest.mark.parametrize("size", [(1280, 720), (853, 480)])
def test_banners_hide_no_picture(window, size: tuple[int, int]) -> None:
    page = window(*size, OUTSIDE)
    settled(page)
    banners, picture = page.evaluate(BOX, "#banners"), page.evaluate(BOX, "#canvas")
    assert banners[1] - banners[0] > 30
    assert banners[1] <= picture[0]
    drawn = page.evaluate("() => planner.pictures[0].view.overlay.clientHeight")
    assert drawn == pytest.approx(picture[1] - picture[0], abs=1)
    assert page.evaluate(UNREACHABLE) == []


def test_colours_that_mean_something_are_kept_where_colours_are_forced(window) -> None:
    page = window(1280, 720)
    page.emulate_media(forced_colors="active")
    bar = page.evaluate("() => getComputedStyle(document.querySelector('.bar')).backgroundImage")
    assert bar.startswith("linear-gradient")
    forced = "(selector) => getComputedStyle(document.querySelector(selector)).forcedColorAdjust"
    assert {page.evaluate(forced, each) for each in (".bar", ".title", "#strip")} == {"none"}


def test_a_report_is_one_page_of_paper(window, tmp_path: Path) -> None:
    page = window(1280, 720, OUTSIDE)
    complete(page)
    single = downloaded(page, "html").rename(tmp_path / "single.html")
    page.click("#pin")
    slide(page, "site_eta", 0.1)
    both = downloaded(page, "html").rename(tmp_path / "both.html")
    for report in (single, both):
        page.goto(report.as_uri())
        pdf = page.pdf(prefer_css_page_size=True)
        assert len(re.findall(rb"/Type\s*/Page\b", pdf)) == 1, report.name
    page.emulate_media(media="print")
    smallest = page.evaluate(
        """() => Math.min(...[...document.querySelectorAll("body *")]
            .map((each) => parseFloat(getComputedStyle(each).fontSize)))"""
    )
    assert smallest >= 6.5 * 96 / 72 - 0.01
