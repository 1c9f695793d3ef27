"""The stages that draw: each reads tables and data files of earlier stages, and writes figures."""

from collections.abc import Sequence

import numpy as np

from braidcast.deployment.outcome import end_nodes_in_sac
from braidcast.study import pictures, vessel_figure
from braidcast.study.plots import insight, outcomes, shapes, workflow
from braidcast.study.sizes import Size
from braidcast.study.stages import Stage
from braidcast.study.workspace import Study, case_of

SHOWN_SITES = (0.1, 0.5)
"""η of the failure and the success that are shown."""

FALSE_NEGATIVES = 4

ERRORS = (1e-3, 0.3)
"""Scale of the colours of nodal errors, mm, one for both recipes."""


def stages(sizes: Sequence[Size], middle: Size, samples: int) -> list[Stage]:
    """One stage a figure; ``middle`` is the size at which the paper compares."""
    at, all_sizes = {"size": middle}, {"sizes": sizes}
    return [
        Stage("figure workflow", workflow.workflow),
        Stage("figure strategy", strategy, needs=("strategy",)),
        Stage("figure vessel", vessel_figure.vessel, needs=("strategy",)),
        Stage("figure sites", sites, needs=("sites",)),
        Stage("figure site probability", outcomes.sites, needs=("sites",)),
        Stage("figure confusion", outcomes.confusion, at, ("table 2",)),
        Stage("figure roc", outcomes.roc, all_sizes, ("table 2",)),
        Stage("figure classifiers", outcomes.classifiers, all_sizes, ("table 2",)),
        Stage(
            "figure false negatives",
            false_negatives,
            {"samples": samples},
            ("false negatives", "cases"),
            samples,
        ),
        Stage("figure modes", shapes.modes, all_sizes, ("singular values", "errors by modes")),
        Stage("figure predictors", shapes.predictors, at, ("table 4",)),
        Stage("figure simulations", shapes.simulations, all_sizes, ("errors by simulations",)),
        Stage("figure first node", shapes.first_node, needs=("first node",)),
        Stage("figure examples", examples, {"samples": samples}, ("examples",), samples),
        Stage("figure recipes", shapes.recipes, needs=("table of recipes",)),
        Stage("figure learning", insight.learning, needs=("learning curves",)),
        Stage("figure importance", insight.importance, needs=("sobol", "permutation")),
    ]


def strategy(study: Study) -> list[str]:
    """The deployment strategy, from the free stent to the deployed (paper, Figure 2)."""
    data = study.arrays("strategy")
    states = {name: data[name] for name in pictures.STATES}
    name = "figures/strategy.png"
    path = study.place(name)
    pictures.strategy_figure(path, case_of(data["case"]), **states, centrelines=data["centrelines"])
    return [name]


def sites(study: Study) -> list[str]:
    """A failure and a success of one vessel (paper, Figure 4)."""
    data, table = study.arrays("sites"), study.table("sites")
    case = case_of(data["case"])
    panels = []
    for eta in SHOWN_SITES:
        row = int(np.abs(table["eta"] - eta).argmin())
        positions = data["positions"][row]
        inside = end_nodes_in_sac(case, positions)
        title = f"η = {table['eta'][row]:.1f}: {table['outcome'][row]}"
        panels.append(pictures.Panel(case, positions, title, mark=inside))
    name = "figures/sites.png"
    pictures.braids_figure(study.place(name), panels)
    return [name]


def false_negatives(study: Study, samples: int) -> list[str]:
    """Up to four successes that are called failures (paper, Figure 10)."""
    table = study.table("false_negatives").head(FALSE_NEGATIVES)
    if table.empty:
        return []
    simulations = study.simulations(samples)
    panels = []
    for _, row in table.iterrows():
        index = int(np.searchsorted(simulations.numbers, int(row["case"])))
        title = f"case {row['case']:.0f}: P = {row['success_probability']:.2f}"
        title += f", end {row['gap_mm']:.2f} mm from the sac"
        panels.append(pictures.Panel(simulations.cases[index], simulations.positions[index], title))
    name = "figures/false_negatives.png"
    pictures.braids_figure(study.place(name), panels)
    return [name]


def examples(study: Study, samples: int) -> list[str]:
    """Six tests with the nodal error as colour, both recipes (paper, Figure 11)."""
    data, table = study.arrays("examples"), study.table("examples").set_index(["recipe", "case"])
    simulations = study.simulations(samples)
    written = []
    for recipe in ("paper", "ours"):
        error = np.log10(np.maximum(data[f"{recipe}_error"], ERRORS[0]))
        panels = []
        for k, number in enumerate(data["case"]):
            row = table.loc[(recipe, number)]
            title = f"case {number}: $D_v$ {row['D_v_mm']:.2f}, $D_a$ {row['D_a_mm']:.2f} mm"
            title += f"\nAE {row['AE']:.4f}, ME {row['ME']:.4f} mm"
            case = simulations.cases[int(np.searchsorted(simulations.numbers, number))]
            positions = data[f"{recipe}_positions"][k]
            panels.append(pictures.Panel(case, positions, title, values=error[k]))
        name = f"figures/examples_{recipe}.png"
        legend = "distance from the simulated node (mm)"
        pictures.braids_figure(study.place(name), panels, legend=legend, decades=ERRORS)
        written.append(name)
    return written
