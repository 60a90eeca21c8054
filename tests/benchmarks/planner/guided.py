"""OMPL: shortest ways for single vehicles, alone and as guides for optimisers of whole plans.

OMPL's planners know one vehicle and what stands in its world. Turn radius, climb angle, and what vehicles owe to one
another they do not know: their paths alone are no plans. So each is given to an optimiser, too, as what offsets are
counted from, with half of the time.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from ompl import base, geometric, util

from gcs.planner import feasibility
from gcs.planner.allocation import allocate
from gcs.planner.curves import lengths
from gcs.planner.limits import flight_box
from gcs.planner.objective import objective
from gcs.planner.plan import TimedCurve
from gcs.planner.problem import Route
from gcs.planner.timing import common_timing
from missions import obstacles
from missions.mission import Mission
from tests.benchmarks.planner.attempt import Attempt, Limits
from tests.benchmarks.planner.peers import run_peer
from tests.benchmarks.planner.task import flown_cost, pose_along

Array = npt.NDArray[np.float64]

SEARCH_SHARE = 0.5
"""Of the time, for OMPL; the rest is the optimiser's."""
SPARE = 1.05
"""Paths keep so many times the limit of clearance, since no curve follows them exactly."""

HEIGHT_ROUNDING_M = 1e-6
"""Feet of far peaks lift the ground below a launch point by less than this."""


@dataclass(frozen=True)
class Paths:
    """What OMPL found for a mission.

    Args:
        polygons_m: (m, 3) ENU for every vehicle; None without one.
        cpu_s: that it took.
    """

    polygons_m: list[Array] | None
    cpu_s: float


@dataclass(frozen=True)
class Alone:
    """OMPL's paths, flown as they are: what eq. 13 makes of them, and what is wrong with them."""

    cost: float
    violations: int


def bit_star(mission: Mission, seed: int, cpu_s: float) -> Paths:
    """Ways of all vehicles by Batch Informed Trees (Gammell et al. 2015), each with its share of the time."""
    util.setLogLevel(util.LogLevel.LOG_NONE)  # it says an error where a seed is set a second time
    util.RNG.setSeed(seed + 1)
    began_s, routes, polygons_m = time.process_time(), allocate(mission), []
    for index, route in enumerate(routes):
        until_s = began_s + cpu_s * (index + 1) / len(routes)
        polygon_m = _path(mission, route, until_s)
        if polygon_m is None:
            return Paths(None, time.process_time() - began_s)
        polygons_m.append(polygon_m)
    return Paths(polygons_m, time.process_time() - began_s)


def guided(name: str, mission: Mission, paths: Paths, seed: int, cpu_s: float) -> Attempt | None:
    """An attempt of a peer on offsets from OMPL's paths, which are charged to it; None without paths."""
    if paths.polygons_m is None:
        return None
    began_s = time.process_time()
    task = pose_along(mission, paths.polygons_m)
    return run_peer(name, task, seed, Limits(cpu_s), spent_s=paths.cpu_s + time.process_time() - began_s)


def alone(mission: Mission, polygons_m: Sequence[Array]) -> Alone:
    """What the paths are worth as they are."""
    spacing_m = 0.99 * feasibility.SPACING_M[mission.site]
    longest_m = max(np.linalg.norm(np.diff(polygon_m, axis=0), axis=1).sum() for polygon_m in polygons_m)
    count = int(np.ceil(longest_m / spacing_m)) + 1
    curves_m = np.array([_resampled(polygon_m, count) for polygon_m in polygons_m])
    measured = feasibility.measure(mission, curves_m)
    timing = common_timing(mission, curves_m, measured.clearance_m, measured.curvature_1_m)
    curves = [
        TimedCurve(route.name, route.sysid, route.targets, curve_m, timing.times_s)
        for route, curve_m in zip(allocate(mission), curves_m, strict=True)
    ]
    cost = flown_cost(mission, curves, objective(mission, curves_m, measured.clearance_m, measured.height_m))
    return Alone(cost, len(feasibility.violations(mission, curves, measured)))


def _resampled(polygon_m: Array, count: int) -> Array:
    along_m = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(polygon_m, axis=0), axis=1))))
    where_m = np.linspace(0.0, along_m[-1], count)
    return np.stack([np.interp(where_m, along_m, polygon_m[:, axis]) for axis in range(3)], axis=-1)


def _path(mission: Mission, route: Route, until_s: float) -> Array | None:
    """(m, 3) ENU: the shortest way found until then on the process's clock."""
    low_m, high_m = flight_box(mission)
    space, box = base.RealVectorStateSpace(3), base.RealVectorBounds(3)
    for axis in range(3):
        box.setLow(axis, float(low_m[axis]))
        box.setHigh(axis, float(high_m[axis]))
    space.setBounds(box)
    setup = geometric.SimpleSetup(space)
    information = setup.getSpaceInformation()
    free = _Free(mission, route)
    motions = _Motions(information, free)
    setup.setStateValidityChecker(lambda state: free.at(_place(state)[None]))
    information.setMotionValidator(motions)
    setup.setStartAndGoalStates(_state(space, route.start_m), _state(space, np.array(route.targets[-1].position_m)))
    setup.setOptimizationObjective(base.PathLengthOptimizationObjective(information))
    setup.setPlanner(geometric.BITstar(information))
    setup.solve(base.PlannerTerminationCondition(lambda: time.process_time() >= until_s))
    if not setup.haveExactSolutionPath():
        return None
    path = setup.getSolutionPath()
    return np.array([[path.getState(i)[axis] for axis in range(3)] for i in range(path.getStateCount())])


def _state(space: base.RealVectorStateSpace, place_m: Array) -> base.RealVectorStateType:
    state = space.allocState()
    for axis in range(3):
        state[axis] = float(place_m[axis])
    return state


def _place(state: base.RealVectorStateType) -> Array:
    return np.array([state[0], state[1], state[2]])


class _Free:
    """Where a vehicle may be: clearance and height as the judge wants them, the former with a margin."""

    def __init__(self, mission: Mission, route: Route) -> None:
        self._solid, self._kept = obstacles.pack(mission.world.as_known()), mission.limits
        self._ends_m = route.places_m[[0, -1]]
        self._radius_m = mission.launch_zone_radius_m

    @property
    def step_m(self) -> float:
        """How closely a motion is looked at."""
        return 0.25 * self._kept.clearance_m

    def at(self, places_m: Array) -> bool:
        """Whether all (n, 3) places are free."""
        kept = self._kept
        in_zone = lengths(places_m[:, None] - self._ends_m).min(axis=1) < self._radius_m
        clearance_m = obstacles.clearance(places_m, self._solid)
        if np.any(clearance_m < np.where(in_zone, kept.body_radius_m, SPARE * kept.clearance_m)):
            return False
        height_m = places_m[:, 2] - obstacles.terrain_height(places_m, self._solid)
        return bool(np.all(height_m >= np.where(in_zone, -HEIGHT_ROUNDING_M, kept.height_m)))


class _Motions(base.MotionValidator):
    """Checks a whole motion in one compiled call: ten times as fast as OMPL calling back into Python for each state."""

    def __init__(self, information: base.SpaceInformation, free: _Free) -> None:
        super().__init__(information)
        self._free = free

    def checkMotion(self, begin: base.RealVectorStateType, end: base.RealVectorStateType) -> bool:  # noqa: N802
        begin_m, end_m = _place(begin), _place(end)
        count = int(np.linalg.norm(end_m - begin_m) / self._free.step_m) + 2
        return self._free.at(begin_m + np.linspace(0.0, 1.0, count)[:, None] * (end_m - begin_m))
