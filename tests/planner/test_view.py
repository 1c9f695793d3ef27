"""The three-dimensional view in a real browser: what is where in the picture, and the files."""

import base64
import io
import json
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import pyvista
from PIL import Image
from playwright.sync_api import Page, Route

import braidcast.planner
from braidcast.case import Case
from braidcast.deployment.shape import nodes_of_wires
from braidcast.deployment.vtp import write_polylines
from braidcast.surrogate.placed_braid import placed_braid
from braidcast.vessels.parametric import SaccularVessel
from braidcast.vessels.surface import vessel_surface

STATIC = Path(braidcast.planner.__file__).parent / "static"
EXAMPLES = Path(__file__).parents[2] / "examples"
ORIGIN = "http://view.test/"
PAGE = """<!doctype html><link rel="icon" href="data:,">
<style>html, body, canvas { margin: 0; width: 100%; height: 100%; display: block }</style>
<script type="importmap">{"imports": {"three": "./vendor/three.module.min.js"}}</script>
<body><canvas id="canvas"></canvas><script type="module">
for (const name of ["view", "views", "wires", "vessel_mesh", "formats", "case", "bezier"]) {
  Object.assign(window, await import(`./${name}.js`));
}
window.base64 = (buffer) => {
  let text = "";
  for (const byte of new Uint8Array(buffer)) text += String.fromCharCode(byte);
  return btoa(text);
};
window.loaded = true;
</script>"""
SHOW = """({positions, wires, radius, segments, tables, device, dark}) => {
  window.positions = Float64Array.from(positions);
  window.nodes = Int32Array.from(wires);
  window.shape = geometry(tables, device);
  window.tables = tables;
  window.device = device;
  window.v = new View(document.getElementById("canvas"), { dark });
  v.setBraid(nodes, radius, segments);
  v.setPositions(window.positions);
  v.setMarks({ sac: { centre: shape.sacCentre, radius: shape.sacRadius } });
}"""
SHOW_VESSEL = "v.setVessel({ kind: 'tube', case: tables, geometry: shape })"


@pytest.fixture(scope="module")
def success() -> SimpleNamespace:
    """A case, its tables, and the braid as geometry places it."""
    text = (EXAMPLES / "success.toml").read_text(encoding="utf-8")
    case = Case.from_toml(EXAMPLES / "success.toml")
    positions = placed_braid(case).positions
    return SimpleNamespace(case=case, tables=tomllib.loads(text), positions=positions)


@pytest.fixture
def modules(browser_page: Page) -> Page:
    """An empty page with the view's modules."""

    def give(route: Route) -> None:
        name = route.request.url.removeprefix(ORIGIN)
        if name:
            route.fulfill(path=STATIC / name)
        else:
            route.fulfill(body=PAGE, content_type="text/html")

    browser_page.route(f"{ORIGIN}**", give)
    browser_page.set_viewport_size({"width": 800, "height": 450})
    browser_page.goto(ORIGIN)
    browser_page.wait_for_function("window.loaded")
    return browser_page


@pytest.fixture
def show(modules: Page, success: SimpleNamespace) -> Callable[..., Page]:
    def start(dark: bool = False) -> Page:
        modules.evaluate(
            SHOW,
            {
                "positions": success.positions.ravel().tolist(),
                "wires": nodes_of_wires(success.case.braid).ravel().tolist(),
                "radius": success.case.braid.wire_radius,
                "segments": success.case.braid.segments,
                "tables": success.tables,
                "device": device(success.case),
                "dark": dark,
            },
        )
        return modules

    return start


@pytest.fixture
def braid(show: Callable[..., Page]) -> Iterator[Page]:
    """Wires alone, on white, from the front."""
    page = show()
    page.evaluate(f"{SHOW_VESSEL}; v.view('front'); v.shell.visible = false")
    yield page


def device(case: Case) -> dict[str, Any]:
    braid = case.braid
    names = "wires radius length segments wire_radius young_modulus poisson_ratio literal_angle"
    return {name: getattr(braid, name) for name in names.split()}


def picture(page: Page) -> np.ndarray:
    """Red, green and blue of the PNG file, (height, width, 3)."""
    data = page.evaluate("v.png().then((blob) => blob.arrayBuffer()).then(base64)")
    image = Image.open(io.BytesIO(base64.b64decode(data)))
    assert image.format == "PNG"
    return np.asarray(image.convert("RGB")).astype(int)


