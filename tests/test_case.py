"""Cases: what is read, what is refused, and in which words."""

import math
import os
import tomllib
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import qmc

from braidcast import Case, InputError
from braidcast.vessels import QuadraticBezier

EXAMPLES = Path(__file__).parents[1] / "examples"


def spoilt(tables: dict[str, Any], field: str, value: Any) -> dict[str, Any]:
    """``tables`` with the value of ``field`` replaced, or left out if it is ``...``."""
    tables = deepcopy(tables)
    table, _, key = field.rpartition(".")
    target = tables.setdefault(table, {}) if table else tables
    if value is ...:
        del target[key]
    else:
        target[key] = value
    return tables


def complaint(tables: Any) -> str:
    with pytest.raises(InputError) as caught:
        Case.from_dict(tables)
    text = str(caught.value)
    assert "\n" not in text and len(text) < 400
    return text


@pytest.mark.parametrize("name", ["success", "failure_end_in_sac"])
def test_examples_are_in_the_range_of_the_study(name: str) -> None:
    case = Case.from_toml(EXAMPLES / f"{name}.toml")
    _, y, z = case.vessel.P1
    assert 5.0 <= y <= 30.0 and 18.0 <= z <= 32.0 and 2.0 <= case.vessel.diameter <= 4.0
    assert case.aneurysm is not None and case.aneurysm.protrusion is not None
    assert 5.0 <= case.aneurysm.diameter <= 10.0 and 0.3 <= case.aneurysm.protrusion <= 0.8


def test_the_strongly_curved_example_is_bent_beyond_the_study() -> None:
    case = Case.from_toml(EXAMPLES / "strongly_curved.toml")
    tightest = QuadraticBezier(*np.array([[0.0, 0.0, 0.0], [0.0, 30.0, 18.0], [0.0, 0.0, 50.0]]))
    assert case.centreline.max_curvature > 2.0 * tightest.max_curvature
    assert case.vessel_radius * case.centreline.max_curvature == pytest.approx(0.2)
    assert case.aneurysm is not None


@pytest.mark.parametrize(
    "path", sorted(set(EXAMPLES.glob("*.toml")) - {EXAMPLES / "plan.toml"}), ids=lambda p: p.stem
)
def test_examples_have_titles_and_survive_rewriting(path: Path) -> None:
    case = Case.from_toml(path)
    assert case.title
    assert Case.from_dict(tomllib.loads(case.to_toml())) == case


def test_defaults_are_the_papers(tables: dict[str, Any]) -> None:
    del tables["device"], tables["aneurysm"]
    case = Case.from_dict(tables)
    assert (case.braid.wires, case.braid.node_count) == (48, 3408)
    assert case.crimped_radius == pytest.approx(0.3 * 2.614)
    assert case.wall.friction == 0.1
    assert case.vessel_geometry.aneurysm is None and case.aneurysm_centre is None
    np.testing.assert_array_equal(case.centreline.P2, [0.0, 0.0, 50.0])


def test_geometry_follows_the_definitions(case: Case) -> None:
    middle = case.centreline.at_arc_length(case.centreline.length / 2)[0]
    np.testing.assert_allclose(case.aneurysm_centre - middle, [0.0, 1.5 + 0.5 * 3.5, 0.0])
    spare = case.centreline.length - case.crimped_length - 0.5
    assert case.start_arc_length == pytest.approx(0.5 * spare)
    assert case.vessel_geometry.distance([case.aneurysm_centre])[0] < 0.0


def test_every_case_of_the_studys_range_is_feasible(tables: dict[str, Any]) -> None:
    plan = qmc.LatinHypercube(6, rng=7).random(60)
    corners = np.array(np.meshgrid(*[[0.0, 1.0]] * 6)).reshape(6, -1).T
    for y, z, d_v, d_a, f, eta in np.concatenate([plan, corners]):
        tables["vessel"] = {"P1": [0.0, 5 + 25 * y, 18 + 14 * z], "diameter": 2 + 2 * d_v}
        tables["aneurysm"] = {"diameter": 5 + 5 * d_a, "protrusion": 0.3 + 0.5 * f}
        tables["device"] = {}
        tables["site"] = {"eta": eta}
        Case.from_dict(tables)


