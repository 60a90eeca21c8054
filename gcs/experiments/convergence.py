"""Figure 13: how the best falls with the evaluations, six algorithms on terrain 1 with 5 UAVs."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from gcs.experiments.drawing import STYLES, picture
from gcs.experiments.experiment import Experiment, Row, Run, product
from gcs.experiments.markdown import table
from gcs.experiments.paper import ALGORITHMS
from gcs.experiments.series import from_cell, to_cell
from gcs.experiments.statistics import numbers, quartiles, select, spread
from gcs.experiments.table2 import EVALUATIONS, search
from gcs.experiments.trials import PAPER_POPULATION, Course

MISSION = "terrain-1-5uav"
POINTS = 200
"""Of each curve: the paper's iterations, where positions are absolute."""
PANELS = (("ecpso", "pso", "ipso", "gapso"), ("ecpso", "ca", "aca"))
"""Figure 13 a and b."""
CLAIMED = {"pso": 0.42, "ipso": 0.25, "gapso": 0.13}
"""By how much less than these E-CPSO is said to end."""


def runs(seeds: Sequence[int]) -> list[Run]:
    """Seed by seed."""
    return product(seed=list(seeds), representation=list(EVALUATIONS), algorithm=ALGORITHMS)


def work(run: Run) -> Row:
    """One search."""
    outcome, most = search(MISSION, run), EVALUATIONS[run.text("representation")]
    return {
        "ibc": outcome.course.converged_after() / PAPER_POPULATION,
        "cost": outcome.course.final,
        "fvc": outcome.candidate.objective,
        "feasible": not outcome.candidate.violations,
        "costs": to_cell(costs_at(outcome.course, np.linspace(most / POINTS, most, POINTS))),
    }


def costs_at(course: Course, evaluations: np.ndarray) -> list[float]:
    """Best cost after so many evaluations; that of the beginning where there was none yet."""
    after = [progress.evaluations for _, progress in course.steps]
    costs = [progress.objective for _, progress in course.steps]
    return [costs[max(index - 1, 0)] for index in np.searchsorted(after, evaluations, "right")]


def summary(rows: Sequence[Row]) -> str:
    """What the searches end with, beside what the paper says of figure 13."""
    parts = [
        "The cost is what the searches minimise: eq. 13 (uncapped) plus penalties. IBC in iterations of 300 "
        "evaluations. Last column: by how much E-CPSO's median ends below the other's; the paper's claim in brackets."
    ]
    for representation in EVALUATIONS:
        here = select(rows, representation=representation)
        if not here:
            continue
        head = ["algorithm", "runs", "IBC", "cost at the end", "feasible", "E-CPSO is less by"]
        parts.append(f"## {representation}, {EVALUATIONS[representation]} evaluations")
        parts.append(table(head, [_line(here, name) for name in ALGORITHMS]))
        parts.append(f"![convergence, {representation}](convergence-{representation}.png)")
    return "\n\n".join(parts)


def figures(rows: Sequence[Row], directory: Path) -> list[str]:
    """Medians and quartiles of the best cost, one picture per representation."""
    drawn: list[str] = []
    for representation, most in EVALUATIONS.items():
        name = f"convergence-{representation}.png"
        here = select(rows, representation=representation)
        if not here:
            continue
        with picture(directory / name, 8.0, 3.4) as figure:
            for axes, names in zip(figure.subplots(1, len(PANELS)), PANELS, strict=True):
                for algorithm in names:
                    _draw(axes, select(here, algorithm=algorithm), algorithm, most / PAPER_POPULATION)
                axes.set_yscale("log")
                axes.set_xlabel("iterations of 300 evaluations", fontsize=8)
                axes.set_ylabel("best cost", fontsize=8)
                axes.legend(fontsize=7)
        drawn.append(name)
    return drawn


def _draw(axes: Axes, rows: Sequence[Row], algorithm: str, iterations: float) -> None:
    if not rows:
        return
    low, middle, high = np.quantile([from_cell(row["costs"]) for row in rows], (0.25, 0.5, 0.75), axis=0)
    label, colour = STYLES[algorithm]
    at = np.linspace(iterations / POINTS, iterations, POINTS)
    axes.plot(at, middle, color=colour, label=label)
    axes.fill_between(at, low, high, color=colour, alpha=0.2, linewidth=0.0)


def _line(rows: Sequence[Row], algorithm: str) -> list[str]:
    here, ours = select(rows, algorithm=algorithm), numbers(select(rows, algorithm="ecpso"), "cost")
    costs = numbers(here, "cost")
    less = ""
    if algorithm != "ecpso" and costs and ours:
        less = f"{100.0 * (1.0 - quartiles(ours)[1] / quartiles(costs)[1]):.1f} %"
        less += f" ({100.0 * CLAIMED[algorithm]:.0f} %)" if algorithm in CLAIMED else ""
    feasible = f"{sum(row['feasible'] is True for row in here)}/{len(here)}"
    return [STYLES[algorithm][0], str(len(here)), spread(numbers(here, "ibc")), spread(costs), feasible, less]


EXPERIMENT = Experiment(
    name="convergence",
    title="Figure 13: convergence of six algorithms, terrain 1, 5 UAVs",
    default_runs=10,
    key=("seed", "representation", "algorithm"),
    values=("ibc", "cost", "fvc", "feasible", "costs"),
    runs=runs,
    work=work,
    figures=figures,
    summary=summary,
)
