"""Deployments simulated for figures alone: the strategy, and one vessel at many sites."""

import numpy as np
import pandas as pd

from braidcast.case import Case
from braidcast.deployment.position import RingPath, placed
from braidcast.deployment.simulate import simulate
from braidcast.mechanics import State
from braidcast.study.surrogates import MODEL
from braidcast.study.workspace import Study
from braidcast.surrogate.model_file import load_model
from braidcast.surrogate.predictors import end_depths

SITES = 11
"""Simulated sites, η from 0 to 1."""

PREDICTED = 201
"""Sites at which the surrogate is asked."""

CENTRELINES = 5
"""Intermediate centrelines C_t that are shown, C_0 and C_T among them."""


def example(simulations_case: Case) -> Case:
    """The case of the figures: the study's device in a vessel from the middle of its ranges."""
    tables = simulations_case.to_dict()
    tables["title"] = "A vessel from the middle of the study"
    tables["vessel"] |= {"P1": [0.0, 20.0, 25.0], "diameter": 3.0}
    tables["aneurysm"] |= {"diameter": 7.5, "protrusion": 0.5}
    tables["site"] |= {"eta": 0.5}
    return Case.from_dict(tables)


def strategy(study: Study, samples: int) -> list[str]:
    """data/strategy.npz: nodes free, crimped, straight on C_0, positioned, deployed; and C_t."""
    case = example(study.simulations(samples).cases[0])
    deployment = simulate(case, keep_frames=True, cache=study.home / "data")
    frames = dict(deployment.frames)
    path = RingPath.along(deployment.positioned_centreline)
    crimped = State(frames["crimp"], np.tile(np.eye(3), (len(frames["crimp"]), 1, 1)))
    fractions = np.linspace(0.0, 1.0, CENTRELINES)
    return [
        study.write_arrays(
            "strategy",
            case=case.to_toml(),
            free=frames["free"],
            crimped=crimped.positions,
            straight=placed(crimped, case.braid.rings, path, 0.0).positions,
            positioned=frames["position"],
            deployed=deployment.positions,
            centrelines=np.array([path.rings(fraction)[0] for fraction in fractions]),
        )
    ]


def sites(study: Study, samples: int) -> list[str]:
    """sites.csv, site_probability.csv, data/sites.npz: the example vessel, η from 0 to 1."""
    first = example(study.simulations(samples).cases[0])
    model = load_model(study.home / MODEL)
    rows, shapes = [], []
    for eta in np.linspace(0.0, 1.0, SITES):
        case = _at(first, float(eta))
        found = simulate(case, cache=study.home / "data")
        depth = end_depths(case, found.positions)
        shapes.append(found.positions)
        rows.append(
            {
                "eta": eta,
                "outcome": found.outcome if found.converged else "not converged",
                "depth_first_mm": depth[0],
                "depth_last_mm": depth[1],
                "success_probability": model.success_probability(case),
            }
        )
    asked = np.linspace(0.0, 1.0, PREDICTED)
    given = [model.success_probability(_at(first, float(eta))) for eta in asked]
    probability = pd.DataFrame({"eta": asked, "success_probability": given})
    return [
        study.write_table("sites", pd.DataFrame(rows)),
        study.write_table("site_probability", probability.assign(threshold=model.threshold)),
        study.write_arrays("sites", case=first.to_toml(), positions=np.array(shapes)),
    ]


def _at(case: Case, eta: float) -> Case:
    tables = case.to_dict()
    tables["site"]["eta"] = eta
    return Case.from_dict(tables)
