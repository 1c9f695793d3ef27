"""Plans: what is read, what is refused, and in which words."""

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from braidcast import Case, InputError
from braidcast.case_toml import toml_text
from braidcast.dataset.plan import Plan, Range
from braidcast.study import PLAN as PLAN_OF_THE_STUDY

HOME = Path(__file__).parents[2]

PLAN = """\
title = "A plan"
seed = 5
cases = 40
subsets = [10, 20]
tests = 5
[case.vessel]
P1 = [0.0, { min = 5.0, max = 30.0 }, 25]
diameter = { min = 2, max = 4 }
[case.aneurysm]
diameter = 7.0
protrusion = 0.5
[case.device]
wires = 12
segments = 24
[case.site]
eta = { min = 0.0, max = 1.0 }
"""


def complaint(text: str) -> str:
    with pytest.raises(InputError) as caught:
        Plan.from_text(text, "mine.toml")
    says = str(caught.value)
    assert says.startswith("mine.toml: ") and "\n" not in says and len(says) < 400
    return says


def test_the_example_is_the_study() -> None:
    plan = Plan.from_toml(PLAN_OF_THE_STUDY)
    assert (plan.cases, plan.subsets, plan.tests) == (900, (150, 300, 600), 100)
    assert [(p.column, p.low, p.high) for p in plan.ranges] == [
        ("vessel_P1_y_mm", 10.0, 30.0),
        ("vessel_P1_z_mm", 18.0, 32.0),
        ("vessel_diameter_mm", 2.0, 4.0),
        ("aneurysm_diameter_mm", 5.0, 10.0),
        ("aneurysm_protrusion", 0.3, 0.75),
        ("site_eta", 0.0, 1.0),
    ]
    assert plan.case([16.0, 20.0, 3.0, 7.0, 0.5, 0.25]).braid.node_count == 3408
    example = Plan.from_toml(HOME / "examples" / "plan.toml")
    assert example.ranges == plan.ranges and example.cases == 60


def test_a_plan_is_what_its_text_says() -> None:
    plan = Plan.from_text(PLAN)
    assert plan.text == PLAN
    assert (plan.title, plan.seed, plan.cases) == ("A plan", 5, 40)
    assert plan.ranges == (
        Range(("vessel", "P1", 1), 5.0, 30.0, "mm"),
        Range(("vessel", "diameter"), 2.0, 4.0, "mm"),
        Range(("site", "eta"), 0.0, 1.0, ""),
    )
    assert plan.ranges[0].name == "vessel_P1_y"
    assert plan == Plan.from_text(PLAN) and plan != Plan.from_text(PLAN.replace("seed = 5", ""))


def test_the_values_go_where_the_ranges_stand() -> None:
    case = Plan.from_text(PLAN).case([6.0, 3.0, 0.25])
    assert case == Case.from_dict(
        {
            "vessel": {"P1": [0.0, 6.0, 25.0], "diameter": 3.0},
            "aneurysm": {"diameter": 7.0, "protrusion": 0.5},
            "device": {"wires": 12, "segments": 24},
            "site": {"eta": 0.25},
        }
    )
    with pytest.raises(InputError, match=r"vessel.diameter = 6 mm must be below 5.256 mm"):
        Plan.from_text(PLAN).case([6.0, 6.0, 0.25])
    with pytest.raises(ValueError, match="shorter"):
        Plan.from_text(PLAN).case([6.0, 3.0])


def test_defaults_and_the_whole_among_the_subsets() -> None:
    short = PLAN.replace('title = "A plan"\nseed = 5\n', "").replace("tests = 5\n", "")
    plan = Plan.from_text(short.replace("[10, 20]", "[10, 20, 40]"))
    assert (plan.title, plan.seed, plan.tests, plan.subsets) == ("", 0, 0, (10, 20))
    assert Plan.from_text(PLAN.replace("subsets = [10, 20]\n", "")).subsets == ()
    assert Plan.from_text(PLAN.replace("tests = 5", "tests = 10")).tests == 10


def test_without_a_range_there_is_one_case() -> None:
    text = (
        'cases = 1\n[case]\ntitle = "x"\nvessel = {P1 = [0, 9, 25], diameter = 3}\nsite = {eta = 0}'
    )
    plan = Plan.from_text(text)
    assert plan.ranges == () and plan.case([]).title == "x"
    assert "cases = 2 must be 1 where no number" in complaint(text.replace("= 1", "= 2", 1))


