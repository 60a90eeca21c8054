"""PX4's multicopter position controller: position P, velocity PID, acceleration to attitude and thrust.

Setpoints that are NaN are not controlled. A position setpoint and a velocity setpoint add up: the velocity is a
feed-forward. The horizontal velocity is limited so that the share which corrects the position goes first.
"""

import math
from typing import Any

from missions.kernels import compiled
from sitl.dynamics.airframe import GRAVITY_M_S2
from sitl.dynamics.rotation import from_z_and_yaw, yaw_of
from sitl.dynamics.state import Guidance, TakeoffStage

TILT_SLEW_RAD_S = 0.2
LEAST_THRUST = 1e-3
"""A thrust vector is never shorter than this, so that an attitude can be read off it."""
DRAG_SHARE = 0.5
"""How much of a horizontal integral is taken for what holds against drag; the rest may hold against wind."""
SLOWEST_WITH_DRAG_M_S = 0.1

_READY, _RAMPUP, _FLIGHT = int(TakeoffStage.READY), int(TakeoffStage.RAMPUP), int(TakeoffStage.FLIGHT)
_WAYPOINT, _LAND = int(Guidance.WAYPOINT), int(Guidance.LAND)


@compiled
def is_flyable(v: Any) -> bool:
    """Whether every axis has some setpoint, and those of x and y come in pairs."""
    p, w, a = v.setpoint_position_m, v.setpoint_velocity_m_s, v.setpoint_acceleration_m_s2
    for k in range(3):
        if math.isnan(p[k]) and math.isnan(w[k]) and math.isnan(a[k]):
            return False
    return (
        math.isnan(p[0]) == math.isnan(p[1])
        and math.isnan(w[0]) == math.isnan(w[1])
        and math.isnan(a[0]) == math.isnan(a[1])
    )


@compiled
def stop_and_wait(v: Any) -> None:
    """The setpoint that stands in for one that cannot be flown: no velocity."""
    for k in range(3):
        v.setpoint_position_m[k] = math.nan
        v.setpoint_velocity_m_s[k] = 0.0
        v.setpoint_acceleration_m_s2[k] = math.nan


@compiled
def position_control(v: Any, g: Any, wants_takeoff: bool, dt_s: float) -> None:
    """One step: the setpoints and the estimate in, `setpoint_attitude` and `setpoint_thrust` out."""
    _take_off(v, g, wants_takeoff, dt_s)
    if not is_flyable(v):
        stop_and_wait(v)
    up_m_s = _speed_up_limit(v, g)
    taking_off = v.takeoff_stage == _RAMPUP
    _command_velocity(v, g, up_m_s)
    _filter_acceleration(v, g, dt_s)
    if v.takeoff_stage < _RAMPUP or (v.takeoff_stage == _FLIGHT and v.ground_contact != 0):
        _stay_down(v)
    else:
        _command_acceleration(v, g, taking_off)
    _command_thrust(v, g, dt_s)


@compiled
def _take_off(v: Any, g: Any, wants_takeoff: bool, dt_s: float) -> None:
    """Walk through PX4's stages of a take-off: rotors spool up, then the limit of the climb rate is ramped."""
    v.stage_s += dt_s
    if v.takeoff_stage == 0:
        v.takeoff_stage, v.stage_s = 1, 0.0
    if v.takeoff_stage == 1 and v.stage_s >= g.COM_SPOOLUP_TIME:
        v.takeoff_stage = _READY
    if v.takeoff_stage == _READY and wants_takeoff:
        v.takeoff_stage, v.stage_s = _RAMPUP, 0.0
    if v.takeoff_stage == _RAMPUP and v.stage_s >= g.MPC_TKO_RAMP_T:
        v.takeoff_stage = _FLIGHT
    elif v.takeoff_stage == _FLIGHT and v.landed != 0:
        v.takeoff_stage = _READY
    tilt_deg = g.MPC_TILTMAX_AIR if v.takeoff_stage == _FLIGHT else g.MPC_TILTMAX_LND
    step = TILT_SLEW_RAD_S * dt_s
    change = math.radians(tilt_deg) - v.tilt_limit_rad
    v.tilt_limit_rad += min(max(change, -step), step)


@compiled
def _speed_up_limit(v: Any, g: Any) -> float:
    """The highest climb rate [m/s]: it begins a take-off far below zero, so that the thrust starts from nothing."""
    if v.takeoff_stage != _RAMPUP:
        return g.MPC_Z_VEL_MAX_UP
    first = -GRAVITY_M_S2 / g.MPC_Z_VEL_P_ACC
    return first + min(v.stage_s / g.MPC_TKO_RAMP_T, 1.0) * (g.MPC_Z_VEL_MAX_UP - first)


