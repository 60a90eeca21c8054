"""The product's own times: a call of `plan_mission` is stopped as soon as it reports what was asked for.

Counted is the CPU time of the whole call, from the mission to the plan in the caller's hands, its own judge included.
"""

import time
from dataclasses import dataclass

import numpy as np

from gcs.planner import FleetPlan, Progress, feasibility, plan_mission
from missions.mission import Mission
from tests.benchmarks.planner.task import flown_cost

PLENTY = 10**6
"""Evaluations: the time is what ends a call."""
SAMPLING_SHARES = (5e-4, 0.0, -5e-4, -1e-3)
"""The objective that the search reports, from fewer samples, may differ from the judge's by so much: of calls that end
that much sooner or later, the first one counts whose plan is as good as was asked for."""


@dataclass(frozen=True)
class Run:
    """What one call of the planner has come to.

    Args:
        cpu_s: of the call.
        objective: of eq. 13, over dense samples; infinite without a feasible plan.
        cost: that and what slow flight costs.
        evaluations: of whole plans.
        violations: what the judge finds, asked once more, apart from the planner's own asking.
    """

    cpu_s: float
    objective: float
    cost: float
    evaluations: int
    violations: tuple[str, ...]

    @property
    def feasible(self) -> bool:
        return not self.violations


def time_to(mission: Mission, seed: int, goal: float, most_s: float) -> Run:
    """The call that ends when a feasible plan with an objective of `goal` or less is there, or after `most_s`."""
    for share in SAMPLING_SHARES:
        run = _until(mission, seed, goal + share * abs(goal) if np.isfinite(goal) else goal, most_s)
        if run.objective <= goal or not run.feasible or run.cpu_s >= most_s:
            break
    return run


def plan_within(mission: Mission, seed: int, cpu_s: float | None = None, evaluations: int | None = None) -> Run:
    """The call with a budget of CPU time, or of evaluations, or with the default one."""
    began_s = time.process_time()
    plan = plan_mission(mission, seed=seed, budget_s=cpu_s, evaluations=evaluations, clock=time.process_time)
    return _judged(mission, plan, time.process_time() - began_s)


def _until(mission: Mission, seed: int, goal: float, most_s: float) -> Run:
    reached, began_s = False, time.process_time()

    def watch(progress: Progress) -> None:
        nonlocal reached
        reached = progress.feasible and progress.objective <= goal

    def should_stop() -> bool:
        return reached or time.process_time() - began_s >= most_s

    plan = plan_mission(mission, seed=seed, evaluations=PLENTY, on_progress=watch, should_stop=should_stop)
    return _judged(mission, plan, time.process_time() - began_s)


def _judged(mission: Mission, plan: FleetPlan, cpu_s: float) -> Run:
    found = tuple(str(violation) for violation in feasibility.violations(mission, plan.vehicles))
    if found:
        return Run(cpu_s, np.inf, np.inf, plan.evaluations, found)
    return Run(cpu_s, plan.objective, flown_cost(mission, plan.vehicles, plan.objective), plan.evaluations, ())
