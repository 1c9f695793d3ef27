"""The case a planner is opened with, above all one whose vessel is a surface."""

import json
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from braidcast.case import Case
from braidcast.errors import InputError
from braidcast.planner.contents import Contents
from braidcast.planner.opened_case import DEFAULT, OpenedCase
from braidcast.surrogate.model_file import load_model
from braidcast.vessels.surface import vessel_surface, write_stl

TUBE = {
    "vessel": {"P1": [0.0, 8.0, 15.0], "P2": [0.0, 0.0, 30.0], "diameter": 3.0},
    "device": {"wires": 12, "segments": 20, "length": 8.0},
    "site": {"eta": 0.5},
}

CASE = """\
[vessel]
surface = "vessel.stl"
centreline = "vessel.csv"
[device]
wires = 12
segments = 20
length = 8.0
[site]
proximal_end_mm = 2.0
"""


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> OpenedCase:
    folder = tmp_path_factory.mktemp("vessel")
    tube = Case.from_dict(TUBE)
    write_stl(folder / "vessel.stl", *vessel_surface(tube.vessel_geometry))
    places = tube.bezier.at_arc_length(np.linspace(0.0, tube.bezier.length, 120))
    rows = np.column_stack([places, np.full(len(places), 1.5)])
    np.savetxt(folder / "vessel.csv", rows, "%.9f", ",", header="x,y,z,radius", comments="")
    (folder / "case.toml").write_text(CASE)
    return OpenedCase.from_toml(folder / "case.toml")


@pytest.fixture
def tables(opened: OpenedCase) -> dict[str, Any]:
    return deepcopy(json.loads(json.dumps(opened.tables)))


def test_the_page_is_told_no_folder(opened: OpenedCase) -> None:
    assert opened.tables["vessel"]["surface"] == "vessel.stl"
    assert opened.tables["vessel"]["centreline"] == "vessel.csv"
    start = Contents(opened, load_model).start.plain.decode()
    assert str(Path(opened.case.vessel.surface).parent) not in start


def test_the_site_may_be_another(opened: OpenedCase, tables: dict[str, Any]) -> None:
    before = sorted(Path(opened.case.vessel.surface).parent.iterdir())
    case = opened.posted({**tables, "site": {"eta": 0.2}, "title": "moved"})
    assert case.eta == 0.2 and case.vessel == opened.case.vessel
    assert sorted(Path(opened.case.vessel.surface).parent.iterdir()) == before


@pytest.mark.parametrize(
    ("table", "change"),
    [
        ("vessel", {"surface": "/etc/passwd"}),
        ("vessel", {"surface": "../vessel.stl"}),
        ("vessel", {"centreline": "other.csv"}),
        ("vessel", {"distance_spacing": 0.05}),
        ("device", {"wire_radius": 0.02}),
        ("aneurysm", {"surface": "sac.stl"}),
    ],
)
def test_the_vessel_may_not(
    opened: OpenedCase, tables: dict[str, Any], table: str, change: dict[str, Any]
) -> None:
    tables[table] = {**tables.get(table, {}), **change}
    with pytest.raises(InputError, match=f"^{table} must be that of the case"):
        opened.posted(tables)


def test_nor_a_tube_in_its_place(opened: OpenedCase) -> None:
    with pytest.raises(InputError, match="^vessel must be that"):
        opened.posted(DEFAULT)


def test_its_surface_is_handed_out_without_a_model(opened: OpenedCase) -> None:
    contents = Contents(opened, lambda: pytest.fail("no model is needed"))
    assert contents.model is None
    start = json.loads(contents.start.plain)
    assert start["modelName"] is None and "switched off" in start["withoutModel"]
    surface = start["surface"]
    vertices = np.array(surface["vertices"]).reshape(-1, 3)
    triangles = np.array(surface["triangles"]).reshape(-1, 3)
    assert triangles.max() < len(vertices) and triangles.min() == 0
    line, along = np.array(surface["centreline"]), np.array(surface["arcLength"])
    assert line.shape == (len(along), 3) and len(surface["lumenRadius"]) == len(along)
    assert surface["startArcLength"] == 2.0
    assert surface["length"] - surface["crimpedLength"] - 0.5 == pytest.approx(
        surface["spareLength"]
    )
    np.testing.assert_allclose(surface["lumenRadius"], 1.5, atol=0.01)


def test_a_device_that_the_model_does_not_know(tmp_path: Path) -> None:
    path = tmp_path / "case.toml"
    path.write_text(
        "[vessel]\nP1 = [0.0, 15.0, 25.0]\ndiameter = 3.0\n"
        "[aneurysm]\ndiameter = 7.0\nprotrusion = 0.5\n"
        "[device]\nwires = 24\n[site]\nproximal_end_mm = 2.0\n"
    )
    opened = OpenedCase.from_toml(path)
    assert opened.tables["site"]["eta"] == pytest.approx(opened.case.eta)
    contents = Contents(opened, load_model)
    assert contents.model is None and "device.wires = 24" in (contents.without_model or "")
