"""The shared frame: a compared algorithm on a mission, with the budget, costs and judge of the planner itself."""

from collections.abc import Callable

import numpy as np

from gcs.planner.assembly import Candidate, judged
from gcs.planner.baselines.algorithms import COMPARED, NewOptimiser
from gcs.planner.baselines.searchers import InTurn, JointSearch, Representation, Searcher, Valued
from gcs.planner.budget import Budget
from gcs.planner.limits import flight_box
from gcs.planner.plan import Progress
from gcs.planner.problem import Route, guides, pose
from missions.mission import Mission

STRICTNESS = 100.0
"""Violations weigh so many times more than in the shipped search, whose polish mends what lighter penalties leave."""
LOOKS_FEASIBLE = 1e-4
"""A plan with a smaller sum of squared violations, sampled and with margins, is shown to the judge ..."""
WORTH_JUDGING = 1e-2
"""... if it is better by this share than the best that the judge approved."""


class BaselineSearch:
    """The search of one algorithm for one mission; compare `gcs.planner.search.FleetSearch`.

    Args:
        mission: what is to be planned.
        routes: who goes where.
        seed: of all random numbers.
        budget: when to end; one step is made at least.
        on_progress: called after every step.
        algorithm: a name in `COMPARED`, or how to make an optimiser.
        representation: of plans.
    """

    def __init__(
        self,
        mission: Mission,
        routes: list[Route],
        seed: int,
        budget: Budget,
        on_progress: Callable[[Progress], None],
        algorithm: str | NewOptimiser,
        representation: Representation = Representation.OFFSETS,
    ) -> None:
        self._mission, self._routes, self._budget, self._on_progress = mission, routes, budget, on_progress
        problem = pose(mission, routes, guides(mission, routes))
        self._weight = STRICTNESS * problem.terms.penalty_weight
        new_optimiser = COMPARED[algorithm] if isinstance(algorithm, str) else algorithm
        rng, population = np.random.default_rng(seed), representation.population
        self._searcher: Searcher
        if representation is Representation.OFFSETS:
            self._searcher = InTurn(problem, new_optimiser, population, self._weight, rng)
        else:
            box_m = np.array(flight_box(mission))
            self._searcher = JointSearch(problem, box_m, new_optimiser, population, self._weight, rng)
        self._approved: tuple[Candidate, float] | None = None
        self.convergence: list[Progress] = []

    @property
    def evaluations(self) -> float:
        """Of whole plans; one vehicle's curve counts as the fleet's share of one."""
        return self._searcher.evaluations

    def run(self) -> Candidate:
        """Search until the budget is used up: the best plan that the judge approved, or else the last one."""
        self._report()
        while self._goes_on():
            self._searcher.step(self._budget.share_done(self.evaluations))
            self._show_judge()
            self._report()
        best = self._searcher.best
        if self._approved is not None and self._approved[1] <= self._cost(best):
            return self._approved[0]
        last = self._judged(best)
        return last if self._approved is None or not last.violations else self._approved[0]

    def _goes_on(self) -> bool:
        enough = self._budget.left(self.evaluations) >= self._searcher.next_evaluations
        return enough and self._budget.share_done(self.evaluations) < 1.0 and not self._budget.interrupted()

    def _show_judge(self) -> None:
        best = self._searcher.best
        least = np.inf if self._approved is None else self._approved[1] - WORTH_JUDGING * abs(self._approved[1])
        if best.violation >= LOOKS_FEASIBLE or self._cost(best) >= least:
            return
        candidate = self._judged(best)
        if not candidate.violations:
            self._budget = self._budget.settled(self.evaluations)
            self._approved = candidate, self._cost(best)

    def _judged(self, plan: Valued) -> Candidate:
        return judged(self._mission, self._routes, plan.controls_m)

    def _cost(self, plan: Valued) -> float:
        return plan.objective + self._weight * plan.violation

    def _report(self) -> None:
        share_done = self._budget.share_done(self.evaluations)
        found, feasible = self._cost(self._searcher.best), self._approved is not None
        progress = Progress(self._searcher.iterations, int(self.evaluations), found, feasible, share_done)
        self.convergence.append(progress)
        self._on_progress(progress)
