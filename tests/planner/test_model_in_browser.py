"""The model in the browser gives the numbers of the model in Python."""

import base64
import gzip
import json
from collections.abc import Iterator
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, Route

from braidcast import Case, InputError, load_model
from braidcast.planner.model_arrays import model_bytes, pack, unpack
from braidcast.surrogate.applicability import fields
from braidcast.surrogate.model import SurrogateModel
from braidcast.surrogate.prediction import Prediction
from braidcast.surrogate.recipes import RECIPES

SITE = "http://planner.test/"

SCRIPT = """
import { Model, unpack } from "./model.js";
import * as cases from "./case.js";
const container = async (name) => (await fetch(name)).arrayBuffer();
const base64 = (arrays) => new Promise((resolve) => {
  const reader = new FileReader();
  reader.onload = () => resolve(reader.result.split(",")[1]);
  reader.readAsDataURL(new Blob(arrays));
});
window.planner = { Model, unpack, cases, container, base64 };
"""


@pytest.fixture(scope="module")
def model() -> SurrogateModel:
    return load_model()


@pytest.fixture(scope="module")
def content(model: SurrogateModel) -> bytes:
    return model_bytes(model)


@pytest.fixture(scope="module")
def page(browser: Browser, content: bytes) -> Iterator[Page]:
    """A page with the model; nothing is complained of in its console."""
    page = browser.new_page()
    troubles: list[str] = []
    page.on("pageerror", lambda error: troubles.append(str(error)))
    page.on("console", lambda line: troubles.append(line.text))
    serve(page, content)
    yield page
    page.close()
    assert troubles == []


def serve(page: Page, content: bytes) -> None:
    """The planner's modules and the model at an address of no server; nothing else is there."""
    static = files("braidcast.planner") / "static"
    pages = {"": f"<!doctype html><link rel=icon href=data:,><script type=module>{SCRIPT}</script>"}

    def answer(route: Route) -> None:
        name = route.request.url.removeprefix(SITE)
        if name == "model":
            route.fulfill(body=content, content_type="application/octet-stream")
        elif name in pages:
            route.fulfill(body=pages[name], content_type="text/html")
        else:
            text = (static / name).read_text("utf-8")
            route.fulfill(body=text, content_type="text/javascript")

    page.route(f"{SITE}**", answer)
    page.goto(SITE)
    page.wait_for_function("window.planner")
    page.evaluate("planner.container('model').then((m) => { window.model = new planner.Model(m) })")


def tables(rng: np.random.Generator, **changed: dict[str, Any]) -> dict[str, Any]:
    """A case of the study's ranges, with keys of its tables changed."""
    case: dict[str, dict[str, Any]] = {
        "vessel": {
            "P1": [0.0, rng.uniform(10.0, 30.0), rng.uniform(18.0, 32.0)],
            "diameter": rng.uniform(2.0, 4.0),
        },
        "aneurysm": {"diameter": rng.uniform(5.0, 10.0), "protrusion": rng.uniform(0.3, 0.75)},
        "site": {"eta": rng.uniform()},
    }
    for name, keys in changed.items():
        case[name] = {**case.get(name, {}), **keys}
    return case


def studied() -> list[dict[str, Any]]:
    """Cases to predict: of the study, at its corners, and outside it."""
    rng = np.random.default_rng(7)
    corners = [
        tables(
            rng,
            vessel={"P1": [0, 10 + 20 * i, 18 + 14 * j], "diameter": 2.0 + 2.0 * k},
            aneurysm={"diameter": 10.0 - 5.0 * i, "protrusion": 0.3 + 0.45 * k},
            site={"eta": float(j)},
        )
        for i in (0, 1)
        for j in (0, 1)
        for k in (0, 1)
    ]
    others = [
        tables(rng, site={"eta": 0.0}),
        tables(rng, site={"eta": 1.0}),
        tables(rng, vessel={"P1": [0.0, 0.0, 25.0]}),  # straight
        tables(rng, vessel={"P1": [0.0, 0.01, 25.0]}),
        tables(rng, vessel={"P1": [2.0, 17.0, 25.0]}),  # out of the plane
        tables(rng, vessel={"P0": [1.0, 2.0, 3.0], "P2": [4.0, 5.0, 54.0]}),
        tables(rng, vessel={"diameter": 4.9}, wall={"friction": 0.3}),
        tables(rng, vessel={"P1": [0.0, 15.0, 25.0], "P0": [0, 0, 30], "P2": [0, 0, -20]}),
        tables(rng, aneurysm={"neck_fillet": 0.5}, site={"crimped_radius": 0.7}),
        {
            "vessel": {"P1": [0.0, 20.0, 25.0], "diameter": 3.0},
            "aneurysm": {"diameter": 7.0, "centre": [0.5, 14.0, 24.0]},
            "site": {"point": [0.0, 9.0, 22.0]},
        },
        {
            "vessel": {"P1": [0.0, 20.0, 25.0], "diameter": 3.0},
            "aneurysm": {"diameter": 7.0, "protrusion": 0.5},
            "site": {"proximal_end_mm": 12.5},
        },
    ]
    return [*(tables(rng) for _ in range(50)), *corners, *others]


