"""Vessels from files: what is refused, in which words, and what is kept on the disk."""

import os
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from braidcast.errors import InputError
from braidcast.vessels import surface_vessel
from braidcast.vessels.surface import write_stl
from braidcast.vessels.surface_vessel import SurfaceSource, load_vessel


@pytest.fixture(autouse=True)
def scratch(tmp_path, monkeypatch):
    monkeypatch.setenv("BRAIDCAST_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(surface_vessel, "_loaded", {})
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def straight(tube):
    """The name of a tube's file, of radius 1.5 mm and from z = 0 to 10 mm."""
    write_stl("a tube, ø 3.stl", *tube(length=10.0, facets=24, rings=11))
    return "a tube, ø 3.stl"


def source(name, **values):
    return SurfaceSource(name, spacing=0.2, **values)


def line(radius=1.5, stop=10.0):
    places = np.linspace(0.0, stop, 21)
    rows = np.column_stack([0 * places, 0 * places, places, np.full(21, radius)])
    np.savetxt("line.csv", rows, delimiter=",", header="x,y,z,radius", comments="")
    return "line.csv"


def refused(given, start, match=None):
    with pytest.raises(InputError, match=match) as raised:
        load_vessel(given)
    assert str(raised.value).startswith(start)


@pytest.mark.parametrize("field", ["surface", "centreline"])
def test_what_never_ends_is_not_read(straight, field):
    names = {"surface": "pipe.stl", "centreline": "pipe.csv"}
    os.mkfifo(names[field])
    given = {"surface": straight, field: names[field]}
    refused(SurfaceSource(**given), f"{field} = {names[field]} is no file")


def test_a_huge_file_is_not_read(straight):
    with open("huge.stl", "wb") as file:
        file.truncate(2_000_000_000)
    refused(source("huge.stl"), "surface = huge.stl has 2.0 GB, where at most 1 GB")


@pytest.mark.parametrize("x", [np.nan, np.inf, 1e300])
def test_ends_are_numbers_of_mm(straight, x):
    with pytest.raises(InputError, match=r"^ends = .* must be two points .* -1000 to 1000$"):
        source(straight, ends=((0.0, 0.0, 0.0), (x, 0.0, 10.0)))


def test_ends_outside_are_named(straight):
    given = source(straight, ends=((0.0, 0.0, 0.0), (9.0, 0.0, 9.0)))
    refused(given, "ends = (0, 0, 0) mm and (9, 0, 9) mm: the second must lie in the lumen")


def test_one_opening_needs_ends(tube, capped):
    vertices, triangles = capped(*tube(length=10.0))
    vertices[-1, 2] += 3.0
    write_stl("blind.stl", vertices, triangles)
    refused(source("blind.stl"), "surface = blind.stl has 1 open end", "must say between which")


def test_what_the_grid_refuses_names_the_file(straight):
    given = SurfaceSource(straight, centreline=line(), spacing=0.005)
    refused(given, f"surface = {straight} is 5 x 5 x 22 mm", "distance_spacing of 0.005 mm")


@pytest.mark.parametrize("radius", [15.0, 0.15])
def test_radii_of_another_unit_are_refused(straight, radius):
    refused(source(straight, centreline=line(radius)), "centreline = line.csv has radii of")


@pytest.mark.parametrize("factor", [0.4, 2.0])
def test_diameters_are_no_radii(straight, factor):
    refused(source(straight, centreline=line(1.5 * factor)), "centreline = line.csv has radii of")


def test_radii_of_one_place_are_those_of_the_wall_there(straight):
    places = np.linspace(0.0, 10.0, 21)
    rows = np.column_stack([0 * places, 0 * places, places, np.linspace(0.4, 4.0, 21)])
    np.savetxt("line.csv", rows, delimiter=",", header="x,y,z,radius", comments="")
    refused(source(straight, centreline="line.csv"), "centreline = line.csv has radii of 0.4 to 4")


def test_a_centreline_off_the_middle_is_moved_there(straight):
    places = np.linspace(0.0, 10.0, 21)
    rows = np.column_stack([0 * places + 0.5, 0 * places, places])
    np.savetxt("line.csv", rows, delimiter=",", header="x,y,z", comments="")
    vessel = load_vessel(source(straight, centreline="line.csv"))
    along = np.linspace(0.0, vessel.centreline.length, 30)
    assert np.abs(vessel.centreline.at_arc_length(along)[:, :2]).max() < 0.02
    assert vessel.centreline.lumen_radius(along) == pytest.approx(1.5, abs=0.03)
    assert any("up to 0.5" in remark and "moved there" in remark for remark in vessel.remarks)


def test_a_centreline_ends_where_the_vessel_does(straight):
    vessel = load_vessel(source(straight, centreline=line(stop=14.0)))
    assert vessel.centreline.length == pytest.approx(10.0, abs=0.25)
    assert any("beyond the open ends and was cut" in remark for remark in vessel.remarks)


def test_a_centreline_that_leaves_the_lumen_is_refused(tube):
    write_stl("ring.stl", *tube(length=10.0))
    np.savetxt("line.csv", np.linspace([0, 0, 0], [9, 0, 10], 21), delimiter=",")
    refused(source("ring.stl", centreline="line.csv"), "centreline = line.csv lies within the surf")


def test_what_is_kept_is_the_same_and_damage_is_made_anew(straight, monkeypatch):
    given, points = source(straight, centreline=line()), [[0.0, 0.3, 4.0], [1.0, 1.0, 7.0]]
    made = load_vessel(given)
    (kept,) = [name for name in os.listdir() if name.endswith(".npz")]
    whole = Path(kept).read_bytes()
    for content in (whole, whole[: len(whole) // 2], b"", whole[:2000] + b"\0" * 99 + whole[2099:]):
        Path(kept).write_bytes(content)
        surface_vessel._loaded.clear()
        again = load_vessel(given)
        assert_array_equal(again.grid.distance(points), made.grid.distance(points))
        assert_array_equal(
            again.centreline.lumen_radius([1, 9]), made.centreline.lumen_radius([1, 9])
        )
        assert [len(o.rim) for o in again.surface.openings] == [24, 24]
