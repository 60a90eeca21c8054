"""What each mechanism of E-CPSO, and each part of the shipped planner, is worth: one switched off at a time."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from gcs.experiments.drawing import picture
from gcs.experiments.experiment import Experiment, Row, Run, product
from gcs.experiments.markdown import table
from gcs.experiments.paper import BEST_KNOWN
from gcs.experiments.statistics import numbers, rank_sum_p, select, share, significance, spread
from gcs.experiments.table2 import EVALUATIONS, SHIPPED
from gcs.experiments.trials import Trial, attempt, uncapped, warm_up
from gcs.planner import SearchSettings, plan_mission
from gcs.planner.baselines import Representation
from gcs.planner.baselines.adaptive import AdaptiveSwarm, paper_settings
from gcs.planner.baselines.optimiser import SearchSpace
from gcs.planner.ecpso import EcpsoSettings

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
PARTS = {
    "swarms": "one swarm per vehicle",
    "bows": "first particles",
    "lone_descents": "first plan",
    "polish": "gradients",
}
"""Each is a switch of `SearchSettings`."""
SHIPPED_EVALUATIONS = 800
SHIPPED_VARIANTS = (*VARIANTS, *(f"no {name}" for name in PARTS))


def runs(seeds: Sequence[int]) -> list[Run]:
    """The mechanisms in both representations, and mechanisms and parts in the shipped planner."""
    alone = product(seed=list(seeds), representation=list(EVALUATIONS), mission=MISSIONS, variant=VARIANTS)
    return alone + product(seed=list(seeds), representation=[SHIPPED], mission=MISSIONS, variant=SHIPPED_VARIANTS)


def work(run: Run) -> Row:
    """One search."""
    return _shipped(run) if run.text("representation") == SHIPPED else _alone(run)


def switched_off(settings: EcpsoSettings, variant: str) -> EcpsoSettings:
    """Settings without the mechanisms that a variant does without."""
    off = {f"adapt_{name}": False for name in MECHANISMS if variant in {NONE, f"no {name}"}}
    return replace(settings, **off)


def _shipped(run: Run) -> Row:
    warm_up()
    mission, variant = run.text("mission"), run.text("variant")
    off = {name: False for name in PARTS if variant == f"no {name}"}
    settings = SearchSettings(swarm=switched_off(EcpsoSettings(), variant), **off)
    plan = plan_mission(uncapped(mission), seed=run.number("seed"), evaluations=SHIPPED_EVALUATIONS, settings=settings)
    return {
        "cost": plan.objective,
        "over": plan.objective / BEST_KNOWN[mission],
        "feasible": plan.feasible,
        "cpu_s": plan.cpu_s,
    }


def _alone(run: Run) -> Row:
    representation, variant = Representation(run.text("representation")), run.text("variant")

    def swarm(space: SearchSpace, population: int, rng: np.random.Generator) -> AdaptiveSwarm:
        return AdaptiveSwarm(space, population, rng, switched_off(paper_settings(population), variant))

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
    for representation, most in (EVALUATIONS | {SHIPPED: SHIPPED_EVALUATIONS}).items():
        here = select(rows, representation=representation)
        head = ["variant", "what is off", "runs", "cost / f*", "feasible", "p"]
        parts.append(f"## {representation}, {most} evaluations")
        variants = SHIPPED_VARIANTS if representation == SHIPPED else VARIANTS
        parts.append(table(head, [_line(here, variant) for variant in variants]))
    parts.append("![ablation](ablation.png)")
    return "\n\n".join(parts)


def figures(rows: Sequence[Row], directory: Path) -> list[str]:
    """Boxes of all variants."""
    panels = dict.fromkeys(EVALUATIONS, VARIANTS) | {SHIPPED: SHIPPED_VARIANTS}
    with picture(directory / "ablation.png", 10.0, 3.6) as figure:
        for axes, (representation, variants) in zip(figure.subplots(1, len(panels)), panels.items(), strict=True):
            here = select(rows, representation=representation)
            costs = [numbers(select(here, variant=variant), "over") or [np.nan] for variant in variants]
            axes.boxplot(costs, tick_labels=list(variants), whis=(0, 100))
            axes.set_title(representation, fontsize=9)
            axes.set_ylabel("cost / f*", fontsize=8)
            axes.tick_params(axis="x", labelsize=7, rotation=60)
    return ["ablation.png"]


def _line(rows: Sequence[Row], variant: str) -> list[str]:
    here = select(rows, variant=variant)
    costs, rival = (numbers(select(rows, variant=name), "over") for name in (variant, ALL))
    names = {ALL: "nothing", NONE: "all of eqs. 9 to 12, figure 4: plain PSO"} | MECHANISMS | PARTS
    source = names[variant.removeprefix("no ")]
    p = "" if variant == ALL else significance(rank_sum_p(costs, rival))
    feasible = f"{100.0 * share(here, 'feasible'):.0f} %" if here else "–"
    return [variant, source, str(len(here)), spread(costs, ".3f"), feasible, p]


EXPERIMENT = Experiment(
    name="ablation",
    title="Ablation: mechanisms of E-CPSO and parts of the planner, one switched off at a time",
    default_runs=10,
    key=("seed", "representation", "mission", "variant"),
    values=("cost", "over", "feasible", "cpu_s"),
    runs=runs,
    work=work,
    figures=figures,
    summary=summary,
)
