"""The reduced order model: from predictors to snapshots, with their uncertainty (paper, 2.3).

Snapshots are written in the basis of their proper orthogonal decomposition, and a Gaussian process
gives each coefficient from the predictors,

    y(x) = mean + Σ c_l(x) v_l,    var y = Σ var c_l(x) v_l² + what the basis leaves out,

the diagonal of K_p = V K_L Vᵀ, which is never formed.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.utils.validation import check_is_fitted, validate_data

from braidcast.surrogate.gaussian_process import Progress, fit_processes
from braidcast.surrogate.pod import Basis, pod

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Mirror:
    """A mirror image of the problem: of its predictors and of its snapshots.

    ``predictors`` (p,) are factors 1 or -1; entry i of the image of a snapshot is ``factors[i]``
    (d,) times its entry ``order[i]`` (d,).
    """

    predictors: Array
    order: NDArray[np.int64]
    factors: Array

    def image(self, snapshots: Array) -> Array:
        """Images (n, d) of snapshots (n, d)."""
        return snapshots[:, self.order] * self.factors


class ReducedOrderModel(RegressorMixin, BaseEstimator):
    """Proper orthogonal decomposition and Gaussian process regression as one estimator.

    ``modes`` L; ``centred``: the mean snapshot is taken away before the decomposition;
    ``isotropic``: one length scale for all predictors; ``mirror``: a ``Mirror`` under which
    the problem looks the same, of which every snapshot then counts twice.
    """

    def __init__(
        self,
        modes: int = 15,
        *,
        centred: bool = True,
        isotropic: bool = False,
        mirror: Mirror | None = None,
    ) -> None:
        self.modes = modes
        self.centred = centred
        self.isotropic = isotropic
        self.mirror = mirror

    def fit(self, X: Array, y: Array, progress: Progress | None = None) -> Self:
        """Learn from predictors (n, p) and snapshots (n, d)."""
        X, y = validate_data(self, X, y, multi_output=True, y_numeric=True, dtype=np.float64)
        self.scale_ = X.std(axis=0)
        self.offset_ = X.mean(axis=0)
        if self.mirror is not None:
            # what changes its sign in the mirror lies as often on either side
            turned = self.mirror.predictors < 0
            self.offset_[turned] = 0.0
            self.scale_[turned] = np.sqrt((X[:, turned] ** 2).mean(axis=0))
        self.scale_[self.scale_ == 0.0] = 1.0
        self.basis_, parity = self._decompose(y)
        coefficients = self.basis_.coefficients(y)
        left_out = y - self.basis_.snapshots(coefficients)
        self.left_out_ = (left_out * left_out).mean(axis=0)
        if self.mirror is not None:
            self.left_out_ = 0.5 * (self.left_out_ + self.left_out_[self.mirror.order])
        self.processes_ = fit_processes(
            self.standardised(X),
            coefficients,
            isotropic=self.isotropic,
            mirror=None if self.mirror is None else self.mirror.predictors,
            parity=parity,
            progress=progress,
        )
        return self

    def predict(self, X: Array, return_std: bool = False) -> Array | tuple[Array, Array]:
        """Snapshots (m, d) at predictors (m, p), on request with their standard deviations."""
        points = self._checked(X)
        if not return_std:
            return self.basis_.snapshots(self.processes_.predict(points))
        return self.assembled(*self.processes_.predict_with_std(points))

    def assembled(self, mean: Array, std: Array) -> tuple[Array, Array]:
        """Snapshots (m, d) and their standard deviations, of coefficients (m, count).

        With fewer coefficients than modes those dropped count as left out.
        """
        count = mean.shape[1]
        basis, dropped = self.basis_.truncated(count), self.basis_.modes[count:]
        energy = (self.processes_.outputs[:, count:] ** 2).mean(axis=0)
        variance = (std * std) @ basis.modes**2 + (self.left_out_ + energy @ dropped**2)
        return basis.snapshots(mean), np.sqrt(variance)

    def sample(self, X: Array, count: int, rng: np.random.Generator) -> Array:
        """Snapshots (count, d) drawn at one set of predictors (1, p) or (p,)."""
        mean, std = self.processes_.predict_with_std(self._checked(np.atleast_2d(X)))
        drawn = mean + std * rng.standard_normal((count, mean.shape[1]))
        return self.basis_.snapshots(drawn)

    def _checked(self, X: Array) -> Array:
        check_is_fitted(self)
        return self.standardised(validate_data(self, X, reset=False, dtype=np.float64))

    def standardised(self, X: Array) -> Array:
        """Predictors (m, p) as the processes take them."""
        return (X - self.offset_) / self.scale_

    def _decompose(self, snapshots: Array) -> tuple[Basis, Array | None]:
        """The basis, and the parity (L,) of its modes under the mirror."""
        if self.mirror is None:
            return pod(snapshots, centred=self.centred).truncated(self.modes), None
        image = self.mirror.image(snapshots)
        even = pod(0.5 * (snapshots + image), centred=self.centred)
        odd = pod(0.5 * (snapshots - image), centred=False)
        values = np.concatenate([even.singular_values, odd.singular_values])
        order = np.argsort(-values, kind="stable")
        parity = np.repeat([1.0, -1.0], [len(even.modes), len(odd.modes)])[order]
        modes = np.concatenate([even.modes, odd.modes])[order]
        whole = Basis(even.mean, modes, values[order])
        return whole.truncated(self.modes), parity[: self.modes]
