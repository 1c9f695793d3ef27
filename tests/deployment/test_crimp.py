"""Crimping the paper's device at full size, and what is kept of it."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from braidcast.deployment import crimp as module
from braidcast.deployment.crimp import CrimpingFailed, crimp, crimped_state
from braidcast.devices import Braid
from braidcast.errors import InputError
from braidcast.mechanics import Equilibrium, Joints, State

PAPER = Braid()
RADIUS = 0.45 * PAPER.axis_radius
SMALL = Braid(wires=12, segments=24)


@pytest.fixture(scope="session")
def crimped(once: Callable[[str, Callable[[], Equilibrium]], Equilibrium]) -> Equilibrium:
    return once("crimped_045", lambda: crimp(PAPER, RADIUS))


def ring_heights(positions: np.ndarray) -> np.ndarray:
    return np.bincount(PAPER.rings, positions[:, 2]) / PAPER.wires


def test_length_is_that_of_inextensible_wires(crimped: Equilibrium) -> None:
    assert crimped.converged
    heights = ring_heights(crimped.state.positions)
    assert heights[-1] - heights[0] == pytest.approx(26.1127, rel=1e-5)
    assert heights[-1] - heights[0] == pytest.approx(PAPER.crimped_length(RADIUS), rel=1e-5)


def test_wires_are_helices_again(crimped: Equilibrium) -> None:
    helices = PAPER.positions_on_cylinder(RADIUS, PAPER.crimped_length(RADIUS))
    assert np.abs(crimped.state.positions - helices).max() < 1e-4


def test_radius_is_the_one_asked_for_and_no_node_turns_about_the_axis(
    crimped: Equilibrium,
) -> None:
    across = crimped.state.positions[:, :2]
    assert np.abs(across - RADIUS / PAPER.axis_radius * PAPER.positions[:, :2]).max() < 1e-12


def test_joints_by_penalty_give_the_same_state(crimped: Equilibrium) -> None:
    penalty = crimp(PAPER, RADIUS, joints=Joints(np.array(PAPER.crossings), "penalty"))
    assert penalty.converged
    assert np.abs(penalty.state.positions - crimped.state.positions).max() < 1e-5
    assert np.abs(penalty.state.rotations - crimped.state.rotations).max() < 1e-5


def by_wire(values: np.ndarray) -> np.ndarray:
    """(2 families, N_w/2 wires, nodes along the wire, ...)."""
    return values.reshape(2, PAPER.wires // 2, PAPER.segments + 1, *values.shape[1:])


def test_a_turn_by_the_distance_of_two_wires_maps_it_on_itself(crimped: Equilibrium) -> None:
    c, s = np.cos(np.pi / 12), np.sin(np.pi / 12)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    positions, rotations = by_wire(crimped.state.positions), by_wire(crimped.state.rotations)
    assert np.abs(positions @ turn.T - np.roll(positions, -1, axis=1)).max() < 1e-9
    assert np.abs(turn @ rotations @ turn.T - np.roll(rotations, -1, axis=1)).max() < 1e-6


def test_its_mirror_image_exchanges_the_families(crimped: Equilibrium) -> None:
    mirror = np.array([-1.0, 1.0, 1.0])
    positions = by_wire(crimped.state.positions)
    # the angle theta of a node becomes pi - theta: wire n one way is wire 12 - n the other
    partner = (12 - np.arange(24)) % 24
    assert np.abs(mirror * positions[0] - positions[1, partner]).max() < 1e-9


@pytest.mark.parametrize("radius", [0.0, -1.0, 2.7, float("nan")])
def test_a_radius_that_cannot_be_is_refused(radius: float) -> None:
    with pytest.raises(InputError, match="crimped_radius"):
        crimp(SMALL, radius)


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "not" / "yet" / "there"
    monkeypatch.setenv("BRAIDCAST_CACHE", str(folder))
    return folder


@pytest.fixture
def crimps(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Radii of every crimping that is computed."""
    computed: list[float] = []

    def counted(braid: Braid, radius: float, **options: Any) -> Equilibrium:
        computed.append(radius)
        return crimp(braid, radius, **options)

    monkeypatch.setattr(module, "crimp", counted)
    return computed


def same(first: State, second: State) -> bool:
    return np.array_equal(first.positions, second.positions) and np.array_equal(
        first.rotations, second.rotations
    )


def test_a_device_is_crimped_once(cache: Path, crimps: list[float]) -> None:
    first = crimped_state(SMALL, 0.8)
    assert same(crimped_state(Braid(wires=12, segments=24), 0.8), first)
    assert crimps == [0.8]
    assert [file.suffix for file in cache.iterdir()] == [".npz"]


def test_each_device_and_radius_has_its_own_state(cache: Path, crimps: list[float]) -> None:
    crimped_state(SMALL, 0.8)
    crimped_state(SMALL, 0.9)
    crimped_state(Braid(wires=12, segments=24, wire_radius=0.02), 0.8)
    assert crimps == [0.8, 0.9, 0.8]
    assert len(list(cache.iterdir())) == 3


def shorten(content: bytes) -> bytes:
    return content[: len(content) // 2]


def flip(content: bytes) -> bytes:
    middle = len(content) // 2
    return content[:middle] + bytes([content[middle] ^ 0xFF]) + content[middle + 1 :]


@pytest.mark.parametrize(
    "spoil",
    [shorten, flip, lambda _: b"", lambda _: b"not at all numpy's"],
    ids=["half", "one byte wrong", "empty", "of another kind"],
)
def test_a_spoilt_file_is_computed_anew(
    spoil: Callable[[bytes], bytes], cache: Path, crimps: list[float]
) -> None:
    first = crimped_state(SMALL, 0.8)
    (file,) = cache.iterdir()
    file.write_bytes(spoil(file.read_bytes()))
    assert same(crimped_state(SMALL, 0.8), first)
    assert len(crimps) == 2
    assert same(crimped_state(SMALL, 0.8), first)
    assert len(crimps) == 2


def test_a_cache_that_cannot_be_written_costs_only_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, crimps: list[float]
) -> None:
    # below a file there can be no folder, not even for root
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("BRAIDCAST_CACHE", str(tmp_path / "file" / "cache"))
    assert same(crimped_state(SMALL, 0.8), crimped_state(SMALL, 0.8))
    assert len(crimps) == 2


def test_failure_to_crimp_is_said_and_not_kept(
    cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    options = module.NewtonOptions
    monkeypatch.setattr(module, "NewtonOptions", lambda **given: options(**given, iterations=0))
    with pytest.raises(CrimpingFailed, match="crimping to 0.8 mm failed: stopped at load factor"):
        crimped_state(SMALL, 0.8)
    assert not cache.exists()
