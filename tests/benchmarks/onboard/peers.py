"""Planners that pip installs beside ours, on the same replans: what was seen, from where, and to where is recorded.

OMPL looks for a path on the same distance field, with the same clearance: no speeds, no accelerations, no smoothness.
pymoo searches exactly our problem, with our compiled evaluation and from our first particles. Their Python is part of
what they cost.
"""

import time
from collections.abc import Callable, Iterable, Iterator
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from ompl import base, geometric, util
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.algorithms.soo.nonconvex.pso import PSO
from pymoo.core.problem import ElementwiseProblem
from pymoo.optimize import minimize

from companion.planner.evaluation import CLEARANCE, HARD, HEIGHT, LENGTH, SOFT, LocalProblem, evaluate
from companion.planner.limits import Surroundings, free_at
from companion.planner.local_plan import LocalPlanner, Way, lay_seeds, pose, reference_within, spread_of
from companion.planner.mopso import FASTEST_SCALE, REACH, SLOWEST_SCALE
from companion.planner.planner import Plan, Planner, PlanRequest
from missions.trajectory import Trajectory
from tests.benchmarks.onboard.craft import Craft
from tests.benchmarks.onboard.flights import cross
from tests.benchmarks.onboard.single import Part
from tests.benchmarks.onboard.worlds import COURSES
from tests.benchmarks.planner.figures import Table

Array = npt.NDArray[np.float64]

PATIENCE_S = 0.2
"""CPU time that OMPL is given for one path."""
EVALUATIONS = (160, 1600)
"""That pymoo is given: as many as ours makes, and ten times as many."""
STEP_SHARE = 0.01
"""How densely OMPL looks at lines, as a share of the flight range's diagonal: about 0.3 m."""
HEADER = ("world", "planner", "replans", "solved", "CPU ms median · p99", "length against ours", "cost against ours")


class Replan(NamedTuple):
    """One recorded replan."""

    request: PlanRequest
    plan: Plan
    planner: Planner
    around: Surroundings
    cpu_ms: float


class Answer(NamedTuple):
    """What a planner made of a replan; NaN where there is nothing to compare."""

    solved: bool
    cpu_ms: float
    length_ratio: float = np.nan
    cost_more: float = np.nan


def peers(seeds: range, worlds: Iterable[str]) -> Iterator[Part]:
    """One table for all worlds; nothing is required of others."""
    util.setLogLevel(util.LogLevel.LOG_NONE)
    table = Table("The same replans, with planners that pip installs", HEADER)
    for world in worlds:
        replans = [replan for seed in seeds for replan in recorded(world, seed) if replan.plan.trajectory is not None]
        for name, solve in PLANNERS.items():
            table.rows.append(_row(world, name, [solve(replan) for replan in replans]))
    yield table, []


def recorded(world: str, seed: int) -> list[Replan]:
    """All replans of one flight."""
    course = COURSES[world](seed)
    craft, replans = Craft(course, 0, seed), list[Replan]()

    def witness(request: PlanRequest, plan: Plan, cpu_ms: float) -> None:
        around = craft.planner.around._replace(field=craft.planner.seen.field)
        replans.append(Replan(request, plan, craft.planner, around, cpu_ms))

    craft.planner.witness = witness
    cross(course, [craft])
    return replans


def _row(world: str, name: str, answers: list[Answer]) -> tuple[str, ...]:
    cpu_ms, solved = [answer.cpu_ms for answer in answers], sum(answer.solved for answer in answers)
    return (
        world,
        name,
        str(len(answers)),
        f"{solved / len(answers):.0%}",
        f"{np.median(cpu_ms):.2f} · {np.percentile(cpu_ms, 99):.1f}",
        _median([answer.length_ratio for answer in answers], "{:.3f}"),
        _median([answer.cost_more for answer in answers], "{:+.3f} m"),
    )


def _median(values: list[float], text: str) -> str:
    known = [value for value in values if np.isfinite(value)]
    return text.format(np.median(known)) if known else "–"


def ours(replan: Replan) -> Answer:
    """What was flown."""
    return Answer(True, replan.cpu_ms, 1.0)


# --------------------------------------------------------------------------- OMPL
def ompl_path(method: Callable[[Any], Any]) -> Callable[[Replan], Answer]:
    """A path from the plan's start to its end by one of OMPL's planners, until it has one."""

    def solve(replan: Replan) -> Answer:
        trajectory = replan.plan.trajectory
        assert trajectory is not None
        around, clearance_m = replan.around, replan.planner.limits.clearance_m
        start_m, goal_m = trajectory.at(trajectory.start_s).position_m, trajectory.control_points_m[-1]
        began_s = time.process_time()
        least_m = min(clearance_m, *(free_at(*place_m, around) for place_m in (start_m, goal_m)))
        space, box = base.RealVectorStateSpace(3), base.RealVectorBounds(3)
        for axis in range(3):
            box.setLow(axis, float(min(around.room_m[0, axis], start_m[axis])))
            box.setHigh(axis, float(max(around.room_m[1, axis], start_m[axis])))
        space.setBounds(box)
        setup = geometric.SimpleSetup(space)
        information = setup.getSpaceInformation()
        information.setStateValidityCheckingResolution(STEP_SHARE)
        setup.setStateValidityChecker(lambda state: free_at(state[0], state[1], state[2], around) >= least_m)
        ends = [space.allocState(), space.allocState()]
        for state, place_m in zip(ends, (start_m, goal_m), strict=True):
            for axis in range(3):
                state[axis] = float(place_m[axis])
        setup.setStartAndGoalStates(*ends)
        setup.setPlanner(method(information))
        until_s = began_s + PATIENCE_S
        done = base.PlannerTerminationCondition(lambda: time.process_time() >= until_s or setup.haveExactSolutionPath())
        setup.solve(done)
        solved = setup.haveExactSolutionPath()
        if solved:
            setup.simplifySolution(base.PlannerTerminationCondition(lambda: time.process_time() >= until_s))
        cpu_ms = (time.process_time() - began_s) * 1e3
        length_m = setup.getSolutionPath().length() if solved else np.nan
        return Answer(solved, cpu_ms, length_m / length_of(trajectory))

    return solve


