"""What is left of a mission in flight, as a mission of its own: from where vehicles are, in the world as seen."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import msgspec
import numpy as np
import numpy.typing as npt

from missions import obstacles
from missions.mission import Mission, Target
from missions.world import Box

Array = npt.NDArray[np.float64]

ZONE_PER_LACK = 2.0
"""Who lacks so much of what is required at its start gets a launch zone so many times as large ..."""
LEAST_ZONE_M = 0.2
"""... and at least so large."""
PLACE_MARGIN_M = 1e-3


@dataclass(frozen=True)
class Aloft:
    """One vehicle in flight.

    Args:
        sysid: its MAVLink system id.
        position_m: (3,) from where its new plan begins, ENU [m].
        targets: that it still has to reach, in flying order; one at least.
        curve_m: (m, 3) what is left of the curve that it flies, ENU [m].
        remaining_s: how long the rest of its plan takes [s].
    """

    sysid: int
    position_m: Array
    targets: tuple[Target, ...]
    curve_m: Array
    remaining_s: float


def remaining_mission(mission: Mission, aloft: Sequence[Aloft], observed: Sequence[Box]) -> Mission:
    """The mission that is left for the vehicles in flight.

    Each begins where it is; the observed boxes join the world as it is known. Where a vehicle has less clearance or
    separation than is required from the outset, launch zones are as wide as it takes to get away: in them only contact
    is forbidden.

    Args:
        mission: the whole one.
        aloft: the vehicles that are still flying, one at least.
        observed: what was seen and no map explains.
    """
    known = mission.world.as_known()
    world = msgspec.structs.replace(known, boxes=known.boxes + tuple(observed))
    starts_m = _within(np.array([vehicle.position_m for vehicle in aloft]), mission)
    hover = np.array([0.0, 0.0, mission.takeoff_height_m])
    names = {vehicle.sysid: mission.vehicle(vehicle.sysid).name for vehicle in aloft}
    vehicles = tuple(
        msgspec.structs.replace(mission.vehicle(vehicle.sysid), pad_m=tuple((start_m - hover).tolist()))
        for vehicle, start_m in zip(aloft, starts_m, strict=True)
    )
    return msgspec.structs.replace(
        mission,
        world=world,
        vehicles=vehicles,
        targets=tuple(target for vehicle in aloft for target in vehicle.targets),
        allocation={names[vehicle.sysid]: tuple(target.name for target in vehicle.targets) for vehicle in aloft},
        launch_point_m=None,
        launch_zone_radius_m=_zone_radius_m(mission, obstacles.pack(world), starts_m),
    )


def _within(starts_m: Array, mission: Mission) -> Array:
    """Places moved into the flight range: who has strayed out of it by a little is planned for from its edge."""
    bounds = mission.world.bounds
    return np.clip(starts_m, bounds.low_enu_m + PLACE_MARGIN_M, bounds.high_enu_m - PLACE_MARGIN_M)


def _zone_radius_m(mission: Mission, solid: obstacles.Obstacles, starts_m: Array) -> float:
    limits = mission.limits
    heights_m = starts_m[:, 2] - obstacles.terrain_height(starts_m, solid)
    lacks_m = [limits.clearance_m - float(obstacles.clearance(starts_m, solid).min())]
    lacks_m.append(limits.height_m - float(heights_m.min()))
    lacks_m += [limits.separation_m - float(np.linalg.norm(a - b)) for a, b in combinations(starts_m, 2)]
    lack_m = max(lacks_m)
    return (
        mission.launch_zone_radius_m
        if lack_m <= 0.0
        else max(mission.launch_zone_radius_m, ZONE_PER_LACK * lack_m, LEAST_ZONE_M)
    )