@pytest.fixture(scope="module")
def predicted(model: SurrogateModel) -> list[Prediction]:
    return [model.predict(Case.from_dict(case)) for case in studied()]


def test_predictions_are_those_of_python(page: Page, predicted: list[Prediction]) -> None:
    before = page.evaluate("(one) => model.predict(one).std", studied()[0])
    assert before is None
    shares = page.evaluate(
        "async () => { const shares = []; await model.prepareStd((x) => shares.push(x));"
        "await model.stdReady; return shares; }"
    )
    assert len(shares) == 30 and shares == sorted(shares) and shares[-1] == 1.0
    for number, (case, expected) in enumerate(zip(studied(), predicted, strict=True)):
        found = page.evaluate(
            """async (one) => {
                const { positions, std, stdNorm, gaps, ...rest } = model.predict(one);
                const arrays = await planner.base64([positions, std, stdNorm, gaps]);
                return { ...rest, arrays, alone: model.successProbability(one) };
            }""",
            case,
        )
        nodes = len(expected.positions)
        ends = np.cumsum([3 * nodes, 3 * nodes, nodes])
        arrays = np.split(np.frombuffer(base64.b64decode(found["arrays"])), ends)
        wanted = (expected.positions, expected.std, expected.std_norm, expected.wire_distance)
        for name, got, right in zip(
            ("positions", "std", "stdNorm", "gaps"), arrays, wanted, strict=True
        ):
            np.testing.assert_allclose(
                got, right.ravel(), rtol=0, atol=1e-6, err_msg=f"{number} {name}"
            )
        assert found["successProbability"] == pytest.approx(expected.success_probability, abs=1e-9)
        assert found["alone"] == found["successProbability"]
        assert found["success"] == (expected.outcome == "success")
        assert found["deployedLength"] == pytest.approx(expected.deployed_length_mm, abs=1e-6)
        assert found["foreshorteningPercent"] == pytest.approx(
            expected.foreshortening_percent, abs=1e-6
        )
        assert found["inRange"] == expected.in_range
        assert tuple(found["outOfRange"]) == expected.out_of_range
        assert found["nearestCase"] == expected.nearest_case
        assert found["nearestDistance"] == pytest.approx(expected.nearest_distance, abs=1e-9)


def test_the_cases_have_both_outcomes_and_lie_within_and_without(
    predicted: list[Prediction],
) -> None:
    assert {p.outcome for p in predicted} == {"success", "failure"}
    assert sum(p.in_range for p in predicted) >= 50
    assert {len(p.out_of_range) for p in predicted} >= {0, 1, 2}


def test_a_case_has_the_same_numbers(page: Page) -> None:
    for case in studied():
        python = Case.from_dict(case)
        found = page.evaluate("(one) => planner.cases.fields(one, model.device)", case)
        assert list(found) == list(fields(python))
        assert found == pytest.approx(fields(python), abs=1e-9)
        geometry = page.evaluate(
            "(one) => { const { curve, ...rest } = planner.cases.geometry(one, model.device);"
            "return rest; }",
            case,
        )
        assert geometry.pop("sacCentre") == pytest.approx(python.aneurysm_centre, abs=1e-9)
        assert geometry == pytest.approx(
            {
                "length": python.bezier.length,
                "vesselRadius": python.vessel_radius,
                "sacRadius": python.sac.diameter / 2.0,
                "neckFillet": python.sac.neck_fillet,
                "startArcLength": python.start_arc_length,
                "crimpedLength": python.crimped_length,
                "crimpedRadius": python.crimped_radius,
                "spareLength": python.spare_length,
                "eta": python.eta,
            },
            abs=1e-9,
        )


IMPOSSIBLE: list[dict[str, dict[str, Any]]] = [
    {"vessel": {"P1": [0, 2000, 25]}},
    {"vessel": {"P1": [0.123456789012345678, 20.1234567890123456, 1234.12345678901234]}},
    {"vessel": {"diameter": -1}},
    {"vessel": {"diameter": 60.5}},
    {"aneurysm": {"diameter": 0}},
    {"aneurysm": {"protrusion": 1.0000001e-5, "diameter": 1e-5}},
    {"aneurysm": {"protrusion": 1}},
    {"aneurysm": {"neck_fillet": 1.5}},
    {"site": {"eta": 1.25}},
    {"site": {"eta": -1e-7}},
    {"wall": {"friction": 3}},
    {"site": {"crimped_radius": 0.05}},
    {"site": {"crimped_radius": 2.614}},
    {"vessel": {"P1": [0, 0, 0]}},
    {"vessel": {"P1": [0.0, 0.0, 60.0]}},
    {"vessel": {"P1": [0.0, 39.5, 0.25], "P2": [0.0, 0.0, 5.0]}},
    {"vessel": {"diameter": 1.5}},
    {"vessel": {"diameter": 5.3}},
    {"vessel": {"P1": [0.0, 0.0, 7.0], "P2": [0.0, 0.0, 14.0]}},
    {"site": {"eta": None, "proximal_end_mm": 45}},
    {"site": {"eta": None, "distal_end_mm": 3.5}},
    {"site": {"eta": None, "point": [0, 0, -5]}},
    {"site": {"eta": None, "point": [26.0, 10.0, 25.0]}},
    {"vessel": {"P1": [0, 15, 25]}, "aneurysm": {"protrusion": None, "centre": [0.0, 8.0, 25.0]}},
    {"aneurysm": {"protrusion": None, "centre": [0.0, 40.0, 25.0]}},
    {"aneurysm": {"protrusion": None, "centre": [0.0, 4.0, 0.5]}},
    {"aneurysm": {"diameter": 1.5, "neck_fillet": 0.8}},
]


