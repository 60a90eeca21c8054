"""Figure 5: where E-CPSO and the traditional swarm end on the two-dimensional Ackley function.

D. H. Ackley: A connectionist machine for genetic hillclimbing. Kluwer, 1987. The paper maximises its negative.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from gcs.experiments.drawing import STYLES, picture
from gcs.experiments.experiment import Experiment, Row, Run, product
from gcs.experiments.markdown import table
from gcs.experiments.statistics import numbers, rank_sum_p, select, significance, spread
from gcs.planner.baselines import COMPARED
from gcs.planner.baselines.optimiser import Array, Lattice, SearchSpace

HALF_RANGE = 32.0
"""The function is searched in [-32, 32] x [-32, 32]."""
SIZES = {"30 x 50": (30, 50), "300 x 200": (300, 200)}
"""Particles and iterations: few, so that there is a difference to be seen, and the paper's."""
ALGORITHMS = ("ecpso", "pso", "ipso", "gapso", "ca")
"""All that move in continuous space; ants walk on lattices."""
DRAWN = ("ecpso", "pso")


def ackley(x: Array) -> Array:
    """(n,) values at (n, d) positions; the minimum is 0, at 0."""
    bowl = -20.0 * np.exp(-0.2 * np.sqrt(np.mean(x**2, axis=1)))
    return bowl - np.exp(np.mean(np.cos(2.0 * np.pi * x), axis=1)) + 20.0 + np.e


def runs(seeds: Sequence[int]) -> list[Run]:
    """Every algorithm in both sizes."""
    return product(seed=list(seeds), size=list(SIZES), algorithm=ALGORITHMS)


def work(run: Run) -> Row:
    """One search from a random start."""
    population, iterations = SIZES[run.text("size")]
    rng = np.random.default_rng(run.number("seed"))
    optimiser = COMPARED[run.text("algorithm")](_plane(), population, rng)
    for iteration in range(iterations):
        optimiser.tell(ackley(HALF_RANGE * optimiser.ask(iteration / iterations)))
    position, value = optimiser.best()
    return {"x": HALF_RANGE * position[0], "y": HALF_RANGE * position[1], "value": value}


def summary(rows: Sequence[Row]) -> str:
    """Distances from the optimum, and values."""
    lines = [_line(select(rows, size=size), size, name) for size in SIZES for name in ALGORITHMS]
    head = ["particles x iterations", "algorithm", "runs", "value reached", "worst", "distance from 0", "p"]
    preface = (
        "Median [quartiles]; the least value is 0. p: Wilcoxon's rank-sum test of the values against E-CPSO, "
        "two-sided, not adjusted for the number of tests."
    )
    return "\n\n".join([preface, table(head, lines), "![where searches end](ackley.png)"])


def figures(rows: Sequence[Row], directory: Path) -> list[str]:
    """Where the searches end, as in figure 5."""
    with picture(directory / "ackley.png", 7.0, 3.4) as figure:
        panels = figure.subplots(1, len(SIZES))
        for axes, size in zip(panels, SIZES, strict=True):
            for name in DRAWN:
                here = select(rows, size=size, algorithm=name)
                label, colour = STYLES[name]
                axes.plot(numbers(here, "x"), numbers(here, "y"), ".", color=colour, alpha=0.6, label=label)
            axes.plot([0.0], [0.0], "+", color="black", markersize=12, label="optimum")
            axes.set_title(f"{size} evaluations", fontsize=9)
            axes.legend(fontsize=7)
    return ["ackley.png"]


def _line(rows: Sequence[Row], size: str, algorithm: str) -> list[str]:
    here, rival = (numbers(select(rows, algorithm=name), "value") for name in (algorithm, "ecpso"))
    chosen = select(rows, algorithm=algorithm)
    away = np.hypot(numbers(chosen, "x"), numbers(chosen, "y")).tolist()
    p = "" if algorithm == "ecpso" else significance(rank_sum_p(here, rival))
    worst = f"{max(here):.1e}" if here else "–"
    return [size, STYLES[algorithm][0], str(len(here)), spread(here, ".1e"), worst, spread(away, ".1e"), p]


def _plane() -> SearchSpace:
    def fresh(rng: np.random.Generator, count: int) -> Array:
        return rng.uniform(-1.0, 1.0, (count, 2))

    nowhere = np.zeros((1, 3))
    one_node = Lattice(nowhere, nowhere, np.zeros((1, 1, 1, 1, 3)), np.zeros((1, 1, 1, 1, 2)))
    return SearchSpace(np.empty((0, 2)), fresh, one_node)


EXPERIMENT = Experiment(
    name="ackley",
    title="Figure 5: the Ackley function",
    default_runs=100,
    key=("seed", "size", "algorithm"),
    values=("x", "y", "value"),
    runs=runs,
    work=work,
    figures=figures,
    summary=summary,
)
