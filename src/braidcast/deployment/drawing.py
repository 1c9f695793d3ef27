"""The process that draws: scenes and the vessel's surface in, PNG files out, both as pickles."""

from __future__ import annotations

import math
import pickle
import sys
from io import BytesIO
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from braidcast.deployment.picture import Array, Scene, Surface
from braidcast.deployment.polydata import polydata

if TYPE_CHECKING:
    import pyvista

#: Wires are 28 µm thick: at their own size most would be thinner than a pixel.
MAGNIFICATION = 2.0
SIZE = (1600, 900)
BARE_SIZE = (1200, 750)
BARE_BAND = (0.09, 0.98)
MARK = "#D55E00"
#: Where stent and sac may be, as shares of the picture's height: scale below, caption above.
BELOW, ABOVE = 0.16, 0.86
#: Height of a line of small print, as a share of the picture's height.
LINE = 0.026
LABELS = 6


def draw(scenes: list[Scene], surface: Surface) -> list[bytes]:
    """PNG bytes of each scene, at the risk of this process's life."""
    import pyvista

    def mesh(vertices: Array, triangles: NDArray[np.int64]) -> pyvista.PolyData:
        faces = np.column_stack([np.full(len(triangles), 3), triangles]).ravel()
        return pyvista.PolyData(np.asarray(vertices, dtype=np.float64), faces)

    return [_png(_image(scene, mesh(*(scene.surface or surface)))) for scene in scenes]


def _png(image: NDArray[np.uint8]) -> bytes:
    from PIL import Image

    stream = BytesIO()
    Image.fromarray(image).save(stream, format="PNG")
    return stream.getvalue()


def _image(scene: Scene, vessel: pyvista.PolyData) -> NDArray[np.uint8]:
    """Red, green and blue of each pixel, (height, width, 3)."""
    import pyvista

    size = BARE_SIZE if scene.bare else SIZE
    plotter = pyvista.Plotter(off_screen=True, window_size=list(size))
    try:
        plotter.set_background("white")
        plotter.enable_parallel_projection()
        plotter.enable_depth_peeling(8)
        plotter.enable_anti_aliasing("ssaa")
        if vessel.n_points:
            plotter.add_mesh(
                vessel,
                color="#d9a08f",
                opacity=0.25,
                smooth_shading=True,
                split_sharp_edges=True,
                specular=0.2,
            )
        if len(scene.wires):
            _add_wires(plotter, scene)
        _add_marks(plotter, scene)
        band = BARE_BAND if scene.bare else (BELOW, ABOVE - _add_caption(plotter, scene))
        view = _view(scene, *band, size)
        _aim(plotter, view)
        _add_ruler(plotter, view, size, 20 if scene.bare else 12)
        return np.asarray(plotter.screenshot(return_img=True))
    finally:
        plotter.close()


def _add_wires(plotter: pyvista.Plotter, scene: Scene) -> None:
    wires = polydata(scene.positions, scene.wires, {"value": scene.values})
    plotter.add_mesh(
        wires.tube(radius=MAGNIFICATION * scene.wire_radius, n_sides=8),
        scalars="value",
        clim=scene.limits,
        cmap="viridis",
        smooth_shading=True,
        show_scalar_bar=not scene.bare,
        scalar_bar_args={
            "title": f"{scene.legend}\n",
            "color": "black",
            "fmt": f"%.{decimals(scene.limits)}f",
            "n_labels": LABELS,
            "width": 0.4,
            "height": 0.1,
            "position_x": 0.3,
            "position_y": 0.02,
            "title_font_size": 24,
            "label_font_size": 22,
        },
    )


def _add_caption(plotter: pyvista.Plotter, scene: Scene) -> float:
    """Title and lines; the share of the height that they need more than usual."""
    lines = [*scene.lines, f"wires drawn {MAGNIFICATION:g} times as thick as they are"]
    lower = LINE * (len(lines) - 2)
    for text, height, font_size in (
        (scene.title, 0.945, 16),
        ("\n".join(lines), 0.875 - lower, 12),
    ):
        plotter.add_text(
            text,
            position=(0.015, height),
            viewport=True,
            font_size=font_size,
            color="black",
            shadow=False,
        )
    return lower


