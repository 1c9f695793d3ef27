"""What a reader must know of a model before trusting it, as one page of Markdown.

The headings follow Mitchell et al. 2019, *Model cards for model reporting*.
"""

from braidcast.surrogate.applicability import unit
from braidcast.surrogate.metrics import LARGE_ERROR
from braidcast.surrogate.model import SurrogateModel

_INTENDED = """\
- Research on braided stents, and engineering of devices: where the wires of this device end up in
  vessels of the kind above, and whether an end lands in the sac, in place of a finite element
  simulation of the same case.
- Not a medical device. Not for diagnosis, and not for the treatment of patients: it is checked
  against simulations, never against patients."""

_LIMITS = """\
- It knows what the simulation knows: rigid smooth walls, a round vessel of constant diameter bent
  in one plane, one spherical sac, Coulomb friction, a delivery all at once. No flow, no clotting.
- Another device is refused. Numbers outside the ranges above are answered with `in_range` false: a
  hint, not a prediction.
- The shape of a predicted failure is that of a successful deployment; shapes are learned from
  successes only.
- Standard deviations hold on average over the tests; a single case may be worse than its own."""


def model_card(model: SurrogateModel) -> str:
    """The card of a model: data, ranges, errors, intended use, limits."""
    record, device = model.record, model.applicability.device
    ranges = [
        f"| `{name}` | {low:g} to {high:g}{unit(name)} |"
        for name, (low, high) in sorted(model.applicability.limits.items())
        if low < high
    ]
    fixed = ", ".join(
        f"`{name}` {low:.6g}{unit(name)}"
        for name, (low, high) in sorted(model.applicability.limits.items())
        if low == high
    )
    versions = ", ".join(f"{name} {number}" for name, number in record["versions"].items())
    lines = [
        f"# Model card: {record['name']}",
        "",
        f"A reduced order model (recipe `{model.recipe.name}`, {model.rom.modes} modes, one "
        "Gaussian process each) of the deployed braid, and a classifier of the outcome.",
        "",
        "## Data",
        "",
        f"{record['shapes']} successful deployments for the shape, {record['outcomes']} for the "
        f"outcome, simulated by braidcast; plan `{record['plan_id']}`. Made with {versions}.",
        "",
        "Device: "
        + ", ".join(f"{name.replace('_', ' ')} {value}" for name, value in device.items())
        + " (mm, MPa).",
        "",
        "| trained over | |",
        "|---|---|",
        *ranges,
        "",
        f"The same in all: {fixed}.",
        "",
        "## Errors on simulations it has not seen",
        "",
        *_errors(model),
        "",
        "## Intended use",
        "",
        _INTENDED,
        "",
        "## Limits",
        "",
        _LIMITS,
    ]
    return "\n".join(lines) + "\n"


def _errors(model: SurrogateModel) -> list[str]:
    test = model.record.get("test")
    tuned = model.record["cross_validation"]
    if test is None:
        error = tuned["errors"][str(tuned["modes"])]
        return [f"Not tested. Mean distance of the nodes under cross-validation {error:.4f} mm."]
    shapes, outcomes = test["shapes"], test["outcomes"]
    found, intervals = shapes["prediction"], outcomes["intervals_95_percent"]
    rows = [
        f"| {what} ({shapes['cases']} shapes) | {value} |"
        for what, value in (
            ("distance of the nodes, mean", f"{found['AE_mm']:.4f} mm"),
            ("largest of a case, mean over the cases", f"{found['ME_mm']:.4f} mm"),
            ("largest of all", f"{found['ME_worst_mm']:.4f} mm"),
            (f"cases with a node off by more than {LARGE_ERROR} mm", found["cases_above_0.15_mm"]),
            ("coordinates inside their 95 % intervals", f"{shapes['inside_95_percent']:.1%}"),
        )
    ]
    rows += [
        f"| {name} ({outcomes['cases']} outcomes) | {outcomes[name]:.3f} "
        f"(95 %: {intervals[name][0]:.3f} to {intervals[name][1]:.3f}) |"
        for name in ("accuracy", "sensitivity", "specificity", "AUC", "Brier")
    ]
    called = f"Success is called from a probability of {outcomes['threshold']:.2f} on."
    return ["| what | value |", "|---|---|", *rows, "", called]