@pytest.mark.parametrize(
    ("field", "unit"),
    [
        ("vessel.diameter", "mm"),
        ("aneurysm.diameter", "mm"),
        ("aneurysm.neck_fillet", "mm"),
        ("aneurysm.protrusion", ""),
        ("device.radius", "mm"),
        ("device.length", "mm"),
        ("device.wire_radius", "mm"),
        ("device.young_modulus", "MPa"),
        ("device.poisson_ratio", ""),
        ("site.eta", ""),
        ("site.crimped_radius", "mm"),
        ("wall.friction", ""),
    ],
)
def test_any_number_of_a_case_may_be_a_range(field: str, unit: str) -> None:
    table, key = field.split(".")
    tables: dict[str, Any] = {
        "vessel": {"P1": [0.0, 15.0, 25.0], "diameter": 3.0},
        "aneurysm": {"diameter": 7.0, "protrusion": 0.5},
        "device": {},
        "site": {"eta": 0.5},
        "wall": {},
    }
    tables[table][key] = "RANGE"
    text = toml_text({f"case.{name}": values for name, values in tables.items()})
    text = "cases = 2\n" + text.replace('"RANGE"', "{ min = 0.2, max = 0.4 }")
    (only,) = Plan.from_text(text).ranges
    assert only == Range((table, key), 0.2, 0.4, unit)
    assert only.column == f"{table}_{key}" + (f"_{unit}" if unit else "")


def test_a_range_in_every_coordinate_of_a_point() -> None:
    ranged = "P1 = [{ min = -1, max = 1 }, { min = 5.0, max = 30.0 }, { min = 20, max = 30 }]"
    plan = Plan.from_text(PLAN.replace("P1 = [0.0, { min = 5.0, max = 30.0 }, 25]", ranged))
    assert [p.name for p in plan.ranges[:3]] == ["vessel_P1_x", "vessel_P1_y", "vessel_P1_z"]
    assert plan.case([-0.5, 6.0, 21.0, 3.0, 0.5]).vessel.P1 == (-0.5, 6.0, 21.0)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("cases = 40\n", "", "cases is missing, must be a whole number from 1 to 100000"),
        ("cases = 40", "cases = 0", "cases = 0 must be a whole number from 1 to 100000"),
        ("cases = 40", "cases = 100001", "cases = 100001 must be a whole number from 1 to 100000"),
        ("cases = 40", "cases = 40.0", "cases = 40.0 must be a whole number"),
        ("cases = 40", "cases = true", "cases = true must be a whole number"),
        ("cases = 40", 'cases = "40"', "cases = '40' must be a whole number"),
        ("cases = 40", "cases = nan", "cases = nan must be a whole number"),
        ("seed = 5", "seed = -1", "seed = -1 must be a whole number from 0"),
        ("seed = 5", "seed = 1.5", "seed = 1.5 must be a whole number"),
        ("seed = 5", f"seed = {2**63}", "seed = 9223372036854775808 must be a whole number"),
        ("seed = 5", "sede = 5", "sede is not a known key; did you mean seed?"),
        ("seed = 5", "colour = 5", "a plan takes title, seed, cases, subsets, tests, case"),
        ("title = ", "title = 3 #", "title = 3 must be a text"),
        ("[10, 20]", "[20, 10]", "subsets = [20, 10] must increase"),
        ("[10, 20]", "[10, 10]", "subsets = [10, 10] must increase"),
        ("[10, 20]", "[10, 41]", "subsets = [10, 41] must be at most cases = 40"),
        ("[10, 20]", "[0, 20]", "subsets = [0, 20] must be an array of whole numbers above 0"),
        ("[10, 20]", "[10, 20.0]", "subsets = [10, 20.0] must be an array of whole"),
        ("[10, 20]", "20", "subsets = 20 must be an array"),
        ("tests = 5", "tests = 11", "tests = 11 must be at most 10, the size of the smallest"),
        ("tests = 5", "tests = -1", "tests = -1 must be a whole number from 0"),
        ("tests = 5", "tests = 5.0", "tests = 5.0 must be a whole number"),
        ("[case.vessel]", "[vessel]", "vessel is not a known key"),
        (PLAN[PLAN.index("[case.vessel]") :], "", "case is missing, must be the tables of a case"),
        (PLAN[PLAN.index("[case.vessel]") :], "case = 3", "case = 3 must be the tables of a case"),
        (
            PLAN[PLAN.index("[case.vessel]") :],
            "case = {min = 1, max = 2}",
            "[case] cannot be a range, must be the tables of a case",
        ),
        ("min = 2, max = 4", "min = 4, max = 2", "[case] vessel.diameter: min = 4 must be below"),
        ("min = 2, max = 4", "min = 2, max = 2.0", "min = 2 must be below max = 2"),
        ("min = 2, max = 4", "min = 2, max = nan", "vessel.diameter: max = nan must be a finite"),
        ("min = 2, max = 4", "min = -inf, max = 4", "vessel.diameter: min = -inf must be a finite"),
        ("min = 2, max = 4", "min = false, max = 4", "min = false must be a finite number"),
        ("min = 2, max = 4", 'min = "2", max = 4', "min = '2' must be a finite number"),
        ("min = 2, max = 4", f"min = 2, max = 1{'0' * 400}", "must be a finite number"),
        ("min = 2, max = 4", "min = 2", "vessel.diameter = {'min': 2} must have min and max"),
        ("min = 2, max = 4", "min = 2, max = 4, n = 3", "min and max and no other key"),
        ("min = 2, max = 4", "low = 2, high = 4", "vessel.diameter = {'low': 2, 'high': 4} must"),
        ("min = 2, max = 4", "min = 2, max = 60", "vessel.diameter = 60.0 must be a number of mm"),
        ("min = 2, max = 4", "min = -2, max = 4", "vessel.diameter = -2.0 must be a number of mm"),
        ("min = 0.0, max = 1.0", "min = 0, max = 1.1", "site.eta = 1.1 must be a number from 0"),
        ("min = 5.0, max = 30.0", "min = 5, max = 1e9", "vessel.P1 = [0.0, 1000000000.0, 25] must"),
        ("min = 5.0, max = 30.0", "min = 30, max = 5", "vessel.P1[1]: min = 30 must be below"),
        ("25]", "25, {min = 1, max = 2}]", "vessel.P1 = [0.0, 5.0, 25, 1.0] must be three numbers"),
        ("25]", "[{min = 1, max = 2}]]", "vessel.P1 = [0.0, 5.0, [1.0]] must be three numbers"),
        (
            "wires = 12",
            "wires = {min = 12, max = 24}",
            "device.wires cannot be a range, must be an",
        ),
        ("segments = 24", "segments = {min = 2, max = 4}", "device.segments cannot be a range"),
        (
            "wires = 12",
            "literal_angle = {min = 0, max = 1}",
            "device.literal_angle cannot be a range, must be true or false",
        ),
        ("wires = 12", "name = {min = 0, max = 1}", "device.name cannot be a range, must be one"),
        (
            "[case.device]\nwires = 12\nsegments = 24",
            "[case.device]\nmin = 1",
            "device cannot be a",
        ),
        ("diameter = {", "diamter = {", "vessel.diamter is not a known key; did you mean vessel.d"),
        ("[case.site]", "[case.sight]", "sight is not a known key; did you mean site"),
        ("eta = {", "#", "site.eta is missing, must be a number from 0 to 1"),
        ("diameter = 7.0", "diameter = -7.0", "[case] aneurysm.diameter = -7.0 must be a number"),
    ],
)
def test_what_is_wrong_is_named_with_what_is_allowed(old: str, new: str, says: str) -> None:
    assert old in PLAN
    assert says in complaint(PLAN.replace(old, new, 1))


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "is empty, must have cases and the tables of"),
        (b" \n", "is empty"),
        (b"\xff\xfe\x00", "is not text in UTF-8, must be a plan file in TOML"),
        (b"cases = ", "is not valid TOML"),
        (b"a = " + b"[" * 5000 + b"]" * 5000, "is not a plan file: its values are nested"),
        (b"# only a comment", "cases is missing"),
        (b"# " + b"x" * 1_100_000, "is longer than"),
    ],
)
def test_files_that_are_no_plan(tmp_path: Path, content: bytes, says: str) -> None:
    path = tmp_path / "plan.toml"
    path.write_bytes(content)
    with pytest.raises(InputError, match=says) as caught:
        Plan.from_toml(path)
    assert str(caught.value).startswith(f"{path}: ") and "\n" not in str(caught.value)
    with pytest.raises(InputError, match="there is no such plan file"):
        Plan.from_toml(tmp_path / "none.toml")
    with pytest.raises(InputError, match="is a folder, must be a plan file"):
        Plan.from_toml(tmp_path)