def places(page: Page, name: str = "positions") -> np.ndarray:
    """Row and column of every node in the picture."""
    flat = page.evaluate(
        f"Array.from({{length: {name}.length / 3}}, (_, i) =>"
        f" v.project([...{name}.subarray(3 * i, 3 * i + 3)]))"
    )
    return np.floor(np.array(flat)).astype(int)[:, ::-1]


def inked(image: np.ndarray) -> np.ndarray:
    return image.min(axis=2) < 235


def at(image: np.ndarray, rows_and_columns: np.ndarray) -> np.ndarray:
    return image[rows_and_columns[:, 0], rows_and_columns[:, 1]]


def test_wires_are_where_their_nodes_project(braid: Page) -> None:
    ink = inked(picture(braid))
    assert at(ink, places(braid)).mean() > 0.99
    assert 0.01 < ink.mean() < 0.3


def test_wires_lie_where_the_millimetres_say(braid: Page, success: SimpleNamespace) -> None:
    """Along z to the right, y upwards, and a pixel is as many mm in both directions."""
    scale = braid.evaluate("v.millimetresPerPixel")
    flat = np.array(braid.evaluate("[[0, 0, 0], [0, 0, 10], [0, 10, 0]].map((p) => v.project(p))"))
    assert flat[1] - flat[0] == pytest.approx([10.0 / scale, 0.0], abs=1e-6)
    assert flat[2] - flat[0] == pytest.approx([0.0, -10.0 / scale], abs=1e-6)


def test_moving_the_braid_moves_the_pixels(braid: Page) -> None:
    before, old = inked(picture(braid)), places(braid)
    braid.evaluate(
        "const step = 40 * v.millimetresPerPixel;"
        " window.moved = positions.map((value, i) => value + (i % 3 === 1 ? step : 0));"
        " v.setPositions(moved)"
    )
    after, new = inked(picture(braid)), places(braid, "moved")
    assert at(after, new).mean() > 0.99
    assert new - old == pytest.approx(np.tile([-40, 0], (len(old), 1)), abs=1)
    # Scale and axes, at the lower left, stay.
    assert (np.roll(before, -40, axis=0) == after)[:350, 100:].mean() > 0.999
    assert at(after, old).mean() < 0.9


@pytest.mark.parametrize("name", ["viridis", "cividis"])
def test_colours_follow_the_values(braid: Page, name: str) -> None:
    colours = braid.evaluate(f"palette('{name}')")
    ends = [[int(c[i : i + 2], 16) for i in (1, 3, 5)] for c in (colours[0], colours[-1])]
    nodes = places(braid)
    for value, (own, other) in ((-3.0, ends), (7.0, ends[::-1])):
        braid.evaluate(
            f"v.setValues(positions.map(() => {value}).slice(0, 3408), [0, 1], '{name}')"
        )
        seen = np.median(at(picture(braid), nodes), axis=0)
        # Light and the fading of the far side change how bright it is, not which end it is.
        assert np.linalg.norm(seen - own) < 0.6 * np.linalg.norm(seen - other)


def test_values_belong_to_their_nodes(braid: Page, success: SimpleNamespace) -> None:
    """One half of the braid at the low end, the other at the high end: blue left, yellow right."""
    braid.evaluate(
        "const half = Float64Array.from({length: 3408}, (_, i) => +(positions[3 * i + 2] > 25));"
        " v.setValues(half, [0, 1], 'viridis')"
    )
    image, nodes = picture(braid), places(braid)
    blueness = at(image, nodes)[:, 2] - at(image, nodes)[:, 1]
    z = success.positions[:, 2]
    assert np.median(blueness[z < 24.5]) > 20
    assert np.median(blueness[z > 25.5]) < -60


def test_views_differ_and_all_show_braid_and_sac(show: Callable[..., Page]) -> None:
    page = show()
    page.evaluate(SHOW_VESSEL)
    seen = []
    for name in ("front", "back", "side", "top", "along", "reset"):
        page.evaluate(f"v.view('{name}')")
        image, nodes = picture(page), places(page)
        assert (nodes >= 0).all() and (nodes < image.shape[:2]).all()
        across = page.evaluate("v.project(shape.sacCentre)")
        radius = page.evaluate("shape.sacRadius / v.millimetresPerPixel")
        for centre, size in zip(across, (800, 450), strict=True):
            assert radius < centre < size - radius
        assert all((image != other).mean() > 0.01 for other in seen)
        seen.append(image)


