"""What each of the mechanisms of E-CPSO is worth: without polish, one of them switched off at a time."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from gcs.experiments.drawing import picture
from gcs.experiments.experiment import Experiment, Row, Run, product
from gcs.experiments.markdown import table
from gcs.experiments.paper import BEST_KNOWN
from gcs.experiments.statistics import numbers, rank_sum_p, select, share, significance, spread
from gcs.experiments.table2 import EVALUATIONS
from gcs.experiments.trials import Trial, attempt
from gcs.planner.baselines import Representation
from gcs.planner.baselines.adaptive import AdaptiveSwarm, paper_settings
from gcs.planner.baselines.optimiser import SearchSpace

MISSIONS = ("terrain-1-5uav", "terrain-2-5uav", "terrain-3-5uav")
MECHANISMS = {
    "inertia": "eq. 9",
    "learning": "eqs. 10, 11",
    "speed": "eq. 12",
    "population": "figure 4",
    "topology": "figure 4",
}
"""Each is a switch `adapt_...` of `EcpsoSettings`."""
ALL, NONE = "all", "none"
VARIANTS = (ALL, *(f"no {name}" for name in MECHANISMS), NONE)


def runs(seeds: Sequence[int]) -> list[Run]:
    """Seed by seed."""
    return product(seed=list(seeds), representation=list(EVALUATIONS), mission=MISSIONS, variant=VARIANTS)


def work(run: Run) -> Row:
    """One search."""
    representation, variant = Representation(run.text("representation")), run.text("variant")

    def swarm(space: SearchSpace, population: int, rng: np.random.Generator) -> AdaptiveSwarm:
        off = {f"adapt_{name}": False for name in MECHANISMS if variant in {NONE, f"no {name}"}}
        return AdaptiveSwarm(space, population, rng, replace(paper_settings(population), **off))

    evaluations = EVALUATIONS[representation.value]
    outcome = attempt(Trial(run.text("mission"), swarm, representation, evaluations, run.number("seed")))
    return {
        "cost": outcome.course.final,
        "over": outcome.course.final / BEST_KNOWN[run.text("mission")],
        "feasible": not outcome.candidate.violations,
        "cpu_s": outcome.cpu_s,
    }


def summary(rows: Sequence[Row]) -> str:
    """Costs of the variants, over all three terrains."""
    parts = [
        "Cost at the end (eq. 13, uncapped, plus penalties) divided by the best known objective, over terrains 1 to 3 "
        "with 5 UAVs; median [quartiles]. p: Wilcoxon's rank-sum test against all mechanisms, two-sided, not adjusted."
    ]
    for representation, most in EVALUATIONS.items():
        here = select(rows, representation=representation)
        head = ["mechanisms", "paper", "runs", "cost / f*", "feasible", "p"]
        parts.append(f"## {representation}, {most} evaluations")
        parts.append(table(head, [_line(here, variant) for variant in VARIANTS]))
    parts.append("![ablation](ablation.png)")
    return "\n\n".join(parts)


def figures(rows: Sequence[Row], directory: Path) -> list[str]:
    """Boxes of all variants."""
    with picture(directory / "ablation.png", 8.0, 3.4) as figure:
        for axes, representation in zip(figure.subplots(1, len(EVALUATIONS)), EVALUATIONS, strict=True):
            here = select(rows, representation=representation)
            costs = [numbers(select(here, variant=variant), "over") or [np.nan] for variant in VARIANTS]
            axes.boxplot(costs, tick_labels=list(VARIANTS), whis=(0, 100))
            axes.set_title(representation, fontsize=9)
            axes.set_ylabel("cost / f*", fontsize=8)
            axes.tick_params(axis="x", labelsize=7, rotation=40)
    return ["ablation.png"]


def _line(rows: Sequence[Row], variant: str) -> list[str]:
    here = select(rows, variant=variant)
    costs, rival = (numbers(select(rows, variant=name), "over") for name in (variant, ALL))
    source = MECHANISMS.get(variant.removeprefix("no "), "plain PSO" if variant == NONE else "E-CPSO")
    p = "" if variant == ALL else significance(rank_sum_p(costs, rival))
    feasible = f"{100.0 * share(here, 'feasible'):.0f} %" if here else "–"
    return [variant, source, str(len(here)), spread(costs, ".3f"), feasible, p]


EXPERIMENT = Experiment(
    name="ablation",
    title="Ablation: the mechanisms of E-CPSO, one switched off at a time",
    default_runs=10,
    key=("seed", "representation", "mission", "variant"),
    values=("cost", "over", "feasible", "cpu_s"),
    runs=runs,
    work=work,
    figures=figures,
    summary=summary,
)
