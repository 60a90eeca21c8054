"""The geofence of a mission: the flight range grown by a margin, and threats that no plan passes over."""

import math
from collections.abc import Iterable

import numpy as np
import numpy.typing as npt
import shapely

from gcs.dialect import mavlink
from missions.mission import Mission
from missions.mission_items import DEG_E7, MAV_FRAME_GLOBAL_INT, MissionItem
from missions.world import Threat

Array = npt.NDArray[np.float64]


def fence_items(mission: Mission, curves_m: Iterable[Array]) -> tuple[MissionItem, ...]:
    """An inclusion polygon around the flight range, and an exclusion circle for each threat that is left aside.

    A threat is a hemisphere and may be flown over, a fence circle is an endless cylinder; so a threat becomes a circle
    only where no curve enters its footprint.

    Args:
        mission: its bounds, threats and site.
        curves_m: the planned curves, each (n, 3) ENU [m].
    """
    margin_m = mission.site.fence_margin_m
    (west, east), (south, north) = mission.world.bounds.east_m, mission.world.bounds.north_m
    corners = shapely.box(west - margin_m, south - margin_m, east + margin_m, north + margin_m).exterior.coords[:-1]
    vertices = [
        _at(mission, corner, mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION, float(len(corners)))
        for corner in corners
    ]
    lines = [shapely.LineString(curve_m[:, :2]) for curve_m in curves_m]
    circles = [
        _at(mission, threat.centre_m, mavlink.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION, threat.radius_m)
        for threat in mission.world.as_known().threats
        if not any(_enters(line, threat) for line in lines)
    ]
    return tuple(vertices + circles)


def fence_height_m(mission: Mission) -> float:
    """GF_MAX_VER_DIST: how far above its home a vehicle may climb [m]."""
    lowest_pad_m = min(vehicle.pad_m[2] for vehicle in mission.vehicles)
    return math.ceil(mission.world.bounds.up_m[1] - lowest_pad_m + mission.site.fence_margin_m)


def return_height_m(mission: Mission) -> float:
    """RTL_RETURN_ALT: how far above its home a vehicle may climb for its way back, within its flight range [m]."""
    highest_pad_m = max(vehicle.pad_m[2] for vehicle in mission.vehicles)
    room_m = mission.world.bounds.up_m[1] - highest_pad_m - mission.limits.clearance_m
    return max(room_m, mission.takeoff_height_m)


def _enters(line: shapely.LineString, threat: Threat) -> bool:
    return line.distance(shapely.Point(threat.centre_m)) < threat.radius_m


def _at(mission: Mission, point_m: tuple[float, ...], command: int, param1: float) -> MissionItem:
    place = mission.frame.geodetic(np.array([point_m[0], point_m[1], 0.0]))
    return MissionItem(
        command=command,
        frame=MAV_FRAME_GLOBAL_INT,
        param1=param1,
        x=round(place.latitude_deg * DEG_E7),
        y=round(place.longitude_deg * DEG_E7),
    )