def test_the_sac_is_above_whichever_way_the_vessel_lies(modules: Page) -> None:
    axes = modules.evaluate("axesOf([0, 0, 0], [5, 1, 0], [10, 0, 0], [5, 0, -4])")
    assert np.array(axes) == pytest.approx(
        np.array([[1, 0, 0], [0, -1 / 17**0.5, -4 / 17**0.5], [0, 4 / 17**0.5, -1 / 17**0.5]])
    )
    straight = np.array(modules.evaluate("axesOf([0, 0, 0], [0, 0, 5], [0, 0, 10], null)"))
    assert straight @ straight.T == pytest.approx(np.eye(3))


def test_the_page_s_size_does_not_squeeze_the_picture(braid: Page) -> None:
    for width, height in ((820, 1180), (1920, 1080)):
        braid.set_viewport_size({"width": width, "height": height})
        braid.wait_for_function(f"v.canvas.width === {width} && v.canvas.height === {height}")
        braid.evaluate("v.fit()")
        test_wires_lie_where_the_millimetres_say(braid, SimpleNamespace())
        assert at(inked(picture(braid)), places(braid)).mean() > 0.98


def test_the_keyboard_turns_zooms_and_resets(show: Callable[..., Page]) -> None:
    page = show()
    page.evaluate(f"{SHOW_VESSEL}; v.view('reset')")
    page.focus("#canvas")
    start = page.evaluate("v.pose")
    for key in ("ArrowLeft", "ArrowUp"):
        page.keyboard.press(key)
        turned = page.evaluate("v.pose")
        assert turned["position"] != start["position"]
        assert turned["zoom"] == pytest.approx(start["zoom"])
    page.keyboard.press("+")
    assert page.evaluate("v.pose.zoom") > start["zoom"]
    page.keyboard.press("0")
    assert page.evaluate("v.pose.position") == pytest.approx(start["position"])
    page.keyboard.press("4")
    page.evaluate("p => { v.pose = p }", start)
    assert page.evaluate("v.pose.position") == pytest.approx(start["position"])


def test_the_mouse_turns_and_zooms(show: Callable[..., Page]) -> None:
    page = show()
    page.evaluate(f"{SHOW_VESSEL}; v.view('front'); v.draw()")
    start = page.evaluate("v.pose")
    page.mouse.move(400, 220)
    page.mouse.down()
    page.mouse.move(500, 260)
    page.mouse.up()
    page.mouse.wheel(0, -300)
    page.wait_for_function(f"v.pose.zoom > {start['zoom']}")
    assert page.evaluate("v.pose.position") != pytest.approx(start["position"], abs=1.0)


def test_nothing_is_drawn_while_nothing_moves(braid: Page) -> None:
    frames = braid.evaluate(
        """async () => {
          const rest = () => new Promise((resolve) => setTimeout(resolve, 400));
          await rest();
          let count = 0;
          const stop = v.onFrame(() => count++);
          await rest();
          const idle = count;
          for (let i = 0; i < 10; i++) v.setPositions(positions);
          await rest();
          stop();
          v.draw();
          return [idle, count];
        }"""
    )
    assert frames == [0, 1]


def test_neck_site_and_a_second_braid_are_marked(braid: Page) -> None:
    plain = picture(braid)
    braid.evaluate(
        "v.setMarks({ neck: {}, site: [[0, 7, 18], [0, 7.5, 25], [0, 7, 32]] });"
        " v.setGhost(positions.map((v, i) => v + (i % 3 === 2 ? 1 : 0)))"
    )
    marked = picture(braid)
    orange = (marked[..., 0] - marked[..., 2] > 90) & (marked[..., 1] < 170)
    assert orange.sum() > 400
    braid.evaluate("v.setGhost(null)")
    only_lines = (picture(braid) != plain).any(axis=2)
    edge = np.array(braid.evaluate("lumenMesh(tables, shape).necks[0].map((p) => v.project(p))"))
    near = np.floor(edge).astype(int)[:, ::-1]
    assert np.mean([only_lines[r - 2 : r + 3, c - 2 : c + 3].any() for r, c in near]) > 0.7
    braid.evaluate("v.setMarks({ neck: null, site: null })")
    assert (picture(braid) == plain).all()


