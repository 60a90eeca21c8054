"""Compile, or load, everything that a flight will call, before anything arms."""

import numpy as np

from companion.planner.grid_search import way_around
from companion.planner.planner import Planner, PlanRequest
from companion.sensing.scan import Scan
from missions.mission import Mission, Vehicle
from missions.mission_items import Track
from missions.trajectory import Motion


def warm_up(planner: Planner, mission: Mission, vehicle: Vehicle) -> None:
    """Look around, plan once from the vehicle's start to the first target, replan, brake, and look for a way around.

    What is seen lies on the ground, so that it is in no map afterwards.
    """
    start_m, target_m = mission.start_m(vehicle), np.array(mission.targets[0].position_m)
    guide = planner.lay_guide(Track(np.array([target_m]), np.array([np.nan])), 0, start_m)
    planner.observe(Scan(0.0, start_m, start_m * np.array([1.0, 1.0, 0.0]) + np.zeros((1, 3)), 1.0))
    planner.may_rest(start_m[None])
    at_rest = Motion(start_m, np.zeros(3), np.zeros(3))
    way_around(start_m, target_m, 0.0, planner.horizon_m, planner.limits, planner.around)
    plan = planner.plan(PlanRequest(0, at_rest, 0.0, guide, 0.0))
    if plan.trajectory is not None:
        trajectory = plan.trajectory
        later_s = 0.1 * trajectory.duration_s
        planner.plan(PlanRequest(1, trajectory.at(later_s), later_s, plan.guide, plan.arc_m, trajectory))
        planner.is_clear(planner.brake(trajectory, later_s), later_s)
