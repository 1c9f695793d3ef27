"""The tables of benchmarks/deployment.py, and that of any benchmark's bars."""

from statistics import median
from typing import Any

Record = dict[str, Any]
Bar = tuple[str, float, float, str]
"""What was asked: description, ours, the bar, unit."""


def table_of_bars(bars: list[Bar]) -> list[str]:
    """Lines of Markdown, one for each bar, and whether it is held."""
    return [
        "| what | ours | bar | |",
        "|---|---|---|---|",
        *(
            f"| {what} | {ours:.3g} {unit} | {bar:.3g} {unit} "
            f"| {'held' if ours <= bar else '**missed**'} |"
            for what, ours, bar, unit in bars
        ),
    ]


def page(records: list[Record]) -> tuple[str, bool]:
    """Markdown of all simulations and of the bars; whether every bar is held."""
    bars = _bars(records)
    held = all(ours <= bar for _, ours, bar, _ in bars)
    first = records[0]
    lines = [
        f"braidcast {first['version']}, sources {first['sources']}, {first['linear_solver']}",
        "",
        *table_of_bars(bars),
        "",
        "| case | y_P1, z_P1, D_v, D_a, f, η | variant | outcome | clinical | ends in sac "
        "| iterations | CPU s | residual | penetration µm | mean µm | max µm | MB |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|---|",
        *(_line(record) for record in records),
        "",
    ]
    return "\n".join(lines), held


def _bars(records: list[Record]) -> list[Bar]:
    """What was asked: description, ours, the bar, unit."""
    ref = median(seconds for record in records for seconds in record["ref_seconds"])
    cpu = median(r["cpu_seconds"] for r in records if r["variant"] == "default")
    worst = {
        key: max(record[key] for record in records)
        for key in ("residual_relative", "max_penetration_mm", "peak_memory_MB")
    }
    compared = [r for r in records if r["variant"] != "default" and "mean_distance_um" in r]
    failed = sum(not record["converged"] for record in records)
    rows = [
        ("simulations that did not converge", failed, 0, ""),
        ("residual over sum of contact forces, worst", worst["residual_relative"], 1e-4, ""),
        (
            "penetration, worst",
            1e3 * worst["max_penetration_mm"],
            1e3 * records[0]["penetration_bar_mm"],
            "µm",
        ),
        (
            f"CPU time of a case, median of the default ({cpu / ref:.1f} ref of {ref:.3f} s)",
            cpu,
            max(8.0, 18.0 * ref),
            "s",
        ),
        ("peak memory, worst", worst["peak_memory_MB"], 1000.0, "MB"),
    ]
    if compared:
        labels = {r["case"]: r["outcome"] for r in records if r["variant"] == "default"}
        rows += [
            ("mean distance, worst", max(r["mean_distance_um"] for r in compared), 5.0, "µm"),
            ("largest distance, worst", max(r["max_distance_um"] for r in compared), 20.0, "µm"),
            (
                "outcomes that changed",
                sum(r["outcome"] != labels[r["case"]] for r in compared),
                0,
                "",
            ),
        ]
    return rows


def _line(r: Record) -> str:
    values = [
        str(r["case"]),
        ", ".join(f"{value:.2f}" for value in r["parameters"].values()),
        r["variant"],
        r["outcome"] if r["converged"] else f"{r['outcome']}, not converged",
        r["clinical_outcome"],
        str(r["end_nodes_in_sac"]),
        str(r["newton_iterations"]),
        f"{r['cpu_seconds']:.2f}",
        f"{r['residual_relative']:.1e}",
        f"{1e3 * r['max_penetration_mm']:.2f}",
        f"{r.get('mean_distance_um', float('nan')):.3f}",
        f"{r.get('max_distance_um', float('nan')):.3f}",
        f"{r['peak_memory_MB']:.0f}",
    ]
    return "| " + " | ".join(values) + " |"
