"""The planner's page in a real browser: what a user does with it, and what it says."""

import random
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest
import pyvista
import trimesh
from driving import (
    complete,
    downloaded,
    opened,
    readout,
    reloaded,
    settled,
    slide,
    tables,
    type_into,
)
from playwright.sync_api import Page, expect

from braidcast import Case
from braidcast.planner.contents import Contents
from braidcast.planner.opened_case import OpenedCase
from braidcast.planner.pages import single_file
from braidcast.planner.server import application
from braidcast.surrogate.model_file import load_model

EXAMPLES = Path(__file__).parents[2] / "examples"
SIMULATED = 120_000.0  # ms; a case takes some seconds, the first also compiles and crimps

#: One of every kind of nonsense that a hand or a clipboard puts into a field.
GARBAGE = ("", " ", "abc", "1e999", "NaN", "-5000", "3 mm", "<b>1</b>", "'; --", "9" * 400)


def test_the_page_is_usable(planner: Page) -> None:
    complete(planner)
    assert planner.title() == "braidcast planner"
    expect(planner.locator("#verdict")).to_contain_text("Success")
    assert re.fullmatch(r"24\.7\d mm", readout(planner, "length"))
    for key, unit in (("foreshortening", "%"), ("std-mean", "mm"), ("proximal", "mm")):
        assert readout(planner, key).endswith(unit)
    expect(planner.locator("footer")).to_contain_text("Not a medical device")
    colours = planner.evaluate(
        """async () => {
            const bitmap = await createImageBitmap(await planner.pictures[0].view.png());
            const canvas = new OffscreenCanvas(bitmap.width, bitmap.height);
            const context = canvas.getContext("2d");
            context.drawImage(bitmap, 0, 0);
            const { data } = context.getImageData(0, 0, bitmap.width, bitmap.height);
            return new Set(new Uint32Array(data.buffer)).size;
        }"""
    )
    assert colours > 100


def test_read_outs_are_python_s(planner: Page) -> None:
    complete(planner)
    slide(planner, "site_eta", 0.3)
    case = Case.from_dict(tables(planner))
    prediction = load_model().predict(case)
    assert readout(planner, "length") == f"{prediction.deployed_length_mm:.2f} mm"
    assert readout(planner, "std-max") == f"{np.linalg.norm(prediction.std, axis=1).max():.4f} mm"


def test_ends_are_measured_from_the_neck(planner: Page) -> None:
    # Straight vessel, sac of radius 4 whose centre is 1.5 + 2 mm above the line: the sphere meets
    # the wall's highest line, at y = 1.5, within sqrt(16 - 4) mm of the middle.
    for name, value in (("vessel_P1_y", "0"), ("aneurysm_diameter", "8")):
        type_into(planner, name, value)
    settled(planner)
    edges = planner.evaluate("() => planner.seen.shape.neck")
    assert edges == pytest.approx([25.0 - 12.0**0.5, 25.0 + 12.0**0.5], abs=0.01)


@pytest.mark.parametrize(
    "name, value",
    [
        ("site_eta", 0.2),
        ("vessel_P1_y", 24.0),
        ("vessel_P1_z", 20.0),
        ("vessel_diameter", 3.6),
        ("aneurysm_diameter", 9.0),
        ("aneurysm_protrusion", 0.35),
    ],
)
def test_a_slider_moves_the_braid(planner: Page, name: str, value: float) -> None:
    before = planner.evaluate("() => [...planner.seen.prediction.positions.slice(0, 300)]")
    rows = planner.inner_text("#readouts")
    slide(planner, name, value)
    after = planner.evaluate("() => [...planner.seen.prediction.positions.slice(0, 300)]")
    assert max(abs(a - b) for a, b in zip(before, after, strict=True)) > 1e-3
    assert planner.inner_text("#readouts") != rows
    assert float(planner.input_value(f"#number-{name}")) == value


