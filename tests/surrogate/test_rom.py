"""The reduced order model as an estimator: what it learns, what it knows of its errors."""

import numpy as np
import pytest
from sklearn.base import clone
from sklearn.model_selection import cross_val_score
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from braidcast.surrogate.rom import Mirror, ReducedOrderModel

PLACES = np.linspace(-1.0, 1.0, 41)
MIRROR = Mirror(np.array([-1.0, 1.0]), np.arange(40, -1, -1), np.ones(41))


def bump(x: np.ndarray) -> np.ndarray:
    """A bump at x0 of width x1 over the places: mirrored with x0."""
    return np.exp(-(((PLACES - x[:, :1]) / (1.0 + 0.3 * x[:, 1:])) ** 2))


def drawn(count: int, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-1.0, 1.0, size=(count, 2))


@pytest.fixture(scope="module")
def plain() -> ReducedOrderModel:
    return ReducedOrderModel(8).fit(drawn(60, 1), bump(drawn(60, 1)))


@pytest.fixture(scope="module")
def mirrored() -> ReducedOrderModel:
    return ReducedOrderModel(8, mirror=MIRROR).fit(drawn(30, 1), bump(drawn(30, 1)))


def test_learns_a_smooth_map(plain: ReducedOrderModel) -> None:
    points = drawn(50, 2)
    gap = np.linalg.norm(points[:, None] - drawn(60, 1), axis=2)
    nearest = bump(drawn(60, 1))[gap.argmin(axis=1)]
    error = np.abs(plain.predict(points) - bump(points)).mean()
    assert error < 0.05 * np.abs(nearest - bump(points)).mean()


def test_half_the_data_do_where_the_mirror_image_is_known(mirrored: ReducedOrderModel) -> None:
    points = drawn(50, 2)
    alone = ReducedOrderModel(8).fit(drawn(30, 1), bump(drawn(30, 1)))

    def error(model: ReducedOrderModel) -> float:
        return float(np.abs(model.predict(points) - bump(points)).mean())

    assert error(mirrored) < 0.5 * error(alone)


def test_the_image_of_a_prediction_is_the_prediction_of_the_image(
    mirrored: ReducedOrderModel,
) -> None:
    points = drawn(20, 3)
    mean, std = mirrored.predict(points, return_std=True)
    image, image_std = mirrored.predict(points * MIRROR.predictors, return_std=True)
    assert np.abs(MIRROR.image(mean) - image).max() < 1e-9
    assert np.abs(std[:, MIRROR.order] ** 2 - image_std**2).max() < 1e-4


def test_intervals_hold_what_they_say() -> None:
    """With noise in the snapshots 95 % intervals hold some 95 % of new ones."""
    rng = np.random.default_rng(4)
    inputs, points = drawn(80, 5), drawn(200, 6)
    noisy = bump(inputs) + 0.05 * rng.normal(size=(80, 41))
    model = ReducedOrderModel(6).fit(inputs, noisy)
    mean, std = model.predict(points, return_std=True)
    inside = np.abs(bump(points) + 0.05 * rng.normal(size=mean.shape) - mean) < 1.96 * std
    assert 0.92 < inside.mean() < 0.98


def test_samples_scatter_as_the_standard_deviation_says(plain: ReducedOrderModel) -> None:
    point = np.array([[0.2, -0.4]])
    mean, std = plain.processes_.predict_with_std(plain.standardised(point))
    samples = plain.sample(point, 4000, np.random.default_rng(7))
    coefficients = plain.basis_.coefficients(samples)
    assert np.abs(coefficients.std(axis=0) / std[0] - 1.0).max() < 0.06
    assert (np.abs(coefficients.mean(axis=0) - mean[0]) < 5.0 * std[0] / np.sqrt(4000)).all()


def test_is_an_estimator_like_any_other() -> None:
    model = ReducedOrderModel(4, isotropic=True)
    assert clone(model).get_params() == model.get_params()
    pipeline = make_pipeline(StandardScaler(), model)
    scores = cross_val_score(pipeline, drawn(40, 8), bump(drawn(40, 8)), cv=3)
    assert (scores > 0.95).all()
