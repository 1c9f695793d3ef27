"""Diagrams of the classifiers (paper, Figure 5 and section 3.1)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from braidcast.study.outcomes import NAMES, OURS
from braidcast.study.plots import style
from braidcast.study.sizes import Size
from braidcast.study.workspace import Study


@style.drawn
def confusion(study: Study, size: Size) -> list[str]:
    """Confusion matrices of all classifiers at one size."""
    table = study.table("table2").query("N_s == @size.cases").set_index("model")
    figure, axes = style.panels(4, 2, 2.0)
    for axis, name in zip(axes, NAMES, strict=False):
        row = table.loc[name]
        counts = np.array([[row["TP"], row["FN"]], [row["FP"], row["TN"]]])
        shares = counts / counts.sum(axis=1, keepdims=True)
        axis.imshow(shares, cmap="Blues", vmin=0.0, vmax=1.4)
        for (i, j), count in np.ndenumerate(counts):
            axis.text(j, i, f"{count:.0f}", ha="center", va="center", fontsize=13)
        axis.set_xticks([0, 1], ["success", "failure"])
        axis.set_yticks([0, 1], ["success", "failure"], rotation=90, va="center")
        axis.set_xlabel("called")
        axis.set_ylabel("simulated")
        axis.tick_params(length=0, labelsize=8)
        axis.grid(False)
        axis.spines[:].set_visible(False)
        style.titled(
            axis, {OURS: "ours: ends", "support vector machine": "support vectors"}.get(name, name)
        )
    for axis in axes[len(NAMES) :]:
        axis.remove()
    return [style.save(study, figure, "confusion")]


@style.drawn
def roc(study: Study, sizes: Sequence[Size]) -> list[str]:
    """ROC curves of all classifiers, a panel a size."""
    curves, table = study.table("roc"), study.table("table2")
    figure, axes = style.panels(2, (len(sizes) + 1) // 2, 3.1)
    for axis, size in zip(axes, sizes, strict=False):
        axis.plot([0, 1], [0, 1], color="#999999", lw=0.8, ls=":")
        for name, colour in zip(NAMES, style.CYCLE, strict=True):
            chosen = curves[(curves["N_s"] == size.cases) & (curves["model"] == name)]
            area = table.query("N_s == @size.cases and model == @name")["AUC"].iloc[0]
            label = f"{'ours: ends' if name == OURS else name}, {area:.3f}"
            width = 2.4 if name == OURS else 1.3
            axis.plot(
                *(chosen["false_positive_rate"], chosen["true_positive_rate"]),
                color=colour,
                lw=width,
                label=label,
            )
        style.titled(axis, f"{size.outcomes} training cases")
        axis.set_xlabel("failures called successes")
        axis.set_ylabel("successes called successes")
        axis.set_aspect("equal")
        axis.legend(title="classifier, AUC", loc="lower right", fontsize=6.5, title_fontsize=7)
    for axis in axes[len(sizes) :]:
        axis.remove()
    return [style.save(study, figure, "roc")]


@style.drawn
def classifiers(study: Study, sizes: Sequence[Size]) -> list[str]:
    """Accuracy and specificity of all classifiers, ours and the paper's."""
    table = study.table("table2")
    figure, axes = style.panels(2, 1, 3.6)
    names = [name for name in NAMES]
    for axis, metric in zip(axes, ("accuracy", "specificity"), strict=True):
        for row, name in enumerate(reversed(names)):
            found = table[table["model"] == name].sort_values("N_s")
            for k, (_, value) in enumerate(found.iterrows()):
                y = row + 0.3 - 0.6 * (k + 0.5) / max(len(sizes), 1)
                shade = style.CYCLE[k]
                span = value[f"{metric}_low"], value[f"{metric}_high"]
                axis.plot(span, [y, y], color=shade, lw=1.2, alpha=0.6)
                axis.plot(value[metric], y, "o", color=shade, ms=4)
                if value["paper_consistent"] == True:  # noqa: E712 - nan is neither
                    axis.plot(value[f"paper_{metric}"], y, "x", color="black", ms=4, mew=1)
        axis.set_yticks(
            range(len(names)), [n if n != OURS else "ours: ends" for n in reversed(names)]
        )
        axis.xaxis.set_major_formatter(style.percent())
        axis.set_xlabel(metric)
        axis.set_xlim(0.0 if metric == "specificity" else 0.6, 1.02)
        style.titled(axis, metric)
    axes[1].set_yticklabels([])
    handles = [
        axes[0].plot([], [], "o-", color=style.CYCLE[k], label=f"{size.outcomes} training cases")[0]
        for k, size in enumerate(sizes)
    ]
    handles += axes[0].plot([], [], "x", color="black", label="paper, read rightly")
    figure.legend(handles=handles, loc="outside lower center", ncols=3)
    return [style.save(study, figure, "classifiers")]


@style.drawn
def sites(study: Study) -> list[str]:
    """Probability of success along the example vessel, and what simulations say."""
    curve, found = study.table("site_probability"), study.table("sites")
    figure, (axis,) = style.panels(1, 1, 2.6)
    axis.plot(curve["eta"], curve["success_probability"], color=style.OURS, label="surrogate")
    axis.axhline(curve["threshold"].iloc[0], color="#777777", lw=0.9, ls="--", label="threshold")
    for outcome, height, marker, colour in (
        ("success", 1.0, "o", style.GREEN),
        ("failure", 0.0, "X", style.VERMILLION),
    ):
        eta = found.loc[found["outcome"] == outcome, "eta"]
        axis.plot(
            eta, np.full(len(eta), height), marker, color=colour, label=f"simulated: {outcome}"
        )
    axis.set_xlabel("site η")
    axis.set_ylabel("probability of success")
    axis.yaxis.set_major_formatter(style.percent())
    axis.set_ylim(-0.05, 1.05)
    axis.legend(loc="center")
    return [style.save(study, figure, "site_probability")]