def test_eta_and_millimetres_are_one_site(planner: Page) -> None:
    spare = planner.evaluate("() => planner.seen.geometry.spareLength")
    type_into(planner, "site_eta", "0.25")
    expect(planner.locator("#number-site_mm")).to_have_value(f"{0.25 * spare:.2f}")
    type_into(planner, "site_mm", "10")
    settled(planner)
    assert tables(planner)["site"]["eta"] == pytest.approx(10.0 / spare)


@pytest.mark.parametrize(
    "name",
    [
        *("site_eta", "site_mm", "vessel_P1_y", "vessel_P1_z", "vessel_diameter"),
        *("aneurysm_diameter", "aneurysm_protrusion"),
    ],
)
def test_garbage_is_refused_and_the_last_value_kept(planner: Page, name: str) -> None:
    before, shown = tables(planner), planner.input_value(f"#number-{name}")
    for text in GARBAGE:
        type_into(planner, name, text)
        note = planner.locator(f"#number-{name}").evaluate(
            "(field) => document.getElementById(field.getAttribute('aria-describedby')).textContent"
        )
        assert "must be" in note and "Kept" in note
        assert planner.input_value(f"#number-{name}") == shown
    assert tables(planner) == before
    expect(planner.locator("#verdict")).to_contain_text("Success")


def test_what_is_being_typed_stays(planner: Page) -> None:
    planner.fill("#number-aneurysm_diameter", "8.5")
    slide(planner, "site_eta", 0.4)
    assert planner.input_value("#number-aneurysm_diameter") == "8.5"
    planner.press("#number-aneurysm_diameter", "Enter")
    settled(planner)
    assert tables(planner)["aneurysm"]["diameter"] == 8.5


def test_outside_of_the_training_data_is_said(planner: Page) -> None:
    type_into(planner, "aneurysm_diameter", "11")
    banner = planner.locator("[data-banner=outside]")
    expect(banner).to_contain_text("Aneurysm diameter = 11 mm, trained from 5 to 10 mm")
    expect(banner).to_contain_text("not a prediction")
    type_into(planner, "aneurysm_diameter", "8")
    expect(banner).to_have_count(0)


def test_an_impossible_case_keeps_the_last_picture_in_grey(planner: Page) -> None:
    length = readout(planner, "length")
    type_into(planner, "vessel_diameter", "9")
    banner = planner.locator("[data-banner=impossible]")
    expect(banner).to_contain_text("vessel.diameter = 9 mm must be below")
    expect(planner.locator("#canvas")).to_have_class("stale")
    expect(planner.locator("#simulate")).to_be_disabled()
    assert readout(planner, "length") == length
    type_into(planner, "vessel_diameter", "3")
    expect(banner).to_have_count(0)
    expect(planner.locator("#canvas")).not_to_have_class("stale")


def test_the_strip_moves_the_site(planner: Page) -> None:
    box = planner.locator("#strip svg").bounding_box()
    planner.mouse.click(box["x"] + 0.25 * box["width"], box["y"] + 0.5 * box["height"])
    settled(planner)
    assert tables(planner)["site"]["eta"] == pytest.approx(0.25, abs=0.003)
    planner.focus("#strip")
    planner.keyboard.press("ArrowRight")
    settled(planner)
    assert tables(planner)["site"]["eta"] == pytest.approx(0.26, abs=0.003)
    expect(planner.locator("#strip")).to_have_attribute("aria-valuetext", re.compile("probability"))


def test_the_best_site_is_above_the_threshold(planner: Page) -> None:
    slide(planner, "site_eta", 0.0)
    expect(planner.locator("#verdict")).to_contain_text("Failure")
    planner.click("#best")
    expect(planner.locator("#verdict")).to_contain_text("Success")
    probability, threshold = planner.evaluate(
        "() => [planner.seen.prediction.successProbability, planner.model.threshold]"
    )
    assert probability >= threshold


