"""What one autopilot knows at one moment: the estimate, the setpoints and the rotors, as plain numbers."""

import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from missions.kernels import compiled
from sitl.dynamics.rotation import euler
from sitl.dynamics.state import Crash
from sitl.geodesy import reproject

Array = npt.NDArray[np.float64]


class Snapshot(NamedTuple):
    """One vehicle's estimate in its own NED frame, with what its control is doing; `observe` fills it."""

    x_m: float
    y_m: float
    z_m: float
    vx_m_s: float
    vy_m_s: float
    vz_m_s: float
    latitude_deg: float
    longitude_deg: float
    altitude_m: float
    """AMSL, as this autopilot sees it."""
    roll_rad: float
    pitch_rad: float
    yaw_rad: float
    qw: float
    qx: float
    qy: float
    qz: float
    p_rad_s: float
    q_rad_s: float
    r_rad_s: float
    force_x_m_s2: float
    """Specific force, body frame."""
    force_y_m_s2: float
    force_z_m_s2: float
    setpoint_x_m: float
    setpoint_y_m: float
    setpoint_z_m: float
    setpoint_vx_m_s: float
    setpoint_vy_m_s: float
    setpoint_vz_m_s: float
    setpoint_ax_m_s2: float
    setpoint_ay_m_s2: float
    setpoint_az_m_s2: float
    setpoint_yaw_rad: float
    setpoint_yawspeed_rad_s: float
    setpoint_qw: float
    setpoint_qx: float
    setpoint_qy: float
    setpoint_qz: float
    setpoint_p_rad_s: float
    setpoint_q_rad_s: float
    setpoint_r_rad_s: float
    thrust: float
    motor_1: float
    motor_2: float
    motor_3: float
    motor_4: float
    takeoff_stage: float
    landed: float
    ground_contact: float
    crash: float
    grounded: float
    """The truth about standing on something."""
    height_m: float
    """Above home."""
    dead_reckoning: float
    """Nothing tells where the vehicle is."""

    @property
    def ground_speed_m_s(self) -> float:
        return math.hypot(self.vx_m_s, self.vy_m_s)


def is_broken(s: Snapshot) -> bool:
    """Whether a collision has cost the vehicle its rotors."""
    return s.crash not in (Crash.NONE, Crash.GROUND)


N_FIELDS = len(Snapshot._fields)


@compiled
def observe(v: Any, row: Any) -> None:
    """Write one vehicle's `Snapshot` into a (N_FIELDS,) array, field by field in order."""
    for k in range(3):
        row[k] = v.position_m[k] + v.offset_m[k]
        row[3 + k] = v.velocity_m_s[k] + v.velocity_error_m_s[k]
    latitude, longitude = reproject(row[0], row[1], v.origin_latitude_rad, v.origin_longitude_rad)
    row[6], row[7], row[8] = math.degrees(latitude), math.degrees(longitude), v.origin_altitude_m - row[2]
    e = v.estimated_attitude
    row[9], row[10], row[11] = euler((e[0], e[1], e[2], e[3]))
    for k in range(4):
        row[12 + k] = e[k]
    for k in range(3):
        row[16 + k] = v.rates_rad_s[k]
        row[19 + k] = v.specific_force_m_s2[k]
        row[22 + k] = v.setpoint_position_m[k]
        row[25 + k] = v.commanded_velocity_m_s[k]
        row[28 + k] = v.commanded_acceleration_m_s2[k]
    row[31], row[32] = v.commanded_yaw_rad, v.setpoint_yawspeed_rad_s
    for k in range(4):
        row[33 + k] = v.setpoint_attitude[k]
    for k in range(3):
        row[37 + k] = v.setpoint_rates_rad_s[k]
    row[40] = v.setpoint_thrust
    for k in range(4):
        row[41 + k] = v.motor[k]
    row[45], row[46], row[47] = v.takeoff_stage, v.landed, v.ground_contact
    row[48], row[49] = v.crash, v.grounded
    row[50] = v.ground_z_m - row[2]
    row[51] = v.dead_reckoning


def new_rows(n_vehicles: int) -> Array:
    """(n, N_FIELDS) zeros."""
    return np.zeros((n_vehicles, N_FIELDS))
