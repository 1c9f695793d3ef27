"""The workflow of the paper (Figure 1): from a site to the deployed stent."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch

from braidcast.study.plots import style
from braidcast.study.workspace import Study

_BOXES = {
    "plan": (0.0, 2.2, "Latin hypercube\nof vessels and sites"),
    "simulate": (2.6, 2.2, "simulation:\ncrimp, position, release"),
    "label": (5.2, 2.2, "label: success\nor failure"),
    "pod": (7.8, 2.2, "successes: modes\nand coefficients"),
    "case": (0.0, 0.0, "new vessel\nand site"),
    "classify": (2.6, 0.0, "classifier: will it\nsucceed?"),
    "regress": (5.2, 0.0, "Gaussian processes:\ncoefficients ± std"),
    "stent": (7.8, 0.0, "deployed stent with\nits uncertainty"),
}
_ARROWS = (
    *(("plan", "simulate"), ("simulate", "label"), ("label", "pod")),
    *(("case", "classify"), ("classify", "regress"), ("regress", "stent")),
    *(("label", "classify"), ("pod", "regress")),
)
_SIZE = (2.1, 1.0)


@style.drawn
def workflow(study: Study) -> list[str]:
    """Offline above, online below."""
    figure, (axis,) = style.panels(1, 1, 2.5)
    axis.set_axis_off()
    axis.grid(False)
    axis.set_xlim(-0.1, 10.0)
    axis.set_ylim(-0.1, 3.7)
    for title, height, colour in (
        ("offline, once", 3.35, "#dbe9f6"),
        ("online, milliseconds", 1.15, "#fde6d5"),
    ):
        axis.text(0.0, height, title, fontsize=9, fontweight="bold")
        for x, y, text in _BOXES.values():
            if (y > 1.0) == (height > 2.0):
                _box(axis, x, y, text, colour)
    for first, second in _ARROWS:
        _arrow(axis, _BOXES[first][:2], _BOXES[second][:2])
    return [style.save(study, figure, "workflow")]


def _box(axis: Axes, x: float, y: float, text: str, colour: str) -> None:
    shape = FancyBboxPatch(
        (x, y), *_SIZE, boxstyle="round,pad=0,rounding_size=0.12", fc=colour, ec="#555555", lw=0.8
    )
    axis.add_patch(shape)
    axis.text(x + _SIZE[0] / 2, y + _SIZE[1] / 2, text, ha="center", va="center", fontsize=8)


def _arrow(axis: Axes, start: tuple[float, float], end: tuple[float, float]) -> None:
    width, height = _SIZE
    if start[1] == end[1]:
        tail, head = (start[0] + width, start[1] + height / 2), (end[0], end[1] + height / 2)
    else:
        tail, head = (start[0] + width / 2, start[1]), (end[0] + width / 2, end[1] + height)
    axis.add_patch(
        FancyArrowPatch(tail, head, arrowstyle="-|>", mutation_scale=10, color="#333333", lw=1.0)
    )
