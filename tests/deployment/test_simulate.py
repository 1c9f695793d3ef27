"""From a case to a deployment: what is reported, and how a failure ends."""

import json
import signal
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from braidcast import cli
from braidcast.case import Case
from braidcast.deployment import position, release
from braidcast.deployment.result import Deployment
from braidcast.deployment.simulate import simulate
from braidcast.mechanics import Equilibrium, NewtonOptions, State, equilibrium, relaxation
from braidcast.mechanics.equilibrium import newton
from braidcast.mechanics.system import System


@pytest.fixture(scope="session")
def small() -> Case:
    """A coarse braid in a curved vessel with a sac: a whole simulation in half a second."""
    return Case.from_dict(
        {
            "vessel": {"P1": [0.0, 15.0, 25.0], "diameter": 3.0},
            "aneurysm": {"diameter": 7.0, "protrusion": 0.5},
            "device": {"wires": 12, "segments": 24},
            "site": {"eta": 0.5},
        }
    )


@pytest.fixture(scope="session")
def plain(small: Case) -> Deployment:
    return simulate(small)


def test_the_record_agrees_with_itself(plain: Deployment, small: Case) -> None:
    braid = small.braid
    assert plain.converged and plain.reason
    assert plain.case == small
    assert plain.positions.shape == (braid.node_count, 3)
    assert np.abs(np.linalg.det(plain.rotations) - 1.0).max() < 1e-12
    distance = -small.vessel_geometry.distance(plain.positions) - braid.wire_radius
    assert plain.wire_distance == pytest.approx(distance, abs=1e-12)
    assert plain.contact_force.min() >= 0.0 and plain.contact_force.sum() > 0.0
    assert plain.residual_N / plain.contact_force.sum() == pytest.approx(
        plain.residual_relative, rel=1e-9
    )
    assert plain.crimped_length_mm == pytest.approx(small.crimped_length, rel=1e-4)
    assert plain.free_length_mm < plain.deployed_length_mm < plain.crimped_length_mm
    assert plain.strain_energy_mJ > 0.0
    assert plain.outcome == "success" and plain.end_nodes_in_sac == 0
    assert plain.newton_iterations > 0
    assert 0.0 < plain.cpu_seconds and 0.0 < plain.wall_seconds
    assert plain.frames == []


def test_the_same_case_gives_the_same_answer_to_the_last_bit(
    plain: Deployment, small: Case
) -> None:
    again = simulate(small)
    assert np.array_equal(again.positions, plain.positions)
    assert np.array_equal(again.rotations, plain.rotations)


def test_the_linear_solver_does_not_matter(plain: Deployment, small: Case) -> None:
    other = simulate(small, linear_solver="superlu")
    assert other.converged
    # rounding alone decides which points stick first: the repeatability bars, not rounding itself
    apart = np.linalg.norm(other.positions - plain.positions, axis=1)
    assert apart.mean() < 5e-3 and apart.max() < 20e-3


def test_progress_goes_through_the_stages(small: Case) -> None:
    calls: list[tuple[str, float]] = []
    simulate(small, progress=lambda stage, fraction: calls.append((stage, fraction)))
    stages = [stage for stage, _ in calls]
    assert list(dict.fromkeys(stages)) == ["crimp", "position", "release"]
    for stage in set(stages):
        fractions = [fraction for name, fraction in calls if name == stage]
        assert fractions == sorted(fractions)
        assert 0.0 <= fractions[0] and fractions[-1] == 1.0


def test_frames_lead_from_the_free_braid_to_the_result(plain: Deployment, small: Case) -> None:
    kept = simulate(small, keep_frames=True)
    stages = [stage for stage, _ in kept.frames]
    assert list(dict.fromkeys(stages)) == ["free", "crimp", "position", "release"]
    assert stages.count("release") > 3
    assert np.array_equal(kept.frames[0][1], small.braid.positions)
    assert np.array_equal(kept.frames[-1][1], kept.positions)
    assert np.array_equal(kept.positions, plain.positions)


def test_without_an_aneurysm_there_is_no_sac(small: Case) -> None:
    tables = small.to_dict()
    del tables["aneurysm"]
    result = simulate(Case.from_dict(tables))
    assert result.converged
    assert result.outcome == "success"


def starved(system: System, state: State, options: NewtonOptions, **others: Any) -> Equilibrium:
    """Newton's method that gives up before its first step."""
    return newton(system, state, replace(options, iterations=0, tolerance=0.0), **others)


FAILURES = {
    "crimping to 0.7842 mm failed: stopped at load factor 0": equilibrium,
    "positioning stopped at 0 of the bend": position,
    "the motion stopped after 0 of": relaxation,
    "no equilibrium within 0 Newton iterations": release,
}


@pytest.mark.parametrize("reason", FAILURES)
def test_no_equilibrium_is_said_with_the_last_state(
    reason: str, small: Case, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("BRAIDCAST_CACHE", str(tmp_path))
    monkeypatch.setattr(FAILURES[reason], "newton", starved)
    result = simulate(small)
    assert not result.converged
    assert reason in result.reason
    assert np.isfinite(result.positions).all() and np.isfinite(result.rotations).all()
    assert result.outcome in ("success", "failure")


@pytest.mark.parametrize("reason", FAILURES)
def test_the_command_ends_with_3_and_writes_the_last_state(
    reason: str,
    small: Case,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("BRAIDCAST_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(FAILURES[reason], "newton", starved)
    assert run(small, monkeypatch, tmp_path) == 3
    assert reason in capsys.readouterr().err
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["converged"] is False and reason in summary["reason"]
    assert (tmp_path / "out" / "deployed.vtp").exists()


def test_the_command_simulates(
    small: Case, plain: Deployment, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    assert run(small, monkeypatch, tmp_path) == 0
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["converged"] is True
    assert summary["outcome"] == plain.outcome
    assert summary["deployed_length_mm"] == pytest.approx(plain.deployed_length_mm, rel=1e-12)


def run(case: Case, monkeypatch: pytest.MonkeyPatch, folder: Path) -> Any:
    """Exit code of ``braidcast simulate``; its handlers of signals stay those of the test."""
    from braidcast.deployment import picture

    find: Callable[[str], None] = lambda name: None  # noqa: E731
    monkeypatch.setattr(picture, "find_spec", find)
    monkeypatch.setattr(signal, "signal", lambda *_: signal.SIG_DFL)
    (folder / "case.toml").write_text(case.to_toml())
    arguments = ["braidcast", "simulate", str(folder / "case.toml"), "-o", str(folder / "out")]
    monkeypatch.setattr(sys, "argv", arguments)
    with pytest.raises(SystemExit) as ended:
        cli.main()
    return ended.value.code or 0
