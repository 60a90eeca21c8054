"""One search of one algorithm on one mission, measured; compiling comes before and is not part of it."""

import functools
import time
from dataclasses import dataclass, field

import msgspec

from gcs.planner import plan_mission
from gcs.planner.allocation import allocate
from gcs.planner.assembly import Candidate
from gcs.planner.baselines import BaselineSearch, Representation
from gcs.planner.baselines.algorithms import NewOptimiser
from gcs.planner.budget import new_budget
from gcs.planner.plan import FleetPlan, Progress
from missions.kernels import one_at_a_time
from missions.mission import Mission, load_mission

PAPER_POPULATION = 300
"""N_s: an iteration in the paper's sense is so many evaluations of whole plans."""
PAPER_EVALUATIONS = 300 * 200
"""N_s particles for T iterations."""
WARM_UP_EVALUATIONS = 400
"""Enough for the shipped planner to have used everything that it is made of."""
CONVERGED = 0.01
"""A search has begun to converge when its best is within this share of its final best."""


@dataclass(frozen=True)
class Trial:
    """What is tried.

    Args:
        mission: name of a shipped mission.
        algorithm: a name in `COMPARED`, or how to make an optimiser.
        representation: of plans.
        evaluations: of whole plans.
        seed: of all random numbers.
    """

    mission: str
    algorithm: str | NewOptimiser
    representation: Representation
    evaluations: int
    seed: int


@dataclass
class Course:
    """How a search went: its progress, and the CPU time of this thread at each step.

    Args:
        began_s: CPU time when the search began.
        steps: (CPU seconds since then, progress).
    """

    began_s: float = field(default_factory=time.thread_time)
    steps: list[tuple[float, Progress]] = field(default_factory=list[tuple[float, Progress]])

    def note(self, progress: Progress) -> None:
        """To be called with every progress."""
        self.steps.append((time.thread_time() - self.began_s, progress))

    @property
    def final(self) -> float:
        """Cost of the best at the end."""
        return self.steps[-1][1].objective

    def converged_after(self) -> int:
        """Evaluations after which the best is, for good, within `CONVERGED` of the final best."""
        enough = self.final + CONVERGED * abs(self.final)
        return next(progress.evaluations for _, progress in self.steps if progress.objective <= enough)

    def first_feasible(self) -> Progress | None:
        """Progress at which the judge had approved of a plan."""
        return next((progress for _, progress in self.steps if progress.feasible), None)

    def cpu_to(self, cost: float) -> float | None:
        """CPU seconds until a feasible plan was known and the best cost no more than this."""
        return next((at_s for at_s, step in self.steps if step.feasible and step.objective <= cost), None)


@dataclass(frozen=True)
class Outcome:
    """What came of a trial.

    Args:
        candidate: the plan, and what the judge says.
        course: how the search went.
        cpu_s: CPU time of this thread.
        evaluations: of whole plans that it took.
    """

    candidate: Candidate
    course: Course
    cpu_s: float
    evaluations: float


@functools.cache
def warm_up() -> None:
    """Compile everything that is measured, or load what was compiled before; once per process."""
    with one_at_a_time("gcs"):
        plan_mission(load_mission("indoor"), evaluations=WARM_UP_EVALUATIONS)
        for representation in Representation:
            _attempt(Trial("indoor", "aca", representation, evaluations=1, seed=0))


def attempt(trial: Trial) -> Outcome:
    """Search once."""
    warm_up()
    return _attempt(trial)


def _attempt(trial: Trial) -> Outcome:
    course = Course()
    mission, budget = uncapped(trial.mission), new_budget(trial.evaluations, None, time.perf_counter, None)
    search = BaselineSearch(
        mission, allocate(mission), trial.seed, budget, course.note, trial.algorithm, trial.representation
    )
    candidate = search.run()
    return Outcome(candidate, course, time.thread_time() - course.began_s, search.evaluations)


def attempt_shipped(mission_name: str, seed: int) -> tuple[FleetPlan, Course]:
    """Plan once with the shipped planner and its default budget."""
    warm_up()
    course = Course()
    plan = plan_mission(uncapped(mission_name), seed=seed, on_progress=course.note)
    return plan, course


def uncapped(name: str) -> Mission:
    """A mission as the paper has it: without caps of clearance and height (reading A of eq. 13)."""
    mission = load_mission(name)
    return msgspec.structs.replace(
        mission, planner=msgspec.structs.replace(mission.planner, clearance_cap_m=None, height_cap_m=None)
    )
