"""The model that ships with braidcast, against simulations that it has not learned from."""

from pathlib import Path

import numpy as np
import pytest

from braidcast import Case, SurrogateModel, load_model, simulate
from braidcast.surrogate import model_file
from braidcast.surrogate.metrics import NodeErrors, share_inside

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture(scope="module")
def shipped() -> SurrogateModel:
    return load_model()


@pytest.mark.slow
def test_predicts_a_simulation(shipped: SurrogateModel) -> None:
    """Errors within the bars of the whole test set: mean 0.012, largest 0.15 mm."""
    case = Case.from_toml(EXAMPLES / "success.toml")
    simulated, prediction = simulate(case), shipped.predict(case)
    errors = NodeErrors.of(prediction.positions[None], simulated.positions[None])
    assert errors.AE_p < 0.012 and errors.ME_p < 0.15
    assert share_inside(prediction.positions, prediction.std, simulated.positions) > 0.8
    assert prediction.outcome == simulated.outcome == "success"
    assert prediction.in_range
    length = simulated.deployed_length_mm
    assert abs(prediction.deployed_length_mm - length) < 1e-3 * length


def test_foresees_the_failure(shipped: SurrogateModel) -> None:
    prediction = shipped.predict(Case.from_toml(EXAMPLES / "failure_end_in_sac.toml"))
    assert prediction.outcome == "failure" and prediction.success_probability < 0.2


def test_carries_its_own_test_figures(shipped: SurrogateModel) -> None:
    figures = shipped.record["test"]
    assert figures["shapes"]["cases"] == 50 and figures["outcomes"]["cases"] == 100
    assert figures["shapes"]["prediction"]["AE_mm"] < 0.008
    assert figures["outcomes"]["accuracy"] >= 0.97


def test_is_small() -> None:
    assert (Path(model_file.__file__).parent / model_file.SHIPPED).stat().st_size < 10e6


def test_knows_its_device(shipped: SurrogateModel) -> None:
    assert shipped.applicability.device["wires"] == 48
    assert np.array_equal(shipped.case.braid.positions, shipped.case.device.braid.positions)
    assert shipped.case.braid.node_count == 3408