def test_dark_and_light(show: Callable[..., Page]) -> None:
    page = show(dark=True)
    page.evaluate(f"{SHOW_VESSEL}; v.view('front')")
    assert picture(page)[5, 5].tolist() == [0x15, 0x19, 0x1E]
    page.evaluate("v.setDark(false)")
    assert picture(page)[5, 5].tolist() == [255, 255, 255]


def test_a_lost_context_comes_back_with_the_same_picture(show: Callable[..., Page]) -> None:
    page = show()
    page.evaluate(f"{SHOW_VESSEL}; v.view('front')")
    before = picture(page)
    page.evaluate(
        """async () => {
          const happens = (name) => new Promise((resolve) => {
            v.canvas.addEventListener(name, resolve, { once: true });
          });
          const context = v.renderer.getContext().getExtension("WEBGL_lose_context");
          const lost = happens("webglcontextlost");
          context.loseContext();
          await lost;
          v.setPositions(positions);
          v.draw();
          await new Promise((resolve) => setTimeout(resolve, 100));
          const restored = happens("webglcontextrestored");
          context.restoreContext();
          await restored;
        }"""
    )
    assert (picture(page) == before).mean() > 0.999


def test_memory_stays_flat(show: Callable[..., Page]) -> None:
    page = show()
    page.evaluate(f"{SHOW_VESSEL}; v.view('front')")
    session = page.context.new_cdp_session(page)

    def used() -> tuple[dict[str, int], float]:
        session.send("HeapProfiler.collectGarbage")
        return page.evaluate("({ ...v.renderer.info.memory })"), session.send(
            "Runtime.getHeapUsage"
        )["usedSize"]

    move = """(rounds) => {
      const values = new Float64Array(3408);
      for (let i = 0; i < rounds; i++) {
        v.setPositions(positions);
        v.setValues(values, [0, 1], i % 2 ? "viridis" : "cividis");
        v.setMarks({ neck: {}, site: Array.from({ length: 2 + (i % 5) }, (_, k) => [0, 0, k]) });
        if (i % 50) continue;
        v.setGhost(i % 100 ? null : positions);
        const vessel = { ...tables.vessel, diameter: 2 + (i % 400) / 200 };
        const other = { ...tables, vessel };
        v.setVessel({ kind: "tube", case: other, geometry: geometry(other, device) });
        v.draw();
      }
    }"""
    page.evaluate(move, 501)
    objects, heap = used()
    page.evaluate(move, 1001)
    after, heap_after = used()
    assert after == objects
    assert heap_after < heap + 1e6
    page.evaluate("v.dispose()")
    assert page.evaluate("v.renderer.info.memory.geometries") == 0
    assert page.evaluate("document.querySelectorAll('canvas').length") == 1


def test_a_vessel_by_its_surface(show: Callable[..., Page]) -> None:
    page = show()
    page.evaluate(
        """() => {
          const mesh = lumenMesh(tables, shape, { beyond: 0 });
          const vertices = Float64Array.from(mesh.vertices);
          v.setVessel({ kind: "surface", vertices, triangles: [...mesh.triangles] });
          const neck = { centre: [0, 8.8, 25], radius: 2, normal: [0, 1, 0] };
          v.setMarks({ neck, site: [[0, 7, 18], [0, 7.5, 25], [0, 7, 32]] });
          v.view("front");
        }"""
    )
    image = picture(page)
    column, row = page.evaluate("v.project(shape.sacCentre)")
    red, green, _ = image[int(row), int(column)]
    assert red - green > 15
    assert at(inked(image), places(page)).mean() > 0.99


VESSELS = {
    "gentle": ([0.0, 15.0, 25.0], 3.0, 7.0, 0.5, 1),
    "wide neck": ([0.0, 12.0, 22.0], 4.0, 9.0, 0.3, 1),
    "cut in two by its sac": ([0.0, 10.0, 25.0], 2.0, 10.0, 0.3, 2),
    "hairpin": ([0.0, 30.0, 25.0], 3.0, 6.0, 0.5, 1),
    "straight": ([0.0, 0.0, 25.0], 3.0, 7.0, 0.5, 1),
}


