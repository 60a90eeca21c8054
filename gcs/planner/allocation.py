"""Who flies to which targets, and in which order: as the mission says, or so that ways are short and balanced.

Ways are as long as they have to be flown: straight, bent around what is in the way, or along a path through a maze.
Only the ways that an allocation would use are looked at: a straight line is never longer than the way, so an allocation
that is best with the ways it uses at their true lengths, and all others at those of straight lines, is the best of all.
"""

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt
from scipy.optimize import linear_sum_assignment

from gcs.planner.curves import lengths, path_lengths
from gcs.planner.fleet_cost import Problem, no_others, swarm_cost
from gcs.planner.guide_path import guide_path
from gcs.planner.limits import path_limit_m
from gcs.planner.problem import Route, guides, pose
from gcs.planner.representation import bows, straight_legs
from gcs.planner.target_order import balanced_routes
from missions.mission import Mission, Target, Vehicle

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
Leg = tuple[int, int]
"""From a place to a target, by their indices; the starts of all vehicles come before the targets."""
Solve = Callable[[Array], list[list[int]]]
"""Targets of each vehicle in flying order, by a (vehicles + targets, targets) table of lengths."""

UNREACHABLE_M = 1e7
"""The length of a way that there is not, or that is too long for one flight."""
SIDES = 0.02
"""Ways through one gap are equally long whoever flies to which target behind it. With so much of the squares of
straight distances added, vehicles then do not change sides."""
FLYABLE = 1e-4
"""A curve with a smaller sum of squared violations is a way."""


def allocate(mission: Mission) -> list[Route]:
    """One route per vehicle that flies, in the order of the mission's vehicles; the others stay on their pads.

    Without an allocation in the mission, each vehicle gets one target so that the ways are shortest in total; with
    fewer targets some vehicles stay; with more, all share them so that the longest route is short. Vehicles that begin
    in one point are told apart by their pads (docs/decisions/0016-allocation.md).
    """
    given = mission.routes
    if given is not None:
        by_name = {target.name: target for target in mission.targets}
        targets = [tuple(by_name[name] for name in given[vehicle.name]) for vehicle in mission.vehicles]
    else:
        chosen = _chosen(mission)
        targets = [tuple(mission.targets[index] for index in route) for route in chosen]
    return [
        route_of(mission, vehicle, stops) for vehicle, stops in zip(mission.vehicles, targets, strict=True) if stops
    ]


def route_of(mission: Mission, vehicle: Vehicle, targets: tuple[Target, ...]) -> Route:
    """The route of a vehicle to its targets."""
    return Route(vehicle.name, vehicle.sysid, mission.start_m(vehicle), targets)


def one_each(table_m: Array) -> list[list[int]]:
    """At most one target per vehicle, as many as there can be, the lengths in total least (Kuhn and Munkres).

    Args:
        table_m: (vehicles + targets, targets) lengths of the ways from every start and target to every target.
    """
    n_vehicles = len(table_m) - table_m.shape[1]
    routes: list[list[int]] = [[] for _ in range(n_vehicles)]
    vehicles, targets = linear_sum_assignment(table_m[:n_vehicles])
    for vehicle, target in zip(vehicles, targets, strict=True):
        routes[int(vehicle)].append(int(target))
    return routes


def shortest(table_m: Array, solve: Solve, way_lengths: Callable[[list[Leg]], Array]) -> list[list[int]]:
    """Routes that are best with the true lengths of the ways.

    Args:
        table_m: (vehicles + targets, targets) lower bounds of the lengths; those of ways that are used are set right.
        solve: finds the best routes for a table.
        way_lengths: (k,) true lengths of k legs.
    """
    known: set[Leg] = set()
    while True:
        routes = solve(table_m)
        new = [leg for leg in legs(routes) if leg not in known]
        if not new:
            return routes
        table_m[tuple(np.array(new).T)] = way_lengths(new)
        known.update(new)


def legs(routes: Sequence[Sequence[int]]) -> list[Leg]:
    """The legs that routes consist of."""
    n = len(routes)
    return [
        (before, target)
        for vehicle, route in enumerate(routes)
        for before, target in zip([vehicle, *(n + target for target in route)], route, strict=False)
    ]


