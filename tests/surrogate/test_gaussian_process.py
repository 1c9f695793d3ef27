"""Gaussian processes: closed forms, another library, symmetry, and what cannot be learned."""

import numpy as np
import pytest
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel

from braidcast.errors import InputError
from braidcast.surrogate.gaussian_process import JITTER, GaussianProcesses, fit_processes

RANDOM = np.random.default_rng(5)


def smooth(x: np.ndarray) -> np.ndarray:
    return np.stack([np.sin(x[:, 0]) + 0.3 * x[:, 1] ** 2, np.cos(x[:, 1]) * x[:, 0]], axis=1)


def test_two_points_have_a_closed_form() -> None:
    signal, noise, length = 2.0, 0.1, 1.5
    inputs, outputs = np.array([[0.0], [1.0]]), np.array([[1.0], [-0.5]])
    processes = GaussianProcesses(
        inputs, outputs, np.array([[length]]), np.array([signal]), np.array([noise]),
        np.zeros(1), np.ones(1), np.zeros(1),
    )  # fmt: skip

    def k(distance: float) -> float:
        r = np.sqrt(5.0) * abs(distance) / length
        return signal * (1.0 + r + r * r / 3.0) * np.exp(-r)

    own, across = signal + noise + JITTER * signal, k(1.0)
    determinant = own**2 - across**2
    a, b = k(0.3), k(0.7)
    mean = (a * (own * 1.0 + across * 0.5) + b * (-across * 1.0 - own * 0.5)) / determinant
    spread = own * (a * a + b * b) - 2.0 * across * a * b
    variance = signal + noise - spread / determinant
    found, std = processes.predict_with_std(np.array([[0.3]]))
    assert abs(found[0, 0] - mean) < 1e-10
    assert abs(std[0, 0] ** 2 - variance) < 1e-10
    assert processes.predict(np.array([[0.3]])) == pytest.approx(found, abs=1e-12)


@pytest.mark.parametrize("isotropic", [True, False])
def test_agrees_with_scikit_learn(isotropic: bool) -> None:
    inputs = RANDOM.normal(size=(40, 2))
    outputs = smooth(inputs) + 0.01 * RANDOM.normal(size=(40, 2))
    processes = fit_processes(inputs, outputs, isotropic=isotropic)
    points = RANDOM.normal(size=(7, 2))
    mean, std = processes.predict_with_std(points)
    for i in range(2):
        scales = processes.length_scales[i]
        assert not isotropic or scales[0] == scales[1]
        kernel = ConstantKernel(processes.signal[i]) * Matern(scales, nu=2.5)
        kernel += WhiteKernel(processes.noise[i])
        other = GaussianProcessRegressor(kernel, optimizer=None, alpha=JITTER * processes.signal[i])
        other.fit(inputs, outputs[:, i] - processes.offset[i])
        theirs, their_std = other.predict(points, return_std=True)
        assert np.abs(theirs + processes.offset[i] - mean[:, i]).max() < 1e-8
        assert np.abs(their_std - std[:, i]).max() < 1e-6


def test_learns_what_is_smooth_and_knows_where_it_does_not_know() -> None:
    inputs = RANDOM.uniform(-2.0, 2.0, size=(60, 2))
    processes = fit_processes(inputs, smooth(inputs))
    points = RANDOM.uniform(-1.5, 1.5, size=(50, 2))
    assert np.abs(processes.predict(points) - smooth(points)).max() < 0.02
    near = processes.predict_with_std(np.zeros((1, 2)))[1]
    far = processes.predict_with_std(np.full((1, 2), 20.0))[1]
    assert (far > 20.0 * near).all()


def test_shuffled_inputs_are_useless() -> None:
    inputs = RANDOM.uniform(-2.0, 2.0, size=(60, 2))
    processes = fit_processes(RANDOM.permutation(inputs), smooth(inputs))
    points = RANDOM.uniform(-1.5, 1.5, size=(200, 2))
    left = ((processes.predict(points) - smooth(points)) ** 2).mean(axis=0)
    assert (left > 0.8 * smooth(points).var(axis=0)).all()


def test_mirror_images_are_kept_and_count_as_observations() -> None:
    """x0 → -x0: the first output keeps its sign, the second changes it."""

    def truth(x: np.ndarray) -> np.ndarray:
        return np.stack([np.cos(x[:, 0]) + x[:, 1], np.sin(x[:, 0]) * x[:, 1]], axis=1)

    mirror, parity = np.array([-1.0, 1.0]), np.array([1.0, -1.0])
    inputs = RANDOM.uniform([0.0, -1.0], [3.0, 1.0], size=(50, 2))  # one half only
    processes = fit_processes(inputs, truth(inputs), mirror=mirror, parity=parity)
    points = RANDOM.uniform([-2.5, -1.0], [2.5, 1.0], size=(40, 2))
    mean, std = processes.predict_with_std(points)
    image, image_std = processes.predict_with_std(points * mirror)
    assert np.abs(image - parity * mean).max() < 1e-9
    assert np.abs(image_std - std).max() < 1e-9
    assert np.abs(mean - truth(points)).max() < 0.02
    assert (processes.predict_with_std(np.array([[0.0, 0.4]]))[1][0, 1]) < 1e-2


@pytest.mark.parametrize(
    ("inputs", "outputs", "said"),
    [
        (np.zeros((3, 2)), np.zeros((2, 1)), "3 inputs and 2 outputs"),
        (np.zeros((1, 2)), np.zeros((1, 1)), "at least 2"),
        (np.full((3, 2), np.nan), np.zeros((3, 1)), "finite"),
    ],
)
def test_bad_observations_are_refused(inputs: np.ndarray, outputs: np.ndarray, said: str) -> None:
    with pytest.raises(InputError, match=said):
        fit_processes(inputs, outputs)
