"""Ways to build a surrogate: what it is told of a case, and in which terms it learns the shape.

``paper`` is the recipe of the paper, exactly: displacements from the free braid, in the axes of
space, from μ_cl with 8 points, 15 modes, one length scale, no centring. ``ours`` learns how far the
braid departs from where geometry alone places it, in the vessel's own axes, and that vessels look
the same from either end.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from braidcast.case import Case
from braidcast.devices import Braid
from braidcast.surrogate.placed_braid import PlacedBraid, placed_braid
from braidcast.surrogate.predictors import (
    SITE,
    SITE_MIRROR,
    centreline_predictors,
    end_predictors,
    site_predictors,
)
from braidcast.surrogate.rom import Mirror, ReducedOrderModel

Array = NDArray[np.float64]

CENTRELINE_POINTS = 8
"""N_cl of the paper's best predictors."""


@dataclass(frozen=True)
class View:
    """A case as a recipe sees it: ``predictors`` (p,) of the shape and ``ends`` (2, 8) of the
    outcome; snapshots are departures from ``reference``."""

    predictors: Array
    ends: Array
    reference: PlacedBraid


@dataclass(frozen=True)
class Recipe:
    """``modes``: numbers L to choose from by cross-validation; ``names`` (p,) of the predictors."""

    name: str
    names: tuple[str, ...]
    view: Callable[[Case], View]
    modes: tuple[int, ...]
    centred: bool
    isotropic: bool
    mirrored: bool

    def reduced_order_model(self, cases: Sequence[Case], modes: int) -> ReducedOrderModel:
        """An unfitted model for these cases."""
        return ReducedOrderModel(
            modes,
            centred=self.centred,
            isotropic=self.isotropic,
            mirror=seen_from_the_other_end(cases) if self.mirrored else None,
        )


def seen_from_the_other_end(cases: Sequence[Case]) -> Mirror | None:
    """The mirror image that exchanges the ends of the vessel, or None if there is none.

    The vessels must lie in the plane of y and z and end on parallels to z, so that rings have the
    same axes from either end; then x and y of a departure stay and the part along the vessel turns.
    """
    if not all(_is_symmetric(case) for case in cases):
        return None
    order = _image(cases[0].braid)
    if order is None:
        return None
    entries = (3 * order[:, None] + np.arange(3)).ravel()
    return Mirror(SITE_MIRROR, entries, np.tile([1.0, 1.0, -1.0], len(order)))


def _is_symmetric(case: Case) -> bool:
    chord = case.bezier.P2 - case.bezier.P0
    x = [point[0] for point in (case.tube.P0, case.tube.P1, case.tube.P2)]
    return bool(np.ptp(x) == 0.0 and chord[1] == 0.0 and chord[2] > 0.0)


def _image(braid: Braid) -> NDArray[np.int64] | None:
    """The node (N,) that lies where the mirror image of each node is, on a wire of the other sense.

    None if the braid is not its own image: with an odd number of segments it is turned.
    """
    half = braid.node_count // 2
    image = braid.positions * [1.0, 1.0, -1.0] + [0.0, 0.0, braid.length]
    families = np.split(np.arange(braid.node_count), [half])
    order = np.empty(braid.node_count, dtype=np.int64)
    for own, other in (families, families[::-1]):
        distance, nearest = KDTree(braid.positions[other]).query(image[own])
        if distance.max() > 1e-6 * braid.radius:
            return None
        order[own] = other[nearest]
    return order


def _ours(case: Case) -> View:
    placed = placed_braid(case)
    site = site_predictors(case, placed)
    return View(site, end_predictors(case, placed, site), placed)


def _paper(case: Case) -> View:
    free = np.broadcast_to(np.eye(3), (case.braid.segments + 1, 3, 3))
    predictors = centreline_predictors(case, CENTRELINE_POINTS)
    placed = placed_braid(case)
    ends = end_predictors(case, placed, site_predictors(case, placed))
    return View(predictors, ends, PlacedBraid(case.braid.positions, free, case.braid.length))


_CENTRELINE = (
    *(f"{axis}_Q{point + 1}" for point in range(CENTRELINE_POINTS) for axis in "yz"),
    *("vessel_diameter", "aneurysm_diameter", "y_Ca"),
)

MODES = (8, 12, 16, 20, 24, 30)

RECIPES = {
    "ours": Recipe("ours", SITE, _ours, MODES, centred=True, isotropic=False, mirrored=True),
    "paper": Recipe(
        "paper", _CENTRELINE, _paper, (15,), centred=False, isotropic=True, mirrored=False
    ),
}
