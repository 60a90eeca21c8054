"""From a target to setpoints: the smooth trajectories of PX4's auto modes, landings, and the heading.

Written as PX4's FlightTaskAuto and PositionSmoothing behave: a velocity towards the target, as fast as the distance
to it, the turn at it and the cruise speed allow, and a jerk-limited point mass that follows this velocity. The point
mass waits for a vehicle that falls behind.
"""

import math
from typing import Any

from missions.kernels import compiled
from sitl.control.smoothing import along, fastest_ramp, slower_ramp, speed_to_stop_within
from sitl.dynamics.rotation import wrap_pi, yaw_of
from sitl.dynamics.state import Guidance, TakeoffStage

L1_DISTANCE_M = 5.0
ALMOST_STRAIGHT = 0.98
"""Cosine of the angle between velocity and target below which a vehicle is turning."""
YAWSPEED_FILTER_S = 0.2
LEAST_CLIMB_M_S = 0.3
"""A take-off is wanted when the trajectory wants to climb faster than this."""

_IDLE, _WAYPOINT, _LAND = int(Guidance.IDLE), int(Guidance.WAYPOINT), int(Guidance.LAND)
_SETPOINT, _RAMPUP = int(Guidance.SETPOINT), int(TakeoffStage.RAMPUP)


@compiled
def guide(v: Any, g: Any, dt_s: float) -> bool:
    """Make the setpoints of one step; returns whether the vehicle wants to leave the ground."""
    if v.guidance == _SETPOINT:
        return _setpoint_lifts_off(v)
    if v.guidance == _IDLE:
        hold_still(v)
        for k in range(3):
            v.setpoint_position_m[k] = math.nan
            v.setpoint_velocity_m_s[k] = math.nan
            v.setpoint_acceleration_m_s2[k] = 0.0
        v.setpoint_acceleration_m_s2[2] = 100.0
        return False
    if v.takeoff_stage < _RAMPUP:
        hold_still(v)
    climb_m_s = _follow(v, g, dt_s)
    _head(v, g, dt_s)
    return v.guidance == _WAYPOINT and climb_m_s > LEAST_CLIMB_M_S


@compiled
def hold_still(v: Any) -> None:
    """Put the trajectory to where the vehicle is, at rest."""
    for k in range(3):
        v.smooth_position_m[k] = v.position_m[k] + v.offset_m[k]
        v.smooth_velocity_m_s[k] = 0.0
        v.smooth_acceleration_m_s2[k] = 0.0
    v.turn_speed_m_s = 0.0


@compiled
def _setpoint_lifts_off(v: Any) -> bool:
    """Whether a setpoint from outside lies above the vehicle or moves upwards."""
    height_m = v.position_m[2] + v.offset_m[2]
    return (
        v.setpoint_position_m[2] < height_m  # comparisons with NaN are false
        or v.setpoint_velocity_m_s[2] < 0.0
        or v.setpoint_acceleration_m_s2[2] < 0.0
    )


@compiled
def _follow(v: Any, g: Any, dt_s: float) -> float:
    """Advance the jerk-limited trajectory by one step; returns the climb rate [m/s] that it aims at."""
    x, y, z = _aimed_velocity(v, g)
    height_m = v.ground_z_m - (v.position_m[2] + v.offset_m[2])
    up = z < 0.0
    acceleration_z = g.MPC_ACC_UP_MAX if up else g.MPC_ACC_DOWN_MAX
    speed_z = g.MPC_Z_V_AUTO_UP if up else g.MPC_Z_V_AUTO_DN
    if up and v.taking_off != 0 and height_m < g.MPC_LAND_ALT1:
        speed_z = min(speed_z, g.MPC_TKO_SPEED)
        acceleration_z = min(acceleration_z, g.MPC_TKO_SPEED / g.MPC_TKO_RAMP_T)
        v.smooth_position_m[2] = v.position_m[2] + v.offset_m[2]
    z = min(max(z, -speed_z), speed_z)
    _advance(v, g, (x, y, z), acceleration_z, dt_s)
    for k in range(3):
        v.setpoint_position_m[k] = v.smooth_position_m[k]
        v.setpoint_velocity_m_s[k] = v.smooth_velocity_m_s[k]
        v.setpoint_acceleration_m_s2[k] = v.smooth_acceleration_m_s2[k]
    return -z


