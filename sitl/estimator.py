"""What the autopilots believe: truth plus errors that wander, each in its own NED frame.

Position, velocity and tilt errors are first-order Gauss-Markov processes. Without a source of its position a vehicle
reckons on from its last one: the tilt error is taken for an acceleration, and velocity and position run away. An
estimator starts where its vehicle stands, as its own error lets it see that place: there is its GPS_GLOBAL_ORIGIN, and
its local position begins at zero.
"""

import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from missions.frames import LocalFrame, swap_enu_ned
from missions.kernels import compiled
from missions.mission import Positioning
from sitl.dynamics.airframe import GRAVITY_M_S2
from sitl.dynamics.rotation import from_rotation_vector, product, unit
from sitl.geodesy import EARTH_RADIUS_M, MissionOrigin, geodetic, project

Array = npt.NDArray[np.float64]

VELOCITY_CORRELATION_S = 0.5
TILT_STD_RAD = math.radians(0.15)
TILT_CORRELATION_S = 10.0
GUST_CORRELATION_S = 2.0
NORMALS_PER_TICK = 12
"""Random numbers that `wander` takes per vehicle and call."""


class Wandering(NamedTuple):
    """How the errors of a fleet wander, per call of `wander`."""

    position_keep: float
    """Share of the position error that stays."""
    velocity_keep: float
    tilt_keep: float
    gust_keep: float
    tilt_std_rad: float
    gust_std_m_s: float
    interval_s: float


def wandering(positioning: Positioning, gust_std_m_s: float, interval_s: float) -> Wandering:
    """The errors that a mission's settings describe, for calls every `interval_s`."""
    return Wandering(
        position_keep=math.exp(-interval_s / positioning.correlation_s),
        velocity_keep=math.exp(-interval_s / VELOCITY_CORRELATION_S),
        tilt_keep=math.exp(-interval_s / TILT_CORRELATION_S),
        gust_keep=math.exp(-interval_s / GUST_CORRELATION_S),
        tilt_std_rad=TILT_STD_RAD,
        gust_std_m_s=gust_std_m_s,
        interval_s=interval_s,
    )


def set_noise(fleet: np.ndarray, horizontal_m: float, vertical_m: float, velocity_m_s: float) -> None:
    """Set the standard deviations of the errors of all vehicles in `fleet`, (n,) records of `VEHICLE`."""
    fleet["position_std_m"] = (horizontal_m, horizontal_m, vertical_m)
    fleet["velocity_std_m_s"] = velocity_m_s


def start_estimators(fleet: np.ndarray, frame: LocalFrame, positioning: Positioning, rng: np.random.Generator) -> None:
    """Draw each vehicle's first error and altitude offset, and set its origin where it sees itself standing.

    Args:
        fleet: (n,) records of `VEHICLE`, changed in place.
        frame: the mission's.
        positioning: how well vehicles know where they are.
        rng: draws the errors.
    """
    n = len(fleet)
    fleet["position_error_m"] = rng.standard_normal((n, 3)) * fleet["position_std_m"]
    fleet["velocity_error_m_s"] = rng.standard_normal((n, 3)) * fleet["velocity_std_m_s"][:, None]
    fleet["tilt_error_rad"] = rng.standard_normal((n, 3)) * TILT_STD_RAD
    fleet["ground_offset_m"] = rng.standard_normal(n) * positioning.ground_offset_std_m
    latitude_deg, longitude_deg, altitude_m = frame.geodetic_arrays(swap_enu_ned(fleet["position_m"]))
    error = fleet["position_error_m"]
    latitude_rad = np.radians(latitude_deg)
    fleet["origin_latitude_rad"] = latitude_rad + error[:, 0] / EARTH_RADIUS_M
    east_rad = error[:, 1] / (EARTH_RADIUS_M * np.cos(latitude_rad))
    fleet["origin_longitude_rad"] = np.radians(longitude_deg) + east_rad
    fleet["origin_altitude_m"] = altitude_m + fleet["ground_offset_m"] - error[:, 2]


@compiled
def wander(v: Any, normals: Any, w: Wandering) -> None:
    """Let one vehicle's errors, and the gust that hits it, take a step; `normals` is (12,) standard normal."""
    for k in range(3):
        if k < 2 and v.dead_reckoning != 0:
            drift_m_s2 = GRAVITY_M_S2 * (-v.tilt_error_rad[1] if k == 0 else v.tilt_error_rad[0])
            v.velocity_error_m_s[k] += drift_m_s2 * w.interval_s
            v.position_error_m[k] += v.velocity_error_m_s[k] * w.interval_s
        else:
            spread = math.sqrt(1.0 - w.position_keep**2) * v.position_std_m[k]
            v.position_error_m[k] = w.position_keep * v.position_error_m[k] + spread * normals[k]
            spread = math.sqrt(1.0 - w.velocity_keep**2) * v.velocity_std_m_s
            v.velocity_error_m_s[k] = w.velocity_keep * v.velocity_error_m_s[k] + spread * normals[3 + k]
        spread = math.sqrt(1.0 - w.tilt_keep**2) * w.tilt_std_rad
        v.tilt_error_rad[k] = w.tilt_keep * v.tilt_error_rad[k] + spread * normals[6 + k]
        spread = math.sqrt(1.0 - w.gust_keep**2) * w.gust_std_m_s
        v.gust_m_s[k] = w.gust_keep * v.gust_m_s[k] + spread * normals[9 + k]


@compiled
def locate(v: Any, origin: MissionOrigin) -> None:
    """Set `offset_m`: what takes one vehicle's true position to the estimated one in its own frame."""
    latitude, longitude, altitude = geodetic(v.position_m, origin)
    north, east = project(latitude, longitude, v.origin_latitude_rad, v.origin_longitude_rad)
    down = v.origin_altitude_m - altitude - v.ground_offset_m
    v.offset_m[0] = north + v.position_error_m[0] - v.position_m[0]
    v.offset_m[1] = east + v.position_error_m[1] - v.position_m[1]
    v.offset_m[2] = down + v.position_error_m[2] - v.position_m[2]


@compiled
def estimate_attitude(v: Any) -> None:
    """Set `estimated_attitude`: the truth, turned by the tilt error."""
    error = from_rotation_vector(v.tilt_error_rad[0], v.tilt_error_rad[1], v.tilt_error_rad[2])
    q = unit(product(error, (v.attitude[0], v.attitude[1], v.attitude[2], v.attitude[3])))
    v.estimated_attitude[0], v.estimated_attitude[1] = q[0], q[1]
    v.estimated_attitude[2], v.estimated_attitude[3] = q[2], q[3]
