"""Files of surfaces: formats back and forth, units, and what is said of files that are no use."""

import os
import subprocess
import sys

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import braidcast.vessels.vtk_file as vtk_file
from braidcast.errors import InputError
from braidcast.vessels import QuadraticBezier, SaccularVessel, Tube, vessel_surface, write_stl
from braidcast.vessels.repair import repaired
from braidcast.vessels.surface_file import declared_axes, read_surface
from braidcast.vessels.vtk_file import read_vtk_lines, read_vtk_polygons


def written(path, vertices, triangles):
    """The mesh in the format of the file's ending; "_ascii.stl" for STL as text."""
    import trimesh

    mesh = trimesh.Trimesh(vertices, triangles, process=False)
    if path.name.endswith("_ascii.stl"):
        path.write_text(mesh.export(file_type="stl_ascii"))
    elif path.suffix in (".vtp", ".vtk"):
        import pyvista

        pyvista.make_tri_mesh(vertices, triangles).save(path)
    elif path.suffix == ".obj":
        path.write_text(mesh.export(file_type="obj", digits=17))
    else:
        path.write_bytes(mesh.export(file_type=path.suffix[1:]))
    return path


def refused(path, text, **options):
    with pytest.raises(InputError) as caught:
        read_surface(path, **options)
    message = str(caught.value)
    assert message.startswith(f"surface = {path} "), message
    assert text in message, message
    assert "\n" not in message
    return message


@pytest.mark.parametrize(
    ("name", "accuracy"),
    [
        ("a.stl", 1e-6),
        ("A.STL", 1e-6),
        ("a_ascii.stl", 0.0),
        ("a.ply", 1e-6),
        ("a.obj", 0.0),
        ("a.vtp", 0.0),
        ("a.vtk", 0.0),
    ],
)
def test_every_format_gives_the_surface_back(tmp_path, tube, name, accuracy):
    """To the bit where the file has double precision."""
    vertices, triangles = tube(rings=9)
    vertices = vertices + [0.1, -0.2, 1 / 3]
    expected = repaired(vertices, triangles)
    path = written(tmp_path / name.lower(), vertices, triangles)
    surface = read_surface(path.rename(tmp_path / name))
    assert surface.remarks == ()
    assert surface.triangles.shape == expected.triangles.shape
    if accuracy == 0.0:
        assert_array_equal(surface.vertices, expected.vertices)
        assert_array_equal(surface.triangles, expected.triangles)
    else:
        order = np.lexsort(np.round(surface.vertices, 4).T[::-1])
        as_before = np.lexsort(np.round(expected.vertices, 4).T[::-1])
        assert_allclose(surface.vertices[order], expected.vertices[as_before], atol=20 * accuracy)
    assert_allclose([end.radius for end in surface.openings], 1.4952, atol=1e-3)


def test_our_own_stl_is_opened_at_both_ends(tmp_path):
    curve = QuadraticBezier([0, 0, 0], [0, 15, 25], [0, 0, 50])
    write_stl(tmp_path / "vessel.stl", *vessel_surface(SaccularVessel(Tube(curve, 2.0), None)))
    surface = read_surface(tmp_path / "vessel.stl")
    assert len(surface.remarks) == 2
    ends = sorted((end.centre for end in surface.openings), key=lambda centre: centre[2])
    assert_allclose(ends, [curve.P0, curve.P2], atol=1e-5)
    assert_allclose([end.radius for end in surface.openings], 2.0, atol=2e-3)


def test_quads_are_split_and_said_to_be(tmp_path, tube):
    vertices, triangles = tube(rings=9)
    half = len(triangles) // 2
    quads = np.column_stack([triangles[:half], triangles[half:, 2]]) + 1
    lines = ["v {!r} {!r} {!r}".format(*row) for row in vertices.tolist()]
    lines += ["f {} {} {} {}".format(*row) for row in quads.tolist()]
    (tmp_path / "quads.obj").write_text("\n".join(lines) + "\n")
    surface = read_surface(tmp_path / "quads.obj")
    assert surface.remarks == (f"{half} polygons were split into {2 * half} triangles",)
    assert_array_equal(surface.vertices, repaired(vertices, triangles).vertices)

    import pyvista

    faces = np.column_stack([np.full(half, 4), quads - 1]).ravel()
    pyvista.PolyData(vertices, faces).save(tmp_path / "quads.vtp")
    assert read_surface(tmp_path / "quads.vtp").remarks == surface.remarks


