"""PX4's attitude and rate controllers and its mixer, for a quadrotor in X configuration.

The attitude controller (Brescianini, Hehn, D'Andrea: Nonlinear Quadrocopter Attitude Control, ETH 2013) turns the
thrust axis the shortest way and gives the yaw less weight.
"""

import math
from typing import Any

from missions.kernels import compiled
from sitl.dynamics.rotation import Quaternion, body_z, conjugate, product, to_body, unit

HALF_SQRT2 = math.sqrt(0.5)
YAW_THRUST_MARGIN = 0.15
"""How much of the thrust may be given up so that yaw keeps working."""
FULL_RATE_ERROR_RAD_S = math.radians(400.0)
"""At this error of a rate its integral stops growing."""


@compiled
def attitude_control(v: Any, g: Any) -> None:
    """The body rates that turn the estimated attitude to `setpoint_attitude`, into `setpoint_rates_rad_s`."""
    e, s = v.estimated_attitude, v.setpoint_attitude
    q = (e[0], e[1], e[2], e[3])
    wanted = (s[0], s[1], s[2], s[3])
    weight = min(max(g.MC_YAW_WEIGHT, 0.0), 1.0)
    reduced = _tilted(q, wanted)
    yaw = unit(product(conjugate(reduced), wanted))
    half = weight * math.atan2(yaw[3], yaw[0])
    error = unit(product(conjugate(q), product(reduced, (math.cos(half), 0.0, 0.0, math.sin(half)))))
    yaw_gain = g.MC_YAW_P / weight if weight > 1e-4 else g.MC_YAW_P
    down = to_body(q, (0.0, 0.0, 1.0))
    yawspeed = 0.0 if math.isnan(v.setpoint_yawspeed_rad_s) else v.setpoint_yawspeed_rad_s
    w = v.setpoint_rates_rad_s
    w[0] = _limited(2.0 * error[1] * g.MC_ROLL_P + down[0] * yawspeed, math.radians(g.MC_ROLLRATE_MAX))
    w[1] = _limited(2.0 * error[2] * g.MC_PITCH_P + down[1] * yawspeed, math.radians(g.MC_PITCHRATE_MAX))
    w[2] = _limited(2.0 * error[3] * yaw_gain + down[2] * yawspeed, math.radians(g.MC_YAWRATE_MAX))


@compiled
def rate_control(v: Any, g: Any, dt_s: float) -> None:
    """PID on the body rates, and the mixer: `setpoint_rates_rad_s` and `setpoint_thrust` in, `motor` out."""
    share = dt_s / (dt_s + 1.0 / (2.0 * math.pi * g.IMU_DGYRO_CUTOFF))
    for k in range(3):
        rate = (v.rates_rad_s[k] - v.rates_before_rad_s[k]) / dt_s
        v.angular_acceleration_rad_s2[k] += share * (rate - v.angular_acceleration_rad_s2[k])
        v.rates_before_rad_s[k] = v.rates_rad_s[k]
    roll = _rate_pid(v, 0, g.MC_ROLLRATE_P, g.MC_ROLLRATE_I, g.MC_ROLLRATE_D, g.MC_RR_INT_LIM, dt_s)
    pitch = _rate_pid(v, 1, g.MC_PITCHRATE_P, g.MC_PITCHRATE_I, g.MC_PITCHRATE_D, g.MC_PR_INT_LIM, dt_s)
    yaw = _rate_pid(v, 2, g.MC_YAWRATE_P, g.MC_YAWRATE_I, g.MC_YAWRATE_D, g.MC_YR_INT_LIM, dt_s)
    if g.MC_YAW_TQ_CUTOFF > 0.0:
        yaw_share = dt_s / (dt_s + 1.0 / (2.0 * math.pi * g.MC_YAW_TQ_CUTOFF))
        v.yaw_torque += yaw_share * (yaw - v.yaw_torque)
    else:
        v.yaw_torque = yaw
    mix(v, roll, pitch, v.yaw_torque, v.setpoint_thrust)
    for k in range(4):
        v.motor[k] = signal_for_thrust(v.motor[k], g.THR_MDL_FAC)


@compiled
def reset_rate_control(v: Any) -> None:
    """Forget the integrals: the motors stand."""
    for k in range(3):
        v.rate_integral[k] = 0.0
        v.saturated[k] = 0
    v.yaw_torque = 0.0


