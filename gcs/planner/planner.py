"""Planning a mission, from the allocation of targets to the judge's verdict."""

import time
from collections.abc import Callable
from functools import partial

from gcs.errors import UsageError
from gcs.planner.allocation import allocate
from gcs.planner.assembly import vehicle_plans
from gcs.planner.baselines import BASELINES, BaselineSearch
from gcs.planner.budget import new_budget
from gcs.planner.flown_plan import NO_FLOWN_PLAN, FlownPlan
from gcs.planner.plan import FleetPlan, Progress
from gcs.planner.problem import Way
from gcs.planner.search import EVERYTHING, FleetSearch, SearchSettings
from missions.kernels import one_at_a_time
from missions.mission import Mission, load_mission

ALGORITHMS = ("ecpso", *BASELINES)
"""The planner itself, and what the paper compares it with (`baselines`)."""


def plan_mission(
    mission: Mission,
    *,
    algorithm: str = "ecpso",
    seed: int = 0,
    evaluations: int | None = None,
    budget_s: float | None = None,
    clock: Callable[[], float] = time.perf_counter,
    on_progress: Callable[[Progress], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
    settings: SearchSettings = EVERYTHING,
    flown: FlownPlan = NO_FLOWN_PLAN,
) -> FleetPlan:
    """Allocate targets and plan curves and track points for all vehicles of a mission, in its world as it is known.

    With the same seed and number of evaluations, and no `budget_s`, the curves are the same to the bit.

    Args:
        mission: what is to be flown.
        algorithm: one of `ALGORITHMS`.
        seed: of all random numbers.
        evaluations: the most evaluations of whole plans; the default suits small fleets.
        budget_s: the most time on `clock`; may be given beside `evaluations`.
        clock: monotonic seconds.
        on_progress: called after every round of the search.
        should_stop: asked often; True ends the search with the best plan so far.
        settings: of `ecpso`, to switch parts of it off.
        flown: the plan that is being flown: `ecpso` begins with it, besides from nothing, and a change of it costs.

    Raises:
        UsageError: there is no such algorithm.
    """
    if algorithm not in ALGORITHMS:
        raise UsageError(f"--algorithm {algorithm}: expected one of {', '.join(ALGORITHMS)}")
    began_cpu_s = time.thread_time()
    budget = new_budget(evaluations, budget_s, clock, should_stop)
    routes = allocate(mission)
    flying = {route.name for route in routes}
    listener: Callable[[Progress], None] = on_progress or (lambda _: None)
    if algorithm in BASELINES:
        search = BaselineSearch(mission, routes, seed, budget, listener, algorithm)
        found = search.run()
    else:
        new_search = partial(FleetSearch, mission, routes, seed, budget, listener, settings, flown)
        search = _begun(new_search, flown.ways(mission, routes))
        found = search.improve()
    return FleetPlan(
        mission=mission.name,
        algorithm=algorithm,
        seed=seed,
        evaluations=round(search.evaluations),
        wall_s=clock() - budget.began_s,
        cpu_s=time.thread_time() - began_cpu_s,
        objective=found.objective,
        feasible=not found.violations,
        violations=found.violations,
        convergence=tuple(search.convergence),
        vehicles=vehicle_plans(mission, found),
        staying=tuple(vehicle.name for vehicle in mission.vehicles if vehicle.name not in flying),
    )


def _begun(new_search: Callable[..., FleetSearch], ways: list[Way] | None) -> FleetSearch:
    """The search that has begun best: from nothing, or along the ways that are flown."""
    if ways is None:
        search = new_search()
        search.begin()
        return search
    along = new_search()
    along.begin_along(ways)
    afresh = new_search(spent=along.evaluations)
    afresh.begin()
    better = min(along, afresh, key=lambda search: search.rank)
    better.count(afresh.evaluations - better.evaluations)
    return better


def compile_kernels() -> None:
    """Compile everything that planning needs, or load what was compiled before; takes seconds on a fresh machine."""
    with one_at_a_time("gcs"):
        plan_mission(load_mission("indoor"), evaluations=1)
