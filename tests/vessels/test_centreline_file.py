"""Centrelines read back from files as VMTK, 3D Slicer and tables hold them."""

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from braidcast.errors import InputError
from braidcast.vessels.centreline_branches import way_through
from braidcast.vessels.centreline_chain import joined_chain
from braidcast.vessels.centreline_file import flipped_lps_ras, read_centreline

S = np.linspace(0.0, 30.0, 61)
MAIN = np.stack([0.0 * S, 4.0 * np.sin(S / 10.0), S], axis=1)
SIDE = MAIN[30] + np.stack([0.5, 0.2, 0.3] * np.arange(25)[:, None], axis=0)
RADII = 2.0 - 0.01 * S


def write_lines(path, lines, name="MaximumInscribedSphereRadius"):
    pyvista = pytest.importorskip("pyvista")
    cells, start = [], 0
    for points, _ in lines:
        cells += [len(points), *range(start, start + len(points))]
        start += len(points)
    mesh = pyvista.PolyData(np.concatenate([points for points, _ in lines]), lines=cells)
    mesh.point_data[name] = np.concatenate([radii for _, radii in lines])
    mesh.save(path)


def write_markups(path, points, **more):
    controls = [{"position": list(p), "positionStatus": "defined"} for p in points]
    markup = {"type": "Curve", "coordinateSystem": "LPS", "controlPoints": controls, **more}
    path.write_text(json.dumps({"markups": [markup]}))


@pytest.mark.parametrize(
    ("ending", "name"), [(".vtp", "MaximumInscribedSphereRadius"), (".vtk", "Radius")]
)
def test_vtk_line(tmp_path, ending, name):
    path = tmp_path / f"line{ending}"
    write_lines(path, [(MAIN, RADII)], name)
    found = read_centreline(path)
    assert_allclose(found.points, MAIN, rtol=0, atol=1e-5)
    assert_allclose(found.radii, RADII, rtol=1e-5)


def test_markups_of_3d_slicer(tmp_path):
    path = tmp_path / "line.mrk.json"
    write_markups(path, MAIN)
    found = read_centreline(path)
    assert_array_equal(found.points, MAIN)
    assert found.radii is None
    measurements = [{"name": "Radius", "controlPointValues": RADII.tolist()}]
    write_markups(path, MAIN, measurements=measurements)
    assert_array_equal(read_centreline(path).radii, RADII)


def test_markups_without_a_place_are_passed_over(tmp_path):
    path = tmp_path / "line.json"
    write_markups(path, MAIN)
    content = json.loads(path.read_text())
    content["markups"][0]["controlPoints"][7]["positionStatus"] = "undefined"
    path.write_text(json.dumps(content))
    assert_array_equal(read_centreline(path).points, np.delete(MAIN, 7, axis=0))


@pytest.mark.parametrize("between", [",", ";", " ", "\t", ", "])
@pytest.mark.parametrize(
    "header", ["x y z radius", "X Y Z Radius", "x y z MaximumInscribedSphereRadius"]
)
def test_table(tmp_path, between, header):
    path = tmp_path / "line.csv"
    rows = [between.join(map(repr, map(float, row))) for row in np.column_stack([MAIN, RADII])]
    path.write_text("\n".join([header.replace(" ", between), *rows]) + "\n")
    found = read_centreline(path)
    assert_array_equal(found.points, MAIN)
    assert_array_equal(found.radii, RADII)
    bare = [between.join(map(repr, map(float, row))) for row in MAIN]
    path.write_text("\n".join(bare))
    found = read_centreline(path)
    assert_array_equal(found.points, MAIN)
    assert found.radii is None