def _chosen(mission: Mission) -> list[list[int]]:
    """Indices of the targets of each vehicle."""
    starts_m = np.array([mission.start_m(vehicle) for vehicle in mission.vehicles])
    targets_m = np.array([target.position_m for target in mission.targets])
    if len(targets_m) <= len(starts_m) and mission.launch_point_m is not None:
        return one_each(np.concatenate((_from_pads(mission, targets_m), np.zeros((len(targets_m),) * 2))))
    places_m = np.concatenate((starts_m, targets_m))
    table_m = lengths(places_m[:, None] - targets_m)
    sides_m = SIDES * table_m**2 / max(float(table_m.max()), 1e-9)
    template = _lengths_alone(mission)

    def way_lengths(wanted: list[Leg]) -> Array:
        begins, ends = np.array(wanted).T
        return _way_lengths(mission, template, places_m[begins], targets_m[ends])

    def one_each_on_its_side(table_m: Array) -> list[list[int]]:
        return one_each(table_m + sides_m)

    solve = one_each_on_its_side if len(targets_m) <= len(starts_m) else balanced_routes
    return shortest(table_m, solve, way_lengths)


def _from_pads(mission: Mission, targets_m: Array) -> Array:
    """(vehicles, targets) squares of the distances from the pads, for vehicles with a common launch point.

    All ways are equally long for all vehicles. With the least sum of squares no two vehicles have to change sides on
    their way from the pads to the curves: (p_i - p_j) . (q_i - q_j) >= 0 (Turpin, Michael and Kumar 2014).
    """
    pads_m = np.array([vehicle.pad_m for vehicle in mission.vehicles])
    return np.sum((pads_m[:, None] - targets_m) ** 2, axis=2)


def _way_lengths(mission: Mission, template: Problem, begins_m: Array, ends_m: Array) -> Array:
    """(k,) lengths [m] of the shortest ways between (k, 3) places: curves that keep the limits, or else paths."""
    found_m = _bent(mission, template, begins_m, ends_m, bows(template.base_m.shape[1]))
    for index in np.flatnonzero(np.isinf(found_m)):
        path_m = guide_path(mission, begins_m[index], ends_m[index])
        found_m[index] = np.inf if path_m is None else path_lengths(path_m)
    return np.where(found_m <= path_limit_m(mission), found_m, UNREACHABLE_M)


def _lengths_alone(mission: Mission) -> Problem:
    """A problem in which curves cost their lengths and whatever limits they break; its guides are of no account."""
    vehicles, targets, count = mission.vehicles, mission.targets, max(len(mission.vehicles), len(mission.targets))
    everywhere = [
        route_of(mission, vehicles[index % len(vehicles)], (targets[index % len(targets)],)) for index in range(count)
    ]
    problem = pose(mission, everywhere, guides(mission, everywhere))
    return problem._replace(
        terms=problem.terms._replace(length_weight=1.0, clearance_weight=0.0, height_weight=0.0, slow_cost=0.0)
    )


def _bent(mission: Mission, template: Problem, begins_m: Array, ends_m: Array, first: Array) -> Array:
    """(k,) lengths [m] of the shortest bow between places that keeps the limits, infinite where none does.

    Where the straight line, the first of the bows, keeps them, the others are not looked at.
    """
    bases_m, axes_m = straight_legs(begins_m, ends_m, template.base_m.shape[1], mission.world.bounds)
    problem = template._replace(base_m=bases_m, axes_m=axes_m, zones_m=np.stack((begins_m, ends_m), axis=1))
    problem = problem._replace(pins=np.zeros((len(begins_m), 0), np.int64))
    nobody, found_m = no_others(), np.full(len(begins_m), np.inf)
    for index in range(len(begins_m)):
        for tried in (first[:1], first[1:]):
            length_m, violation = np.empty(len(tried)), np.empty(len(tried))
            swarm_cost(problem, index, tried, nobody, length_m, violation)
            found_m[index] = np.where(violation < FLYABLE, length_m, np.inf).min()
            if np.isfinite(found_m[index]):
                break
    return found_m
