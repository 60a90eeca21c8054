"""What a mission's limits mean for plans where the mission leaves it open (docs/decisions/0011-limits-of-plans.md)."""

import numpy as np
import numpy.typing as npt

from gcs.planner.curves import lengths
from missions.mission import Mission, Site
from missions.obstacles import FAR_M
from missions.world import World

Array = npt.NDArray[np.float64]

SHORTEST_M = 0.1
"""Any endurance lets vehicles fly so far, as far as the search is concerned; the judge counts seconds."""
WALL_SHARE = 0.5
"""Indoors plans stay away from walls and ceiling by this share of the limit of clearance."""


def flight_box(mission: Mission) -> tuple[Array, Array]:
    """(3,) lowest and highest corner, ENU [m], of what plans may use of the flight range.

    Outdoors all of it. Indoors its sides are walls and its top a ceiling: plans keep away from them, except where
    a start or a target lies nearer. The floor is left to the limit of height.
    """
    low, high = mission.world.bounds.low_enu_m, mission.world.bounds.high_enu_m
    if mission.site is not Site.INDOOR:
        return low, high
    wall_m = WALL_SHARE * mission.limits.clearance_m
    starts = [mission.start_m(vehicle) for vehicle in mission.vehicles]
    ends = np.array(starts + [np.array(target.position_m) for target in mission.targets])
    return (
        np.minimum(low + np.array([wall_m, wall_m, 0.0]), ends.min(axis=0)),
        np.maximum(high - wall_m, ends.max(axis=0)),
    )


def join_distance_m(mission: Mission) -> float:
    """How far from a common launch point the vehicles, which stand on pads around it, have joined their curves."""
    if mission.launch_point_m is None:
        return 0.0
    pads_m = np.array([vehicle.pad_m for vehicle in mission.vehicles])
    return float(lengths(pads_m - np.array(mission.launch_point_m)).max()) + mission.takeoff_height_m


def clearance_cap_m(mission: Mission, world: World) -> float:
    """Clearance beyond which no more is earned; nothing is to be earned in an empty world."""
    if mission.planner.clearance_cap_m is not None:
        return mission.planner.clearance_cap_m
    return FAR_M if world.boxes or world.cylinders or world.threats or world.peaks else 0.0


def height_cap_m(mission: Mission) -> float:
    """Height above which no more is earned."""
    return FAR_M if mission.planner.height_cap_m is None else mission.planner.height_cap_m


def path_limit_m(mission: Mission) -> float:
    """Longest path that range and endurance allow at cruise speed, speeding up and slowing down included."""
    limits = mission.limits
    cruise_m_s = limits.cruise_speed_m_s
    flown_m = (limits.endurance_s - cruise_m_s / limits.acceleration_m_s2) * cruise_m_s
    return min(limits.range_m, max(flown_m, SHORTEST_M))