@pytest.mark.parametrize(
    ("field", "value", "says"),
    [
        ("vessel.diamter", 3.0, "vessel.diamter is not a known key; did you mean vessel.diameter"),
        ("vessel.p1", [1.0, 2.0, 3.0], "did you mean vessel.P1"),
        ("site.friction", 0.2, "did you mean wall.friction"),
        ("vesel", {}, "vesel is not a known key; did you mean vessel"),
        ("colour", "red", "a case takes title, vessel"),
        ("vessel", ..., "vessel is missing, must be a table"),
        ("site", ..., "site is missing"),
        ("site.eta", ..., "site.eta is missing, must be a number from 0 to 1"),
        ("vessel.diameter", ..., "vessel.diameter is missing"),
        ("vessel", 3, "vessel = 3 must be a table"),
        ("aneurysm", [1, 2], "aneurysm = [1, 2] must be a table"),
        ("vessel.P1", [1.0, 2.0], "vessel.P1 = [1.0, 2.0] must be three numbers"),
        ("vessel.P1", [1.0, 2.0, 3.0, 4.0], "must be three numbers"),
        ("vessel.P1", [0.0, "15", 25.0], "must be three numbers"),
        ("vessel.P1", "abc", "must be three numbers"),
        ("vessel.P1", [0.0, math.nan, 25.0], "must be three numbers"),
        ("vessel.P1", [0.0, 1e9, 25.0], "must be three numbers"),
        ("vessel.P1", [0.0, 0.0, 0.0], "vessel.P1 = "),
        ("vessel.P1", [0.0, 0.0, 90.0], "vessel.P1 = "),
        ("vessel.P1", [0.0, 600.0, 25.0], "bends the centreline to a radius of"),
        ("vessel.P2", [0.0, 0.0, 0.0], "vessel."),
        ("vessel.diameter", "3", "vessel.diameter = '3' must be a number of mm"),
        ("vessel.diameter", True, "vessel.diameter = true must be a number"),
        ("vessel.diameter", math.nan, "vessel.diameter = nan must be a number"),
        ("vessel.diameter", math.inf, "vessel.diameter = inf must be a number"),
        ("vessel.diameter", -3.0, "vessel.diameter = -3.0 must be a number of mm above 0"),
        ("vessel.diameter", 1.6, "vessel.diameter = 1.6 mm must be above 1.624 mm"),
        ("vessel.diameter", 6.0, "vessel.diameter = 6 mm must be below 5.256 mm"),
        ("device.wires", 47, "device.wires = 47 must be even"),
        ("device.wires", 48.0, "device.wires = 48.0 must be an even whole number"),
        ("device.wires", 10**30, "device.wires = 1000"),
        ("device.name", "x", "device.name = 'x' must be one of: paper"),
        ("device.length", 100.0, "device.length = 100 mm gives a stent of"),
        ("device.wire_radius", 0.9, "device.wire_radius = 0.9 mm must be below"),
        ("device.poisson_ratio", 0.6, "device.poisson_ratio = 0.6 must be"),
        ("device.literal_angle", 1, "device.literal_angle = 1 must be true or false"),
        ("aneurysm.centre", [0.0, 9.0, 25.0], "both given, must be exactly one"),
        ("aneurysm.protrusion", ..., "neither given, must be exactly one"),
        ("aneurysm.protrusion", 1.0, "aneurysm.protrusion = 1.0 must be a number between 0 and 1"),
        ("aneurysm.neck_fillet", 0.0, "aneurysm.neck_fillet = 0.0 must be"),
        ("aneurysm", {"diameter": 7.0, "centre": [0.0, 90.0, 25.0]}, "touching it"),
        ("aneurysm", {"diameter": 7.0, "centre": [0.0, 7.5, 25.0]}, "outside the vessel"),
        ("aneurysm", {"diameter": 7.0, "centre": [0.0, -3.0, 3.0]}, "swallows that end"),
        (
            "aneurysm",
            {"diameter": 0.8, "protrusion": 0.5, "neck_fillet": 0.5},
            "aneurysm.neck_fillet = 0.5 mm must be below 0.4 mm",
        ),
        ("site.eta", 1.1, "site.eta = 1.1 must be a number from 0 to 1"),
        ("site.crimped_radius", 0.01, "site.crimped_radius = 0.01 mm must be from"),
        ("site.crimped_radius", 3.0, "site.crimped_radius = 3 mm must be from"),
        ("wall.friction", -0.1, "wall.friction = -0.1 must be a number from 0 to 2"),
        ("title", 3, "title = 3 must be a text"),
        ("title", "x" * 1000, "title = 'xxx"),
    ],
)
def test_bad_values_are_named_with_what_is_allowed(
    tables: dict[str, Any], field: str, value: Any, says: str
) -> None:
    assert says in complaint(spoilt(tables, field, value))


def test_a_number_too_long_to_print(tables: dict[str, Any]) -> None:
    says = complaint(spoilt(tables, "vessel.diameter", 10**5000))
    assert says.startswith("vessel.diameter = a huge number must be a number of mm")


