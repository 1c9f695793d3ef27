"""The planner's states at three sizes: python benchmarks/planner_pictures.py [DIR]

Writes docs/images/planner/SIZE_STATE.png, or into DIR. Look at them after every change of the page.
"""

import sys
from io import BytesIO
from pathlib import Path

from PIL import Image
from playwright.sync_api import Page, sync_playwright

from planner import DRAWN_BY_THE_PROCESSOR, chromium, planner

FOLDER = Path(__file__).parents[1] / "docs" / "images" / "planner"
SIZES = {"1280": (1280, 720), "1920": (1920, 1080), "820": (820, 1180)}


def typed(page: Page, name: str, text: str) -> None:
    """Type a number and leave it."""
    page.fill(f"#number-{name}", text)
    page.press(f"#number-{name}", "Enter")


def states(page: Page, keep) -> None:
    """Go through the states of the page; ``keep(name)`` takes the picture of each."""
    page.wait_for_selector("body[data-ready=all]", timeout=60_000)
    keep("prediction")
    typed(page, "aneurysm_diameter", "11")
    typed(page, "vessel_diameter", "x")
    keep("outside_and_refused")
    typed(page, "vessel_diameter", "9")
    keep("impossible")
    typed(page, "vessel_diameter", "3")
    typed(page, "aneurysm_diameter", "7")
    page.click("#pin")
    typed(page, "site_eta", "0.12")
    page.locator("#compare").scroll_into_view_if_needed()
    keep("side_by_side")
    page.select_option("#arrange", "ghost")
    page.locator("#compare-table").scroll_into_view_if_needed()
    keep("one_over_the_other")
    page.click("#unpin")
    page.click("#theme")
    page.select_option("#colour", "std")
    page.locator("#panel").evaluate("panel => { panel.scrollTop = 0; }")
    keep("dark")
    page.click("#simulate")
    page.locator("#simulation").scroll_into_view_if_needed()
    page.wait_for_timeout(1500)
    keep("simulating")
    page.wait_for_selector('[data-key="sim-mean"]', timeout=90_000)
    page.select_option("#colour", "departure")
    page.locator("#simulation-rows").scroll_into_view_if_needed()
    keep("simulated")


def main() -> None:
    folder = Path(sys.argv[1]) if sys.argv[1:] else FOLDER
    folder.mkdir(parents=True, exist_ok=True)
    with planner() as (_, address), sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=chromium(), args=DRAWN_BY_THE_PROCESSOR
        )
        for size, (width, height) in SIZES.items():
            page = browser.new_page(viewport={"width": width, "height": height})
            page.goto(address)

            def keep(state: str, page: Page = page, size: str = size) -> None:
                page.wait_for_timeout(900)
                image = Image.open(BytesIO(page.screenshot())).convert("RGB")
                few = image.quantize(256, dither=Image.Dither.NONE)
                few.save(folder / f"{size}_{state}.png", optimize=True)

            states(page, keep)
            page.close()
        browser.close()


if __name__ == "__main__":
    main()
