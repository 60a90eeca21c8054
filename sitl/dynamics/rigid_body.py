"""A quadrotor as a rigid body (equations MR-1 to MR-5), in semi-implicit Euler steps.

MR-1  thrust of a rotor    T_i = T_max (c s_i^2 + (1 - c) s_i),  s_i' = (u_i - s_i) / tau
MR-2  force                F = R [0, 0, -sum T_i] - k_d (v - wind),  v' = g + F / m
MR-3  torque               M = [l (-T_1 + T_2 + T_3 - T_4), l (T_1 - T_2 + T_3 - T_4), (q/T) (T_1 + T_2 - T_3 - T_4)]
MR-4  rates                I w' = M - k_w w - w x I w
MR-5  attitude             q' = q * (0, w) / 2
"""

from typing import Any

from missions.kernels import compiled
from sitl.dynamics.airframe import GRAVITY_M_S2
from sitl.dynamics.rotation import body_z, from_rotation_vector, product, to_body, unit
from sitl.dynamics.state import Crash

_NONE, _GROUND = int(Crash.NONE), int(Crash.GROUND)

RATE_LIMIT_RAD_S = 18.85
"""No body turns faster than three turns a second: a bound for the integration, as in PX4's simulator."""


@compiled
def spin_rotors(v: Any, a: Any, dt_s: float) -> None:
    """MR-1: the rotors follow their signals as well as they can; those of a broken vehicle do not turn."""
    share = dt_s / (a.rotor_lag_s + dt_s)
    whole = v.crash == _NONE or v.crash == _GROUND
    for k in range(4):
        signal = v.motor[k] * v.rotor_health[k] if whole else 0.0
        v.rotor[k] += share * (signal - v.rotor[k])


@compiled
def thrust_of(signal: float, a: Any) -> float:
    """MR-1: thrust [N] of a rotor that has settled to `signal`."""
    return a.thrust_max_n * signal * (a.thrust_curve * signal + 1.0 - a.thrust_curve)


@compiled
def move(v: Any, a: Any, wind_ned_m_s: Any, dt_s: float) -> None:
    """One step of MR-1 to MR-5 in free air."""
    spin_rotors(v, a, dt_s)
    t1, t2 = thrust_of(v.rotor[0], a), thrust_of(v.rotor[1], a)
    t3, t4 = thrust_of(v.rotor[2], a), thrust_of(v.rotor[3], a)
    _accelerate(v, a, t1 + t2 + t3 + t4, wind_ned_m_s, dt_s)
    torque_share = a.torque_max_n_m / a.thrust_max_n
    _turn(
        v,
        a,
        a.arm_m * (-t1 + t2 + t3 - t4),
        a.arm_m * (t1 - t2 + t3 - t4),
        torque_share * (t1 + t2 - t3 - t4),
        dt_s,
    )


@compiled
def _accelerate(v: Any, a: Any, thrust_n: float, wind_ned_m_s: Any, dt_s: float) -> None:
    """MR-2, and the position from the mean of the old and the new velocity."""
    q = (v.attitude[0], v.attitude[1], v.attitude[2], v.attitude[3])
    z = body_z(q)
    force_x = -z[0] * thrust_n - a.drag_n_s_m * (v.velocity_m_s[0] - wind_ned_m_s[0] - v.gust_m_s[0])
    force_y = -z[1] * thrust_n - a.drag_n_s_m * (v.velocity_m_s[1] - wind_ned_m_s[1] - v.gust_m_s[1])
    force_z = -z[2] * thrust_n - a.drag_n_s_m * (v.velocity_m_s[2] - wind_ned_m_s[2] - v.gust_m_s[2])
    felt = to_body(q, (force_x / a.mass_kg, force_y / a.mass_kg, force_z / a.mass_kg))
    v.specific_force_m_s2[0], v.specific_force_m_s2[1], v.specific_force_m_s2[2] = felt
    half = 0.5 * dt_s
    for k in range(3):
        v.position_m[k] += half * v.velocity_m_s[k]
    v.velocity_m_s[0] += dt_s * force_x / a.mass_kg
    v.velocity_m_s[1] += dt_s * force_y / a.mass_kg
    v.velocity_m_s[2] += dt_s * (force_z / a.mass_kg + GRAVITY_M_S2)
    for k in range(3):
        v.position_m[k] += half * v.velocity_m_s[k]


@compiled
def _turn(v: Any, a: Any, roll_n_m: float, pitch_n_m: float, yaw_n_m: float, dt_s: float) -> None:
    """MR-4 and MR-5."""
    w, inertia, drag = v.rates_rad_s, a.inertia_kg_m2, a.rotational_drag_n_m_s
    gyro_x = (inertia[2] - inertia[1]) * w[1] * w[2]
    gyro_y = (inertia[0] - inertia[2]) * w[2] * w[0]
    gyro_z = (inertia[1] - inertia[0]) * w[0] * w[1]
    w_x = w[0] + dt_s * (roll_n_m - drag * w[0] - gyro_x) / inertia[0]
    w_y = w[1] + dt_s * (pitch_n_m - drag * w[1] - gyro_y) / inertia[1]
    w_z = w[2] + dt_s * (yaw_n_m - drag * w[2] - gyro_z) / inertia[2]
    w[0] = min(max(w_x, -RATE_LIMIT_RAD_S), RATE_LIMIT_RAD_S)
    w[1] = min(max(w_y, -RATE_LIMIT_RAD_S), RATE_LIMIT_RAD_S)
    w[2] = min(max(w_z, -RATE_LIMIT_RAD_S), RATE_LIMIT_RAD_S)
    turn = from_rotation_vector(w[0] * dt_s, w[1] * dt_s, w[2] * dt_s)
    q = unit(product((v.attitude[0], v.attitude[1], v.attitude[2], v.attitude[3]), turn))
    v.attitude[0], v.attitude[1], v.attitude[2], v.attitude[3] = q
