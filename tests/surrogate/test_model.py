"""A surrogate from simulations to predictions: what it learns, and that it knows its limits."""

from pathlib import Path

import numpy as np
import pytest

from braidcast import Case, InputError
from braidcast.dataset.folder import DatasetFolder
from braidcast.dataset.plan import Plan
from braidcast.dataset.work import Job, do_case
from braidcast.surrogate.evaluate import evaluate
from braidcast.surrogate.model import SurrogateModel
from braidcast.surrogate.recipes import RECIPES, seen_from_the_other_end
from braidcast.surrogate.train import FEWEST, train
from braidcast.surrogate.training_set import Simulations


def changed(case: Case, **tables: dict[str, object]) -> Case:
    data = case.to_dict()
    for name, keys in tables.items():
        data[name] = {**data.get(name, {}), **keys}
    return Case.from_dict(data)


def test_predicts_what_it_has_not_seen(model: SurrogateModel, simulations: Simulations) -> None:
    found = evaluate(model, simulations)
    assert len(found.numbers) == len(simulations.regression_tests) > 5
    assert not set(found.numbers) & set(model.numbers)
    assert found.prediction.AE_p < found.geometry.AE_p / 5.0
    assert found.nearest is not None and found.prediction.AE_p < found.nearest.AE_p / 5.0
    assert found.projection.AE_p < found.prediction.AE_p
    assert found.inside > 0.85
    assert found.classes.accuracy > 0.85 and found.classes.AUC > 0.95
    figures = model.record["test"]["shapes"]["prediction"]
    assert figures["AE_mm"] == pytest.approx(found.prediction.AE_p)


def test_learns_from_training_cases_only(simulations: Simulations) -> None:
    test, train_ = simulations.regression_tests, simulations.regression_training
    assert not set(test) & set(train_)
    assert set(test) | set(train_) == set(np.flatnonzero(simulations.success))
    assert simulations.test[test].all()
    assert not simulations.test[simulations.classification_training].any()


def test_shuffled_predictors_are_useless(simulations: Simulations) -> None:
    recipe, shapes = RECIPES["ours"], simulations.regression_training
    rng = np.random.default_rng(0)
    views = [recipe.view(simulations.cases[k]) for k in shapes]
    inputs = np.array([view.predictors for view in views])
    shapes_ = np.array(
        [
            v.reference.departure(simulations.positions[k]).ravel()
            for v, k in zip(views, shapes, strict=True)
        ]
    )
    half = len(shapes) // 2
    cases = [simulations.cases[k] for k in shapes]

    def left(given: np.ndarray) -> float:
        rom = recipe.reduced_order_model(cases, 5).fit(given[:half], shapes_[:half])
        error = rom.predict(inputs[half:]) - shapes_[half:]
        return float((error**2).mean() / shapes_[half:].var(axis=0).mean())

    shuffled = inputs.copy()
    shuffled[:half] = rng.permutation(inputs[:half])
    assert left(shuffled) > 0.8
    assert left(inputs) < 0.1


def test_the_papers_recipe_is_the_papers(simulations: Simulations) -> None:
    """Absolute displacements, 15 modes, no mean taken away, one length scale a process."""
    model = train(simulations, RECIPES["paper"])
    rom = model.rom
    assert len(rom.basis_.modes) == 15 and not rom.basis_.mean.any()
    assert (rom.processes_.length_scales == rom.processes_.length_scales[:, :1]).all()
    index = simulations.regression_training[0]
    snapshots = rom.basis_.snapshots(rom.processes_.outputs[:1])
    displacement = simulations.positions[index] - simulations.cases[index].braid.positions
    assert np.abs(snapshots.reshape(-1, 3) - displacement).max() < 0.05
    assert rom.processes_.inputs.shape[1] == 2 * 8 + 3


def test_std_and_samples_agree(model: SurrogateModel, simulations: Simulations) -> None:
    """Variances turned from the rings' axes against shapes drawn from the same distribution."""
    prediction = model.predict(simulations.cases[0])
    samples = prediction.sample(4000, rng=1)
    assert samples.shape == (4000, *prediction.positions.shape)
    assert np.abs(samples.mean(axis=0) - prediction.positions).max() < 0.1 * prediction.std.max()
    rough = prediction.std > np.median(prediction.std)
    assert np.abs(samples.std(axis=0)[rough] / prediction.std[rough] - 1.0).mean() < 0.1
    assert np.array_equal(samples, prediction.sample(4000, rng=1))


def test_shape_alone_is_the_same(model: SurrogateModel, simulations: Simulations) -> None:
    case = simulations.cases[3]
    assert np.abs(model.positions(case) - model.predict(case).positions).max() < 1e-12