def length_of(trajectory: Trajectory) -> float:
    """Length [m] of a trajectory."""
    times_s = np.linspace(trajectory.start_s, trajectory.end_s, 200)
    return float(np.linalg.norm(np.diff(trajectory.sample(times_s).position_m, axis=0), axis=1).sum())


# --------------------------------------------------------------------------- pymoo
class Posed(ElementwiseProblem):
    """Our local problem as pymoo has it.

    Args:
        problem: with its compiled evaluation.
        low, high: (d,) bounds of the search.
        weights: (3,) of a single objective; none for all three.
    """

    def __init__(self, problem: LocalProblem, low: Array, high: Array, weights: Array | None) -> None:
        super().__init__(n_var=len(low), n_obj=3 if weights is None else 1, n_ieq_constr=1, xl=low, xu=high)
        self._problem, self._weights, self._value = problem, weights, np.empty(5)

    def _evaluate(self, x: Array, out: dict[str, Any], *_: object, **__: object) -> None:
        evaluate(np.ascontiguousarray(x), self._problem, self._value)
        objectives = self._value[[LENGTH, CLEARANCE, HEIGHT]]
        out["F"] = objectives.copy() if self._weights is None else float(self._weights @ objectives)
        out["G"] = self._value[HARD] + self._value[SOFT]


def pymoo_search(method: type, evaluations: int, *, weighted: bool) -> Callable[[Replan], Answer]:
    """Our problem searched by one of pymoo's algorithms; its cost is what the flown search's weights make of it."""

    def solve(replan: Replan) -> Answer:
        local: LocalPlanner = replan.planner.local
        request, weights, rng = replan.request, local.search.weights, np.random.default_rng(0)
        began_s = time.process_time()
        start = np.ascontiguousarray(request.start, dtype=float)
        guide, arc_m = replan.plan.guide, replan.plan.arc_m
        to_m, reference = reference_within(1.0, guide.way, arc_m, start, local, replan.around)
        problem = pose(start, reference, local, replan.around)
        none = Way(np.empty((0, 5)), np.empty(0))
        x, n_seeds = lay_seeds(problem, none, to_m - arc_m, local, replan.around)
        spread = spread_of(x[0], problem)
        x[n_seeds:] = x[np.arange(n_seeds, len(x)) % n_seeds] + spread * rng.standard_normal(x[n_seeds:].shape)
        high = REACH * spread
        low = -high
        low[0], high[0] = FASTEST_SCALE, SLOWEST_SCALE
        posed = Posed(problem, low, high, weights if weighted else None)
        algorithm = method(pop_size=len(x), sampling=np.clip(x, low, high))
        found = minimize(posed, algorithm, ("n_eval", evaluations), seed=1)
        cpu_ms = (time.process_time() - began_s) * 1e3
        if found.X is None:
            return Answer(False, cpu_ms)
        costs = np.atleast_2d(found.F) @ (np.ones(1) if weighted else weights)
        return Answer(True, cpu_ms, np.nan, float(costs.min()) - _our_cost(replan, problem, weights))

    return solve


def _our_cost(replan: Replan, problem: LocalProblem, weights: Array) -> float:
    """What our search finds on the same problem, in the same weights; NaN without anything."""
    from companion.planner.mopso import chosen, new_swarm, search

    local = replan.planner.local
    none = Way(np.empty((0, 5)), np.empty(0))
    x, n_seeds = lay_seeds(problem, none, problem.reference.length_m, local, replan.around)
    spread, rng = spread_of(x[0], problem), np.random.default_rng(0)
    x[n_seeds:] = x[np.arange(n_seeds, len(x)) % n_seeds] + spread * rng.standard_normal(x[n_seeds:].shape)
    swarm = new_swarm(x, local.search.archive_size, local.search.tabu_neighbours, local.search.tabu_length)
    search(problem, swarm, spread, local.search, rng)
    value = chosen(swarm, weights)[1]
    return float(weights @ value[:3]) if value[HARD] + value[SOFT] == 0.0 else np.nan


PLANNERS: dict[str, Callable[[Replan], Answer]] = {
    "this planner": ours,
    "OMPL RRT-Connect, path only": ompl_path(geometric.RRTConnect),
    "OMPL BIT*, path only": ompl_path(geometric.BITstar),
    "pymoo NSGA-II, as many evaluations": pymoo_search(NSGA2, EVALUATIONS[0], weighted=False),
    "pymoo NSGA-II, ten times as many": pymoo_search(NSGA2, EVALUATIONS[1], weighted=False),
    "pymoo PSO, ten times as many": pymoo_search(PSO, EVALUATIONS[1], weighted=True),
}
"""By the name under which they are reported."""
