"""Two cases beside each other: each is said to be what it is, whatever happens between."""

import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from driving import complete, opened, readout, reloaded, settled, slide, type_into
from playwright.sync_api import Page, expect

from braidcast import Case
from braidcast.planner.contents import Contents
from braidcast.planner.model_arrays import pack
from braidcast.planner.opened_case import OpenedCase
from braidcast.planner.server import application
from braidcast.surrogate.model import SurrogateModel
from braidcast.surrogate.model_file import load_model

AWAY = 0.05  # mm


@cache
def _model() -> SurrogateModel:
    return load_model()


async def stand_in(tables, advance) -> bytes:
    """In place of the finite elements, the prediction moved aside by 0.05 mm."""
    prediction = _model().predict(Case.from_dict(tables))
    header = {
        "outcome": "success",
        "clinical_outcome": "success",
        "converged": True,
        "reason": "",
        "deployed_length_mm": prediction.deployed_length_mm,
        "foreshortening_percent": 1.0,
        "strain_energy_mJ": 1.0,
        "newton_iterations": 1,
        "wall_seconds": 1.0,
    }
    positions = prediction.positions + [AWAY, 0.0, 0.0]
    return pack(header, {"positions": positions, "gaps": np.zeros(len(positions))})


@pytest.fixture(scope="module")
def address(contents: Contents, serving) -> Iterator[str]:
    with serving(application(contents, simulate=stand_in)) as served:
        yield served.url


@pytest.fixture
def page(browser_page: Page, address: str) -> Page:
    return opened(browser_page, address)


def simulate(page: Page) -> None:
    page.click("#simulate")
    expect(page.locator('[data-key="sim-outcome"]')).to_be_visible()


def of(page: Page, side: str, key: str):
    return page.locator(f'#compare-table [data-{side}="{key}"]')


def test_both_pictures_have_one_scale(page: Page) -> None:
    """Of the larger standard deviations, whosever they are."""
    complete(page)
    page.click("#pin")
    page.select_option("#colour", "std")
    type_into(page, "vessel_diameter", "4.9")
    settled(page)
    expect(page.locator("#legend")).to_contain_text("standard deviation, mm")
    largest = [float(of(page, side, "std-max").inner_text().removesuffix(" mm")) for side in "ab"]
    low, high = page.evaluate("() => planner.scale.range")
    assert low == 0.0
    assert max(largest) <= high <= 2.5 * max(largest)
    shares = page.evaluate(
        """() => planner.pictures.map(({ view }) => Math.max(...view.braid.data
            .subarray(0, 4 * view.order.length).filter((_, i) => i % 4 === 3)))"""
    )
    assert np.multiply(shares, high) == pytest.approx(largest[::-1], abs=1e-4)


def test_what_only_one_of_them_has_colours_neither(page: Page) -> None:
    simulate(page)
    page.click("#pin")
    page.select_option("#colour", "departure")
    expect(page.locator("#legend")).to_contain_text("departure")
    slide(page, "site_eta", 0.3)
    expect(page.locator("#legend")).to_contain_text("distance to the wall")
    expect(page.locator("#colour")).to_have_value("gap")
    # What A has and B has not is said of A alone.
    expect(of(page, "a", "sim-outcome")).to_have_text("success")
    expect(of(page, "b", "sim-outcome")).to_have_text("–")


def test_a_result_is_that_of_its_case_alone(page: Page) -> None:
    slide(page, "site_eta", 0.3)
    simulate(page)
    type_into(page, "vessel_diameter", "3.6")
    settled(page)
    page.click("#pin")  # not simulated
    settled(page)
    type_into(page, "vessel_diameter", "3")
    settled(page)
    expect(of(page, "b", "sim-outcome")).to_have_text("success")
    page.click("#pin")
    settled(page)
    expect(of(page, "a", "sim-outcome")).to_have_text("success")
    page.go_back()
    expect(of(page, "a", "sim-outcome")).to_have_text("–")


def test_an_impossible_case_is_neither_pinned_nor_exported(page: Page) -> None:
    page.click("#pin")
    type_into(page, "vessel_diameter", "40")
    expect(page.locator("[data-banner=impossible]")).to_contain_text("shown in grey")
    expect(page.locator("#pin")).to_be_disabled()
    expect(page.locator("#swap")).to_be_disabled()
    page.click("#download-html")
    expect(page.locator("[data-banner=download]")).to_contain_text("the case is impossible")
    type_into(page, "vessel_diameter", "3")
    expect(page.locator("[data-banner=download]")).to_have_count(0)
    expect(page.locator("#verdict")).to_contain_text("Success")
    expect(page.locator("#swap")).to_be_enabled()


