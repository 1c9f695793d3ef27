"""Diagrams of what a user asks next: learning curves and what matters."""

from __future__ import annotations

import numpy as np

from braidcast.study.importance import QUANTITIES
from braidcast.study.learning import TARGETS
from braidcast.study.outcomes import EXAMINED, OURS
from braidcast.study.plots import style
from braidcast.study.workspace import Study

_PARAMETERS = {
    "vessel_P1_y": "$y_{P1}$",
    "vessel_P1_z": "$z_{P1}$",
    "vessel_diameter": "$D_v$",
    "aneurysm_diameter": "$D_a$",
    "aneurysm_protrusion": "$f$",
    "site_eta": r"$\eta$",
}


@style.drawn
def learning(study: Study) -> list[str]:
    """Errors and accuracy by training cases, with 95 % bands."""
    table = study.table("learning_curves")
    figure, axes = style.panels(3, 1, 3.1)
    curves = {
        "AE": (("ours", "ours", style.OURS), ("paper", "paper's recipe", style.PAPER)),
        "ME": (("ours", "ours", style.OURS), ("paper", "paper's recipe", style.PAPER)),
        "accuracy": (
            (OURS, "ours: ends", style.OURS),
            (EXAMINED, r"support vectors, $\mu_B$", style.PAPER),
        ),
    }
    for axis, (measure, lines) in zip(axes, curves.items(), strict=True):
        ticks: set[int] = set()
        for model, label, colour in lines:
            found = table[(table["model"] == model) & (table["measure"] == measure)]
            found = found.sort_values("N_train")
            axis.plot(found["N_train"], found["mean"], "o-", ms=3, color=colour, label=label)
            axis.fill_between(
                found["N_train"], found["low"], found["high"], color=colour, alpha=0.2, lw=0
            )
            ticks |= set(found["N_train"])
        axis.set_xscale("log")
        axis.minorticks_off()
        shown = [t for t in (5, 10, 20, 50, 100, 200, 500) if min(ticks) <= t <= max(ticks)]
        axis.set_xticks(shown, [str(t) for t in shown])
        axis.set_xlabel("training cases" if measure == "accuracy" else "training shapes")
        if measure == "accuracy":
            axis.yaxis.set_major_formatter(style.percent())
            style.titled(axis, "accuracy of the outcome")
        else:
            axis.set_yscale("log")
            axis.axhline(TARGETS[measure], color="#777777", lw=0.8, ls="--")
            style.titled(axis, f"${measure}_p$ (mm)")
        axis.legend(fontsize=7)
    return [style.save(study, figure, "learning_curves")]


@style.drawn
def importance(study: Study) -> list[str]:
    """Sobol indices of three answers of the surrogate, and permutation importance of its error."""
    sobol, table = study.table("sobol"), study.table("importance")
    figure, axes = style.panels(2, 2, 2.6)
    for axis, quantity in zip(axes, QUANTITIES, strict=False):
        found = sobol[sobol["quantity"] == quantity].reset_index(drop=True)
        places = np.arange(len(found))
        for shift, order, colour, label in (
            (-0.2, "first_order", style.SKY, "alone (first order)"),
            (0.2, "total_order", style.BLUE, "with all others (total)"),
        ):
            span = found[order] - found[f"{order}_low"], found[f"{order}_high"] - found[order]
            axis.bar(
                places + shift,
                found[order],
                0.38,
                yerr=np.maximum(span, 0.0),
                color=colour,
                ecolor="#444444",
                error_kw={"lw": 0.8},
                label=label,
            )
        axis.set_xticks(places, [_PARAMETERS.get(p, p) for p in found["parameter"]])
        style.titled(axis, quantity)
        axis.set_ylabel("share of the variance")
    axes[0].legend(fontsize=7, loc="upper left")
    axis = axes[3]
    places = np.arange(len(table))
    axis.bar(
        places,
        table["importance"],
        0.6,
        yerr=table["importance_SD"],
        color=style.ORANGE,
        ecolor="#444444",
        error_kw={"lw": 0.8},
    )
    axis.set_xticks(places, [_PARAMETERS.get(p, p) for p in table["parameter"]])
    axis.set_ylabel("loss of R²")
    style.titled(axis, f"error left out (R² {table['R2_out_of_bag'].iloc[0]:.2f})")
    return [style.save(study, figure, "importance")]
