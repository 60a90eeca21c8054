"""Compile, or load, everything that a flight will call, before anything arms."""

import numpy as np

from companion.fleet.neighbour import Neighbour
from companion.mapping.local_map import LocalMap
from companion.mapping.sorting import Known
from companion.planner.detours import blocked_samples, first_blocked_piece
from companion.planner.grid_search import straighten, way_around
from companion.planner.limits import ends_of
from companion.planner.planner import Planner, PlanRequest
from companion.sensing.scan import Scan
from missions.mission import Mission, Vehicle
from missions.mission_items import Track
from missions.trajectory import Motion, at_rest
from missions.tunnel import TrajectoryKind


def warm_up(planner: Planner, mission: Mission, vehicle: Vehicle) -> None:
    """Look once, plan once from the vehicle's start to the first target, replan, brake, and look for a way around."""
    start_m, target_m = mission.start_m(vehicle), np.array(mission.targets[0].position_m)
    _look(planner, mission, start_m)
    guide = planner.lay_guide(Track(np.array([target_m]), np.array([np.nan])), 0, start_m)
    planner.may_rest(start_m[None])
    way, limits, around = guide.way, planner.limits, planner.around
    way_around(start_m, target_m, 0.0, planner.horizon_m, limits, around)
    straighten(
        np.array([start_m, target_m]), planner.horizon_m, limits, around, ends_of(start_m, target_m, around, limits)
    )
    first_blocked_piece(way, around, limits)
    blocked_samples(way.points_m, around, limits)
    resting = Motion(start_m, np.zeros(3), np.zeros(3))
    far_off = Neighbour(0, at_rest(start_m + 1e3, 0.0), 0.0, TrajectoryKind.COMMITTED, 0.0)
    plan = planner.plan(PlanRequest(0, resting, 0.0, guide, 0.0, neighbours=(far_off,)))
    if plan.trajectory is not None:
        trajectory = plan.trajectory
        later_s = 0.1 * trajectory.duration_s
        planner.plan(PlanRequest(1, trajectory.at(later_s), later_s, plan.guide, plan.arc_m, trajectory))
        planner.is_clear(planner.brake(trajectory, later_s), later_s)


def _look(planner: Planner, mission: Mission, start_m: np.ndarray) -> None:
    """Take a scan of one point into a map that is thrown away."""
    voxel_m = mission.onboard.voxel_m
    known = Known(planner.around.obstacles, planner.around.room_m, voxel_m, voxel_m)
    throwaway = LocalMap(known, voxel_m, 3.0 * voxel_m, mission.limits.body_radius_m)
    ahead_m = start_m + np.array([3.0, 0.0, 3.0]) * mission.limits.body_radius_m
    throwaway.observe(Scan(0.0, start_m, ahead_m[None], mission.sensor.range_m), np.zeros((0, 4)))
    throwaway.forget(ahead_m, voxel_m)