def test_a_stent_seen_from_the_other_end_is_predicted_the_same(model: SurrogateModel) -> None:
    """z to 50 − z, and the site from the other end."""
    case = model.case
    _, y, z = case.vessel.P1
    spare = case.centreline.length - case.crimped_length
    eta = (spare - case.start_arc_length) / (spare - 0.5)
    other = changed(case, vessel={"P1": [0.0, y, 50.0 - z]}, site={"eta": min(eta, 1.0)})
    ours, theirs = model.predict(case), model.predict(other)
    mirror = seen_from_the_other_end([case])
    assert mirror is not None
    order = mirror.order[::3] // 3
    image = theirs.positions[order] * [1.0, 1.0, -1.0] + [0.0, 0.0, 50.0]
    assert np.abs(image - ours.positions).max() < 1e-6
    # a variance is a small difference of large numbers
    assert np.abs(theirs.std[order] ** 2 - ours.std**2).max() < 1e-9
    assert theirs.success_probability == pytest.approx(ours.success_probability, abs=1e-9)


def test_outside_the_training_intervals_grow(model: SurrogateModel) -> None:
    inside = model.predict(model.case)
    assert inside.in_range and inside.out_of_range == () and inside.nearest_distance < 1e-9
    assert inside.nearest_case == model.numbers[0]
    case = changed(
        model.case, vessel={"diameter": 4.6}, aneurysm={"diameter": 12.0}, wall={"friction": 0.3}
    )
    outside = model.predict(case)
    assert not outside.in_range
    assert outside.out_of_range == (
        "vessel_diameter = 4.6 mm, trained from 2.5 to 3.5 mm",
        "aneurysm_diameter = 12 mm, trained from 6 to 8 mm",
        "wall_friction = 0.3, trained at 0.1",
    )
    assert outside.std.mean() > 3.0 * inside.std.mean()
    assert outside.nearest_distance > 1.0


def test_a_sac_given_by_its_centre_is_the_same_sac(model: SurrogateModel) -> None:
    case = model.case
    assert case.aneurysm is not None and case.aneurysm_centre is not None
    tables = case.to_dict()
    tables["aneurysm"] = {
        "diameter": case.aneurysm.diameter,
        "centre": case.aneurysm_centre.tolist(),
    }
    found = model.predict(Case.from_dict(tables))
    assert found.in_range
    assert np.abs(found.positions - model.predict(case).positions).max() < 1e-9
    aside = case.aneurysm_centre + [0.3, 0.0, 0.0]
    tables["aneurysm"]["centre"] = aside.tolist()
    assert "aneurysm_aside" in model.predict(Case.from_dict(tables)).out_of_range[0]


def test_what_cannot_be_predicted_is_refused(model: SurrogateModel) -> None:
    with pytest.raises(InputError, match=r"device.wires = 16 must be 12, that of the device the"):
        model.predict(changed(model.case, device={"wires": 16}))
    plain = model.case.to_dict()
    del plain["aneurysm"]
    with pytest.raises(InputError, match="aneurysm is missing"):
        model.predict(Case.from_dict(plain))


def test_no_mirror_where_there_is_none(model: SurrogateModel) -> None:
    assert seen_from_the_other_end([changed(model.case, device={"segments": 21})]) is None
    assert seen_from_the_other_end([changed(model.case, vessel={"P1": [1.0, 15.0, 25.0]})]) is None


def test_too_few_successes_are_refused(simulations: Simulations) -> None:
    few = simulations.regression_training[: FEWEST - 1]
    with pytest.raises(InputError, match="19 successful cases to learn from, must be 20 or more"):
        train(simulations, RECIPES["ours"], shapes=few)


def test_failed_and_waiting_cases_are_refused_or_left_out(
    store: DatasetFolder, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match="90 waiting cases, must have none"):
        Simulations.of(DatasetFolder.create(store.plan, tmp_path / "empty"))

    def broken(case: Case, crimped: Path) -> None:
        raise RuntimeError("no equilibrium")

    other = DatasetFolder.create(store.plan, tmp_path / "data")
    other.cases_folder.mkdir()
    do_case(Job(other.path, other.plan_id, broken), 0)  # type: ignore[arg-type]
    for index in range(1, 60):
        other.case_file(index).write_bytes(store.case_file(index).read_bytes())
    with pytest.raises(InputError, match="has 1 failed and 30 waiting cases, must have none"):
        Simulations.of(other)
    found = Simulations.of(other, finished_only=True)
    assert found.numbers.tolist() == list(range(1, 60))


def test_cases_of_another_plan_are_refused(store: DatasetFolder, tmp_path: Path) -> None:
    plan = Plan.from_text(store.plan.text.replace("seed = 3", "seed = 4"))
    foreign = DatasetFolder.create(plan, tmp_path / "foreign")
    foreign.cases_folder.mkdir()
    foreign.case_file(0).write_bytes(store.case_file(0).read_bytes())
    with pytest.raises(InputError, match="belongs to another plan"):
        Simulations.of(foreign)
