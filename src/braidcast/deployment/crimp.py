"""Crimping: the free braid is squeezed onto a thinner cylinder.

Paper, section 2.1.3: the circumferential freedoms are blocked, every node gets the same radial
displacement, and the braid lengthens as it likes. The result depends on the device and the
crimped radius alone, so it is computed once and kept.
"""

import hashlib
from dataclasses import astuple, replace
from pathlib import Path

import numpy as np

from braidcast.cache_folder import cache_folder
from braidcast.deployment.net import braid_net
from braidcast.devices import Braid
from braidcast.errors import InputError
from braidcast.kept_arrays import keep, read_kept
from braidcast.mechanics import (
    Equilibrium,
    Joints,
    NewtonOptions,
    Problem,
    State,
    Supports,
    follow_path,
)
from braidcast.mechanics.equilibrium import Progress

VERSION = 2
"""Raised whenever the crimped state of the same device would come out differently."""


class CrimpingFailed(Exception):
    """No equilibrium at the crimped radius; ``equilibrium`` is the last state, with the reason."""

    def __init__(self, equilibrium: Equilibrium) -> None:
        super().__init__(equilibrium.reason)
        self.equilibrium = equilibrium


def crimp(
    braid: Braid,
    crimped_radius: float,
    *,
    joints: Joints | None = None,
    progress: Progress | None = None,
) -> Equilibrium:
    """Equilibrium with all wire axes at ``crimped_radius`` (mm) from the axis of the braid.

    The first ring stays in its plane; ``joints`` default to shared translations. Raises
    InputError if the radius is not between 0 and that of the free braid.
    """
    if not 0.0 < crimped_radius <= braid.axis_radius:
        raise InputError(
            f"site.crimped_radius is {crimped_radius} mm; it must be above 0 and at most "
            f"{braid.axis_radius} mm, the free radius of the wire axes"
        )
    net = braid_net(braid)
    count = len(net.nodes)
    radial = net.nodes * [1.0, 1.0, 0.0] / braid.axis_radius
    axial = np.tile([0.0, 0.0, 1.0], (count, 1))
    axes = np.stack([radial, np.cross(axial, radial), axial], axis=2)
    fixed = np.zeros((count, 6), dtype=bool)
    fixed[:, :2] = True
    rings = np.array(braid.rings)
    fixed[rings == 0, 2] = True
    motion = np.zeros((count, 6))
    motion[:, 0] = crimped_radius - braid.axis_radius
    problem = Problem(
        net,
        joints=joints or Joints(np.array(braid.crossings)),
        supports=Supports(fixed, motion, axes),
        levels=rings,
    )
    return follow_path(problem, steps=4, options=NewtonOptions(tolerance=1e-7), progress=progress)


def crimped_state(
    braid: Braid,
    crimped_radius: float,
    progress: Progress | None = None,
    cache: Path | None = None,
) -> State:
    """The crimped state, from the cache when this device was crimped before.

    The ``cache`` is a folder, by default ``BRAIDCAST_CACHE`` or the user's cache folder; a file
    there is named by all that it depends on, written whole or not at all, and computed anew when
    unreadable.

    Raises CrimpingFailed if crimping does not converge.
    """
    folders, name = (cache or cache_folder(),), _cache_name(braid, crimped_radius)
    kept = read_kept(folders, name)
    if kept is not None and {"positions", "rotations"} <= kept.keys():
        return State(kept["positions"], kept["rotations"])
    result = crimp(braid, crimped_radius, progress=progress)
    if not result.converged:
        reason = f"crimping to {crimped_radius:.4g} mm failed: {result.reason}"
        raise CrimpingFailed(replace(result, reason=reason))
    state = result.state
    keep(folders, name, {"positions": state.positions, "rotations": state.rotations})
    return state


def _cache_name(braid: Braid, crimped_radius: float) -> str:
    key = repr((VERSION, astuple(braid), float(crimped_radius)))
    return f"crimped_{hashlib.sha256(key.encode()).hexdigest()[:24]}.npz"