def test_impossible_from_the_start(browser_page: Page, address: str) -> None:
    page = opened(browser_page, address, "#vessel_diameter=40")
    expect(page.locator("[data-banner=impossible]")).to_contain_text("must be below")
    expect(page.locator("[data-banner=impossible]")).not_to_contain_text("grey")
    page.click("#download-vtp")
    expect(page.locator("[data-banner=download]")).to_contain_text("the case is impossible")


def test_a_pinned_case_outside_of_the_training_data_is_said_to_be(page: Page) -> None:
    type_into(page, "vessel_diameter", "4.9")
    page.click("#pin")
    type_into(page, "vessel_diameter", "3")
    expect(page.locator("[data-banner=outside-a]")).to_contain_text("A is outside")
    expect(page.locator("[data-banner=outside]")).to_have_count(0)
    expect(page.locator("[data-banner=outside-a]")).to_contain_text("Vessel diameter = 4.9 mm")


def test_an_address_with_a_shows_it(browser_page: Page, address: str) -> None:
    page = opened(browser_page, address, "#site_eta=0.5&A.site_eta=0.2")
    expect(page.locator("#compare-table")).to_be_visible()
    expect(page.locator("#canvas-a")).to_be_visible()


def test_whose_vessel_is_drawn_is_said(page: Page) -> None:
    page.click("#pin")
    page.select_option("#arrange", "ghost")
    caption = page.locator("#view-b").locator("> :last-child")
    expect(caption).to_have_text("B in colours; A as the thin second braid")
    slide(page, "vessel_diameter", 3.6)
    expect(caption).to_contain_text("the vessel is that of B")


def test_a_typed_length_keeps_its_simulation(page: Page) -> None:
    """Its η has more digits than the address."""
    type_into(page, "site_mm", "10")
    settled(page)
    simulate(page)
    type_into(page, "vessel_diameter", "3.3")
    settled(page)
    expect(page.locator("#simulation-other")).to_contain_text("another case")
    page.go_back()
    expect(page.locator('[data-key="sim-outcome"]')).to_be_visible()


def test_a_reload_keeps_all_simulations(page: Page) -> None:
    for eta in ("0.4", "0.45"):
        type_into(page, "site_eta", eta)
        settled(page)
        simulate(page)
    reloaded(page)
    expect(page.locator('[data-key="sim-outcome"]')).to_be_visible()
    type_into(page, "site_eta", "0.4")
    expect(page.locator('[data-key="sim-outcome"]')).to_be_visible()
    assert readout(page, "sim-mean") == f"{AWAY:.4f} mm"


def test_refusals_end_with_the_next_change(page: Page) -> None:
    type_into(page, "site_eta", "7")
    expect(page.locator("#site-note")).to_contain_text("must be from 0 to 1")
    expect(page.locator("#number-site_eta")).to_have_attribute("aria-invalid", "true")
    type_into(page, "vessel_diameter", "abc")
    note = page.locator("#number-vessel_diameter-note")
    expect(note).to_contain_text("is not a number")
    slide(page, "aneurysm_diameter", 8.0)
    expect(page.locator("#site-note")).to_have_text("")
    expect(page.locator("#number-site_eta")).not_to_have_attribute("aria-invalid", "true")
    expect(note).to_have_text("")


def test_simulations_wait_for_a_server_that_is_gone(
    browser_page: Page, contents: Contents, serving, troubles: list[str]
) -> None:
    with serving(application(contents, simulate=stand_in)) as served:
        page = opened(browser_page, served.url)
    expect(page.locator("[data-banner=server]")).to_contain_text("is gone")
    page.click("#simulate")
    expect(page.locator("#simulation-stage")).to_have_text("waiting for the server")
    page.click("#cancel")
    expect(page.locator("#simulation-message")).to_have_text("The simulation was cancelled.")
    page.click("#simulate")
    with serving(application(contents, simulate=stand_in), served.port):
        expect(page.locator('[data-key="sim-outcome"]')).to_be_visible(timeout=10_000)
        page.goto("about:blank")
    assert troubles and all("ERR_CONNECTION" in trouble for trouble in troubles)
    troubles.clear()


def test_another_case_at_the_same_address_is_noticed(
    browser_page: Page, contents: Contents, serving, troubles: list[str], tmp_path: Path
) -> None:
    with serving(application(contents)) as served:
        page = opened(browser_page, served.url, "#site_eta=0.3")
    case = contents.opened.case.to_dict() | {"title": "Another"}
    (tmp_path / "other.toml").write_text(Case.from_dict(case).to_toml())
    other = Contents(OpenedCase.from_toml(tmp_path / "other.toml"), load_model)
    with serving(application(other), served.port):
        banner = page.locator("[data-banner=server]")
        expect(banner).to_contain_text("another case")
        assert re.fullmatch(r"http://[^#]*", page.url)
        reloaded(page)
        expect(page.locator("#case-title")).to_have_text("Another")
        page.goto("about:blank")
    troubles.clear()
