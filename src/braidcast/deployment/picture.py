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
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from braidcast.deployment.result import Array, Deployment

if TYPE_CHECKING:
    import pyvista

#: Wires are 28 µm thick: at their own size most would be thinner than a pixel.
MAGNIFICATION = 2.0
SIZE = (1600, 1000)


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
            opacity=0.22,
            smooth_shading=True,
            split_sharp_edges=True,
            specular=0.2,
        )
        wires = deployment.to_polydata()
        radius = MAGNIFICATION * deployment.case.braid.wire_radius
        plotter.add_mesh(
            wires.tube(radius=radius, n_sides=8),
            scalars="gap_mm",
            # At most a tenth of a millimetre apart, all would be noise in full colour.
            clim=(0.0, max(0.1, float(np.max(deployment.wire_distance)))),
            cmap="viridis",
            smooth_shading=True,
            scalar_bar_args={
                "title": "distance of wire to wall (mm)\n",
                "color": "black",
                "fmt": "%.2f",
                "n_labels": 5,
                "width": 0.4,
                "height": 0.09,
                "position_x": 0.3,
                "position_y": 0.03,
                "title_font_size": 22,
                "label_font_size": 20,
            },
        )
        plotter.add_text(_caption(deployment), position="upper_left", font_size=11, color="black")
        _aim(plotter, deployment)
        image = np.asarray(plotter.screenshot(return_img=True))
    finally:
        plotter.close()
    stream = BytesIO()
    Image.fromarray(image).save(stream, format="PNG", optimize=True)
    return stream.getvalue()


def _caption(deployment: Deployment) -> str:
    lines = [
        f"outcome: {deployment.outcome}" + ("" if deployment.converged else " (NOT CONVERGED)"),
        f"wires drawn {MAGNIFICATION:g} times as thick as they are",
    ]
    title = deployment.case.title
    return "\n".join([title, *lines] if title else lines)


def _aim(plotter: pyvista.Plotter, deployment: Deployment) -> None:
    """Look at right angles to the vessel's plane, the sac upwards, stent and sac filling it."""
    case = deployment.case
    shown = deployment.positions
    ends = case.centreline.P2 - case.centreline.P0
    along = _unit(ends, np.array([0.0, 0.0, 1.0]))
    middle = case.centreline.at_arc_length(case.centreline.length / 2.0)[0]
    aneurysm = case.vessel_geometry.aneurysm
    if aneurysm is not None:
        centre, sac = aneurysm.centre, aneurysm.radius
        upward = centre - middle
        box = np.stack([centre + sac * sign * axis for sign in (-1, 1) for axis in np.eye(3)])
        shown = np.concatenate([shown, box])
    else:
        upward = case.centreline.P1 - 0.5 * (case.centreline.P0 + case.centreline.P2)
    upward = upward - (upward @ along) * along
    # A straight plain vessel has no plane: any direction across it will do.
    across = np.eye(3)[np.argmin(np.abs(along))]
    up = _unit(upward, np.cross(along, across))
    towards = np.cross(along, up)
    # A little to the side and from above, so that tubes look round.
    eye = _unit(towards + 0.18 * up - 0.25 * along, towards)
    right = _unit(np.cross(up, eye), along)
    top = np.cross(eye, right)
    frame = np.stack([right, top])
    low, high = (shown @ frame.T).min(axis=0), (shown @ frame.T).max(axis=0)
    focus = 0.5 * (low + high) @ frame + (shown @ eye).mean() * eye
    width, height = high - low
    camera = plotter.camera
    camera.focal_point = tuple(focus)
    camera.position = tuple(focus + 200.0 * eye)
    camera.up = tuple(top)
    # Margins leave room for the caption above and the scale below.
    camera.parallel_scale = max(0.5 * height / 0.68, 0.5 * width * SIZE[1] / SIZE[0] / 0.85)
    plotter.reset_camera_clipping_range()


def _unit(vector: Array, otherwise: Array) -> Array:
    size = np.linalg.norm(vector)
    return vector / size if size > 1e-9 else otherwise


if __name__ == "__main__":
    sys.stdout.buffer.write(draw(*pickle.load(sys.stdin.buffer)))
