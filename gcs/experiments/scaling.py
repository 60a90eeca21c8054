"""From 5 to 200 UAVs: how long the shipped planner takes to its first feasible plan of a generated fleet."""

import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from gcs.experiments.drawing import picture
from gcs.experiments.experiment import Experiment, Row, Run, product
from gcs.experiments.markdown import table
from gcs.experiments.statistics import numbers, quartiles, select, share, spread
from gcs.experiments.trials import Course, warm_up
from gcs.planner import plan_mission
from gcs.planner.allocation import allocate
from missions.generators import Kind, generate
from missions.mission import Mission

SIZES = (5, 10, 20, 50, 100, 200)
MOST_CPU_S = 600.0
"""Without a feasible plan after so long, a run has failed."""


def runs(seeds: Sequence[int]) -> list[Run]:
    """Seed by seed, small fleets first."""
    return product(seed=list(seeds), vehicles=SIZES)


def work(run: Run) -> Row:
    """Plan one generated fleet, until the judge approves of a plan."""
    warm_up()
    mission = generate(Kind.FLEET, run.number("seed"), run.number("vehicles"))
    course = Course()

    def enough() -> bool:
        return course.first_feasible() is not None or time.thread_time() - course.began_s > MOST_CPU_S

    plan = plan_mission(mission, evaluations=10**9, on_progress=course.note, should_stop=enough)
    return {
        "feasible": plan.feasible,
        "cpu_s": plan.cpu_s,
        "evaluations": plan.evaluations,
        "objective": plan.objective,
        "over_bound": plan.objective / least_objective(mission),
    }


def least_objective(mission: Mission) -> float:
    """No plan can be better: straight lines, and all that clearance and height can earn."""
    weights, routes = mission.planner, allocate(mission)
    assert weights.clearance_cap_m is not None
    assert weights.height_cap_m is not None
    earned = weights.clearance_weight * weights.clearance_cap_m + weights.height_weight * weights.height_cap_m
    return weights.length_weight * sum(route.direct_m for route in routes) - len(routes) * earned


def summary(rows: Sequence[Row]) -> str:
    """CPU times by the size of the fleet."""
    head = ["UAVs", "runs", "feasible", "CPU s to the first feasible plan", "worst", "evaluations", "objective / bound"]
    preface = (
        "Generated fleets: pads on a grid in the corner, random targets on the far side. The clock runs from the "
        "mission to a plan that the judge approves of, allocation included; CPU time of one thread. Median "
        "[quartiles]. The bound is that of straight lines with all clearance and height that earn anything."
    )
    lines = [_line(select(rows, vehicles=size), size) for size in SIZES]
    return "\n\n".join([preface, table(head, lines), "![scaling](scaling.png)"])


def figures(rows: Sequence[Row], directory: Path) -> list[str]:
    """CPU time over the number of UAVs."""
    with picture(directory / "scaling.png", 5.0, 3.4) as figure:
        axes = figure.subplots()
        axes.loglog(numbers(rows, "vehicles"), numbers(rows, "cpu_s"), ".", color="tab:gray", label="runs")
        sizes = [size for size in SIZES if select(rows, vehicles=size)]
        medians = [quartiles(numbers(select(rows, vehicles=size), "cpu_s"))[1] for size in sizes]
        axes.loglog(sizes, medians, "o-", color="tab:red", label="median")
        if len(sizes) > 1:
            slope = np.polyfit(np.log(sizes), np.log(medians), 1)[0]
            axes.set_title(f"grows as the number of UAVs to the {slope:.1f}", fontsize=9)
        axes.set_xlabel("UAVs", fontsize=8)
        axes.set_ylabel("CPU s to the first feasible plan", fontsize=8)
        axes.legend(fontsize=7)
    return ["scaling.png"]


def _line(rows: Sequence[Row], size: int) -> list[str]:
    if not rows:
        return [str(size), "0", "–", "–", "–", "–", "–"]
    times_s = numbers(rows, "cpu_s")
    return [
        str(size),
        str(len(rows)),
        f"{100.0 * share(rows, 'feasible'):.0f} %",
        spread(times_s, ".2f"),
        f"{max(times_s):.2f}",
        spread(numbers(rows, "evaluations"), ".0f"),
        spread(numbers(rows, "over_bound"), ".4f"),
    ]


EXPERIMENT = Experiment(
    name="scaling",
    title="Scaling: 5 to 200 UAVs",
    default_runs=5,
    key=("seed", "vehicles"),
    values=("feasible", "cpu_s", "evaluations", "objective", "over_bound"),
    runs=runs,
    work=work,
    figures=figures,
    summary=summary,
)