@compiled
def _advance(v: Any, g: Any, wanted: tuple[float, float, float], acceleration_z: float, dt_s: float) -> None:
    """Move the point mass; all axes reach the wanted velocity together, and it waits for a vehicle behind it."""
    stretched_s = dt_s * _time_stretch(v, g)
    jerk = g.MPC_JERK_AUTO
    longest_s = 0.0
    for k in range(3):
        most = g.MPC_ACC_HOR if k < 2 else acceleration_z
        _, t1, t2, t3 = fastest_ramp(v.smooth_velocity_m_s[k], v.smooth_acceleration_m_s2[k], wanted[k], jerk, most)
        longest_s = max(longest_s, t1 + t2 + t3)
    for k in range(3):
        most = g.MPC_ACC_HOR if k < 2 else acceleration_z
        speed, acceleration = v.smooth_velocity_m_s[k], v.smooth_acceleration_m_s2[k]
        ramp = fastest_ramp(speed, acceleration, wanted[k], jerk, most)
        if ramp[1] + ramp[2] + ramp[3] < longest_s:
            ramp = slower_ramp(speed, acceleration, wanted[k], jerk, most, longest_s)
        moved = along(ramp, v.smooth_position_m[k], speed, acceleration, stretched_s)
        v.smooth_position_m[k], v.smooth_velocity_m_s[k], v.smooth_acceleration_m_s2[k] = moved


@compiled
def _time_stretch(v: Any, g: Any) -> float:
    """In [0, 1]: less than 1 when the vehicle is behind its trajectory."""
    x = v.smooth_position_m[0] - v.position_m[0] - v.offset_m[0]
    y = v.smooth_position_m[1] - v.position_m[1] - v.offset_m[1]
    if x * v.smooth_velocity_m_s[0] + y * v.smooth_velocity_m_s[1] < 0.0:
        return 1.0
    return 1.0 - min(math.hypot(x, y) / g.MPC_XY_ERR_MAX, 1.0)


@compiled
def _aimed_velocity(v: Any, g: Any) -> tuple[float, float, float]:
    """The velocity towards the target that leaves room to brake and to turn at it."""
    landing = v.guidance == _LAND
    x, y = v.target_m[0] - v.smooth_position_m[0], v.target_m[1] - v.smooth_position_m[1]
    z = 0.0 if landing else v.target_m[2] - v.smooth_position_m[2]
    distance = math.hypot(x, y)
    speed = _horizontal_speed(v, g, distance)
    turning = _is_turning(v, x, y, distance)
    if turning:
        speed = min(speed, v.turn_speed_m_s)
        if not landing:
            x, y, z = _towards_track(v, x, y, z)
    else:
        v.turn_speed_m_s = speed
    if landing:
        scale = speed / distance if distance > 1e-9 else 0.0
        return x * scale, y * scale, _descent_speed(v, g)
    return _shared(x, y, z, speed, _vertical_speed(v, g))


@compiled
def _shared(x: float, y: float, z: float, speed: float, speed_z: float) -> tuple[float, float, float]:
    """A velocity along (x, y, z) that keeps both limits; small limits shorten their own axis alone."""
    length = math.sqrt(x * x + y * y + z * z)
    if length < 1e-9:
        return 0.0, 0.0, 0.0
    scale = math.sqrt(speed * speed + speed_z * speed_z) / length
    x, y, z = x * scale, y * scale, z * scale
    across = math.hypot(x, y)
    if across > speed:
        x, y = x * speed / across, y * speed / across
        if speed >= 0.5 or across >= 0.5:
            z *= speed / across
    if abs(z) > speed_z:
        share = speed_z / abs(z)
        z *= share
        if speed_z >= 0.5 or abs(z) >= 0.5 * share:
            x, y = x * share, y * share
    return x, y, z


@compiled
def _is_turning(v: Any, x: float, y: float, distance: float) -> bool:
    """Whether the trajectory does not yet point to the target, which is still away."""
    speed = math.hypot(v.smooth_velocity_m_s[0], v.smooth_velocity_m_s[1])
    if speed <= 0.2 or distance <= v.acceptance_m:
        return False
    return (x * v.smooth_velocity_m_s[0] + y * v.smooth_velocity_m_s[1]) / (speed * distance) < ALMOST_STRAIGHT


@compiled
def _towards_track(v: Any, x: float, y: float, z: float) -> tuple[float, float, float]:
    """L1 guidance: aim at the point of the track previous -> target that is one L1 distance away."""
    tx = v.target_m[0] - v.previous_m[0]
    ty = v.target_m[1] - v.previous_m[1]
    tz = v.target_m[2] - v.previous_m[2]
    length = math.sqrt(tx * tx + ty * ty + tz * tz)
    if length < 1e-3:
        return x, y, z
    tx, ty, tz = tx / length, ty / length, tz / length
    px = v.smooth_position_m[0] - v.previous_m[0]
    py = v.smooth_position_m[1] - v.previous_m[1]
    pz = v.smooth_position_m[2] - v.previous_m[2]
    done = px * tx + py * ty + pz * tz
    cx, cy, cz = done * tx - px, done * ty - py, done * tz - pz  # to the closest point of the track
    l1 = max(v.acceptance_m, L1_DISTANCE_M)
    ahead = math.sqrt(max(l1 * l1 - cx * cx - cy * cy - cz * cz, 0.0))
    return cx + ahead * tx, cy + ahead * ty, cz + ahead * tz