def test_solids_of_one_stl_are_one_surface(tmp_path, tube):
    vertices, triangles = tube(rings=9)
    text = ""
    for part in (triangles[:100], triangles[100:]):
        text += written(tmp_path / "part_ascii.stl", vertices, part).read_text()
    (tmp_path / "both_ascii.stl").write_text(text)
    surface = read_surface(tmp_path / "both_ascii.stl")
    assert_array_equal(surface.triangles, repaired(vertices, triangles).triangles)


@pytest.mark.parametrize(("units", "mm"), [("cm", 10.0), ("m", 1000.0), ("inch", 25.4)])
def test_units(tmp_path, tube, units, mm):
    vertices, triangles = tube(rings=9)
    path = written(tmp_path / "a.obj", vertices / mm, triangles)
    ends = zip(
        read_surface(path, units).openings, repaired(vertices, triangles).openings, strict=True
    )
    for found, expected in ends:
        assert found.radius == pytest.approx(expected.radius, rel=1e-12)
        assert_allclose(found.centre, expected.centre, atol=1e-12)


@pytest.mark.parametrize(
    ("length", "guess"),
    [
        (0.05, 'smells of metres: say units = "m"'),
        (0.5, 'smells of inches: say units = "inch" or "m"'),
        (4.0, 'smells of centimetres: say units = "cm" or "inch"'),
        (50_000.0, "smells of micrometres: scale it to mm"),
        (1e-5, "which no unit makes a vessel's"),
    ],
)
def test_size_that_no_vessel_has_is_refused_with_a_guess(tmp_path, tube, length, guess):
    vertices, triangles = tube(rings=9)
    path = written(tmp_path / "a.obj", vertices * length / 20.0, triangles)
    message = refused(path, guess)
    assert f"{0.15 * length:.3g} by {0.15 * length:.3g} by {length:.3g} mm" in message


@pytest.mark.parametrize(
    ("length", "radius", "units", "said"),
    [
        (20.0, 0.2, "mm", 'a lumen of radius 0.2 mm on average with units = "mm"'),
        (20.0, 0.2, "mm", 'smells of centimetres: say units = "cm" or "inch"'),
        (50.0, 4.0, "cm", 'smells of millimetres: say units = "mm"'),
    ],
)
def test_lumen_that_no_vessel_has_is_refused_with_a_guess(
    tmp_path, tube, length, radius, units, said
):
    """Where the extent alone would pass."""
    path = written(tmp_path / "a.obj", *tube(radius, length, rings=9))
    refused(path, said, units=units)


def test_millimetres_given_as_metres_are_refused(tmp_path, tube):
    path = written(tmp_path / "a.obj", *tube(rings=9))
    refused(path, 'smells of millimetres: say units = "mm"', units="m")


def test_unknown_unit_is_refused(tmp_path):
    with pytest.raises(InputError, match='units = \'km\' must be one of "mm", "cm", "m", "inch"'):
        read_surface(tmp_path / "a.stl", "km")


def test_files_that_are_none(tmp_path):
    refused(tmp_path / "none.stl", "cannot be read: No such file")
    (tmp_path / "folder.stl").mkdir()
    refused(tmp_path / "folder.stl", "is no file")
    (tmp_path / "image.nii").write_bytes(b"x")
    refused(tmp_path / "image.nii", "must end in one of .stl, .ply, .obj, .vtp, .vtk")
    large = tmp_path / "large.stl"
    with large.open("wb") as stream:
        stream.truncate(3_000_000_000)  # a file of holes: it takes no room
    refused(large, "has 3.0 GB, where at most 1 GB is read")


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root reads all files")
def test_file_without_permission(tmp_path):
    path = tmp_path / "a.stl"
    path.write_bytes(b"x")
    path.chmod(0)
    refused(path, "cannot be read: Permission denied")