def test_best_site_is_the_middle_of_the_widest_window(planner: Page) -> None:
    found = planner.evaluate(
        """async () => {
            const { bestSite } = await import("/static/strip.js");
            const p = Array(101).fill(0);
            p.fill(1, 10, 13).fill(0.9, 40, 61);
            const halves = p.map((x) => x / 2);
            return [bestSite(p, 0.8), bestSite(halves, 0.8), bestSite(Array(101).fill(1), 0.5)];
        }"""
    )
    assert found == [
        {"eta": 0.5, "safe": True},
        {"eta": 0.1, "safe": False},
        {"eta": 0.5, "safe": True},
    ]


def test_back_forward_and_reload_keep_the_case(planner: Page) -> None:
    for eta in (0.2, 0.4):
        slide(planner, "site_eta", eta)
        settled(planner)
    complete(planner)
    planner.select_option("#colour", "std")
    settled(planner)
    planner.go_back()
    planner.go_back()
    expect(planner.locator("#number-site_eta")).to_have_value("0.2")
    planner.go_forward()
    expect(planner.locator("#number-site_eta")).to_have_value("0.4")
    planner.go_forward()
    reloaded(planner)
    expect(planner.locator("#number-site_eta")).to_have_value("0.4")
    complete(planner)
    expect(planner.locator("#colour")).to_have_value("std")


def test_a_drag_is_one_entry_of_the_history(planner: Page) -> None:
    before = planner.evaluate("() => history.length")
    for i in range(20):
        slide(planner, "site_eta", 0.3 + 0.01 * i, committed=False)
    slide(planner, "site_eta", 0.6)
    settled(planner)
    assert planner.evaluate("() => history.length") == before + 1


@pytest.mark.parametrize(
    "hash",
    [
        "#site_eta=abc",
        "#%E0%A4%A",
        "#vessel_diameter=-1",
        "#nonsense",
        "#A.site_eta=7&compare=sides",
    ],
)
def test_a_garbled_address_is_survived(browser_page: Page, server, hash: str) -> None:
    page = opened(browser_page, server.url, hash)
    expect(page.locator("[data-banner=address]")).to_contain_text("The address holds")
    expect(page.locator("#verdict")).to_contain_text("Success")


@pytest.mark.slow
def test_random_moves_leave_no_error(planner: Page) -> None:
    draw = random.Random(7)
    ranges = planner.evaluate("() => planner.fields.map(({ name, range }) => [name, range])")
    for _ in range(200):
        name, (low, high) = draw.choice(ranges)
        slide(planner, name, draw.uniform(low, high), committed=draw.random() < 0.5)
    settled(planner)
    case = Case.from_dict(tables(planner))
    prediction = load_model().predict(case)
    found = planner.evaluate("() => [...planner.seen.prediction.positions]")
    assert found == pytest.approx(prediction.positions.ravel().tolist(), abs=1e-6)


def test_two_cases_are_compared(planner: Page) -> None:
    planner.click("#pin")
    slide(planner, "site_eta", 0.1)
    table = planner.locator("#compare-table")
    expect(table.locator('[data-a="length"]')).to_have_text(re.compile(r"24\.7\d mm"))
    expect(table.locator('[data-b="length"]')).to_have_text(readout(planner, "length"))
    expect(planner.locator("#canvas-a")).to_be_visible()
    planner.select_option("#arrange", "ghost")
    expect(planner.locator("#canvas-a")).to_be_hidden()
    settled(planner)
    reloaded(planner)
    expect(planner.locator("#arrange")).to_have_value("ghost")
    planner.click("#unpin")
    expect(table).to_be_hidden()


