"""Diagrams of the reduced order model (paper, Figures 6 to 9)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from braidcast.study import published
from braidcast.study.plots import style
from braidcast.study.shapes import BEST, MODES, PREDICTORS, REFERENCE, RESOLUTIONS, file_of
from braidcast.study.sizes import Size
from braidcast.study.workspace import Study

_LABELS = {
    "Bezier": r"$\mu_B$",
    "Ncl=3": r"$\mu_{cl}$, 3 points",
    "Ncl=5": r"$\mu_{cl}$, 5",
    "Ncl=8": r"$\mu_{cl}$, 8",
}
_RECIPES = {"paper": ("paper's recipe", style.PAPER, "s"), "ours": ("ours", style.OURS, "o")}


@style.drawn
def modes(study: Study, sizes: Sequence[Size]) -> list[str]:
    """Singular values, what the first L hold, and errors by L."""
    sigma, errors = study.table("singular_values"), study.table("errors_by_modes")
    figure, axes = style.panels(2, 2, 2.9)
    for size, colour in zip(sizes, style.CYCLE, strict=False):
        found = sigma[sigma["N_train"] == size.shapes]
        label = f"{size.shapes} shapes"
        axes[0].semilogy(found["L"], found["sigma_mm"], color=colour, label=label)
        axes[1].plot(found["L"], found["share_of_sum"], color=colour, label=label)
        chosen = errors[errors["N_train"] == size.shapes]
        axes[2].semilogy(chosen["L"], chosen["AE_p"], color=colour)
        axes[2].semilogy(chosen["L"], chosen["AE_rb"], color=colour, ls="--")
        axes[3].semilogy(chosen["L"], chosen["AE_gpr"].clip(lower=1e-5), color=colour, label=label)
    theirs = published.table(3)
    axes[2].plot(theirs["L"], theirs["AE_p"], "x", color="black", label="paper, $AE_p$")
    axes[2].plot(theirs["L"], theirs["AE_rb"], "+", color="black", label="paper, $AE_{rb}$")
    for axis in axes[:2]:
        axis.set_xlim(0, 60)
    for axis in axes[2:]:
        axis.set_xlim(0, 42)
        axis.axvline(MODES, color="#999999", lw=0.8, ls=":")
    axes[1].yaxis.set_major_formatter(style.percent())
    for axis, title, what in (
        (axes[0], "singular values", "σ (mm)"),
        (axes[1], r"share of $\Sigma\sigma$ in the first $L$", ""),
        (axes[2], "$AE_p$ (full), $AE_{rb}$ (dashed)", "mm"),
        (axes[3], "$AE_{gpr} = AE_p - AE_{rb}$", "mm"),
    ):
        style.titled(axis, title)
        axis.set_xlabel("modes $L$")
        axis.set_ylabel(what)
        axis.legend(fontsize=7)
    return [style.save(study, figure, "modes")]


@style.drawn
def predictors(study: Study, size: Size) -> list[str]:
    """AE_p and ME_p of every test by predictors."""
    groups = {}
    for name in PREDICTORS:
        found = study.table(file_of(name, size.shapes))
        groups[_LABELS[name]] = found[found["L"] == min(MODES, found["L"].max())]
    theirs = published.table(4)
    return _boxes(study, "predictors", groups, theirs["AE_p"], theirs["ME_p"], "predictors")


@style.drawn
def simulations(study: Study, sizes: Sequence[Size]) -> list[str]:
    """AE_p and ME_p of every test by number of training shapes, with μ_cl, 8 points."""
    found = study.table("errors_by_simulations")
    groups = {str(s.shapes): found[found["N_train"] == s.shapes] for s in sizes}
    # The paper prints numbers at 146 alone, in its Table 4; its text gives ratios to the others.
    printed = published.table(4).set_index("predictors").loc[BEST]
    ratios = published.RATIOS_TO_146.set_index("N_train").reindex([s.shapes for s in sizes])
    AE, ME = (printed[error] * ratios[f"paper_{error}_ratio"] for error in ("AE_p", "ME_p"))
    return _boxes(study, "simulations", groups, AE, ME, "training shapes")


def _boxes(
    study: Study,
    name: str,
    groups: dict[str, pd.DataFrame],
    paper_AE: pd.Series,
    paper_ME: pd.Series,
    what: str,
) -> list[str]:
    figure, axes = style.panels(2, 1, 3.1)
    places = np.arange(1, len(groups) + 1)
    for axis, column, theirs in zip(axes, ("AE_p", "ME_p"), (paper_AE, paper_ME), strict=True):
        values = [group[column].to_numpy() for group in groups.values()]
        axis.boxplot(
            values,
            widths=0.5,
            showfliers=False,
            medianprops={"color": style.PAPER},
            tick_labels=list(groups),
        )
        rng = np.random.default_rng(0)
        for place, points in zip(places, values, strict=True):
            x = place + rng.uniform(-0.17, 0.17, len(points))
            axis.plot(x, points, "o", ms=2.2, color=style.PAPER, alpha=0.45)
        axis.plot(places, [v.mean() for v in values], "D", color=style.OURS, label="mean, here")
        axis.plot(places, theirs, "x", color="black", ms=7, mew=1.6, label="mean, paper")
        _resolutions(axis)
        axis.set_yscale("log")
        axis.set_ylabel(f"${column[:2]}_p$ (mm)")
        axis.set_xlabel(what)
        axis.tick_params(axis="x", labelsize=7.5)
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    style.titled(axes[0], "mean over the nodes")
    style.titled(axes[1], "largest of the nodes")
    return [style.save(study, figure, name)]


def _resolutions(axis: Axes) -> None:
    for what, value in RESOLUTIONS.items():
        axis.axhline(value, color="#777777", lw=0.8, ls="--")
        axis.annotate(
            f"{what}\n{value:g} mm",
            (1.01, value),
            xycoords=("axes fraction", "data"),
            va="center",
            fontsize=7,
            color="#555555",
        )


@style.drawn
def first_node(study: Study) -> list[str]:
    """Samples of the first node's displacement, both predictors, two tests."""
    found = study.table("first_node")
    cases = list(dict.fromkeys(found["case"]))
    figure, axes = style.panels(2, len(cases), 2.9)
    for row, case in enumerate(cases):
        for column, name in enumerate(("Bezier", BEST)):
            axis = axes[2 * row + column]
            points = found[(found["case"] == case) & (found["predictors"] == name)]
            points = points.set_index("kind")[["u_z_mm", "u_y_mm"]]
            colour = (style.GREEN, style.VERMILLION)[column]
            axis.plot(
                *points.loc["sample"].to_numpy().T,
                "o",
                ms=2.5,
                color=colour,
                alpha=0.5,
                label="samples",
            )
            axis.plot(*points.loc["predicted"], "D", color=colour, mec="black", label="predicted")
            axis.plot(*points.loc["simulated"], "*", ms=10, color="black", label="simulated")
            style.titled(axis, f"case {case}, {_LABELS[name]}")
            axis.set_xlabel("$u_z$ (mm)")
            axis.set_ylabel("$u_y$ (mm)")
        _same_span(axes[2 * row : 2 * row + 2])
    axes[0].legend(loc="best", fontsize=7)
    return [style.save(study, figure, "first_node")]