@compiled
def mix(v: Any, roll: float, pitch: float, yaw: float, thrust: float) -> None:
    """Share torques and thrust among the rotors; what does not fit is cut: thrust first, then roll and pitch, yaw."""
    motor = v.motor
    across, along = HALF_SQRT2 * roll, HALF_SQRT2 * pitch
    motor[0] = thrust - across + along
    motor[1] = thrust + across - along
    motor[2] = thrust + across + along
    motor[3] = thrust - across - along
    _desaturate(motor, 1.0, 1.0, 1.0, 1.0, 0.0, 1.0)
    _desaturate(motor, -HALF_SQRT2, HALF_SQRT2, HALF_SQRT2, -HALF_SQRT2, 1.0, 1.0)
    _desaturate(motor, HALF_SQRT2, -HALF_SQRT2, HALF_SQRT2, -HALF_SQRT2, 1.0, 1.0)
    before = HALF_SQRT2 * 0.5 * (-motor[0] + motor[1] + motor[2] - motor[3])
    before_pitch = HALF_SQRT2 * 0.5 * (motor[0] - motor[1] + motor[2] - motor[3])
    motor[0] += yaw
    motor[1] += yaw
    motor[2] -= yaw
    motor[3] -= yaw
    _desaturate(motor, 1.0, 1.0, -1.0, -1.0, 1.0, 1.0 + YAW_THRUST_MARGIN)
    _desaturate(motor, 1.0, 1.0, 1.0, 1.0, 0.0, 1.0)
    given_yaw = 0.25 * (motor[0] + motor[1] - motor[2] - motor[3])
    v.saturated[0] = _sign(roll - before)
    v.saturated[1] = _sign(pitch - before_pitch)
    v.saturated[2] = _sign(yaw - given_yaw)
    for k in range(4):
        motor[k] = min(max(motor[k], 0.0), 1.0)


@compiled
def signal_for_thrust(thrust: float, curve: float) -> float:
    """The rotor signal that yields a share of full thrust under THR_MDL_FAC = `curve`."""
    if curve <= 0.0:
        return thrust
    linear = (1.0 - curve) / (2.0 * curve)
    return -linear + math.sqrt(linear * linear + max(thrust, 0.0) / curve)


@compiled
def _tilted(q: Quaternion, wanted: Quaternion) -> Quaternion:
    """`q` turned the shortest way until its z axis is that of `wanted`."""
    z, z_wanted = body_z(q), body_z(wanted)
    dot = z[0] * z_wanted[0] + z[1] * z_wanted[1] + z[2] * z_wanted[2]
    if dot < -0.99999:
        return wanted  # upside down: any way is as good
    cross = (
        z[1] * z_wanted[2] - z[2] * z_wanted[1],
        z[2] * z_wanted[0] - z[0] * z_wanted[2],
        z[0] * z_wanted[1] - z[1] * z_wanted[0],
    )
    return product(unit((1.0 + dot, cross[0], cross[1], cross[2])), q)


@compiled
def _rate_pid(v: Any, k: int, p: float, i: float, d: float, limit: float, dt_s: float) -> float:
    error = v.setpoint_rates_rad_s[k] - v.rates_rad_s[k]
    torque = p * error + v.rate_integral[k] - d * v.angular_acceleration_rad_s2[k]
    if v.landed == 0 and v.maybe_landed == 0:
        if v.saturated[k] > 0:
            error = min(error, 0.0)
        elif v.saturated[k] < 0:
            error = max(error, 0.0)
        share = error / FULL_RATE_ERROR_RAD_S
        grown = v.rate_integral[k] + max(0.0, 1.0 - share * share) * i * error * dt_s
        v.rate_integral[k] = _limited(grown, limit)
    return torque


@compiled
def _desaturate(motor: Any, d0: float, d1: float, d2: float, d3: float, upwards: float, top: float) -> None:
    """Move the motors along a direction until none is outside [0, top], or the excess is the same on both sides.

    Args:
        motor: (4,) thrusts, changed in place.
        d0, d1, d2, d3: the direction.
        upwards: 1 to allow moves along the direction, 0 for moves against it alone.
        top: the highest thrust of a motor.
    """
    direction = (d0, d1, d2, d3)
    for share in (1.0, 0.5):
        lowest, highest = 0.0, 0.0
        for k in range(4):
            excess = -motor[k] if motor[k] < 0.0 else min(top - motor[k], 0.0)
            move = excess / direction[k]
            lowest, highest = min(lowest, move), max(highest, move)
        move = share * (lowest + highest)
        move = min(move, upwards * abs(move))
        for k in range(4):
            motor[k] += move * direction[k]


@compiled
def _limited(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)


@compiled
def _sign(value: float) -> int:
    return 1 if value > 1e-6 else (-1 if value < -1e-6 else 0)