def cleaned(case: dict[str, Any]) -> dict[str, Any]:
    """The tables without the keys that are None, as Python takes them."""
    return {
        name: {key: value for key, value in table.items() if value is not None}
        for name, table in case.items()
    }


@pytest.mark.parametrize("changed", IMPOSSIBLE, ids=str)
def test_an_impossible_case_has_the_same_complaint(page: Page, changed: dict[str, Any]) -> None:
    case = tables(np.random.default_rng(3), **changed)
    with pytest.raises(InputError) as complaint:
        Case.from_dict(cleaned(case))
    assert page.evaluate("(one) => model.complaint(one)", case) == str(complaint.value)


def test_possible_cases_have_no_complaint(page: Page) -> None:
    assert {page.evaluate("(one) => model.complaint(one)", case) for case in studied()} == {None}


@pytest.mark.parametrize(
    "device", [{"wires": 24}, {"length": 12.0}, {"literal_angle": True}, {"young_modulus": 2e5}]
)
def test_another_device_is_refused(
    page: Page, model: SurrogateModel, device: dict[str, Any]
) -> None:
    case = tables(np.random.default_rng(3), device=device)
    with pytest.raises(InputError) as complaint:
        model.predict(Case.from_dict(case))
    found = page.evaluate(
        "(one) => { try { model.predict(one) } catch (error) { return error.message } }", case
    )
    assert found == str(complaint.value)


def test_a_case_file_is_read_back_as_the_same_case(page: Page, tmp_path: Path) -> None:
    named = {"title": 'Ä "case" \\ of\ttwo\x7f lines\n', "device": {"name": "paper", "wires": 48}}
    for case in [{**studied()[0], **named}, *studied()[50:]]:
        file = tmp_path / "case.toml"
        file.write_text(page.evaluate("(one) => planner.cases.toToml(one)", case), "utf-8")
        assert Case.from_toml(file) == Case.from_dict(case)


def test_the_model_is_small(content: bytes) -> None:
    assert len(gzip.compress(content, 6)) <= 4.5e6


def test_a_container_is_read_back(page: Page) -> None:
    header, arrays = {"stage": "größer"}, {"a": np.arange(6).reshape(2, 3), "b": [0.1, -2e300]}
    content = pack(header, arrays)
    again, found = unpack(content)
    assert again == header
    for name, array in arrays.items():
        np.testing.assert_array_equal(found[name], array)
    browser = page.evaluate(
        "(bytes) => { const { header, arrays } = planner.unpack(new Uint8Array(bytes).buffer);"
        "return { ...header, a: [...arrays.a], b: [...arrays.b] }; }",
        list(content),
    )
    assert browser == {
        "stage": "größer",
        "arrays": [{"name": "a", "shape": [2, 3]}, {"name": "b", "shape": [2]}],
        "a": [0, 1, 2, 3, 4, 5],
        "b": [0.1, -2e300],
    }


def test_other_bytes_are_no_container(page: Page) -> None:
    message = page.evaluate(
        "() => { try { planner.unpack(new TextEncoder().encode('<html>').buffer) }"
        "catch (error) { return error.message } }"
    )
    assert "not of this planner" in message


def test_only_our_recipe_is_for_the_planner(model: SurrogateModel) -> None:
    with pytest.raises(InputError, match="must be of the recipe 'ours'"):
        model_bytes(replace(model, recipe=RECIPES["paper"]))


def test_numbers_are_written_as_python_writes_them(page: Page) -> None:
    rng = np.random.default_rng(0)
    numbers = [0.0, 1.0, 100000.0, 1e6, 123456.7, 1e-4, 9.9999e-5, 0.99996, 1e16, 2.5e-7, -3.0]
    numbers += (rng.standard_normal(200) * 10.0 ** rng.integers(-9, 9, 200)).tolist()
    found = page.evaluate(
        "async (numbers) => { const { float, general } = await import('./number_text.js');"
        "return numbers.map((x) => [float(x), general(x), general(x, 4), general(x, 3)]); }",
        json.loads(json.dumps(numbers)),
    )
    assert found == [[repr(x), f"{x:g}", f"{x:.4g}", f"{x:.3g}"] for x in numbers]
