"""Cases in vessels from surfaces: read, refused, put at a site, simulated, written."""

from collections.abc import Callable
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import braidcast
from braidcast.case import Case
from braidcast.deployment.outcome import end_nodes_in_sac, outcome
from braidcast.errors import InputError
from braidcast.vessels import surface_vessel
from braidcast.vessels.surface import vessel_surface, write_stl

EXAMPLES = Path(__file__).parents[1] / "examples" / "vessels"


@pytest.fixture(scope="module")
def parametric() -> Case:
    """The parametric case whose wall the others have as a surface."""
    return Case.from_dict(
        {
            "vessel": {"P1": [0.0, 15.0, 20.0], "P2": [0.0, 0.0, 40.0], "diameter": 3.0},
            "aneurysm": {"diameter": 6.0, "protrusion": 0.5},
            "device": {"wires": 12, "segments": 20, "length": 8.0},
            "site": {"eta": 0.5},
        }
    )


@pytest.fixture(scope="module")
def surface(parametric: Case, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("vessel") / "vessel.stl"
    write_stl(path, *vessel_surface(parametric.vessel_geometry))
    curve = parametric.bezier
    places = curve.at_arc_length(np.linspace(0.0, curve.length, 120))
    rows = np.column_stack([places, np.full(len(places), parametric.vessel_radius)])
    np.savetxt(path.with_suffix(".csv"), rows, "%.9f", ",", header="x,y,z,radius", comments="")
    return path


@pytest.fixture
def tables(parametric: Case, surface: Path) -> dict[str, Any]:
    return {
        "title": "By its surface",
        "vessel": {"surface": str(surface), "centreline": str(surface.with_suffix(".csv"))},
        "aneurysm": {"diameter": 6.0, "centre": list(map(float, parametric.aneurysm_centre))},
        "device": {"wires": 12, "segments": 20, "length": 8.0},
        "site": {"eta": 0.5},
    }


def spoilt(tables: dict[str, Any], field: str, value: Any) -> dict[str, Any]:
    tables, (table, _, key) = deepcopy(tables), field.partition(".")
    if not key:
        return tables | {table: value}
    tables[table].pop(key, None)
    if value is not ...:
        tables[table][key] = value
    return tables


@pytest.mark.slow
def test_its_own_surface_gives_the_same_deployment(
    parametric: Case, tables: dict[str, Any]
) -> None:
    tables["device"] = {}
    case = Case.from_dict(tables)
    parametric = Case.from_dict(parametric.to_dict() | {"device": {}})
    assert case.start_arc_length == pytest.approx(parametric.start_arc_length, abs=2e-3)
    ours, theirs = braidcast.simulate(case), braidcast.simulate(parametric)
    assert ours.converged and theirs.converged
    assert ours.outcome == theirs.outcome and ours.end_nodes_in_sac == theirs.end_nodes_in_sac
    apart = np.linalg.norm(ours.positions - theirs.positions, axis=1)
    assert apart.mean() < 5e-3 and apart.max() < 30e-3
    # In the depth of the neck the parametric distance is a lower bound.
    assert (ours.wire_distance > theirs.wire_distance - 0.02).all()
    at_wall = theirs.wire_distance < 0.02
    assert at_wall.mean() > 0.3
    apart = np.abs(ours.wire_distance - theirs.wire_distance)[at_wall]
    assert np.quantile(apart, 0.99) < 2e-3


def test_distance_is_that_of_the_parametric_vessel(
    parametric: Case, tables: dict[str, Any]
) -> None:
    vessel, exact = Case.from_dict(tables).surface_geometry, parametric.vessel_geometry
    rng = np.random.default_rng(3)
    wall = vessel.surface.vertices
    wall = wall[(wall[:, 2] > 0.5) & (wall[:, 2] < 39.5)]
    points = wall[rng.integers(0, len(wall), 2000)] + rng.uniform(-0.06, 0.06, (2000, 3))
    distance, gradient, hessian = vessel.evaluate(points)
    expected, slope, _ = exact.evaluate(points)
    # Off the wall the parametric distance is no distance within the fillet, but a bound of it.
    away = np.abs(exact.tube.distance(points) + exact.aneurysm.depth(points)) > 0.3
    assert away.mean() > 0.5
    np.testing.assert_allclose(distance[away], expected[away], atol=4e-3)
    near = np.abs(vessel.distance(wall))
    assert near.max() < 1e-9
    np.testing.assert_allclose(vessel.grid.distance(wall), 0.0, atol=0.01)
    cosine = np.einsum("ni,ni->n", gradient, slope)[away] / np.linalg.norm(gradient[away], axis=1)
    assert np.degrees(np.arccos(np.clip(cosine, -1, 1))).max() < 3.0
    assert np.isfinite(hessian).all()
    np.testing.assert_allclose(vessel.distance(points), distance, atol=0.02)


def test_the_centreline_is_found(parametric: Case, tables: dict[str, Any]) -> None:
    case = Case.from_dict(spoilt(tables, "vessel.centreline", ...))
    curve, line = parametric.bezier, case.centreline
    assert case.surface_geometry.centreline_found
    places = curve.at_arc_length(np.linspace(0.5, curve.length - 0.5, 60))
    # The openings are equally wide: which is the first is not said.
    away, along = line.closest(places)
    assert away.mean() < 0.02
    np.testing.assert_allclose(line.lumen_radius(along), 1.5, rtol=0.02)


@pytest.mark.parametrize(
    ("site", "start"),
    [
        ({"proximal_end_mm": 4.0}, 4.0),
        ({"distal_end_mm": 34.0}, None),
        ({"eta": 0.0}, 0.0),
        ({"point": [0.0, 7.5, 20.0]}, None),
    ],
)
def test_sites(parametric: Case, tables: dict[str, Any], site: dict, start: float | None) -> None:
    """The same in a vessel from a surface and in a parametric one."""
    tables["site"] = site
    case = Case.from_dict(tables)
    same = Case.from_dict(parametric.to_dict() | {"site": site})
    assert case.start_arc_length == pytest.approx(same.start_arc_length, abs=3e-3)
    if start is not None:
        assert case.start_arc_length == pytest.approx(start)
    elif "point" in site:
        middle = case.start_arc_length + 0.5 * case.crimped_length
        assert middle == pytest.approx(0.5 * case.centreline.length, abs=3e-3)
    else:
        assert case.start_arc_length + case.crimped_length == pytest.approx(34.0)
    assert case.eta == pytest.approx(case.start_arc_length / case.spare_length)


def test_a_point_far_from_the_vessel_is_no_site(tables: dict[str, Any]) -> None:
    for given in (tables, {"vessel": {"P1": [0.0, 15.0, 20.0], "diameter": 3.0}}):
        with pytest.raises(InputError, match=r"^site\.point = .* must be at most .* mm from it$"):
            Case.from_dict(given | {"site": {"point": [40.0, 7.5, 20.0]}})


@pytest.mark.parametrize(
    ("field", "value", "says"),
    [
        ("vessel.surface", "nowhere.stl", "vessel.surface = nowhere.stl cannot be read"),
        ("vessel.surface", 3, "vessel.surface = 3 must be the name of an STL"),
        ("vessel.centreline", "nowhere.csv", "vessel.centreline = nowhere.csv cannot be read"),
        ("vessel.units", "km", "vessel.units = 'km' must be one of"),
        ("vessel.units", "m", "vessel.surface = "),
        ("vessel.P1", [0.0, 1.0, 2.0], "vessel.P1 is not a known key; [vessel] takes surface"),
        ("vessel.unit", "mm", "vessel.unit is not a known key; did you mean vessel.units"),
        ("vessel.distance_spacing", 0.001, "vessel.distance_spacing = 0.001 must be a number of"),
        ("vessel.ends", [[0.0, 0.0, 0.0]], "vessel.ends = [[0.0, 0.0, 0.0]] must be two points"),
        ("vessel.ends", [[0.0, 0.0, 0.0], [90.0, 0.0, 0.0]], "vessel."),
        ("aneurysm.protrusion", 0.5, "both given, must be exactly one"),
        ("aneurysm.centre", [0.0, 50.0, 20.0], "aneurysm.centre = [0.0, 50.0, 20.0] is "),
        ("aneurysm", {"neck": [0.0, 7.5, 20.0], "neck_radius": 2.0}, "must be from 0.75"),
        ("aneurysm", {"neck": [0.0, 70.0, 20.0], "neck_radius": 2.0}, "aneurysm.neck = "),
        ("aneurysm", {"diameter": 80.0, "centre": [0.0, 9.0, 20.0]}, "must be the sac alone"),
        ("aneurysm.neck_fillet", 0.9, "must be left out in one from a surface"),
        ("aneurysm", {"neck": [1.5, 2.7, 4.0], "neck_radius": 2.0}, "must be where the wall"),
        ("device.length", 40.0, "device.length = 40 mm gives a stent of"),
        ("device.radius", 1.2, "in place"),
        ("site.crimped_radius", 1.48, "must be below 1.471 mm, or the stent and a wire do not fit"),
        ("site.point", [0.0, 7.5, 20.0], "site.eta and site.point: 2 given, must be exactly one"),
    ],
)
def test_what_is_wrong_is_named(tables: dict[str, Any], field: str, value: Any, says: str) -> None:
    with pytest.raises(InputError) as caught:
        Case.from_dict(spoilt(tables, field, value))
    text = str(caught.value)
    assert "\n" not in text and (says in text or says == "in place"), text


@pytest.mark.parametrize(
    ("site", "says"),
    [
        ({"proximal_end_mm": 40.0}, "site.proximal_end_mm = 40.0 mm must be from 0 to"),
        ({"distal_end_mm": 3.0}, "site.distal_end_mm = 3.0 mm must be from"),
        ({"point": [0.0, 0.0, 0.0]}, "site.point = [0.0, 0.0, 0.0], at "),
        ({}, "site.eta is missing"),
    ],
)
def test_sites_beyond_the_ends_are_refused(
    tables: dict[str, Any], site: dict[str, Any], says: str
) -> None:
    tables["site"] = site
    with pytest.raises(InputError) as caught:
        Case.from_dict(tables)
    assert says in str(caught.value), caught.value


def test_a_region_is_no_sac_of_a_parametric_vessel(parametric: Case) -> None:
    tables = parametric.to_dict() | {"aneurysm": {"neck": [0.0, 8.0, 20.0], "neck_radius": 2.0}}
    with pytest.raises(InputError, match="aneurysm.neck and aneurysm.surface are for a vessel"):
        Case.from_dict(tables)


def test_sacs_by_neck_by_surface_and_by_sphere_agree(
    parametric: Case, tables: dict[str, Any], tmp_path: Path
) -> None:
    """The same nodes deep in the sac and beside it, asked of all three."""
    import manifold3d

    centre = parametric.aneurysm_centre
    ball = manifold3d.Manifold.sphere(3.0, 64).translate(centre.tolist()).to_mesh()
    write_stl(tmp_path / "sac.stl", ball.vert_properties[:, :3], ball.tri_verts)
    neck = parametric.bezier.at_arc_length(0.5 * parametric.bezier.length)[0] + [0.0, 1.5, 0.0]
    regions = (
        tables["aneurysm"],
        {"surface": str(tmp_path / "sac.stl")},
        {"neck": neck.tolist(), "neck_radius": 2.6},
    )
    points = centre + np.array([[0, 0, 0], [0, -1, 0], [0, 0, 1.5], [0, -3.5, 0], [0, -4, 8]])
    for region in regions:
        sac = Case.from_dict(tables | {"aneurysm": region}).vessel_geometry.aneurysm
        assert (np.sign(sac.depth(points)) == [1, 1, 1, -1, -1]).all(), region
        assert np.linalg.norm(sac.centre - centre) < 3.5
        assert (np.asarray(sac.depth(points)[:3]) > 0.3).all()


def test_without_a_sac_success_is_not_assessed(tables: dict[str, Any]) -> None:
    del tables["aneurysm"]
    case = Case.from_dict(tables)
    nodes = np.zeros((case.braid.node_count, 3))
    found = outcome(case, nodes, np.zeros(len(nodes)))
    assert (found.label, found.clinical_label) == ("not assessed", "not assessed")
    assert len(end_nodes_in_sac(case, nodes)) == 0


def test_a_surrogate_says_that_it_knows_no_such_vessel(tables: dict[str, Any]) -> None:
    model = braidcast.load_model()
    tables["device"] = {}
    tables["vessel"]["surface"] = str(EXAMPLES / "siphon.stl")
    with pytest.raises(InputError, match="a surrogate knows no other"):
        model.predict(Case.from_toml(EXAMPLES / "siphon.toml"))


def test_what_was_made_of_a_surface_is_kept(
    tables: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    before = Case.from_dict(tables).surface_geometry
    path = Path(tables["vessel"]["surface"])
    kept = list(path.parent.glob("vessel.distance-*.npz"))
    assert kept and max(file.stat().st_size for file in kept) < 40e6
    monkeypatch.setattr(surface_vessel, "_loaded", {})
    monkeypatch.setattr(surface_vessel, "_made", lambda *_: pytest.fail("made again"))
    after = Case.from_dict(tables).surface_geometry
    points = before.centreline.at_arc_length(np.linspace(0.0, before.centreline.length, 50))
    points[:, 0] += 1.4
    np.testing.assert_array_equal(before.evaluate(points)[0], after.evaluate(points)[0])
    np.testing.assert_array_equal(before.distance(points), after.distance(points))
    for ours, theirs in zip(
        before.centreline.closest(points), after.centreline.closest(points), strict=True
    ):
        np.testing.assert_array_equal(ours, theirs)
    assert before.remarks == after.remarks


def test_a_damaged_file_of_it_is_made_anew(
    tables: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = Path(tables["vessel"]["surface"])
    Case.from_dict(tables)
    (kept,) = [
        file
        for file in path.parent.glob("vessel.distance-*.npz")
        if surface_vessel._key(
            surface_vessel.SurfaceSource(str(path), centreline=tables["vessel"]["centreline"])
        )
        in file.name
    ]
    whole = kept.read_bytes()
    kept.write_bytes(whole[: len(whole) // 2])
    monkeypatch.setattr(surface_vessel, "_loaded", {})
    Case.from_dict(tables)
    assert len(kept.read_bytes()) == len(whole)


def test_files_are_looked_for_beside_the_case_file(
    tables: dict[str, Any], surface: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tables["vessel"] = {"surface": surface.name, "centreline": f"{surface.stem}.csv"}
    case_file = surface.parent / "case.toml"
    case_file.write_text(
        'title = ""\n[vessel]\nsurface = "vessel.stl"\ncentreline = "vessel.csv"\n'
        "[device]\nwires = 12\nsegments = 20\nlength = 8.0\n[site]\neta = 0.5\n"
    )
    monkeypatch.chdir(tmp_path)
    case = Case.from_toml(case_file)
    assert Path(case.vessel.surface) == surface
    again = tmp_path / "again.toml"
    again.write_text(case.to_toml())
    assert Case.from_toml(again) == case


@pytest.mark.slow
def test_the_commands(
    tables: dict[str, Any], run: Callable[..., int], tmp_path: Path, capsys: Any
) -> None:
    case = Case.from_dict(tables)
    (tmp_path / "case.toml").write_text(case.to_toml())
    assert run("simulate", "case.toml", "-o", "out") == 0
    assert {"deployed.vtp", "vessel.stl", "summary.json"} <= {
        path.name for path in (tmp_path / "out").iterdir()
    }
    assert run("vessel", "case.toml", "-o", "seen") == 0
    names = {path.name for path in (tmp_path / "seen").iterdir()}
    assert names >= {"vessel.json", "centreline.vtp", "repaired.stl", "vessel.png"}
    capsys.readouterr()
    assert run("vessel", tables["vessel"]["surface"], "-o", "seen") == 0
    out = capsys.readouterr().out
    for part in ("open end", "centreline", "lumen radius", "tightest bend", "signed distance"):
        assert part in out
    assert run("vessel", "case.toml", "--units", "m") == 2
    assert "--units cannot be given with a case file" in capsys.readouterr().err
    assert run("vessel", "nowhere.stl") == 2
    assert "surface = nowhere.stl cannot be read" in capsys.readouterr().err
    assert run("predict", "case.toml") == 2
    assert "device.wires" in capsys.readouterr().err