@compiled
def _command_velocity(v: Any, g: Any, up_m_s: float) -> None:
    """Position P with velocity feed-forward, limited; axes that nothing controls get NaN."""
    for k in range(3):
        gain = g.MPC_XY_P if k < 2 else g.MPC_Z_P
        position, velocity = v.setpoint_position_m[k], v.setpoint_velocity_m_s[k]
        correction = gain * (position - v.position_m[k] - v.offset_m[k])
        if math.isnan(position):
            v.commanded_velocity_m_s[k] = velocity
        elif math.isnan(velocity):
            v.commanded_velocity_m_s[k] = correction
        else:
            v.commanded_velocity_m_s[k] = correction + velocity
    if not math.isnan(v.commanded_velocity_m_s[0]):
        _limit_horizontal_velocity(v, g)
    if not math.isnan(v.commanded_velocity_m_s[2]):
        auto = v.guidance == _WAYPOINT or v.guidance == _LAND  # its own speeds leave room for corrections
        down_m_s = max(g.MPC_Z_VEL_MAX_DN, 1.2 * g.MPC_Z_V_AUTO_DN) if auto else g.MPC_Z_VEL_MAX_DN
        v.commanded_velocity_m_s[2] = min(max(v.commanded_velocity_m_s[2], -up_m_s), down_m_s)


@compiled
def _limit_horizontal_velocity(v: Any, g: Any) -> None:
    """Shorten the feed-forward until the sum is fast enough but no faster than MPC_XY_VEL_MAX."""
    limit, c = g.MPC_XY_VEL_MAX, v.commanded_velocity_m_s
    if math.hypot(c[0], c[1]) <= limit:
        return
    forward_x, forward_y = v.setpoint_velocity_m_s[0], v.setpoint_velocity_m_s[1]
    if math.isnan(forward_x):
        forward_x = forward_y = 0.0
    first_x, first_y = c[0] - forward_x, c[1] - forward_y  # the correction of the position
    first = math.hypot(first_x, first_y)
    forward = math.hypot(forward_x, forward_y)
    if first >= limit or forward < 1e-3:
        c[0], c[1] = first_x / first * limit, first_y / first * limit
        return
    # the scale s with |first + s * unit(forward)| = limit
    unit_x, unit_y = forward_x / forward, forward_y / forward
    along = unit_x * first_x + unit_y * first_y
    scale = -along + math.sqrt(max(along * along - first * first + limit * limit, 0.0))
    c[0], c[1] = first_x + scale * unit_x, first_y + scale * unit_y


@compiled
def _filter_acceleration(v: Any, g: Any, dt_s: float) -> None:
    """The low-passed derivative of the estimated velocity, for the controller's D."""
    share = dt_s / (dt_s + 1.0 / (2.0 * math.pi * g.MPC_VELD_LP))
    for k in range(3):
        velocity = v.velocity_m_s[k] + v.velocity_error_m_s[k]
        rate = (velocity - v.velocity_before_m_s[k]) / dt_s
        v.acceleration_filtered_m_s2[k] += share * (rate - v.acceleration_filtered_m_s2[k])
        v.velocity_before_m_s[k] = velocity


@compiled
def _stay_down(v: Any) -> None:
    """On the ground: a high downward acceleration makes sure that there is no thrust."""
    for k in range(3):
        v.commanded_acceleration_m_s2[k] = 0.0
        v.velocity_integral_m_s2[k] = 0.0
        v.commanded_velocity_m_s[k] = math.nan
    v.commanded_acceleration_m_s2[2] = 100.0


@compiled
def _command_acceleration(v: Any, g: Any, taking_off: bool) -> None:
    """Velocity PID with acceleration feed-forward; axes without a velocity setpoint get the feed-forward alone."""
    for k in range(3):
        gain = g.MPC_XY_VEL_P_ACC if k < 2 else g.MPC_Z_VEL_P_ACC
        damping = g.MPC_XY_VEL_D_ACC if k < 2 else g.MPC_Z_VEL_D_ACC
        error = v.commanded_velocity_m_s[k] - v.velocity_before_m_s[k]
        forward = v.setpoint_acceleration_m_s2[k]
        if math.isnan(forward) or (k == 2 and taking_off and not math.isnan(v.setpoint_velocity_m_s[2])):
            forward = 0.0  # a ramped take-off is not amended by a feed-forward
        correction = gain * error + v.velocity_integral_m_s2[k] - damping * v.acceleration_filtered_m_s2[k]
        v.commanded_acceleration_m_s2[k] = forward + (0.0 if math.isnan(correction) else correction)


