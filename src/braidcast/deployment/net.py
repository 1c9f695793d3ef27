"""The braid as a net of beams: where devices meet mechanics."""

import numpy as np

from braidcast.devices import Braid
from braidcast.mechanics import BeamNet, Section


def wire_section(braid: Braid) -> Section:
    """Cross-section of a wire."""
    return Section.circular(braid.wire_radius, braid.young_modulus, braid.poisson_ratio)


def braid_net(braid: Braid) -> BeamNet:
    """All wires, stress-free as made; contact sees their helices, not the chords."""
    elements = np.array(braid.elements)
    return BeamNet(
        np.array(braid.positions),
        elements,
        wire_section(braid),
        end_tangents=braid.tangents[elements],
    )
