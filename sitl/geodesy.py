"""Places on earth for compiled code: the mission's ENU frame, and PX4's map projection of each autopilot.

The same arithmetic as `missions.frames` (pymap3d), for a fleet at 50 Hz; tests hold them equal.
"""

import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from missions.frames import GeodeticPoint
from missions.kernels import compiled

Array = npt.NDArray[np.float64]

EARTH_RADIUS_M = 6_371_000.0
"""PX4 projects onto a sphere of this radius."""
WGS84_A_M = 6_378_137.0
WGS84_E2 = 6.69437999014e-3


class MissionOrigin(NamedTuple):
    """The mission's tangent plane in earth-centred coordinates."""

    ecef_m: Array
    """(3,) the origin."""
    ecef_from_ned: Array
    """(3, 3) rotation."""


def mission_origin(origin: GeodeticPoint) -> MissionOrigin:
    """The tangent plane at `origin`."""
    latitude, longitude = math.radians(origin.latitude_deg), math.radians(origin.longitude_deg)
    sin_lat, cos_lat = math.sin(latitude), math.cos(latitude)
    sin_lon, cos_lon = math.sin(longitude), math.cos(longitude)
    normal_m = WGS84_A_M / math.sqrt(1.0 - WGS84_E2 * sin_lat * sin_lat)
    across_m = (normal_m + origin.altitude_amsl_m) * cos_lat
    up_m = (normal_m * (1.0 - WGS84_E2) + origin.altitude_amsl_m) * sin_lat
    rotation = [
        [-sin_lat * cos_lon, -sin_lon, -cos_lat * cos_lon],
        [-sin_lat * sin_lon, cos_lon, -cos_lat * sin_lon],
        [cos_lat, 0.0, -sin_lat],
    ]
    return MissionOrigin(np.array([across_m * cos_lon, across_m * sin_lon, up_m]), np.array(rotation))


@compiled
def geodetic(ned_m: Any, origin: MissionOrigin) -> tuple[float, float, float]:
    """Latitude, longitude [rad] and altitude AMSL [m] of a (3,) point of the mission's frame, axes swapped to NED."""
    r, e = origin.ecef_from_ned, origin.ecef_m
    x = e[0] + r[0, 0] * ned_m[0] + r[0, 1] * ned_m[1] + r[0, 2] * ned_m[2]
    y = e[1] + r[1, 0] * ned_m[0] + r[1, 1] * ned_m[1] + r[1, 2] * ned_m[2]
    z = e[2] + r[2, 0] * ned_m[0] + r[2, 1] * ned_m[1] + r[2, 2] * ned_m[2]
    across = math.hypot(x, y)
    latitude = math.atan2(z, across * (1.0 - WGS84_E2))
    for _ in range(4):  # converges by a factor of 300 a step near the surface
        sin_lat = math.sin(latitude)
        normal = WGS84_A_M / math.sqrt(1.0 - WGS84_E2 * sin_lat * sin_lat)
        latitude = math.atan2(z + WGS84_E2 * normal * sin_lat, across)
    sin_lat, cos_lat = math.sin(latitude), math.cos(latitude)
    altitude = across * cos_lat + z * sin_lat - WGS84_A_M * math.sqrt(1.0 - WGS84_E2 * sin_lat * sin_lat)
    return latitude, math.atan2(y, x), altitude


@compiled
def project(latitude: float, longitude: float, latitude0: float, longitude0: float) -> tuple[float, float]:
    """North and east [m] of a place [rad] in PX4's azimuthal equidistant projection around another."""
    sin_lat, cos_lat = math.sin(latitude), math.cos(latitude)
    sin_lat0, cos_lat0 = math.sin(latitude0), math.cos(latitude0)
    cos_dlon = math.cos(longitude - longitude0)
    north = cos_lat0 * sin_lat - sin_lat0 * cos_lat * cos_dlon
    east = cos_lat * math.sin(longitude - longitude0)
    chord = math.hypot(north, east)
    angle = math.atan2(chord, sin_lat0 * sin_lat + cos_lat0 * cos_lat * cos_dlon)
    scale = angle / chord if chord > 1e-12 else 1.0
    return north * scale * EARTH_RADIUS_M, east * scale * EARTH_RADIUS_M


@compiled
def reproject(north_m: float, east_m: float, latitude0: float, longitude0: float) -> tuple[float, float]:
    """Latitude and longitude [rad]: the inverse of `project`."""
    x, y = north_m / EARTH_RADIUS_M, east_m / EARTH_RADIUS_M
    angle = math.hypot(x, y)
    if angle < 1e-12:
        return latitude0, longitude0
    sin_c, cos_c = math.sin(angle), math.cos(angle)
    sin_lat0, cos_lat0 = math.sin(latitude0), math.cos(latitude0)
    latitude = math.asin(min(max(cos_c * sin_lat0 + x * sin_c * cos_lat0 / angle, -1.0), 1.0))
    longitude = longitude0 + math.atan2(y * sin_c, angle * cos_lat0 * cos_c - x * sin_lat0 * sin_c)
    return latitude, longitude