@pytest.mark.parametrize("name", VESSELS)
def test_the_lumen_is_closed_and_its_wall_exact(modules: Page, name: str, tmp_path: Path) -> None:
    P1, diameter, sac, protrusion, necks = VESSELS[name]
    tables = {
        "vessel": {"P1": P1, "diameter": diameter},
        "aneurysm": {"diameter": sac, "protrusion": protrusion},
        "site": {"eta": 0.5},
    }
    if name == "straight":
        tables["aneurysm"] = {"diameter": sac, "centre": [0.0, 3.25, 25.0]}
    case = Case.from_dict(tables)
    found = modules.evaluate(
        """([tables, device]) => {
          const how = { facets: 120, beyond: 0, closed: true };
          const mesh = lumenMesh(tables, geometry(tables, device), how);
          return [mesh.necks, mesh.watertight, base64(stl(mesh.vertices, mesh.triangles))];
        }""",
        [tables, device(case)],
    )
    assert len(found[0]) == necks
    assert found[1] is True
    (tmp_path / "vessel.stl").write_bytes(base64.b64decode(found[2]))
    surface = pyvista.read(tmp_path / "vessel.stl")
    assert surface.n_open_edges == 0
    vessel = case.vessel_geometry
    assert isinstance(vessel, SaccularVessel)
    sharp = SaccularVessel(vessel.tube, vessel.aneurysm, neck_fillet=0.0)
    edge = np.concatenate(found[0])
    assert np.abs(sharp.distance(edge)).max() < 1e-5
    assert np.abs(vessel.tube.distance(edge)).max() < 1e-5
    distance = np.abs(sharp.distance(surface.points))
    # The middles of the two flat ends are the only vertices that are not on the wall.
    assert np.sort(distance)[:-2].max() < 1e-5
    vertices, triangles = vessel_surface(sharp)
    faces = np.column_stack([np.full(len(triangles), 3), triangles])
    reference = pyvista.PolyData(vertices, faces.ravel())
    assert surface.volume == pytest.approx(reference.volume, rel=3e-3)


def test_wires_as_vtp_are_what_python_writes(
    show: Callable[..., Page], success: SimpleNamespace, tmp_path: Path
) -> None:
    page = show()
    text = page.evaluate(
        "vtp(positions, nodes, { distance_mm: positions.slice(0, 3408), wire: nodes,"
        " displacement_mm: positions }, 70)"
    )
    positions, braid = success.positions, success.case.braid
    wires = nodes_of_wires(braid)
    arrays = {
        "distance_mm": positions.ravel()[:3408],
        "wire": wires.ravel(),
        "displacement_mm": positions,
    }
    write_polylines(tmp_path / "python.vtp", positions, wires, arrays)
    assert text == (tmp_path / "python.vtp").read_text(encoding="ascii")
    (tmp_path / "page.vtp").write_text(text, encoding="ascii")
    read = pyvista.read(tmp_path / "page.vtp")
    assert np.array_equal(read.points, positions)
    assert np.array_equal(read.lines.reshape(48, 72)[:, 1:], wires)
    assert np.array_equal(read.point_data["displacement_mm"], positions)


def test_stl_keeps_points_and_outward_normals(modules: Page, tmp_path: Path) -> None:
    vertices = [0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 3]
    triangles = [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3]
    data = modules.evaluate(
        "([v, t]) => base64(stl(Float64Array.from(v), Uint32Array.from(t)))", [vertices, triangles]
    )
    (tmp_path / "t.stl").write_bytes(base64.b64decode(data))
    read = pyvista.read(tmp_path / "t.stl")
    assert read.volume == pytest.approx(1.0)
    assert read.n_points == 4
    records = np.frombuffer(base64.b64decode(data)[84:], dtype=("<f4", 3), count=1)
    assert records[0].tolist() == [0.0, 0.0, -1.0]


def test_scale_bar_lengths_are_round(modules: Page) -> None:
    longest = [0.07, 0.19, 1.0, 4.9, 5.0, 73.0]
    found = modules.evaluate(f"{json.dumps(longest)}.map(roundLength)")
    assert found == pytest.approx([0.05, 0.1, 1.0, 2.0, 5.0, 50.0])