@pytest.mark.parametrize(
    ("header", "order"),
    [
        ("X [mm];Y [mm];Z [mm];Radius (mm)", [0, 1, 2, 3]),
        ('"Radius";"Points:0";"Points:1";"Points:2"', [3, 0, 1, 2]),
        ("Points_0;Points_1;Points_2;Radius", [0, 1, 2, 3]),
    ],
)
@pytest.mark.parametrize("comma", [False, True])
def test_table_as_other_programs_write_it(tmp_path, header, order, comma):
    path = tmp_path / "line.csv"
    table = np.column_stack([MAIN, RADII])[:, order].tolist()
    text = "\n".join([header, *(";".join(map(repr, row)) for row in table)])
    path.write_text(text.replace(".", ",") if comma else text)
    found = read_centreline(path)
    assert_array_equal(found.points, MAIN)
    assert_array_equal(found.radii, RADII)


@pytest.mark.parametrize(("between", "header"), [(";", "x;y;z\n"), ("\t", "")])
def test_decimal_commas(tmp_path, between, header):
    path = tmp_path / "line.csv"
    rows = [between.join(f"{x:.3f}".replace(".", ",") for x in row) for row in MAIN]
    path.write_text(header + "\n".join(rows))
    assert_array_equal(read_centreline(path).points, MAIN.round(3))


def test_table_with_its_columns_in_another_order(tmp_path):
    path = tmp_path / "line.csv"
    rows = [f"{i},{z},{y},{x}" for i, (x, y, z) in enumerate(MAIN.tolist())]
    path.write_text("\n".join(["id,z,y,x", *rows]))
    found = read_centreline(path)
    assert_array_equal(found.points, MAIN)
    assert found.radii is None


TREES = {
    # VMTK: each line from the inlet; segments that share their end points; segments with a gap.
    "from one inlet": [MAIN, np.concatenate([MAIN[:31], SIDE[1:]])],
    "segments": [MAIN[:31], MAIN[30:], SIDE],
    "segments apart": [MAIN[:31], MAIN[31:], SIDE[1:]],
    "branch from the middle": [MAIN, SIDE],
}


@pytest.mark.parametrize("lines", TREES.values(), ids=TREES)
def test_ends_choose_the_way_through_branches(lines):
    points = np.concatenate(lines)
    for ends, expected in (
        ((MAIN[0], MAIN[-1]), MAIN),
        ((MAIN[-1], MAIN[0]), MAIN[::-1]),
        ((MAIN[0], SIDE[-1]), np.concatenate([MAIN[:31], SIDE[1:]])),
        ((SIDE[-1], MAIN[-1]), np.concatenate([SIDE[:0:-1], MAIN[30:]])),
    ):
        way, away = way_through(lines, np.array(ends))
        found = points[way]
        distance = np.linalg.norm(found[:, None] - expected, axis=2)
        assert_allclose(away, 0.0, rtol=0, atol=1e-12)
        assert distance.min(axis=1).max() < 0.65
        assert distance.min(axis=0).max() < 0.65
        assert_array_equal(found[[0, -1]], expected[[0, -1]])
        assert np.linalg.norm(np.diff(found, axis=0), axis=1).max() < 1.0


def test_a_file_with_branches_needs_ends(tmp_path):
    path = tmp_path / "tree.vtp"
    write_lines(path, [(MAIN[:31], RADII[:31]), (MAIN[30:], RADII[30:]), (SIDE, RADII[30:55])])
    with pytest.raises(InputError, match=r"^centreline = .*tree.vtp holds 3 .* by `vessel.ends`"):
        read_centreline(path)
    found = read_centreline(path, [MAIN[0], MAIN[-1]])
    assert_allclose(found.points[:31], MAIN[:31], rtol=0, atol=1e-5)
    assert_allclose(found.radii[:31], RADII[:31], rtol=1e-6)
    assert_allclose(found.points[-30:], MAIN[-30:], rtol=0, atol=1e-5)


def test_ends_cut_and_turn_a_single_line(tmp_path):
    path = tmp_path / "line.csv"
    table = np.column_stack([MAIN, RADII])
    np.savetxt(path, table, delimiter=",", header="x,y,z,radius", comments="")
    found = read_centreline(path, [MAIN[50] + [1, 0, 0], MAIN[10] + [0.1, 0, 0]])
    assert_allclose(found.points, MAIN[50:9:-1])
    assert_allclose(found.radii, RADII[50:9:-1])


