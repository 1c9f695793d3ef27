"""The braid's geometry: the paper's device, its invariants and its limits."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial import cKDTree

from braidcast.devices import Braid, catalogue
from braidcast.errors import InputError

PAPER = catalogue["paper"]

braids = st.builds(
    Braid,
    wires=st.integers(2, 30).map(lambda half: 2 * half),
    segments=st.integers(1, 40),
    length=st.floats(5, 30),
    literal_angle=st.booleans(),
)


def test_the_papers_mesh():
    assert PAPER.positions.shape == (3408, 3)
    assert PAPER.elements.shape == (3360, 2)
    assert PAPER.crossings.shape == (1704, 2)
    assert PAPER.end_nodes.shape == (96,)
    assert PAPER.axis_radius == 2.614
    assert_allclose(70 * PAPER.angle_step / (2 * np.pi), 1.458, atol=5e-4)


def test_nodes_follow_their_formula():
    for wire, ring in [(0, 0), (5, 31), (24, 70), (40, 12)]:
        turn = 1 if wire < 24 else -1
        angle = turn * ring * math.radians(7.5) + (wire % 24) * math.radians(15)
        expected = [2.614 * math.cos(angle), 2.614 * math.sin(angle), ring * 15 / 70]
        assert_allclose(PAPER.positions[71 * wire + ring], expected, atol=1e-13)
        assert PAPER.rings[71 * wire + ring] == ring
        assert PAPER.wire_of_node[71 * wire + ring] == wire


@settings(deadline=None, max_examples=60)
@given(braids)
def test_crossings_are_exactly_the_coincident_nodes(braid):
    found = cKDTree(braid.positions).query_pairs(1e-9, output_type="ndarray")
    assert set(map(tuple, np.sort(found, axis=1).tolist())) == set(
        map(tuple, braid.crossings.tolist())
    )
    assert_array_equal(np.sort(braid.crossings.ravel()), np.arange(braid.node_count))


@settings(deadline=None, max_examples=60)
@given(braids)
def test_elements_have_one_length_and_join_neighbours_of_a_wire(braid):
    first, second = braid.elements.T
    lengths = np.linalg.norm(braid.positions[second] - braid.positions[first], axis=1)
    assert_allclose(lengths, braid.segment_length, rtol=1e-12)
    assert_array_equal(braid.wire_of_node[first], braid.wire_of_node[second])
    assert_array_equal(braid.rings[second] - braid.rings[first], 1)
    assert len(braid.elements) == braid.wires * braid.segments


def test_crimped_length():
    assert_allclose(PAPER.crimped_length(PAPER.axis_radius), 15.0, rtol=1e-14)
    assert_allclose(PAPER.crimped_length(0.45 * PAPER.axis_radius), 26.1127, atol=1e-4)
    literal = Braid(literal_angle=True)
    assert_allclose(literal.crimped_length(0.45 * literal.axis_radius), 45.2, atol=0.05)
    assert_allclose(PAPER.crimped_length(1e-9), PAPER.straight_length, rtol=1e-12)
    crimped = PAPER.positions_on_cylinder(0.78, PAPER.crimped_length(0.78))
    ends = crimped[PAPER.elements]
    assert_allclose(
        np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1), PAPER.segment_length, rtol=1e-12
    )


@pytest.mark.parametrize("radius", [0.0, -1.0, 3.2, float("nan")])
def test_impossible_crimped_radius_is_refused(radius):
    with pytest.raises(InputError, match="crimped radius"):
        PAPER.crimped_length(radius)


def test_angles_and_spacing_of_the_wires():
    # Spacing from the nodes: the nearest two parallel wires, on the unrolled cylinder.
    around, along = 2 * np.pi * 2.614 / 24, 15 / (70 * math.radians(7.5) * 2.614)
    assert_allclose(math.tan(PAPER.pitch_angle), along, rtol=1e-14)
    assert_allclose(PAPER.wire_spacing, around * along / math.hypot(1, along), rtol=1e-14)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("wires", 47),
        ("wires", 2),
        ("wires", 48.5),
        ("wires", "48"),
        ("wires", True),
        ("segments", 0),
        ("radius", 0.0),
        ("radius", float("nan")),
        ("length", -1.0),
        ("length", float("inf")),
        ("wire_radius", 0.0),
        ("wire_radius", 0.2),
        ("young_modulus", 0.0),
        ("poisson_ratio", 0.51),
        ("poisson_ratio", -1.0),
    ],
)
def test_impossible_braids_are_named(field, value):
    with pytest.raises(InputError, match=field):
        Braid(**{field: value})


def test_braids_compare_by_value_and_keep_their_arrays():
    assert Braid() == PAPER and hash(Braid()) == hash(PAPER)
    assert Braid(wires=24) != PAPER
    assert PAPER.positions is PAPER.positions
    with pytest.raises(ValueError, match="read-only"):
        PAPER.positions[0, 0] = 1.0


def test_tangents_are_those_of_the_helices() -> None:
    """The chord between neighbours is the mean of their tangents, up to its length."""
    braid = Braid()
    chords = np.diff(braid.positions.reshape(48, 71, 3), axis=1)
    tangents = braid.tangents.reshape(48, 71, 3)
    mean = tangents[:, :-1] + tangents[:, 1:]
    cosine = np.einsum("nij,nij->ni", chords, mean) / (
        np.linalg.norm(chords, axis=2) * np.linalg.norm(mean, axis=2)
    )
    np.testing.assert_allclose(cosine, 1.0, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(braid.tangents, axis=1), 1.0)
    np.testing.assert_allclose(braid.tangents[:, 2], np.sin(braid.pitch_angle))
