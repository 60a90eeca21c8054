"""Who flies to which target: as the mission says, or as costs least in total."""

import numpy as np
import numpy.typing as npt
from scipy.optimize import linear_sum_assignment

from gcs.planner.fleet_cost import Problem, no_others, swarm_cost
from gcs.planner.problem import Route, guides, pose
from gcs.planner.representation import bows
from missions.errors import InfeasibleMission
from missions.mission import Mission, Target

Array = npt.NDArray[np.float64]


def allocate(mission: Mission) -> list[Route]:
    """One route per vehicle, in the order of the mission's vehicles.

    Without an allocation in the mission, every vehicle gets one target so that the costs (eq. 13) of the best first
    particles add up to the least; what vehicles owe to one another is left to the search.

    Raises:
        InfeasibleMission: the mission allocates nothing, and has not as many targets as vehicles.
    """
    if mission.allocation is not None:
        by_name = {target.name: target for target in mission.targets}
        return _routes(mission, [by_name[mission.allocation[vehicle.name]] for vehicle in mission.vehicles])
    if len(mission.targets) != len(mission.vehicles):
        raise InfeasibleMission(
            f"mission {mission.name}: expected as many targets as vehicles, or an allocation that names one target per "
            f"vehicle, found {len(mission.vehicles)} vehicles and {len(mission.targets)} targets"
        )
    if mission.launch_point_m is not None:  # all start in one point: every allocation costs the same
        return _routes(mission, list(mission.targets))
    _, chosen = linear_sum_assignment(path_costs(mission))
    return _routes(mission, [mission.targets[index] for index in chosen])


def path_costs(mission: Mission) -> Array:
    """(vehicles, targets) costs of the best first particle of each vehicle to each target, flown alone."""
    costs = np.empty((len(mission.vehicles), len(mission.targets)))
    for row, vehicle in enumerate(mission.vehicles):
        routes = [Route(vehicle.name, vehicle.sysid, mission.start_m(vehicle), target) for target in mission.targets]
        problem = pose(mission, routes, guides(mission, routes))
        costs[row] = [_best_alone(problem, index) for index in range(len(routes))]
    return costs


def _best_alone(problem: Problem, index: int) -> float:
    first = bows(problem.base_m.shape[1])
    objective, violation = np.empty(len(first)), np.empty(len(first))
    swarm_cost(problem, index, first, no_others(), objective, violation)
    return float(np.min(objective + problem.terms.penalty_weight * violation))


def _routes(mission: Mission, targets: list[Target]) -> list[Route]:
    return [
        Route(vehicle.name, vehicle.sysid, mission.start_m(vehicle), target)
        for vehicle, target in zip(mission.vehicles, targets, strict=True)
    ]