@pytest.mark.parametrize("data", [None, 3, "vessel", []])
def test_a_case_must_be_a_mapping(data: Any) -> None:
    assert "must be a mapping" in complaint(data)


leaves = (
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text(max_size=5)
    | st.lists(st.floats(), max_size=4)
)
FIELDS = [
    *("title", "vessel", "vessel.P0", "vessel.P1", "vessel.P2", "vessel.diameter", "aneurysm"),
    *("aneurysm.diameter", "aneurysm.centre", "aneurysm.protrusion", "aneurysm.neck_fillet"),
    *("device", "device.wires", "device.radius", "device.length", "device.segments", "site"),
    *("device.wire_radius", "device.young_modulus", "site.eta", "site.crimped_radius", "wall"),
]


@settings(max_examples=300, deadline=None)
@given(field=st.sampled_from(FIELDS), value=leaves)
def test_whatever_is_given_is_read_or_refused_in_one_sentence(field: str, value: Any) -> None:
    tables = {
        "vessel": {"P1": [0.0, 15.0, 25.0], "diameter": 3.0},
        "aneurysm": {"diameter": 7.0, "protrusion": 0.5},
        "device": {"wires": 12, "segments": 24},
        "site": {"eta": 0.5},
    }
    try:
        Case.from_dict(spoilt(tables, field, value))
    except InputError as error:
        assert "\n" not in str(error)


def test_toml_goes_round(tables: dict[str, Any], tmp_path: Path) -> None:
    tables["title"] = 'tab\t, "quoted", back\\slash, \x7f\x00, new\nline, λ and \U0001f600'
    tables["aneurysm"] = {"diameter": 7.0, "centre": [0.0, 10.0, 1e-7 + 25.0]}
    tables["device"]["literal_angle"] = False
    case = Case.from_dict(tables)
    path = tmp_path / "case.toml"
    path.write_text(case.to_toml(), encoding="utf-8", newline="\n")
    again = Case.from_toml(path)
    assert again == case
    assert again.to_toml() == case.to_toml()
    assert Case.from_dict(case.to_dict()) == case


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "is empty"),
        (b" \n\n", "is empty"),
        (b"# only a comment", "vessel is missing"),
        (b"\xff\xfe\x00\x01binary\x89PNG", "is not text in UTF-8"),
        (b"\x00\x01\x02", "is not valid TOML"),
        (b"[vessel\ndiameter = 3", "is not valid TOML"),
        (b"a = 1\na = 2", "is not valid TOML"),
        (b"a = " + b"[" * 5000 + b"]" * 5000, "nested too deeply"),
        (b"a = " + b"9" * 5000, "is not valid TOML"),
        (b"# " + b"x" * 1_100_000, "is longer than"),
    ],
)
def test_files_that_are_no_case(tmp_path: Path, content: bytes, says: str) -> None:
    path = tmp_path / "case.toml"
    path.write_bytes(content)
    with pytest.raises(InputError, match=says) as caught:
        Case.from_toml(path)
    assert str(caught.value).startswith(f"{path}: ") and "\n" not in str(caught.value)


def test_a_byte_order_mark_is_no_hindrance(case: Case, tmp_path: Path) -> None:
    path = tmp_path / "case.toml"
    path.write_text(case.to_toml(), encoding="utf-8-sig")
    assert Case.from_toml(path) == case


def test_files_that_cannot_be_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match="there is no such case file"):
        Case.from_toml(tmp_path / "none.toml")
    with pytest.raises(InputError, match="is a folder"):
        Case.from_toml(tmp_path)
    with pytest.raises(InputError, match="cannot be read"):
        Case.from_toml("nul\0byte.toml")
    if Path("/dev/zero").exists():
        with pytest.raises(InputError, match="is longer than"):
            Case.from_toml("/dev/zero")

    # The user root may read everything, so that permission is refused here by hand.
    def refuse(*_: Any, **__: Any) -> None:
        raise PermissionError(13, os.strerror(13))

    monkeypatch.setattr(Path, "open", refuse)
    with pytest.raises(InputError, match="cannot be read: Permission denied"):
        Case.from_toml(EXAMPLES / "success.toml")


@pytest.mark.parametrize("value", ["true", "1979-05-27", "07:32:00"])
def test_complaints_show_values_as_the_case_file_has_them(
    tables: dict[str, Any], value: str
) -> None:
    with pytest.raises(InputError, match=f"site.eta = {value} must be a number from 0 to 1"):
        Case.from_dict(spoilt(tables, "site.eta", tomllib.loads(f"eta = {value}")["eta"]))