@compiled
def _horizontal_speed(v: Any, g: Any, distance_m: float) -> float:
    """Cruise speed, less where the brakes need it: for the stop or the turn at the target."""
    cruise = min(v.cruise_m_s, g.MPC_XY_VEL_MAX)
    nx, ny = v.next_m[0] - v.target_m[0], v.next_m[1] - v.target_m[1]
    onward = math.hypot(nx, ny)
    end = 0.0
    if onward > 1e-3 and onward >= v.acceptance_m and distance_m > 1e-9:
        x, y = v.target_m[0] - v.smooth_position_m[0], v.target_m[1] - v.smooth_position_m[1]
        cosine = -(x * nx + y * ny) / (distance_m * onward)
        angle = min(math.acos(min(max(cosine, -1.0), 1.0)), math.pi - 1e-7)
        # a circle tangent to both legs, inside of the acceptance radius
        turn = math.sqrt(g.MPC_XY_TRAJ_P * g.MPC_ACC_HOR * v.acceptance_m * math.tan(0.5 * angle))
        leave = speed_to_stop_within(onward, 0.0, g.MPC_JERK_AUTO, g.MPC_ACC_HOR)
        end = min(min(turn, leave), cruise)
    return min(cruise, speed_to_stop_within(distance_m, end, g.MPC_JERK_AUTO, g.MPC_ACC_HOR))


@compiled
def _vertical_speed(v: Any, g: Any) -> float:
    """Climb or descent speed that stops at the target's height, or flies through where the next leg goes on."""
    z = v.target_m[2] - v.smooth_position_m[2]
    most = g.MPC_Z_V_AUTO_UP if z < 0.0 else g.MPC_Z_V_AUTO_DN
    acceleration = g.MPC_ACC_UP_MAX if z < 0.0 else g.MPC_ACC_DOWN_MAX
    end, nz = 0.0, v.next_m[2] - v.target_m[2]
    if abs(nz) > 1e-3:
        x, y = v.target_m[0] - v.smooth_position_m[0], v.target_m[1] - v.smooth_position_m[1]
        across = math.hypot(x, y)
        onward = math.hypot(v.next_m[0] - v.target_m[0], v.next_m[1] - v.target_m[1])
        before = math.sqrt(across * across + z * z)
        after = math.sqrt(onward * onward + nz * nz)
        cosine = -(across * onward + z * nz) / (before * after) if before * after > 1e-9 else 1.0
        angle = min(math.acos(min(max(cosine, -1.0), 1.0)), math.pi - 1e-7)
        end = min(math.sqrt(acceleration * g.NAV_MC_ALT_RAD * math.tan(0.5 * angle)), most)
    return min(most, speed_to_stop_within(abs(z), end, g.MPC_JERK_AUTO, acceleration))


@compiled
def _descent_speed(v: Any, g: Any) -> float:
    """Down fast high up, at MPC_LAND_SPEED below MPC_LAND_ALT2, crawling below MPC_LAND_ALT3 [m/s]."""
    height_m = v.ground_z_m - (v.position_m[2] + v.offset_m[2])
    if height_m <= g.MPC_LAND_ALT3:
        return g.MPC_LAND_CRWL
    low, high = g.MPC_LAND_ALT2, max(g.MPC_LAND_ALT1, g.MPC_LAND_ALT2 + 1e-3)
    share = min(max((height_m - low) / (high - low), 0.0), 1.0)
    return g.MPC_LAND_SPEED + share * (g.MPC_Z_V_AUTO_DN - g.MPC_LAND_SPEED)


@compiled
def _head(v: Any, g: Any, dt_s: float) -> None:
    """The heading: as ordered, else along the trajectory, else as before; turned at MPC_YAWRAUTO_MAX."""
    wanted = v.target_yaw_rad
    if math.isnan(wanted):
        wanted = v.yaw_before_rad
        vx, vy = v.setpoint_velocity_m_s[0], v.setpoint_velocity_m_s[1]
        x = v.target_m[0] - v.position_m[0] - v.offset_m[0]
        y = v.target_m[1] - v.position_m[1] - v.offset_m[1]
        if math.hypot(vx, vy) > 0.1 and math.hypot(x, y) > 2.0:
            wanted = math.atan2(vy, vx)
    e = v.estimated_attitude
    if math.isnan(wanted):
        wanted = yaw_of((e[0], e[1], e[2], e[3]))
    before = wanted if math.isnan(v.yaw_before_rad) else v.yaw_before_rad
    most = math.radians(g.MPC_YAWRAUTO_MAX)
    turn = min(max(wrap_pi(wanted - before), -most * dt_s), most * dt_s)
    v.setpoint_yaw_rad = wrap_pi(before + turn)
    share = dt_s / (dt_s + YAWSPEED_FILTER_S)
    v.yawspeed_filtered_rad_s += share * (turn / dt_s - v.yawspeed_filtered_rad_s)
    v.setpoint_yawspeed_rad_s = v.yawspeed_filtered_rad_s
    v.yaw_before_rad = v.setpoint_yaw_rad
