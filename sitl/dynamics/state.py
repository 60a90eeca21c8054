"""The state of a fleet as one array of records, which compiled code reads and writes in place.

Vectors are NED with FRD bodies here, as in PX4. `position_m` and `velocity_m_s` are the truth in the mission's frame
with its axes swapped; everything else that is a place is in the autopilot's own frame, as its estimator sees it
(`position_m + offset_m`).
"""

from enum import IntEnum
from typing import Any

import numpy as np


def record(fields: list[tuple[str, str] | tuple[str, str, int]]) -> np.dtype[Any]:
    """A record type whose fields are attributes, in compiled code and, with NUMBA_DISABLE_JIT=1, in plain Python."""
    return np.dtype((np.record, np.dtype(fields, align=True)))


class Guidance(IntEnum):
    """Who makes a vehicle's setpoints."""

    MOTORS_OFF = 0
    """Disarmed."""
    IDLE = 1
    """Armed, on the ground, nothing to fly to."""
    WAYPOINT = 2
    """A jerk-limited trajectory to `target_m`."""
    LAND = 3
    """As WAYPOINT across, down at a speed that depends on the height above the ground."""
    SETPOINT = 4
    """Position, velocity and acceleration setpoints from outside."""
    ATTITUDE = 5
    """An attitude and a thrust from outside."""
    RATES = 6
    """Body rates and a thrust from outside."""


class TakeoffStage(IntEnum):
    """How far a take-off has got; PX4's names."""

    DISARMED = 0
    SPOOLUP = 1
    READY = 2
    RAMPUP = 3
    FLIGHT = 4


class Crash(IntEnum):
    """What a vehicle collided with."""

    NONE = 0
    OBSTACLE = 1
    MOVER = 2
    VEHICLE = 3
    TERRAIN = 4
    """Flown into the ground."""
    GROUND = 5
    """Fallen onto it: that hurts, and is recorded, but what is still whole flies again."""


VEHICLE = record(
    [
        # ------------------------------------------------------------- truth
        ("position_m", "f8", 3),
        ("velocity_m_s", "f8", 3),
        ("attitude", "f8", 4),  # quaternion w, x, y, z: FRD -> NED
        ("rates_rad_s", "f8", 3),
        ("specific_force_m_s2", "f8", 3),  # body frame: what an accelerometer measures
        ("rotor", "f8", 4),  # rotor speeds as the signal that they have settled to, [0, 1]
        ("rotor_health", "f8", 4),  # share of its signal that each rotor follows: 1 whole, 0 failed
        ("gust_m_s", "f8", 3),
        ("grounded", "i8"),
        ("crash", "i8"),
        ("crash_other", "i8"),  # index of the obstacle, mover or vehicle
        # ---------------------------------------------------------- estimate
        ("origin_latitude_rad", "f8"),  # of the autopilot's own NED frame
        ("origin_longitude_rad", "f8"),
        ("origin_altitude_m", "f8"),
        ("ground_offset_m", "f8"),
        ("position_std_m", "f8", 3),  # how far the errors wander
        ("velocity_std_m_s", "f8"),
        ("dead_reckoning", "i8"),  # nothing tells where the vehicle is: the errors grow
        ("position_error_m", "f8", 3),
        ("velocity_error_m_s", "f8", 3),
        ("tilt_error_rad", "f8", 3),
        ("offset_m", "f8", 3),  # estimate minus truth, the shift of the frames included
        ("estimated_attitude", "f8", 4),
        # ---------------------------------------------------------- guidance
        ("guidance", "i8"),
        ("previous_m", "f8", 3),
        ("target_m", "f8", 3),
        ("next_m", "f8", 3),
        ("target_yaw_rad", "f8"),  # NaN: along the trajectory
        ("cruise_m_s", "f8"),
        ("acceptance_m", "f8"),
        ("taking_off", "i8"),  # the target is a take-off's
        ("ground_z_m", "f8"),  # home's height, from which the landing speeds are counted
        ("smooth_position_m", "f8", 3),
        ("smooth_velocity_m_s", "f8", 3),
        ("smooth_acceleration_m_s2", "f8", 3),
        ("turn_speed_m_s", "f8"),
        ("yaw_before_rad", "f8"),
        ("yawspeed_filtered_rad_s", "f8"),
        # --------------------------------- setpoints; NaN: not controlled
        ("setpoint_position_m", "f8", 3),
        ("setpoint_velocity_m_s", "f8", 3),
        ("setpoint_acceleration_m_s2", "f8", 3),
        ("setpoint_yaw_rad", "f8"),
        ("setpoint_yawspeed_rad_s", "f8"),
        ("setpoint_attitude", "f8", 4),
        ("setpoint_rates_rad_s", "f8", 3),
        ("setpoint_thrust", "f8"),
        # ----------------------------------------------------------- control
        ("takeoff_stage", "i8"),
        ("stage_s", "f8"),
        ("tilt_limit_rad", "f8"),
        ("velocity_integral_m_s2", "f8", 3),
        ("velocity_before_m_s", "f8", 3),
        ("acceleration_filtered_m_s2", "f8", 3),
        ("rate_integral", "f8", 3),
        ("rates_before_rad_s", "f8", 3),
        ("angular_acceleration_rad_s2", "f8", 3),
        ("yaw_torque", "f8"),
        ("saturated", "i8", 3),  # sign of the torque that the rotors could not give
        ("commanded_velocity_m_s", "f8", 3),
        ("commanded_acceleration_m_s2", "f8", 3),
        ("commanded_yaw_rad", "f8"),
        ("motor", "f8", 4),  # signals to the rotors, [0, 1]
        # ---------------------------------------------------- land detection
        ("contact_s", "f8"),  # how long each condition has held
        ("maybe_landed_s", "f8"),
        ("landed_s", "f8"),
        ("ground_contact", "i8"),
        ("maybe_landed", "i8"),
        ("landed", "i8"),
    ]
)
"""One vehicle."""


def new_fleet(n_vehicles: int) -> np.ndarray:
    """(n,) records of dtype `VEHICLE`: level, at rest, disarmed and landed at their origins."""
    fleet = np.zeros(n_vehicles, dtype=VEHICLE)
    for quaternion in ("attitude", "estimated_attitude", "setpoint_attitude"):
        fleet[quaternion][:, 0] = 1.0
    fleet["rotor_health"] = 1.0
    fleet["grounded"] = fleet["ground_contact"] = fleet["maybe_landed"] = fleet["landed"] = 1
    return fleet
