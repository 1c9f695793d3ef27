"""Predictors: what they say of a case, and of its image seen from the other end."""

import numpy as np
import pytest

from braidcast.case import Case
from braidcast.errors import InputError
from braidcast.surrogate.placed_braid import placed_braid
from braidcast.surrogate.predictors import (
    SITE,
    SITE_MIRROR,
    bezier_predictors,
    centreline_predictors,
    end_depths,
    end_predictors,
    site_predictors,
)


def case(z: float = 28.0, eta: float = 0.3) -> Case:
    return Case.from_dict(
        {
            "vessel": {"P1": [0.0, 15.0, z], "diameter": 3.0},
            "aneurysm": {"diameter": 7.0, "protrusion": 0.5},
            "site": {"eta": eta},
        }
    )


def site(given: Case) -> np.ndarray:
    return site_predictors(given, placed_braid(given))


def test_the_papers_parameters() -> None:
    found = bezier_predictors(case())
    assert found[[0, 1, 2, 3, 5]] == pytest.approx([15.0, 28.0, 3.0, 7.0, 0.3])
    middle = case().centreline.at_arc_length([0.5 * case().centreline.length])[0]
    assert found[4] == pytest.approx(middle[1] + 1.5 + 0.5 * 3.5)


def test_centreline_points_lie_on_the_vessel_a_stent_length_apart() -> None:
    found = centreline_predictors(case(), 8)
    assert found.shape == (19,)
    points = np.column_stack([np.zeros(8), found[:16].reshape(8, 2)])
    distance, arc = case().centreline.closest(points)
    assert distance.max() < 1e-9
    assert np.diff(arc) == pytest.approx(case().crimped_length / 7)
    assert arc[0] == pytest.approx(case().start_arc_length)
    with pytest.raises(InputError, match="N_cl = 1 must be 2 or more"):
        centreline_predictors(case(), 1)


def test_the_site_by_hand() -> None:
    found = dict(zip(SITE, site(case()), strict=True))
    assert found["lean"] == pytest.approx(3.0)
    assert found["bend"] == pytest.approx(15.0)
    # the vessel leans a little where the sac is put above it
    assert found["neck_radius"] == pytest.approx(3.5 * np.sqrt(0.75), rel=1e-3)
    assert found["protrusion"] == pytest.approx(0.5, rel=1e-2)
    assert (found["lumen_radius"], found["sac_radius"]) == (1.5, 3.5)


def test_seen_from_the_other_end() -> None:
    """z → 50 - z turns the stent's site around the middle of the vessel."""
    spare = case().centreline.length - case().crimped_length
    eta = 0.3
    start = eta * (spare - 0.5)
    other = case(z=22.0, eta=(spare - start) / (spare - 0.5))
    assert site(other) == pytest.approx(SITE_MIRROR * site(case()), abs=1e-9)


def test_ends_seen_from_the_other_end_change_places() -> None:
    spare = case().centreline.length - case().crimped_length
    other = case(z=22.0, eta=(spare - 0.3 * (spare - 0.5)) / (spare - 0.5))
    ours, theirs = (end_predictors(c, placed_braid(c), site(c)) for c in (case(), other))
    assert theirs[::-1] == pytest.approx(ours, abs=1e-9)


def test_ends_by_hand() -> None:
    """The deepest node of an end ring; the vessel's turn between the ends."""
    given, placed = case(), placed_braid(case())
    rings = np.array(given.braid.rings)
    assert given.aneurysm_centre is not None
    reach = 3.5 - np.linalg.norm(placed.positions - given.aneurysm_centre, axis=1) - 0.014
    depths = [reach[rings == 0].max(), reach[rings == 70].max()]
    assert end_depths(given, placed.positions) == pytest.approx(depths, abs=1e-12)
    found = dict(zip(SITE, site(given), strict=True))
    both = np.exp(np.array(depths) / 2.0)
    assert found["exposure"] == pytest.approx(both.sum())
    assert found["exposure_difference"] == pytest.approx(both[0] - both[1])
    tangents = placed.axes[[0, -1], :, 2]
    assert found["turn"] == pytest.approx(np.arccos(tangents[0] @ tangents[1]))


def test_a_plain_vessel_is_refused() -> None:
    plain = Case.from_dict(
        {"vessel": {"P1": [0.0, 15.0, 25.0], "diameter": 3.0}, "site": {"eta": 0.5}}
    )
    for predictors in (bezier_predictors, site):
        with pytest.raises(InputError, match="aneurysm is missing"):
            predictors(plain)