@pytest.mark.parametrize("ending", [".stl", ".ply", ".obj", ".vtp", ".vtk"])
def test_empty_garbled_and_cut_files(tmp_path, tube, ending):
    path = tmp_path / f"a{ending}"
    path.write_bytes(b"")
    refused(path, "is an empty file")
    path.write_text("This is no surface.\n" * 50)
    refused(path, "is damaged or ")
    path.write_bytes(np.random.default_rng(3).bytes(2000))
    refused(path, "is damaged")
    whole = written(path, *tube(rings=9)).read_bytes()
    path.write_bytes(whole[: len(whole) // 3])
    message = refused(path, "")
    assert "damaged" in message or "holds no triangle" in message


def test_text_stl_with_a_word_for_a_number(tmp_path, tube):
    path = written(tmp_path / "a_ascii.stl", *tube(rings=9))
    path.write_text(path.read_text().replace("vertex 1.5 ", "vertex 1.S ", 1))
    refused(path, "is damaged or no .stl file")


def test_corner_that_is_not_there(tmp_path):
    head = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
    head += "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
    (tmp_path / "a.ply").write_text(head + "0 0 0\n9 0 0\n0 9 0\n3 0 1 7\n")
    refused(tmp_path / "a.ply", "a triangle has the vertex 7, where there are 3")


def test_one_triangle_is_no_vessel(tmp_path):
    path = written(tmp_path / "a.stl", np.diag([9.0, 9, 9]), np.array([[0, 1, 2]]))
    refused(path, "holds 1 triangle, which is no vessel: must be 4 or more")
    path = written(tmp_path / "a.stl", np.diag([0.1, 0.1, 0.1]), np.array([[0, 1, 2]]))
    refused(path, "holds 1 triangle, which is no vessel")


def test_crumb_far_away_does_not_count_as_the_vessel_s_size(tmp_path, tube):
    vertices, triangles = tube(rings=9)
    crumb = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]]) + [900.0, 0.0, 0.0]
    sides = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]) + len(vertices)
    both = np.concatenate([vertices, crumb]), np.concatenate([triangles, sides])
    surface = read_surface(written(tmp_path / "a.stl", *both))
    assert np.ptp(surface.vertices, axis=0).max() == pytest.approx(20.0)
    assert "1 loose piece of 4 triangles was left out" in surface.remarks[0]
    both = both[0] * 1e-3, both[1]
    refused(written(tmp_path / "b.stl", *both), 'by 0.02 mm with units = "mm"')


def test_vessel_too_large_for_a_grid_is_guessed_to_have_other_units(tmp_path, tube):
    vertices, triangles = tube(2.0, 40.0, rings=9)
    turn = np.linalg.qr(np.array([[1.0, 2, 3], [-1, 1, 0], [1, 1, -1]]))[0]
    path = written(tmp_path / "a.obj", vertices @ turn, triangles)
    said = 'units = "mm" would make it 3'
    assert "too large for a grid" in refused(path, said, units="cm")
    read_surface(path)


def obj(path, vertices, faces, between=""):
    """Vertices and faces of words, with ``between`` before the faces."""
    lines = ["v {!r} {!r} {!r}".format(*row) for row in vertices.tolist()]
    lines += [between] + ["f " + " ".join(face) for face in faces]
    path.write_text("\n".join(lines) + "\n")
    return path


def test_obj_with_all_that_a_surface_does_not_need(tmp_path, tube):
    vertices, triangles = tube(rings=9)
    plain = [[str(corner) for corner in row] for row in (triangles + 1).tolist()]
    expected = read_surface(obj(tmp_path / "plain.obj", vertices, plain))
    text = (tmp_path / "plain.obj").read_text()
    normals = "vn 0 0 1\nvt 0.5 0.5\nusemtl a"
    textured = [[f"{corner}/1/1" for corner in face] for face in plain]
    half = len(textured) // 2
    textured[half][-1] += "\nusemtl b\no other\ng part\ns off\nl 1 2 3"
    relative = (triangles - len(vertices)).tolist()
    others = {
        "materials": obj(tmp_path / "a.obj", vertices, textured, normals).read_text(),
        "normals": text.replace("f ", "vn 0 0 1\nf ", 1).replace("\nf 1 ", "\nf 1//1 "),
        "tabs": text.replace(" ", "\t"),
        "indents": text.replace("f ", "  f  ").replace("v ", " v "),
        "continued": text.replace("f ", "f \\\n"),
        "carriage returns": text.replace("\n", "\r\n"),
        "comments": "# v 1 2 3\n" + text.replace("\nf ", " # f 1 2\nf "),
        "colours": text.replace("\nv", " 1 0 0\nv"),
        "relative": obj(
            tmp_path / "b.obj", vertices, [[f"{i}/-1" for i in row] for row in relative], "vt 0 0"
        ).read_text()
        + "v 500 500 500\n" * 7,
    }
    for name, other in others.items():
        (tmp_path / "other.obj").write_text(other)
        surface = read_surface(tmp_path / "other.obj")
        assert_array_equal(surface.vertices, expected.vertices, err_msg=name)
        assert_array_equal(surface.triangles, expected.triangles, err_msg=name)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("f 0 1 2", "line 5 has the vertex 0, must be from 1 up, or from -1 down to -4"),
        ("f 1 2 -5", "line 5 has the vertex -5, must be"),
        ("f 1 2 5", "line 5 has the vertex 5, where there are 4"),
        ("f 1 2", "line 5 must hold a face of three or more vertices' numbers, not 'f 1 2'"),
        ("f 1 2 x", "line 5 must hold a face"),
        ("f 1 2 /3", "line 5 must hold a face"),
        ("v 1,5 2,5 3,5", "line 5 must hold a vertex of three numbers, not 'v 1,5 2,5 3,5'"),
        ("v 1 2", "line 5 must hold a vertex"),
    ],
)
def test_obj_line_that_is_wrong_is_named(tmp_path, line, said):
    corners = "v 0 0 0\nv 9 0 0\nv 0 9 0\nv 0 0 9\n"
    (tmp_path / "a.obj").write_text(f"{corners}{line}\nf 1 2 3\n")
    refused(tmp_path / "a.obj", f"is damaged: {said}")


