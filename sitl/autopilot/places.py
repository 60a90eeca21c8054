"""Places on earth and in one autopilot's own NED frame."""

import math
from dataclasses import dataclass
from typing import NamedTuple

from sitl.geodesy import project, reproject

HIGHEST_M = 1e5
"""No home lies higher or deeper than this [m]: it has to fit into messages."""


class LocalPoint(NamedTuple):
    """A point in the autopilot's NED frame [m]."""

    x_m: float
    y_m: float
    z_m: float


class GlobalPoint(NamedTuple):
    """A point on earth; altitude AMSL as the autopilot sees it."""

    latitude_deg: float
    longitude_deg: float
    altitude_m: float


@dataclass(frozen=True)
class OwnFrame:
    """One autopilot's NED frame, around its GPS_GLOBAL_ORIGIN."""

    origin: GlobalPoint

    def local(self, latitude_deg: float, longitude_deg: float, altitude_m: float) -> LocalPoint:
        """A place on earth in this frame."""
        o = self.origin
        north, east = project(
            math.radians(latitude_deg),
            math.radians(longitude_deg),
            math.radians(o.latitude_deg),
            math.radians(o.longitude_deg),
        )
        return LocalPoint(north, east, o.altitude_m - altitude_m)

    def on_earth(self, point: LocalPoint) -> GlobalPoint:
        """A point of this frame on earth."""
        o = self.origin
        latitude, longitude = reproject(
            point.x_m, point.y_m, math.radians(o.latitude_deg), math.radians(o.longitude_deg)
        )
        return GlobalPoint(math.degrees(latitude), math.degrees(longitude), o.altitude_m - point.z_m)


def is_place(latitude_deg: float, longitude_deg: float) -> bool:
    """Whether two numbers are a latitude and a longitude; false for NaN."""
    return abs(latitude_deg) <= 90.0 and abs(longitude_deg) <= 180.0