def _same_span(axes: Sequence[Axes]) -> None:
    """The same limits in all panels: what is to be compared is how far the points spread."""
    spans = np.array([[*axis.get_xlim(), *axis.get_ylim()] for axis in axes])
    for axis in axes:
        axis.set_xlim(spans[:, 0].min(), spans[:, 1].max())
        axis.set_ylim(spans[:, 2].min(), spans[:, 3].max())


@style.drawn
def recipes(study: Study) -> list[str]:
    """Ours against the paper's recipe by training shapes."""
    table = study.table("recipes")
    figure, axes = style.panels(2, 1, 3.0)
    printed = published.table(4).set_index("predictors").loc[BEST]
    for axis, column, theirs in zip(axes, ("AE", "ME"), ("AE_p", "ME_p"), strict=True):
        for recipe, (label, colour, marker) in _RECIPES.items():
            found = table[table["recipe"] == recipe].sort_values("N_train")
            axis.plot(found["N_train"], found[column], f"{marker}-", color=colour, label=label)
        axis.plot(
            REFERENCE, printed[theirs], "x", color="black", ms=7, mew=1.6, label="paper, printed"
        )
        first = table[table["recipe"] == "ours"].iloc[0]
        axis.axhline(first[f"{column}_geometry"], color=style.PURPLE, lw=1, ls="-.")
        axis.annotate(
            "placed by geometry alone",
            (1.0, first[f"{column}_geometry"]),
            xycoords=("axes fraction", "data"),
            xytext=(0, 2),
            textcoords="offset points",
            ha="right",
            fontsize=7,
            color=style.PURPLE,
        )
        axis.set_xscale("log")
        axis.set_yscale("log")
        axis.set_xticks(ticks := sorted(table["N_train"].unique()), [str(t) for t in ticks])
        axis.minorticks_off()
        axis.set_xlabel("training shapes")
        axis.set_ylabel(f"${theirs}$ (mm)")
        axis.legend(loc="upper right", bbox_to_anchor=(1.0, 0.94))
    style.titled(axes[0], "mean over the nodes")
    style.titled(axes[1], "largest of the nodes")
    return [style.save(study, figure, "recipes")]