def test_ends_that_no_line_joins_or_meets(tmp_path):
    path = tmp_path / "two.vtp"
    other = MAIN + [20.0, 0.0, 0.0]
    write_lines(path, [(MAIN, RADII), (other, RADII)])
    with pytest.raises(InputError, match="does not join the ends"):
        read_centreline(path, [MAIN[0], other[-1]])
    with pytest.raises(InputError, match=r"is 10 mm from the end .* at most 5 mm"):
        read_centreline(path, [MAIN[0], MAIN[-1] + [0, 0, 10]])


def test_the_other_axes_turn_x_and_y():
    assert_array_equal(flipped_lps_ras([[1.0, 2.0, 3.0]]), [[-1.0, -2.0, 3.0]])
    assert_array_equal(flipped_lps_ras(flipped_lps_ras(MAIN)), MAIN)


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("line.stl", "", r"must end in one of .vtp, .vtk, .json, .csv"),
        ("line.csv", "", "is an empty file"),
        ("line.csv", "x,y,z\n", "holds no points"),
        ("line.csv", "x,y,r\n1,2,3\n", "must have x, y, z"),
        ("line.csv", "x,y,z\n1,2,3\n1,zwei,3\n", "line 3 must hold 3 numbers, not '1 zwei 3'"),
        ("line.csv", "1,2,3\n1,2\n", "line 2 must hold 3 numbers"),
        ("line.csv", "1,2,3\n1,2,nan\n1,2,5\n1,2,6\n", "point 2"),
        ("line.csv", "1,2,3,1\n1,2,4,1\n", "fourth column needs a header that names it radius"),
        ("line.csv", "x,y,z,radius\n1,2,3,1\n1,2,5,-1\n1,2,6,1\n", "radius -1.0 of point 2"),
        ("line.csv", "x [cm],y [cm],z [cm]\n1,2,3\n", r"the column 'x \[cm\]', must be in mm"),
        ("line.csv", "x,y,z\n0,5,1,5,2,5\n", "line 2 must hold 3 columns .* decimal commas"),
        ("line.csv", "0,5 1,5 2,5\n", "line 1 has decimal commas, must have decimal points"),
        ("line.csv", "x y z\n0,5 1,5 2,5\n", "line 2 must hold 3 numbers.* decimal commas"),
        ("line.csv", "0,5,1,5,2,5\n", "has 6 columns and no header"),
        ("line.csv", "1,2,3\n1,2,4\n1,2,4\n1,2,5\n", "3 different points"),
        ("line.json", "{", "is not JSON"),
        ("line.json", "[1, 2]", "not a markups file"),
        ("line.json", "[" * 100_000, "not a markups file"),
        ("line.json", '{"markups": [{"type": "Curve"}]}', "not a markups file"),
        ("line.json", '{"markups": []}', "holds no curve"),
        ("line.json", '{"markups": [{"type": "Fiducial", "controlPoints": []}]}', "no curve"),
    ],
)
def test_what_is_no_centreline_is_refused(tmp_path, name, text, message):
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(InputError, match=message) as raised:
        read_centreline(path)
    assert str(raised.value).startswith(f"centreline = {path} ")


def test_units_that_markups_give(tmp_path):
    path = tmp_path / "line.json"
    for unit, mm in (("cm", 10.0), (["m", "UCUM", "meter"], 1e3), ("", 1.0), ("um", 1e-3)):
        radius = {"name": "Radius", "controlPointValues": (RADII / mm).tolist()}
        write_markups(path, MAIN / mm, coordinateUnits=unit, measurements=[radius])
        assert_allclose(read_centreline(path).points, MAIN, rtol=0, atol=1e-12)
        assert_allclose(read_centreline(path).radii, RADII, rtol=1e-12)
    radius |= {"units": "mm", "controlPointValues": RADII.tolist()}
    write_markups(path, MAIN / 10.0, coordinateUnits="cm", measurements=[radius])
    assert_allclose(read_centreline(path).radii, RADII, rtol=1e-12)
    write_markups(path, MAIN, coordinateUnits="furlong")
    with pytest.raises(InputError, match="has coordinateUnits 'furlong', must be one of um, "):
        read_centreline(path)


