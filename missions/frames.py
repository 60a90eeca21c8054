"""WGS84 <-> local ENU <-> each autopilot's own NED: the only place where axes swap.

Missions, planners, logs and the web page use one frame alone: local ENU in metres around the mission's
origin (`LocalFrame`). Every PX4 has a NED frame of its own, with its origin where its estimator started,
and projects latitude and longitude onto it from a sphere (`AutopilotFrame`). docs/conventions.md has a drawing.
"""

from dataclasses import dataclass
from typing import Annotated

import msgspec
import numpy as np
import numpy.typing as npt
import pymap3d

from missions.errors import MissionError

Array = npt.NDArray[np.float64]

PX4_EARTH_RADIUS_M = 6_371_000.0
"""PX4's map projection takes the earth for a sphere of this radius."""

Latitude = Annotated[float, msgspec.Meta(ge=-85.0, le=85.0)]
Longitude = Annotated[float, msgspec.Meta(ge=-180.0, le=180.0)]
Altitude = Annotated[float, msgspec.Meta(ge=-500.0, le=9000.0)]


class GeodeticPoint(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A place on earth (WGS84), its altitude above mean sea level as autopilots report it."""

    latitude_deg: Latitude
    longitude_deg: Longitude
    altitude_amsl_m: Altitude = 0.0


def parse_origin(text: str) -> GeodeticPoint:
    """Read a place as it is written on the command line: LAT,LON,ALT in degrees and metres above mean sea level.

    Raises:
        MissionError: naming what was expected and what was found.

    Example:
        >>> parse_origin("47.4,8.5,490").altitude_amsl_m
        490.0
    """
    names, parts = ("latitude_deg", "longitude_deg", "altitude_amsl_m"), text.split(",")
    try:
        if len(parts) != len(names):
            raise ValueError(f"{len(parts)} value{'s' * (len(parts) > 1)} found")
        return msgspec.convert({name: float(part) for name, part in zip(names, parts, strict=True)}, GeodeticPoint)
    except (ValueError, msgspec.ValidationError) as wrong:
        raise MissionError(f"--origin {text}: expected LAT,LON,ALT such as 47.3977,8.5456,489.4 ({wrong})") from None


@dataclass(frozen=True)
class LocalFrame:
    """The mission's frame: ENU [m], tangent to the ellipsoid at `origin`.

    Example:
        >>> frame = LocalFrame(GeodeticPoint(latitude_deg=47.4, longitude_deg=8.5, altitude_amsl_m=490.0))
        >>> place = frame.geodetic(np.array([100.0, 0.0, 20.0]))
        >>> bool(place.longitude_deg > 8.5), round(place.altitude_amsl_m, 1)
        (True, 510.0)
    """

    origin: GeodeticPoint

    def geodetic_arrays(self, points_enu_m: Array) -> tuple[Array, Array, Array]:
        """Latitude [deg], longitude [deg] and altitude AMSL [m], each (...), of (..., 3) ENU points [m]."""
        east, north, up = np.moveaxis(np.asarray(points_enu_m, dtype=float), -1, 0)
        o = self.origin
        return pymap3d.enu2geodetic(east, north, up, o.latitude_deg, o.longitude_deg, o.altitude_amsl_m)

    def geodetic(self, point_enu_m: Array) -> GeodeticPoint:
        """The place on earth of one (3,) ENU point [m]."""
        latitude, longitude, altitude = self.geodetic_arrays(point_enu_m)
        return GeodeticPoint(
            latitude_deg=float(latitude), longitude_deg=float(longitude), altitude_amsl_m=float(altitude)
        )

    def enu(self, latitude_deg: npt.ArrayLike, longitude_deg: npt.ArrayLike, altitude_amsl_m: npt.ArrayLike) -> Array:
        """(..., 3) ENU points [m] of places on earth given by (...) arrays or numbers."""
        o = self.origin
        east, north, up = pymap3d.geodetic2enu(
            np.asarray(latitude_deg, dtype=float),
            np.asarray(longitude_deg, dtype=float),
            np.asarray(altitude_amsl_m, dtype=float),
            o.latitude_deg,
            o.longitude_deg,
            o.altitude_amsl_m,
        )
        return np.stack(np.broadcast_arrays(east, north, up), axis=-1)


@dataclass(frozen=True)
class AutopilotFrame:
    """One autopilot's NED frame [m]: its GPS_GLOBAL_ORIGIN, projected as PX4 does (a sphere; down is altitude).

    `ground_offset_m` is what this autopilot's altitude reads too high when it stands on the ground, a boot-to-boot
    error of barometer and GNSS; it is measured before arming and taken out here.
    """

    origin: GeodeticPoint
    mission: LocalFrame
    ground_offset_m: float = 0.0

    def ned(self, points_enu_m: Array) -> Array:
        """(..., 3) mission ENU points [m] in this autopilot's NED frame."""
        latitude, longitude, altitude = self.mission.geodetic_arrays(points_enu_m)
        north, east = _project(latitude, longitude, self.origin)
        return np.stack((north, east, self.origin.altitude_amsl_m - altitude - self.ground_offset_m), axis=-1)

    def enu(self, points_ned_m: Array) -> Array:
        """(..., 3) points of this autopilot's NED frame in mission ENU [m]."""
        north, east, down = np.moveaxis(np.asarray(points_ned_m, dtype=float), -1, 0)
        latitude, longitude = _unproject(north, east, self.origin)
        return self.mission.enu(latitude, longitude, self.origin.altitude_amsl_m - down - self.ground_offset_m)


def _project(latitude_deg: Array, longitude_deg: Array, origin: GeodeticPoint) -> tuple[Array, Array]:
    """North and east [m], (...) each, of places on PX4's sphere: azimuthal equidistant around `origin`."""
    latitude, latitude_0 = np.radians(latitude_deg), np.radians(origin.latitude_deg)
    turn = np.radians(longitude_deg - origin.longitude_deg)
    north = np.cos(latitude_0) * np.sin(latitude) - np.sin(latitude_0) * np.cos(latitude) * np.cos(turn)
    east = np.cos(latitude) * np.sin(turn)
    scale_m = PX4_EARTH_RADIUS_M / _sinc(np.arcsin(np.hypot(north, east)))
    return north * scale_m, east * scale_m


def _unproject(north_m: Array, east_m: Array, origin: GeodeticPoint) -> tuple[Array, Array]:
    """Latitude and longitude [deg], (...) each: the inverse of `_project`."""
    north, east = north_m / PX4_EARTH_RADIUS_M, east_m / PX4_EARTH_RADIUS_M
    away = np.hypot(north, east)
    latitude_0, shrink = np.radians(origin.latitude_deg), _sinc(away)
    latitude = np.arcsin(np.cos(away) * np.sin(latitude_0) + north * shrink * np.cos(latitude_0))
    turn = np.arctan2(east * shrink, np.cos(latitude_0) * np.cos(away) - north * shrink * np.sin(latitude_0))
    return np.degrees(latitude), origin.longitude_deg + np.degrees(turn)


def _sinc(angle_rad: Array) -> Array:
    """sin(x) / x, and 1 at 0."""
    return np.sinc(angle_rad / np.pi)


def swap_enu_ned(vectors_m: Array) -> Array:
    """(..., 3) vectors from ENU to NED or back: the same swap both ways, for parallel axes."""
    v = np.asarray(vectors_m, dtype=float)
    swapped = np.empty(v.shape)  # several times as fast as a stack, and every tick does it
    swapped[..., 0], swapped[..., 1] = v[..., 1], v[..., 0]
    np.negative(v[..., 2], out=swapped[..., 2])
    return swapped


def quaternion_enu_from_flu(quaternion_ned_frd: Array) -> Array:
    """(..., 4) unit quaternions (w, x, y, z; FLU -> ENU) of MAVLink attitudes (w, x, y, z; FRD -> NED)."""
    w, x, y, z = np.moveaxis(np.asarray(quaternion_ned_frd, dtype=float), -1, 0)
    # q_enu_ned * q * q_frd_flu, with q_enu_ned = (0, 1, 1, 0) / sqrt(2) and q_frd_flu = (0, 1, 0, 0)
    turned = np.stack((w + z, x + y, x - y, w - z), axis=-1)
    return turned / np.linalg.norm(turned, axis=-1, keepdims=True)