numbers = st.floats() | st.integers()
ranges = st.fixed_dictionaries({"min": numbers, "max": numbers})
values = numbers | st.booleans() | st.text(max_size=4) | ranges | st.lists(numbers | ranges)
PLACES = [
    *("vessel", "vessel.P0", "vessel.P1", "vessel.diameter", "aneurysm", "aneurysm.protrusion"),
    *(
        "aneurysm.centre",
        "device.wires",
        "device.radius",
        "device.name",
        "site.eta",
        "wall.friction",
    ),
]


@settings(max_examples=200, deadline=None)
@given(place=st.sampled_from(PLACES), value=values)
def test_whatever_ranges_is_read_within_its_limits_or_refused(place: str, value: Any) -> None:
    tables: dict[str, Any] = {
        "vessel": {"P1": [0.0, 15.0, 25.0], "diameter": 3.0},
        "aneurysm": {"diameter": 7.0, "protrusion": 0.5},
        "device": {"wires": 12, "segments": 24},
        "site": {"eta": 0.5},
        "wall": {},
    }
    table, _, key = place.partition(".")
    if key:
        tables[table][key] = value
    else:
        tables[table] = value
    try:
        plan = Plan.from_text(f"cases = 1\ncase = {inline(tables)}\n")
    except InputError as error:
        assert "\n" not in str(error)
        return
    for parameter in plan.ranges:
        assert parameter.low < parameter.high
    for end in ("low", "high"):
        try:
            plan.case([getattr(parameter, end) for parameter in plan.ranges])
        except InputError as error:  # only because its parts do not go together
            assert "\n" not in str(error) and "must be a number" not in str(error)


def inline(value: Any) -> str:
    """``value`` as TOML on one line."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {inline(inner)}" for key, inner in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(inline, value)) + "]"
    return toml_text({"x": value}).partition(" = ")[2].strip()
