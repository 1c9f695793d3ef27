"""The smooth tube that most of a lumen's wall lies on.

Centre c(u) and radius r(u) are splines along the vessel. The squares of the misses |p − c| − r of
the wall's places p and the roughness of c and r are least; places that lie farther out than the
tube, in an aneurysm or a side branch, lose their weight (iteratively reweighted least squares, as
P. W. Holland and R. E. Welsch, Communications in Statistics A 6 (1977) 813-827).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import block_array, block_diag, csc_array, diags_array
from scipy.sparse.linalg import spsolve

from braidcast.vessels.smooth_spline import basis, even_knots, roughness, shares

Array = NDArray[np.float64]

_REWEIGHTINGS = 6
_HOLD = 1e-6
_ROUND = 0.1
"""A section with walls all around, as far from its centre to this share, is the vessel's own even
if the tube's radius is another: it is at a stenosis, or beside one."""
LEAST_SEEN = 1.0 / 3.0
"""Share of a section's wall that must lie on the tube, or its neighbours tell centre and radius."""


@dataclass(frozen=True, eq=False)
class Sections:
    """Sections across a vessel, at u (m,) mm along it."""

    u: Array
    tangents: Array
    """(m, 3)."""
    centres: Array
    """(m, 3) mm."""
    radii: Array
    """(m,) mm."""
    wall: Array
    """Places of the wall (m, k, 3) mm."""
    seen: NDArray[np.bool_]
    """Whether there is such a place (m, k)."""

    def misses(self, centres: Array, radii: Array) -> tuple[Array, Array]:
        """How far the wall is outside the tube, (m, k) mm, and where it is seen, (m, k, 3)."""
        off = self.wall - centres[:, None]
        off -= np.einsum("mki,mi->mk", off, self.tangents)[..., None] * self.tangents[:, None]
        size = np.linalg.norm(off, axis=2)
        return size - radii[:, None], off / np.where(size > 0.0, size, 1.0)[..., None]


def fitted(
    sections: Sections, tolerance: float, bend: float, swell: float, order: int = 3
) -> tuple[Array, Array, Array]:
    """Centres (m, 3) and radii (m,) mm of the tube, and the share of each section on it (m,).

    A place loses most of its weight ``tolerance`` times the radius outside the tube. ``bend`` and
    ``swell`` are the smoothing lengths, mm, of centre and radius, ``order`` is the derivative of
    the centre that is to be small.
    """
    u, m = sections.u, len(sections.u)
    knots = even_knots(float(u[0]), float(u[-1]), max(4, m))
    rows = basis(knots, u)
    bending = bend ** (2 * order) * roughness(knots, order)
    swelling = swell**4 * roughness(knots, 2)
    stiff = block_diag([bending, bending, bending, swelling], format="csc")
    share_of_length = shares(u)
    centres, radii = sections.centres, sections.radii
    pin = np.einsum("mi,mj->mij", sections.tangents, sections.tangents)
    for _ in range(_REWEIGHTINGS):
        miss, e = sections.misses(centres, radii)
        apart = miss + radii[:, None]
        own = sections.seen.all(axis=1) & (apart.std(axis=1) < _ROUND * apart.mean(axis=1))
        level = np.where(own, np.median(miss, axis=1), 0.0)
        size = (miss - level[:, None]) / (tolerance * radii[:, None])
        # Nothing but the vessel's own wall can lie inside the tube.
        weight = np.where(size > 0.0, 1.0 / (1.0 + size**2) ** 2, 1.0 / (1.0 - np.minimum(size, 0)))
        weight = np.where(sections.seen, weight, 0.0)
        share = ((size < 2.0) & sections.seen).mean(axis=1)
        weight *= (share >= LEAST_SEEN)[:, None] * (2.0 / weight.shape[1])
        one = np.concatenate([e, np.ones((*e.shape[:2], 1))], axis=2)
        target = miss + radii[:, None] + np.einsum("mki,mi->mk", e, centres)
        matrix = np.einsum("mk,mki,mkj->mij", weight, one, one)
        right = np.einsum("mk,mki,mk->mi", weight, one, target)
        # Along the vessel a centre has no reason to move.
        matrix[:, :3, :3] += pin
        right[:, :3] += np.einsum("mij,mj->mi", pin, centres)
        # Where no wall is seen at all the radius stays.
        matrix[:, 3, 3] += _HOLD
        right[:, 3] += _HOLD * radii
        blocks = block_array(
            [
                [rows.T @ diags_array(share_of_length * matrix[:, i, j]) @ rows for j in range(4)]
                for i in range(4)
            ]
        )
        load = rows.T @ (share_of_length[:, None] * right)
        solution = spsolve(csc_array(blocks + stiff), load.T.ravel()).reshape(4, -1)
        values = rows @ solution.T
        centres, radii = values[:, :3], np.maximum(values[:, 3], 0.1 * sections.radii)
    return centres, radii, share
