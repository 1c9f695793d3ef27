"""Joints of the paper's braid: springs of the paper's stiffness against shared translations."""

import numpy as np
import pytest

from braidcast.deployment.crimp import crimp
from braidcast.devices import Braid
from braidcast.mechanics import Joints


@pytest.mark.slow
def test_crimped_braid_by_penalty_and_by_shared_translations():
    braid = Braid()
    shared, penalty = (
        crimp(braid, 0.45 * braid.axis_radius, joints=Joints(braid.crossings, method, 1e3))
        for method in ("shared", "penalty")
    )
    assert shared.converged and penalty.converged
    apart = np.linalg.norm(shared.state.positions - penalty.state.positions, axis=1)
    assert apart.max() < 1e-5
