"""What the study consists of: which stage needs which."""

from collections.abc import Sequence
from pathlib import Path

from braidcast.dataset.folder import DatasetFolder
from braidcast.study import (
    agreement,
    deployments,
    figures,
    importance,
    learning,
    outcomes,
    report,
    shapes,
    surrogates,
)
from braidcast.study import sizes as dataset
from braidcast.study.sizes import Size
from braidcast.study.stages import Stage
from braidcast.study.workspace import Study

AT = 300
"""N_s at which the paper compares predictors: 146 shapes, 200 outcomes."""


def pipeline(study: Study, samples: int) -> list[Stage]:
    """All stages of the study of the first ``samples`` cases, each after those it needs."""
    simulations = study.simulations(samples)
    sizes = dataset.sizes(DatasetFolder.open(study.dataset).plan, simulations, samples)
    middle = next((size for size in sizes if size.cases == AT), sizes[-1])
    stages = [
        Stage("cases", dataset.cases_table, {"samples": samples}, cases=samples),
        Stage("table 1", dataset.table1, {"sizes": sizes}, cases=samples),
        *_outcomes(sizes),
        *_shapes(sizes, middle),
        *_surrogates(sizes, middle, samples),
        *_learning(simulations.regression_training.size, sizes[-1], samples),
    ]
    for name, stage, needs in (
        ("sobol", importance.sobol, ("shipped model",)),
        ("leave one out", importance.leave_one_out, ("shipped model",)),
        ("permutation", importance.permutation, ("leave one out",)),
        ("strategy", deployments.strategy, ()),
        ("sites", deployments.sites, ("shipped model",)),
    ):
        stages.append(Stage(name, stage, {"samples": samples}, needs, samples))
    compared = (
        "table 1",
        "table 2",
        "table 3",
        "table 4",
        "errors by modes",
        "errors by simulations",
    )
    stages.append(Stage("agreement", agreement.agreement, needs=compared))
    everything = tuple(stage.name for stage in stages)
    drawn = figures.stages(sizes, middle, samples)
    written = Stage(
        "report",
        report.write,
        {"sizes": sizes, "middle": middle, "samples": samples},
        (*everything, *(stage.name for stage in drawn)),
        samples,
    )
    return [*stages, *drawn, written]


def _outcomes(sizes: Sequence[Size]) -> list[Stage]:
    classify = [
        Stage(
            f"classify {size.outcomes} {name}",
            outcomes.classify,
            {"size": size, "name": name},
            cases=size.cases,
        )
        # The slow ones first, so that no worker waits for them at the end.
        for size in reversed(sizes)
        for name in outcomes.NAMES
    ]
    needs = tuple(stage.name for stage in classify)
    return [
        *classify,
        Stage("table 2", outcomes.table2, {"sizes": sizes}, needs),
        Stage("false negatives", outcomes.false_negatives, {"sizes": sizes}, (*needs, "cases")),
    ]


def _shapes(sizes: Sequence[Size], middle: Size) -> list[Stage]:
    def errors(size: Size, name: str, centred: bool = False) -> Stage:
        options = {"size": size, "name": name, "centred": centred}
        title = f"shapes {size.shapes} {name}{' centred' if centred else ''}"
        return Stage(title, shapes.errors_by_modes, options, cases=size.cases)

    bezier = [errors(size, "Bezier") for size in sizes]
    best = [errors(size, shapes.BEST) for size in sizes]
    others = [errors(middle, name) for name in ("Ncl=3", "Ncl=5")]
    centred = errors(middle, "Bezier", centred=True)
    largest = sizes[-1].cases

    def names(stages: Sequence[Stage]) -> tuple[str, ...]:
        return tuple(stage.name for stage in stages)

    return [
        *bezier,
        *best,
        *others,
        centred,
        Stage("singular values", shapes.singular_values, {"sizes": sizes}, cases=largest),
        Stage("errors by modes", shapes.by_modes, {"sizes": sizes}, names(bezier)),
        Stage("table 3", shapes.table3, {"sizes": sizes}, (*names(bezier), "singular values")),
        Stage(
            "table 4", shapes.table4, {"size": middle}, names([*bezier, *best, *others, centred])
        ),
        Stage("errors by simulations", shapes.by_simulations, {"sizes": sizes}, names(best)),
        Stage("first node", shapes.first_node, {"size": middle}, names(bezier), middle.cases),
    ]


def _surrogates(sizes: Sequence[Size], middle: Size, samples: int) -> list[Stage]:
    trained = [
        Stage(
            f"train {recipe} {size.shapes}",
            surrogates.train_recipe,
            {"size": size, "recipe": recipe},
            cases=size.cases,
        )
        for recipe in ("ours", "paper")
        for size in reversed(sizes)
    ]
    pairs = [(recipe, size.shapes) for recipe in ("paper", "ours") for size in sizes]
    names = tuple(stage.name for stage in trained)
    return [
        Stage("shipped model", surrogates.train_shipped, {"samples": samples}, cases=samples),
        *trained,
        Stage("table of recipes", surrogates.table_recipes, {"trained": pairs}, names),
        Stage("examples", surrogates.examples, {"size": middle}, names, middle.cases),
        Stage(
            "shipped", surrogates.shipped, {"samples": samples}, ("shipped model",), cases=samples
        ),
    ]


def _learning(shapes: int, largest: Size, samples: int) -> list[Stage]:
    by_shapes = [
        (recipe, count)
        for recipe in ("ours", "paper")
        for count in reversed(learning.SHAPES)
        if count <= shapes
    ]
    by_outcomes = [
        (name, count)
        for name in (outcomes.OURS, outcomes.EXAMINED)
        for count in reversed(learning.OUTCOMES)
        if count <= largest.outcomes
    ]
    drawn = [
        *(
            Stage(
                f"learn shapes {count} {recipe}",
                learning.learn_shapes,
                {"samples": samples, "recipe": recipe, "count": count},
                cases=samples,
            )
            for recipe, count in by_shapes
        ),
        *(
            Stage(
                f"learn outcomes {count} {name}",
                learning.learn_outcomes,
                {"samples": samples, "name": name, "count": count},
                cases=samples,
            )
            for name, count in by_outcomes
        ),
    ]
    options = {"shapes": sorted(by_shapes), "outcomes": sorted(by_outcomes)}
    return [
        *drawn,
        Stage("learning curves", learning.curves, options, tuple(stage.name for stage in drawn)),
        Stage("needed", learning.needed, {}, ("learning curves", "table 1")),
    ]


def open_study(home: Path, dataset: Path) -> Study:
    """The study in the folder ``home``, of the simulations in the folder ``dataset``."""
    return Study(home.resolve(), dataset.resolve())