@pytest.mark.parametrize(
    ("beginning", "axes"),
    [
        (b"3D Slicer output. SPACE=LPS".ljust(80) + bytes(4), "LPS"),
        (b"solid 3D Slicer output. SPACE=RAS\nfacet", "RAS"),
        (b"solid SPACE=LPSX\n", None),
        (b"", None),
    ],
)
def test_axes_that_a_file_declares(tmp_path, beginning, axes):
    (tmp_path / "a.stl").write_bytes(beginning)
    assert declared_axes(tmp_path / "a.stl") == axes


def test_no_number_is_refused_with_its_place(tmp_path, tube):
    vertices, triangles = tube(rings=9)
    vertices[40] = [np.nan, 2.0, 3.0]
    refused(written(tmp_path / "a.obj", vertices, triangles), "vertex 40 is at (nan, 2, 3) mm")


def test_vtk_lines_come_with_their_arrays(tmp_path):
    import pyvista

    first = pyvista.lines_from_points(np.arange(12.0).reshape(4, 3))
    first = pyvista.PolyData(first.points, lines=[4, 0, 1, 2, 3])
    first["Radius"] = [1.0, 2.0, 3.0, 4.0]
    second = pyvista.PolyData(np.ones((2, 3)), lines=[2, 0, 1])
    second["Radius"] = [5.0, 6.0]
    for name in ("lines.vtp", "lines.vtk"):
        first.append_polydata(second).save(tmp_path / name)
        (one, at_one), (two, at_two) = read_vtk_lines(tmp_path / name)
        assert_array_equal(one, np.arange(12.0).reshape(4, 3))
        assert_array_equal(two, np.ones((2, 3)))
        assert_array_equal(at_one["Radius"], [1, 2, 3, 4])
        assert_array_equal(at_two["Radius"], [5, 6])
        refused(tmp_path / name, "holds no triangle")


def test_vtk_file_of_something_else_names_it(tmp_path):
    import pyvista

    pyvista.ImageData(dimensions=(2, 2, 2)).save(tmp_path / "image.vtk")
    refused(tmp_path / "image.vtk", "holds a vtkStructuredPoints where polygonal data")


def test_without_vtk_the_remedy_is_named(tmp_path, monkeypatch):
    (tmp_path / "a.vtp").write_bytes(b"x")
    monkeypatch.setattr(vtk_file, "find_spec", lambda name: None)
    refused(tmp_path / "a.vtp", "needs VTK to be read: pip install 'braidcast[pictures]'")


@pytest.mark.parametrize(
    ("returncode", "stderr", "said"),
    [
        (-11, b"", "is damaged: VTK crashed on it (signal 11)"),
        (1, b"Traceback\nImportError: libX11.so", "cannot be read by VTK: ImportError: libX11.so"),
        (3, b"is damaged or no VTK file\n", "is damaged or no VTK file"),
    ],
)
def test_death_of_the_reading_process_is_told_apart(
    tmp_path, monkeypatch, returncode, stderr, said
):
    (tmp_path / "a.vtp").write_bytes(b"x")
    ended = subprocess.CompletedProcess([], returncode, b"", stderr)
    monkeypatch.setattr(vtk_file.subprocess, "run", lambda *_, **__: ended)
    with pytest.raises(InputError) as caught:
        read_vtk_polygons(tmp_path / "a.vtp")
    assert str(caught.value) == f"surface = {tmp_path / 'a.vtp'} {said}"


def test_reading_libraries_are_imported_when_needed():
    code = "import sys, braidcast.vessels.surface_file; print('trimesh' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True)
    assert done.stdout.split() == [b"False"]
