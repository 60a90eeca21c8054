"""Jerk-limited motion towards a velocity, as PX4's auto modes have it: jerk, constant acceleration, jerk back.

A `Ramp` is the fastest such change of velocity: jerk `sign * jerk` for t1, none for t2, `-sign * jerk` for t3.
"""

import math

from missions.kernels import compiled

Ramp = tuple[float, float, float, float]
"""Signed jerk [m/s^3], t1, t2, t3 [s]."""


@compiled
def fastest_ramp(velocity: float, acceleration: float, wanted: float, jerk: float, most: float) -> Ramp:
    """The fastest ramp from a velocity and an acceleration to the `wanted` velocity at no acceleration.

    Args:
        velocity, acceleration, wanted: in m/s, m/s^2, m/s.
        jerk: limit [m/s^3].
        most: limit of the acceleration [m/s^2].
    """
    signed = _jerk_towards(velocity, acceleration, wanted, jerk)
    if signed == 0.0:
        return (0.0, 0.0, 0.0, 0.0)
    change = wanted - velocity
    discriminant = 2.0 * acceleration * acceleration + 4.0 * signed * change
    t1 = 0.0
    if discriminant >= 0.0:
        root = 0.5 * math.sqrt(discriminant)
        t1 = (-acceleration + root) / signed
        if t1 < 0.0 or t1 + acceleration / signed < 0.0:
            t1 = (-acceleration - root) / signed
        if t1 < 0.0 or t1 + acceleration / signed < 0.0:
            t1 = 0.0
    t1 = max(_until_saturated(acceleration, signed, t1, most), 0.0)
    t3 = max(acceleration / signed + t1, 0.0)
    peak = acceleration + signed * t1
    t2 = 0.0
    if abs(peak) > 1e-9:
        gained = acceleration * t1 + 0.5 * signed * t1 * t1 + peak * t3 - 0.5 * signed * t3 * t3
        t2 = max((change - gained) / peak, 0.0)
    return (signed, t1, t2, t3)


@compiled
def slower_ramp(velocity: float, acceleration: float, wanted: float, jerk: float, most: float, total_s: float) -> Ramp:
    """The ramp that takes `total_s`, so that several axes arrive together; the fastest one if there is none."""
    signed = _jerk_towards(velocity, acceleration, wanted, jerk)
    if signed == 0.0:
        return (0.0, 0.0, 0.0, 0.0)
    change = wanted - velocity
    b = signed * total_s - acceleration
    discriminant = b * b + 4.0 * signed * (acceleration * total_s - change) - 2.0 * acceleration * acceleration
    t1 = 0.0
    if discriminant >= 0.0:
        root = math.sqrt(discriminant)
        for sign in (-1.0, 1.0):  # the smaller root is the gentler ramp
            candidate = max((b + sign * root) / (2.0 * signed), 0.0)
            t3 = acceleration / signed + candidate
            if t3 >= 0.0 and candidate + t3 <= total_s:
                t1 = candidate
                break
    t1 = max(_until_saturated(acceleration, signed, t1, most), 0.0)
    t3 = max(acceleration / signed + t1, 0.0)
    return (signed, t1, max(total_s - t1 - t3, 0.0), t3)


@compiled
def along(ramp: Ramp, position: float, velocity: float, acceleration: float, dt_s: float) -> tuple[float, float, float]:
    """Position, velocity and acceleration after `dt_s` on a ramp; past its end the velocity stays."""
    left_s = dt_s
    for phase in range(3):
        jerk = ramp[0] if phase == 0 else (0.0 if phase == 1 else -ramp[0])
        t = min(left_s, ramp[1 + phase])
        position += t * (velocity + t * (0.5 * acceleration + jerk * t / 6.0))
        velocity += t * (acceleration + 0.5 * jerk * t)
        acceleration += jerk * t
        left_s -= t
    if left_s > 0.0:
        acceleration = 0.0
        position += velocity * left_s
    return position, velocity, acceleration


@compiled
def speed_to_stop_within(distance_m: float, end_m_s: float, jerk: float, acceleration: float) -> float:
    """The highest speed [m/s] from which one is down to `end_m_s` after `distance_m`, the build-up of jerk included."""
    b = 4.0 * acceleration * acceleration / jerk
    c = -2.0 * acceleration * distance_m - end_m_s * end_m_s
    return max(0.5 * (-b + math.sqrt(b * b - 4.0 * c)), end_m_s)


@compiled
def _jerk_towards(velocity: float, acceleration: float, wanted: float, jerk: float) -> float:
    """The jerk to begin with: compare with the velocity at which braking the acceleration at once would end."""
    coasted = velocity + 0.5 * acceleration * abs(acceleration) / jerk
    if wanted > coasted:
        return jerk
    if wanted < coasted:
        return -jerk
    return math.copysign(jerk, acceleration) if acceleration != 0.0 else 0.0


@compiled
def _until_saturated(acceleration: float, signed_jerk: float, t1: float, most: float) -> float:
    peak = acceleration + signed_jerk * t1
    if peak > most:
        return (most - acceleration) / signed_jerk
    if peak < -most:
        return (-most - acceleration) / signed_jerk
    return t1
