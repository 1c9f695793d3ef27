"""The reduced order model of the paper: errors by modes, predictors and simulations (2.3, 3.2).

Everything is as in the paper: displacements from the free braid along x, y, z, no centring, one
Gaussian process a coefficient with one length scale. Only what the captions vary is varied.
"""

from collections.abc import Callable, Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from braidcast.case import Case
from braidcast.study import published
from braidcast.study.sizes import Size
from braidcast.study.workspace import Study
from braidcast.surrogate.metrics import NodeErrors
from braidcast.surrogate.pod import modes_for, pod
from braidcast.surrogate.predictors import bezier_predictors, centreline_predictors
from braidcast.surrogate.rom import ReducedOrderModel
from braidcast.surrogate.training_set import Simulations

Array = NDArray[np.float64]

MODES = 15
"""L of the paper."""

MOST_MODES = 40
"""Errors are computed for every L up to this, or to what the smallest tolerance asks for."""

TOLERANCES = (0.1, 0.01, 0.001)

PREDICTORS: dict[str, Callable[[Case], Array]] = {
    "Bezier": bezier_predictors,
    "Ncl=3": lambda case: centreline_predictors(case, 3),
    "Ncl=5": lambda case: centreline_predictors(case, 5),
    "Ncl=8": lambda case: centreline_predictors(case, 8),
}
"""μ_B, and μ_cl with 3, 5 and 8 points, as Table 4 calls them."""

REFERENCE = 146
"""Training shapes that the paper compares others with."""

BEST = "Ncl=8"

RESOLUTIONS = {"3DRA": 0.15, "CTA": 0.4}
"""What the paper measures errors by: the resolution of 3D rotational and of CT angiography, mm."""


def displacements(simulations: Simulations, indices: NDArray[np.int64]) -> Array:
    """Snapshots (n, 3N) mm: nodes of the released less those of the free braid."""
    free = simulations.cases[0].braid.positions
    return (simulations.positions[indices] - free).reshape(len(indices), -1)


def predictors(simulations: Simulations, indices: NDArray[np.int64], name: str) -> Array:
    """Predictors (n, p) of a name of ``PREDICTORS``."""
    return np.array([PREDICTORS[name](simulations.cases[k]) for k in indices])


def file_of(name: str, count: int, centred: bool = False) -> str:
    """The table of errors of a model with these predictors and so many training shapes."""
    return f"shapes/{name.replace('=', '')}_{count}{'_centred' if centred else ''}"


def errors_by_modes(study: Study, size: Size, name: str, centred: bool = False) -> list[str]:
    """AE and ME, mm, of the projection (rb) and of the prediction (p) of every test, by L.

    Processes are independent, so that one model with the most modes gives those with fewer.
    """
    simulations = study.simulations(size.cases)
    training, tests = size.training(simulations), simulations.regression_tests
    snapshots, true = displacements(simulations, training), displacements(simulations, tests)
    basis = pod(snapshots, centred=centred)
    wanted = modes_for(basis.singular_values, TOLERANCES[-1])
    most = min(max(MOST_MODES, wanted), len(basis.modes))
    model = ReducedOrderModel(most, centred=centred, isotropic=True)
    model.fit(predictors(simulations, training, name), snapshots)
    asked = model.standardised(predictors(simulations, tests, name))
    mean = model.processes_.predict(asked)
    projected = model.basis_.coefficients(true)
    rows = []
    for L in range(1, most + 1):
        basis = model.basis_.truncated(L)
        rb, p = (_errors(basis.snapshots(c[:, :L]), true) for c in (projected, mean))
        values = {"AE_rb": rb.AE, "ME_rb": rb.ME, "AE_p": p.AE, "ME_p": p.ME}
        rows.append(pd.DataFrame({"L": L, "case": simulations.numbers[tests], **values}))
    return [study.write_table(file_of(name, size.shapes, centred), pd.concat(rows))]


def singular_values(study: Study, sizes: Sequence[Size]) -> list[str]:
    """singular_values.csv: σ of the snapshot matrix, and what the first L leave out of Σσ, Σσ²."""
    simulations = study.simulations(sizes[-1].cases)
    rows = []
    for size in sizes:
        snapshots = displacements(simulations, size.training(simulations))
        sigma = pod(snapshots, centred=False).singular_values
        sums, squares = np.cumsum(sigma), np.cumsum(sigma * sigma)
        rows.append(
            pd.DataFrame(
                {
                    "N_train": size.shapes,
                    "L": np.arange(1, len(sigma) + 1),
                    "sigma_mm": sigma,
                    "share_of_sum": sums / sums[-1],
                    "share_of_squares": squares / squares[-1],
                }
            )
        )
    return [study.write_table("singular_values", pd.concat(rows))]


def by_modes(study: Study, sizes: Sequence[Size]) -> list[str]:
    """errors_by_modes.csv: test means by L and training size, with μ_B."""
    frame = pd.concat(
        _means(study, file_of("Bezier", size.shapes)).assign(N_train=size.shapes) for size in sizes
    )
    frame["AE_gpr"] = frame["AE_p"] - frame["AE_rb"]
    return [study.write_table("errors_by_modes", frame)]


