"""The report: one file of HTML with every figure and table, and where each comes from."""

from __future__ import annotations

import base64
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import pandas as pd
from jinja2 import Environment, PackageLoader, StrictUndefined
from markdown_it import MarkdownIt
from markupsafe import Markup

from braidcast.dataset.folder import DatasetFolder
from braidcast.study.outcomes import OURS
from braidcast.study.outcomes import threshold as threshold_of
from braidcast.study.report_tables import View, view
from braidcast.study.sizes import Size
from braidcast.study.workspace import Study

TITLE = "Deployment of braided stents: the study of Bisighini et al. 2023, repeated"

_HEADINGS = {
    "agreement": "What agrees with the paper, and what does not",
    "workflow-section": "Workflow, deployment and vessel",
    "sizes-section": "The simulations",
    "outcomes-section": "Success or failure",
    "modes-section": "Modes",
    "predictors-section": "Predictors, and numbers of simulations",
    "recipes-section": "Our recipe against the paper's",
    "learning-section": "How many simulations a new device needs",
    "importance-section": "Which parameters matter",
    "model-section": "The model",
}

_DIFFERENT = 1e-6
"""Two models give the same shape if no node of any test differs by more, mm."""


class _Finding(NamedTuple):
    finding: str
    here: str
    paper: str
    tolerance: str
    verdict: str
    why: str


def write(study: Study, sizes: Sequence[Size], middle: Size, samples: int) -> list[str]:
    """report.html."""
    counter: Counter[str] = Counter()

    def number(kind: str) -> int:
        counter[kind] += 1
        return counter[kind]

    environment = Environment(
        loader=PackageLoader("braidcast.study"), autoescape=True, undefined=StrictUndefined
    )
    environment.filters["kinds"] = _kinds
    simulations = study.simulations(samples)
    found = study.table("agreement")
    agrees = found["verdict"] == "agrees"
    smaller = (found["verdict"] == "lower here") & found["finding"].str.match("AE_|ME_|share of t")
    text = environment.get_template("report.html").render(
        title=TITLE,
        samples=samples,
        plan=DatasetFolder.open(study.dataset).plan_id,
        headings=_HEADINGS,
        middle=middle,
        tests={
            "outcomes": len(simulations.classification_tests),
            "shapes": len(simulations.regression_tests),
        },
        threshold=threshold_of(OURS),
        missed=len(study.table("false_negatives")),
        forest=study.table("importance")["R2_out_of_bag"].iloc[0],
        verdicts={"all": len(found), "agree": int(agrees.sum()), "smaller": int(smaller.sum())},
        shipped=_shipped(study.table("shipped")),
        card=_card((study.home / "model_card.md").read_text(encoding="utf-8")),
        agreement=lambda section: list(_findings(found, section)),
        rows=lambda name: view(name, study.table(name)),
        image=lambda name: _data_uri(study, _file(study, name)),
        file=lambda name: _file(study, name),
        number=number,
    )
    return [study.write("report.html", _with_subscripts(text).encode())]


def _findings(table: pd.DataFrame, section: str | None) -> Iterable[_Finding]:
    """Of a section, or all; a reason that is that of the finding before is not said again."""
    said = ""
    for _, row in table.iterrows():
        if section in (None, row["section"]):
            form = ".1%" if "share" in row["finding"] or row["section"] == "outcomes" else ".3g"
            here, paper, tolerance = (
                format(row[name], form) for name in ("here", "paper", "may_differ_by")
            )
            reason = "" if pd.isna(row["why"]) else row["why"]
            why = "As above." if reason and reason == said else reason
            said = reason or said
            yield _Finding(row["finding"], here, paper, tolerance, row["verdict"], why)


def _shipped(table: pd.DataFrame) -> str:
    if table.empty:
        return (
            "The model that comes with braidcast was trained on other simulations than these; "
            "models/braidcast.npz is that of this study."
        )
    distance = table["distance_max_mm"].max()
    if distance < _DIFFERENT and table["probability_difference"].max() < _DIFFERENT:
        return (
            "The model that this study trains on all its training cases, models/braidcast.npz, is "
            f"the one that comes with braidcast: in {len(table)} tests no node differs by more "
            f"than {distance:.1g} mm."
        )
    return (
        "The model of this study, models/braidcast.npz, is not the one that comes with braidcast, "
        f"which knows more or other simulations: in {len(table)} tests they differ by up to "
        f"{distance:.2g} mm (mean of the largest {table['distance_max_mm'].mean():.2g} mm) and by "
        f"up to {table['probability_difference'].max():.2g} in the probability of success."
    )


def _card(markdown: str) -> Markup:
    html = MarkdownIt().enable("table").render(markdown)
    html = html.replace("<table>", '<div class="scroll"><table>')
    return Markup(html.replace("</table>", "</table></div>"))


def _file(study: Study, name: str) -> str:
    found = next(iter(sorted((study.home / "figures").glob(f"{name}.*"))))
    return found.relative_to(study.home).as_posix()


def _data_uri(study: Study, file: str) -> str:
    kind = "svg+xml" if file.endswith(".svg") else "png"
    content = base64.b64encode((study.home / file).read_bytes()).decode()
    return f"data:image/{kind};base64,{content}"


def _with_subscripts(html: str) -> str:
    """N_train as N with a subscript, and so on, wherever it stands between tags."""
    parts = re.split(r"(<[^>]*>)", html)
    parts[::2] = [
        re.sub(r"\b([A-Zyzμεσ]E?)_(\w+)", r"\1<sub>\2</sub>", part) for part in parts[::2]
    ]
    return "".join(parts)


def _kinds(row: list[str], view: View) -> list[tuple[str, str]]:
    """Each cell with whose it is where ours and the paper's stand side by side."""
    kinds = [
        kind for _, span in view.headings for kind in (("first", "paper") if span > 1 else ("",))
    ]
    return list(zip(row, kinds, strict=True))