@compiled
def _command_thrust(v: Any, g: Any, dt_s: float) -> None:
    """The attitude whose tilt gives the commanded acceleration, and the collective thrust; then the integrals."""
    a, hover = v.commanded_acceleration_m_s2, g.MPC_THR_HOVER
    least = max(g.MPC_THR_MIN, LEAST_THRUST) if v.takeoff_stage == _FLIGHT else LEAST_THRUST
    tilt = min(math.atan2(math.hypot(a[0], a[1]), GRAVITY_M_S2), v.tilt_limit_rad)
    heading = math.atan2(a[1], a[0])
    z = (-math.sin(tilt) * math.cos(heading), -math.sin(tilt) * math.sin(heading), math.cos(tilt))
    collective = min((a[2] * (hover / GRAVITY_M_S2) - hover) / z[2], -least)
    t_x, t_y, t_z = z[0] * collective, z[1] * collective, z[2] * collective
    error_z = v.commanded_velocity_m_s[2] - v.velocity_before_m_s[2]
    if (t_z >= -least and error_z >= 0.0) or (t_z <= -g.MPC_THR_MAX and error_z <= 0.0):
        error_z = 0.0
    # up and down goes first, but for a margin that is kept for the horizontal
    across = math.hypot(t_x, t_y)
    t_z = max(t_z, -math.sqrt(g.MPC_THR_MAX**2 - min(across, g.MPC_THR_XY_MARG) ** 2))
    across_limit = math.sqrt(max(g.MPC_THR_MAX**2 - t_z * t_z, 0.0))
    if across > across_limit:
        t_x, t_y = t_x / across * across_limit, t_y / across * across_limit
    _integrate_velocity_error(v, g, t_x * GRAVITY_M_S2 / hover, t_y * GRAVITY_M_S2 / hover, error_z, dt_s)
    thrust = math.sqrt(t_x * t_x + t_y * t_y + t_z * t_z)
    yaw_rad = v.setpoint_yaw_rad
    if math.isnan(yaw_rad):
        e = v.estimated_attitude
        yaw_rad = yaw_of((e[0], e[1], e[2], e[3]))
    v.commanded_yaw_rad = yaw_rad
    v.setpoint_thrust = thrust
    q = from_z_and_yaw((-t_x / thrust, -t_y / thrust, -t_z / thrust), yaw_rad)
    v.setpoint_attitude[0], v.setpoint_attitude[1], v.setpoint_attitude[2], v.setpoint_attitude[3] = q


@compiled
def _integrate_velocity_error(
    v: Any, g: Any, produced_x: float, produced_y: float, error_z: float, dt_s: float
) -> None:
    """The velocity integrals, with tracking anti-windup across [m/s^2]."""
    a, integral = v.commanded_acceleration_m_s2, v.velocity_integral_m_s2
    error_x = v.commanded_velocity_m_s[0] - v.velocity_before_m_s[0]
    error_y = v.commanded_velocity_m_s[1] - v.velocity_before_m_s[1]
    if a[0] * a[0] + a[1] * a[1] > produced_x * produced_x + produced_y * produced_y:
        gain = 2.0 / g.MPC_XY_VEL_P_ACC
        error_x -= gain * (a[0] - produced_x)
        error_y -= gain * (a[1] - produced_y)
    _let_go_of_drag(v, dt_s)
    if not math.isnan(error_x):
        integral[0] += g.MPC_XY_VEL_I_ACC * error_x * dt_s
        integral[1] += g.MPC_XY_VEL_I_ACC * error_y * dt_s
    else:  # nothing controls the horizontal velocity
        integral[0] = integral[1] = 0.0
    if not math.isnan(error_z):
        integral[2] += g.MPC_Z_VEL_I_ACC * error_z * dt_s
    integral[2] = min(max(integral[2], -GRAVITY_M_S2), GRAVITY_M_S2)


@compiled
def _let_go_of_drag(v: Any, dt_s: float) -> None:
    """While a trajectory brakes, what the integrals hold against drag shrinks as its speed does.

    A velocity integral that has learnt the drag of a cruise carries a vehicle metres past its target otherwise.
    """
    w, a, integral = v.setpoint_velocity_m_s, v.setpoint_acceleration_m_s2, v.velocity_integral_m_s2
    speed2 = w[0] * w[0] + w[1] * w[1]
    braking = -(w[0] * a[0] + w[1] * a[1])
    pushes = w[0] * integral[0] + w[1] * integral[1] > 0.0
    if braking > 0.0 and pushes and speed2 > SLOWEST_WITH_DRAG_M_S * SLOWEST_WITH_DRAG_M_S:  # false for NaN
        keep = max(1.0 - DRAG_SHARE * braking / speed2 * dt_s, 0.0)
        integral[0] *= keep
        integral[1] *= keep
