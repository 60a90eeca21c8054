"""One optimiser's run on one task: it evaluates, the attempt keeps the time and shows promising plans to the judge.

A plan counts as found when its verdict is there, as the product's do. Nothing else that the attempt does is charged to
the optimiser: no verdict on another plan, no comparison of costs.
"""

import time
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tests.benchmarks.planner.task import STRICTNESS, Task, flown_cost

Array = npt.NDArray[np.float64]

SHOWN_BELOW = 1e-4
"""A plan with a smaller sum of squared violations is shown to the judge ..."""
WORTH_SHOWING = 1e-3
"""... if it is so much better than the best so far (relative), or all but halves a violation that was refused."""


class Finished(Exception):
    """The attempt is over: its goal is reached, or its time is up."""


@dataclass(frozen=True)
class Limits:
    """When an attempt ends.

    Args:
        cpu_s: at the latest.
        goal: an objective at which it may end ...
        at_least_s: ... but not before this time ...
        at_least_evaluations: ... and so many evaluations.
    """

    cpu_s: float
    goal: float = -np.inf
    at_least_s: float = 0.0
    at_least_evaluations: int = 0


@dataclass(frozen=True)
class Found:
    """A plan that the judge approved, and when it was found.

    Args:
        cpu_s: since the beginning of the attempt.
        evaluations: of whole plans until then.
        objective: of eq. 13, over dense samples.
        cost: that and what slow flight costs.
    """

    cpu_s: float
    evaluations: int
    objective: float
    cost: float


class Attempt:
    """See the module.

    Args:
        task: what is planned.
        limits: when to end.
        spent_s: CPU time that the contestant has used already, to pose this task.
    """

    def __init__(self, task: Task, limits: Limits, spent_s: float = 0.0) -> None:
        self.task, self.limits = task, limits
        self.found: list[Found] = []
        self.evaluations = 0
        self._began_s = time.process_time() - spent_s
        self._refused: tuple[float, float] | None = None

    @property
    def cpu_s(self) -> float:
        """CPU time that the contestant has used."""
        return time.process_time() - self._began_s

    def costs(self, plans: Array) -> Array:
        """(p,) penalised costs of (p, dimension) plans.

        Raises:
            Finished: the attempt is over.
        """
        objective, violation = self.task.costs(plans)
        self.evaluations += len(plans)
        best = int(np.argmin(np.where(violation < SHOWN_BELOW, objective, np.inf)))
        self._look_at(plans[best], float(objective[best]), float(violation[best]))
        return objective + STRICTNESS * self.task.problem.terms.penalty_weight * violation

    def cost(self, plan: Array) -> float:
        """Penalised cost of one (dimension,) plan; raises like `costs`."""
        return float(self.costs(plan[None])[0])

    def cost_and_gradient(self, plan: Array, strictness: float = STRICTNESS) -> tuple[float, Array]:
        """Penalised cost of one (dimension,) plan and its gradient; raises like `costs`."""
        objective, violation, gradient = self.task.cost_and_gradient(plan, strictness)
        self.evaluations += 1
        self._look_at(plan, objective, violation)
        return objective + strictness * self.task.problem.terms.penalty_weight * violation, gradient

    def first_at(self, objective: float) -> Found | None:
        """The first approved plan with this objective or a better one."""
        return next((found for found in self.found if found.objective <= objective), None)

    def best_within(self, cpu_s: float = np.inf, evaluations: float = np.inf) -> Found | None:
        """The best approved plan of that time and number of evaluations."""
        within = [found for found in self.found if found.cpu_s <= cpu_s and found.evaluations <= evaluations]
        return within[-1] if within else None

    def _look_at(self, plan: Array, objective: float, violation: float) -> None:
        cpu_s = self.cpu_s
        if cpu_s < self.limits.cpu_s and violation < SHOWN_BELOW and self._is_news(objective, violation):
            self._judge(plan, objective, violation)
            self._began_s += self.cpu_s - cpu_s
        reached = bool(self.found) and self.found[-1].objective <= self.limits.goal
        enough = cpu_s >= self.limits.at_least_s and self.evaluations >= self.limits.at_least_evaluations
        if cpu_s >= self.limits.cpu_s or (reached and enough):
            raise Finished

    def _is_news(self, objective: float, violation: float) -> bool:
        best = self.found[-1].objective if self.found else np.inf
        if objective > best - WORTH_SHOWING * abs(best):
            return bool(self.found) and objective < best and objective <= self.limits.goal < best
        if self._refused is None:
            return True
        refused_objective, refused_violation = self._refused
        return violation < 0.5 * refused_violation or objective < refused_objective * (1.0 - WORTH_SHOWING)

    def _judge(self, plan: Array, objective: float, violation: float) -> None:
        candidate = self.task.judge(plan)
        cpu_s = self.cpu_s
        if candidate.violations:
            self._refused = objective, violation
        elif not self.found or candidate.objective < self.found[-1].objective:
            cost = flown_cost(self.task.mission, candidate.curves, candidate.objective)
            self.found.append(Found(cpu_s, self.evaluations, candidate.objective, cost))
            self._refused = None