@pytest.mark.slow
def test_a_simulation_is_shown_with_its_difference(planner: Page) -> None:
    planner.click("#simulate")
    expect(planner.locator("#cancel")).to_be_visible()
    expect(planner.locator('[data-key="sim-mean"]')).to_be_visible(timeout=SIMULATED)
    assert readout(planner, "sim-outcome") == "success"
    assert float(readout(planner, "sim-max").removesuffix(" mm")) < 0.1
    assert int(readout(planner, "sim-iterations")) > 0
    planner.select_option("#colour", "departure")
    expect(planner.locator("#legend")).to_contain_text("departure from the simulation, mm")
    # It stays with its case.
    slide(planner, "site_eta", 0.3)
    expect(planner.locator("#simulation-other")).to_contain_text("another case")
    expect(planner.locator('[data-key="sim-mean"]')).to_have_count(0)
    planner.click("text=Show that case")
    expect(planner.locator('[data-key="sim-mean"]')).to_be_visible()


def test_a_simulation_is_cancelled(planner: Page) -> None:
    planner.click("#simulate")
    planner.click("#cancel")
    expect(planner.locator("#simulation-message")).to_have_text("The simulation was cancelled.")
    expect(planner.locator("#simulate")).to_be_enabled()


def test_a_restarted_server_is_noticed(
    browser_page: Page, contents: Contents, serving, troubles: list[str]
) -> None:
    with serving(application(contents)) as served:
        opened(browser_page, served.url)
        slide(browser_page, "site_eta", 0.35)
        settled(browser_page)
        browser_page.wait_for_timeout(500)
    banner = browser_page.locator("[data-banner=server]")
    expect(banner).to_contain_text("The server is gone")
    slide(browser_page, "site_eta", 0.4)
    expect(browser_page.locator("#verdict")).to_contain_text("Success")
    with serving(application(contents), served.port):
        expect(banner).to_contain_text("was restarted")
        assert tables(browser_page)["site"]["eta"] == 0.4
        browser_page.goto("about:blank")
    assert troubles and all("ERR_CONNECTION" in trouble for trouble in troubles)
    troubles.clear()


def test_what_is_seen_is_exported(planner: Page, tmp_path: Path) -> None:
    complete(planner)
    slide(planner, "site_eta", 0.45)
    wires = downloaded(planner, "vtp").rename(tmp_path / "wires.vtp")
    mesh = pyvista.read(wires)
    assert (mesh.n_points, mesh.n_lines) == (3408, 48)
    assert {"gap_mm", "std_norm_mm"} <= set(mesh.point_data)
    surface = trimesh.load_mesh(downloaded(planner, "stl"), file_type="stl")
    assert surface.is_watertight
    assert downloaded(planner, "png").read_bytes().startswith(b"\x89PNG")
    text = downloaded(planner, "toml").read_text("utf-8")
    assert Case.from_dict(tomllib.loads(text)).eta == 0.45
    report = downloaded(planner, "html").read_text("utf-8")
    assert "Not a medical device" in report and "Model card" in report
    assert report.count("data:image/png;base64,") == 3  # as seen, and two standard views
    assert not re.search(r"""(src|href)=["'](?!data:)""", report)


def test_the_keyboard_is_enough(planner: Page) -> None:
    def tab_to(identity: str) -> None:
        for _ in range(60):
            planner.keyboard.press("Tab")
            if planner.evaluate("() => document.activeElement.id") == identity:
                return
        raise AssertionError(f"no Tab leads to {identity}")

    tab_to("canvas")
    planner.keyboard.press("4")
    tab_to("best")
    planner.keyboard.press("Enter")
    tab_to("strip")
    planner.keyboard.press("Home")
    expect(planner.locator("#number-site_eta")).to_have_value("0")
    tab_to("number-vessel_diameter")
    planner.keyboard.press("Control+A")
    planner.keyboard.type("3.5")
    planner.keyboard.press("Enter")
    settled(planner)
    assert tables(planner)["vessel"]["diameter"] == 3.5
    tab_to("pin")
    planner.keyboard.press("Space")
    expect(planner.locator("#compare-table")).to_be_visible()
    unnamed = planner.evaluate(
        """() => [...document.querySelectorAll("input, select, button, canvas, [role=slider]")]
            .filter((e) => !e.ariaHidden)
            .filter((e) => !(e.labels?.length || e.ariaLabel || e.textContent.trim())).length"""
    )
    assert unnamed == 0