@pytest.mark.parametrize(
    ("factor", "said"),
    [(1e-3, ", which smells of metres: "), (0.1, ", which smells of cent"), (1e6, ": a cent")],
)
def test_a_line_that_cannot_be_in_mm_is_refused(tmp_path, factor, said):
    path = tmp_path / "line.csv"
    np.savetxt(path, factor * MAIN, delimiter=",")
    with pytest.raises(InputError, match=f"^centreline = .* must be from 8 to 600 mm{said}"):
        read_centreline(path)


@pytest.mark.parametrize(
    ("said", "of_surface", "turned"),
    [
        ("LPS", b"SPACE=LPS", False),
        ("LPS", b"SPACE=RAS", True),
        ("RAS", b"SPACE=LPS", True),
        ("0", b"SPACE=LPS", True),
        (1, b"SPACE=LPS", False),
        ("RAS", b"made elsewhere", False),
        (None, b"SPACE=LPS", False),
    ],
)
def test_axes_that_both_files_declare_are_made_the_surface_s(tmp_path, said, of_surface, turned):
    path, surface = tmp_path / "line.json", tmp_path / "a.stl"
    surface.write_bytes(of_surface.ljust(80) + bytes(4))
    write_markups(path, MAIN, coordinateSystem=said)
    expected = flipped_lps_ras(MAIN) if turned else MAIN
    found = read_centreline(path, surface=surface)
    assert_array_equal(found.points, expected)
    assert len(found.remarks) == turned
    assert_array_equal(read_centreline(path, expected[[50, 10]], surface).points, expected[50:9:-1])
    assert_array_equal(read_centreline(path).points, MAIN)


def test_unknown_axes_are_refused(tmp_path):
    path = tmp_path / "line.json"
    write_markups(path, MAIN, coordinateSystem="SPL")
    with pytest.raises(InputError, match="coordinateSystem 'SPL', must be one of LPS, RAS, 0, 1$"):
        read_centreline(path)


def test_segments_of_one_line_are_one_line():
    lines = [(MAIN[i : i + 2], RADII[i : i + 2]) for i in range(len(MAIN) - 1)]
    mixed = [lines[i] for i in np.random.default_rng(0).permutation(len(lines))]
    for given in (lines, mixed, [(MAIN[:31], RADII[:31]), (MAIN[:29:-1], RADII[:29:-1])]):
        points, radii = joined_chain(given)
        assert_array_equal(points, MAIN)
        assert_array_equal(radii, RADII)
    assert joined_chain([lines[0], (lines[1][0], None), *lines[2:]])[1] is None


@pytest.mark.parametrize(
    "lines",
    [
        *TREES.values(),
        [MAIN, MAIN + [20.0, 0.0, 0.0]],
        [MAIN[:20], MAIN[25:]],
        [MAIN[:31], np.concatenate([MAIN[30:], MAIN[:1]])],
        [MAIN[:3], MAIN[10:13], np.stack([MAIN[12], SIDE[3], MAIN[10]])],
    ],
)
def test_lines_that_are_no_chain(lines):
    assert joined_chain([(points, None) for points in lines]) is None


@pytest.mark.parametrize("name", ["none.csv", "none.json", "none.vtp"])
def test_a_missing_file_is_refused(tmp_path, name):
    with pytest.raises(InputError, match=r"^centreline = .*none.* cannot be read: No such file"):
        read_centreline(tmp_path / name)


def test_a_surface_is_no_centreline(tmp_path):
    pyvista = pytest.importorskip("pyvista")
    pyvista.Sphere().save(tmp_path / "ball.vtp")
    with pytest.raises(InputError, match="holds no line"):
        read_centreline(tmp_path / "ball.vtp")