def decimals(limits: tuple[float, float]) -> int:
    """Decimals that the labels of the scale need to be what they say, to two digits."""
    step = (limits[1] - limits[0]) / (LABELS - 1)
    fewest = max(0, math.ceil(-math.log10(step) - 1e-9))
    exact = abs(step - round(step, fewest)) < 1e-6 * step
    return fewest if exact else fewest + 1


class _View(NamedTuple):
    """A parallel view: unit vectors to the right, up and towards the eye, what it is centred on,
    and half the height of what it shows, mm."""

    right: Array
    up: Array
    eye: Array
    centre: Array
    half_height: float


def _view(scene: Scene, below: float, above: float, size: tuple[int, int]) -> _View:
    """At right angles to the vessel's plane, stent and sac filling the height between the two."""
    shown = scene.positions
    along = _unit(scene.along, np.array([0.0, 0.0, 1.0]))
    upward = scene.upward - (scene.upward @ along) * along
    # A straight plain vessel has no plane: any direction across it will do.
    across = np.eye(3)[np.argmin(np.abs(along))]
    up = _unit(upward, np.cross(along, across))
    # A little to the side and from above, so that tubes look round.
    towards = np.cross(along, up)
    eye = _unit(towards + 0.18 * up - 0.25 * along, towards)
    right = _unit(np.cross(up, eye), along)
    top = np.cross(eye, right)
    frame = np.stack([right, top])
    flat = shown @ frame.T
    if scene.sac is not None:
        centre, radius = scene.sac
        sac = centre @ frame.T
        flat = np.concatenate([flat, [sac - radius, sac + radius]])
    low, high = flat.min(axis=0), flat.max(axis=0)
    width, height = high - low
    half = max(0.5 * height / (above - below), 0.5 * width * size[1] / size[0] / 0.92)
    # The middle of the free band between caption and scale is not the middle of the picture.
    off = np.array([0.0, (1.0 - above - below) * half])
    centre = (0.5 * (low + high) + off) @ frame + (shown @ eye).mean() * eye
    return _View(right, top, eye, centre, half)


def _aim(plotter: pyvista.Plotter, view: _View) -> None:
    camera = plotter.camera
    camera.focal_point = tuple(view.centre)
    camera.position = tuple(view.centre + 200.0 * view.eye)
    camera.up = tuple(view.up)
    camera.parallel_scale = view.half_height
    plotter.reset_camera_clipping_range()


def _add_marks(plotter: pyvista.Plotter, scene: Scene) -> None:
    """Marked nodes as balls, and curves as lines."""
    import pyvista

    if scene.marked is not None and len(scene.marked):
        balls = pyvista.PolyData(scene.positions[scene.marked]).glyph(
            geom=pyvista.Sphere(radius=10.0 * scene.wire_radius), scale=False, orient=False
        )
        plotter.add_mesh(balls, color=MARK)
    for curve in scene.curves:
        plotter.add_mesh(
            pyvista.MultipleLines(curve), color=MARK, line_width=4, render_lines_as_tubes=True
        )


def _add_ruler(
    plotter: pyvista.Plotter, view: _View, size: tuple[int, int], font_size: int
) -> None:
    """A line as long as a round number of millimetres, with that number, at the lower left."""
    import pyvista

    half = view.half_height * np.array([size[0] / size[1], 1.0])
    length = max(n for n in (0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100) if n <= max(0.1, half[0] / 2))
    # Just above the number.
    left, low = -0.97 * half[0], (4.4 * font_size / size[1] - 0.94) * half[1]
    # Nearer to the eye than anything else, so that nothing hides it.
    plane = view.centre + 100.0 * view.eye + low * view.up
    ends = plane + left * view.right, plane + (left + length) * view.right
    plotter.add_mesh(pyvista.Line(*ends), color="black", line_width=4, lighting=False)
    plotter.add_text(
        f"{length:g} mm",
        position=(0.015, 0.015),
        viewport=True,
        font_size=font_size,
        color="black",
    )
    plotter.reset_camera_clipping_range()


def _unit(vector: Array, otherwise: Array) -> Array:
    size = np.linalg.norm(vector)
    return vector / size if size > 1e-9 else otherwise


def _main() -> None:
    import pyvista  # noqa: F401 - meanwhile the other process finds out what to draw

    asked = sys.stdin.buffer.read()
    if asked:
        sys.stdout.buffer.write(pickle.dumps(draw(*pickle.loads(asked))))


if __name__ == "__main__":
    _main()