def test_light_and_dark(planner: Page) -> None:
    background = "() => getComputedStyle(document.body).backgroundColor"
    light = planner.evaluate(background)
    planner.click("#theme")
    dark = planner.evaluate(background)
    assert light != dark
    reloaded(planner)
    assert planner.evaluate(background) == dark


@pytest.mark.parametrize("size", [(1280, 720), (1920, 1080), (820, 1180)])
def test_nothing_overlaps_or_overflows(planner: Page, size: tuple[int, int]) -> None:
    planner.set_viewport_size({"width": size[0], "height": size[1]})
    settled(planner)
    assert planner.evaluate(
        """() => [document.documentElement.scrollWidth <= innerWidth,
            document.documentElement.scrollHeight <= innerHeight]"""
    ) == [True, True]
    overlaps = planner.evaluate(
        """() => {
            const parts = [...document.querySelectorAll("label, button, dt, dd, h1, h2, input, p")];
            const boxes = parts.filter((part) => part.checkVisibility())
                .map((part) => [part, part.getBoundingClientRect()]).filter(([, b]) => b.width);
            return boxes.flatMap(([a, x], i) => boxes.slice(i + 1)
                .filter(([b, y]) => !a.contains(b) && !b.contains(a)
                    && Math.min(x.right, y.right) - Math.max(x.left, y.left) > 1
                    && Math.min(x.bottom, y.bottom) - Math.max(x.top, y.top) > 1
                    && Boolean(a.closest("#panel")) === Boolean(b.closest("#panel")))
                .map(([b]) => `${a.outerHTML.slice(0, 60)} | ${b.outerHTML.slice(0, 60)}`));
        }"""
    )
    assert overlaps == []


@pytest.mark.slow
def test_a_vessel_from_a_surface_is_simulated(browser_page: Page, serving) -> None:
    contents = Contents(OpenedCase.from_toml(EXAMPLES / "vessels" / "siphon.toml"), load_model)
    with serving(application(contents)) as served:
        page = opened(browser_page, served.url)
        expect(page.locator("#verdict")).to_contain_text("switched off")
        expect(page.locator("#strip")).to_be_hidden()
        spare = page.evaluate("() => planner.seen.geometry.spareLength")
        type_into(page, "site_mm", "20")
        settled(page)
        assert tables(page)["site"]["eta"] == pytest.approx(20.0 / spare)
        page.click("#simulate")
        expect(page.locator('[data-key="sim-length"]')).to_be_visible(timeout=SIMULATED)
        # At another site there is no braid until it is simulated.
        assert page.evaluate("() => planner.pictures[0].view.braid.visible")
        type_into(page, "site_mm", "5")
        settled(page)
        assert not page.evaluate("() => planner.pictures[0].view.braid.visible")
        expect(page.locator("#legend")).to_be_hidden()
        page.click("#download-vtp")
        expect(page.locator("[data-banner=download]")).to_contain_text("no braid yet")
        page.goto("about:blank")


def test_the_page_as_a_file(browser_page: Page, contents: Contents, tmp_path: Path) -> None:
    path = tmp_path / "planner.html"
    path.write_text(single_file(contents), "utf-8")
    page = opened(browser_page, path.as_uri())
    expect(page.locator("#simulation-message")).to_contain_text("cannot simulate")
    expect(page.locator("#simulate")).to_be_disabled()
    slide(page, "site_eta", 0.3)
    settled(page)
    reloaded(page)
    expect(page.locator("#number-site_eta")).to_have_value("0.3")
    assert tables(page)["site"]["eta"] == 0.3
