"""A picture of a deployed braid: vessel translucent, wires coloured by their distance to it.

Needs ``braidcast[pictures]``. The drawing is done in a process of its own, because VTK does not
raise an error where it finds no OpenGL: it ends the process.
"""

from __future__ import annotations

import pickle
import subprocess
import sys
from dataclasses import replace
from importlib.util import find_spec
from io import BytesIO
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from braidcast.deployment.result import Array, Deployment

if TYPE_CHECKING:
    import pyvista

#: Wires are 28 µm thick: at their own size most would be thinner than a pixel.
MAGNIFICATION = 2.0
SIZE = (1600, 900)
#: The same colour means the same distance in every picture; this and more, mm, is the last one.
FARTHEST = 1.0
#: Where stent and sac may be, as shares of the picture's height: scale below, caption above.
BELOW, ABOVE = 0.16, 0.86

_PATIENCE_SECONDS = 120.0


class PictureError(RuntimeError):
    """Why there is no picture, and what would give one."""


def picture_png(deployment: Deployment, surface: tuple[Array, NDArray[np.int64]]) -> bytes:
    """Draw the deployment and its vessel's ``surface`` (vertices, triangles); PNG bytes.

    ``PictureError`` if PyVista is not installed or finds no OpenGL on this machine.
    """
    if find_spec("pyvista") is None:
        raise PictureError("PyVista is not installed: pip install 'braidcast[pictures]'")
    try:
        drawn = subprocess.run(
            [sys.executable, "-m", "braidcast.deployment.picture"],
            input=pickle.dumps((replace(deployment, frames=[]), surface)),
            capture_output=True,
            timeout=_PATIENCE_SECONDS,
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise PictureError(f"the drawing process failed: {error}") from None
    if drawn.returncode < 0:
        raise PictureError("VTK found no OpenGL here: install libegl1, or Mesa's software OpenGL")
    if drawn.returncode or not drawn.stdout.startswith(b"\x89PNG"):
        said = drawn.stderr.decode(errors="replace").strip().splitlines() or ["no reason given"]
        raise PictureError(f"the picture could not be drawn: {said[-1]}")
    return drawn.stdout


def draw(deployment: Deployment, surface: tuple[Array, NDArray[np.int64]]) -> bytes:
    """The same in this process, at the risk of its life."""
    import pyvista
    from PIL import Image

    vertices, triangles = surface
    faces = np.column_stack([np.full(len(triangles), 3), triangles]).ravel()
    plotter = pyvista.Plotter(off_screen=True, window_size=list(SIZE))
    try:
        plotter.set_background("white")
        plotter.enable_parallel_projection()
        plotter.enable_depth_peeling(8)
        plotter.enable_anti_aliasing("ssaa")
        plotter.add_mesh(
            pyvista.PolyData(np.asarray(vertices, dtype=np.float64), faces),
            color="#d9a08f",
            opacity=0.25,
            smooth_shading=True,
            split_sharp_edges=True,
            specular=0.2,
        )
        wires = deployment.to_polydata()
        radius = MAGNIFICATION * deployment.case.braid.wire_radius
        plotter.add_mesh(
            wires.tube(radius=radius, n_sides=8),
            scalars="gap_mm",
            clim=(0.0, FARTHEST),
            cmap="viridis",
            smooth_shading=True,
            scalar_bar_args={
                "title": f"distance from wire to wall (mm; yellow: {FARTHEST:g} mm or more)\n",
                "color": "black",
                "fmt": "%.1f",
                "n_labels": 6,
                "width": 0.4,
                "height": 0.1,
                "position_x": 0.3,
                "position_y": 0.02,
                "title_font_size": 24,
                "label_font_size": 22,
            },
        )
        title, *lines = _caption(deployment)
        for text, height, size in ((title, 0.945, 16), ("\n".join(lines), 0.875, 12)):
            plotter.add_text(
                text,
                position=(0.015, height),
                viewport=True,
                font_size=size,
                color="black",
                shadow=False,
            )
        view = _view(deployment)
        _aim(plotter, view)
        _add_ruler(plotter, view)
        image = np.asarray(plotter.screenshot(return_img=True))
    finally:
        plotter.close()
    stream = BytesIO()
    Image.fromarray(image).save(stream, format="PNG", optimize=True)
    return stream.getvalue()


def _caption(deployment: Deployment) -> list[str]:
    d = deployment
    title = " ".join(d.case.title.split()) or "Deployed stent"
    outcome = f"outcome: {d.outcome}"
    if d.case.aneurysm is not None:
        outcome += f", {d.end_nodes_in_sac} of {len(d.case.braid.end_nodes)} end nodes in the sac"
    return [
        title if len(title) <= 80 else title[:77] + "...",
        outcome if d.converged else f"{outcome}; NOT CONVERGED",
        f"wires drawn {MAGNIFICATION:g} times as thick as they are",
    ]


class _View(NamedTuple):
    """A parallel view: unit vectors to the right, up and towards the eye, what it is centred on,
    and half the height of what it shows, mm."""

    right: Array
    up: Array
    eye: Array
    centre: Array
    half_height: float


def _view(deployment: Deployment) -> _View:
    """At right angles to the vessel's plane, the sac upwards, stent and sac filling it."""
    case = deployment.case
    shown = deployment.positions
    along = _unit(case.centreline.P2 - case.centreline.P0, np.array([0.0, 0.0, 1.0]))
    middle = case.centreline.at_arc_length(case.centreline.length / 2.0)[0]
    aneurysm = case.vessel_geometry.aneurysm
    if aneurysm is not None:
        upward = aneurysm.centre - middle
    else:
        upward = case.centreline.P1 - 0.5 * (case.centreline.P0 + case.centreline.P2)
    upward = upward - (upward @ along) * along
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
    if aneurysm is not None:
        sac = aneurysm.centre @ frame.T
        flat = np.concatenate([flat, [sac - aneurysm.radius, sac + aneurysm.radius]])
    low, high = flat.min(axis=0), flat.max(axis=0)
    width, height = high - low
    half = max(0.5 * height / (ABOVE - BELOW), 0.5 * width * SIZE[1] / SIZE[0] / 0.92)
    # The middle of the free band between caption and scale is not the middle of the picture.
    off = np.array([0.0, (1.0 - ABOVE - BELOW) * half])
    centre = (0.5 * (low + high) + off) @ frame + (shown @ eye).mean() * eye
    return _View(right, top, eye, centre, half)


def _aim(plotter: pyvista.Plotter, view: _View) -> None:
    camera = plotter.camera
    camera.focal_point = tuple(view.centre)
    camera.position = tuple(view.centre + 200.0 * view.eye)
    camera.up = tuple(view.up)
    camera.parallel_scale = view.half_height
    plotter.reset_camera_clipping_range()


def _add_ruler(plotter: pyvista.Plotter, view: _View) -> None:
    """A line as long as a round number of millimetres, with that number, at the lower left."""
    import pyvista

    half = view.half_height * np.array([SIZE[0] / SIZE[1], 1.0])
    length = max(n for n in (0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100) if n <= max(0.1, half[0] / 2))
    left, low = -0.97 * half[0], -0.88 * half[1]
    # Nearer to the eye than anything else, so that nothing hides it.
    plane = view.centre + 100.0 * view.eye + low * view.up
    ends = plane + left * view.right, plane + (left + length) * view.right
    plotter.add_mesh(pyvista.Line(*ends), color="black", line_width=4, lighting=False)
    plotter.add_text(
        f"{length:g} mm", position=(0.015, 0.015), viewport=True, font_size=12, color="black"
    )
    plotter.reset_camera_clipping_range()


def _unit(vector: Array, otherwise: Array) -> Array:
    size = np.linalg.norm(vector)
    return vector / size if size > 1e-9 else otherwise


if __name__ == "__main__":
    sys.stdout.buffer.write(draw(*pickle.load(sys.stdin.buffer)))