def table3(study: Study, sizes: Sequence[Size]) -> list[str]:
    """table3.csv: L by tolerance, and errors with μ_B; beside the paper's."""
    sigma = study.table("singular_values")
    rows = []
    for count in (size.shapes for size in sizes):
        values = sigma.loc[sigma["N_train"] == count, "sigma_mm"].to_numpy()
        means = _means(study, file_of("Bezier", count)).set_index("L")
        for tolerance in TOLERANCES:
            L = modes_for(values, tolerance)
            row = {"N_train": count, "eps_POD": tolerance, "L": L}
            row["L_of_squares"] = modes_for(values, tolerance, "squares")
            rows.append(row | means.loc[L].to_dict())
    theirs = published.table(3)
    key = ["N_train", "eps_POD"]
    theirs = theirs.rename(columns=lambda c: c if c in key else f"paper_{c}")
    return [study.write_table("table3", pd.DataFrame(rows).merge(theirs, "left", key))]


def table4(study: Study, size: Size) -> list[str]:
    """table4.csv: errors by predictors at L = 15; centring.csv: the same with the mean taken away.

    The paper has 146 training shapes.
    """
    shapes, rows = size.shapes, []
    for name in PREDICTORS:
        found = _at(study.table(file_of(name, shapes)), MODES)
        row = {"predictors": name, "N_train": shapes, "L": int(found["L"].iloc[0])}
        row |= _mean_row(found)
        for error in ("AE_p", "ME_p"):
            for what, limit in RESOLUTIONS.items():
                row[f"{error}_above_{what}"] = int((found[error] > limit).sum())
        rows.append(row)
    theirs = published.table(4).rename(
        columns={
            **{c: f"paper_{c}" for c in ("AE_p", "AE_p_SD", "ME_p", "ME_p_SD")},
            "N(AE_p>0.15)": "paper_AE_p_above_3DRA",
            "N(ME_p>0.15)": "paper_ME_p_above_3DRA",
            "N(ME_p>0.4)": "paper_ME_p_above_CTA",
        }
    )
    both = pd.DataFrame(rows).merge(theirs, "left", "predictors")
    centring = [
        {"centred": centred, "N_train": shapes}
        | _mean_row(_at(study.table(file_of("Bezier", shapes, centred)), MODES))
        for centred in (False, True)
    ]
    return [
        study.write_table("table4", both),
        study.write_table("centring", pd.DataFrame(centring)),
    ]


def by_simulations(study: Study, sizes: Sequence[Size]) -> list[str]:
    """errors_by_simulations.csv: errors of every test at L = 15 with μ_cl, 8 points, by N_train.

    simulations.csv: their means, and over those with 146 shapes, as the paper gives them.
    """
    tests = {size.shapes: _at(study.table(file_of(BEST, size.shapes)), MODES) for size in sizes}
    means = pd.DataFrame([{"N_train": count} | _mean_row(t) for count, t in tests.items()])
    for error in ("AE_p", "ME_p"):
        reference = means.loc[means["N_train"] == REFERENCE, error]
        means[f"{error}_ratio"] = means[error] / (reference.iloc[0] if len(reference) else np.nan)
    every = pd.concat(found.assign(N_train=count) for count, found in tests.items())
    return [
        study.write_table("errors_by_simulations", every),
        study.write_table("simulations", means.merge(published.RATIOS_TO_146, "left", "N_train")),
    ]


def first_node(study: Study, size: Size) -> list[str]:
    """first_node.csv: the first node's displacement in two tests, and 100 samples of it.

    The tests are those whose error with μ_B is the median and the largest but four.
    """
    simulations = study.simulations(size.cases)
    found = _at(study.table(file_of("Bezier", size.shapes)), MODES).sort_values("AE_p")
    examples = found["case"].iloc[[(len(found) - 1) // 2, max(len(found) - 5, 0)]].to_numpy()
    training = size.training(simulations)
    tests = np.searchsorted(simulations.numbers, examples)
    snapshots, true = displacements(simulations, training), displacements(simulations, tests)
    rows = []
    for name in ("Bezier", BEST):
        model = ReducedOrderModel(min(MODES, len(training) - 1), centred=False, isotropic=True)
        model.fit(predictors(simulations, training, name), snapshots)
        for case, asked, real in zip(
            examples, predictors(simulations, tests, name), true, strict=True
        ):
            predicted = np.asarray(model.predict(asked[None]))[0, :3]
            samples = model.sample(asked, 100, np.random.default_rng(0))[:, :3]
            points = np.vstack([real[:3], predicted, samples])
            kind = ["simulated", "predicted", *["sample"] * len(samples)]
            frame = pd.DataFrame(points, columns=["u_x_mm", "u_y_mm", "u_z_mm"])
            rows.append(frame.assign(case=case, predictors=name, kind=kind))
    return [study.write_table("first_node", pd.concat(rows))]


def _errors(snapshots: Array, true: Array) -> NodeErrors:
    return NodeErrors.of(*(s.reshape(len(s), -1, 3) for s in (snapshots, true)))


def _at(errors: pd.DataFrame, modes: int) -> pd.DataFrame:
    """The rows of L = ``modes``, or of the most there are."""
    return errors[errors["L"] == min(modes, errors["L"].max())]


def _mean_row(errors: pd.DataFrame) -> dict[str, float]:
    """Means and standard deviations over the tests, by name."""
    columns = ["AE_rb", "ME_rb", "AE_p", "ME_p"]
    means, spreads = errors[columns].mean(), errors[columns].std(ddof=0)
    return {
        name: value
        for column in columns
        for name, value in ((column, means[column]), (f"{column}_SD", spreads[column]))
    }


def _means(study: Study, file: str) -> pd.DataFrame:
    """Means and standard deviations over the tests, a row for each L."""
    groups = study.table(file).groupby("L")
    return pd.DataFrame([{"L": L} | _mean_row(group) for L, group in groups])
