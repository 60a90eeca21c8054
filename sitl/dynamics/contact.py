"""What vehicles touch: the ground, obstacles, movers, each other. Whoever collides falls and stays where it lands."""

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from missions.kernels import compiled
from missions.obstacles import Obstacles, clearance_at, terrain_height_at
from sitl.dynamics.airframe import GRAVITY_M_S2
from sitl.dynamics.rotation import body_z, yaw_of
from sitl.dynamics.state import Crash

Array = npt.NDArray[np.float64]

SAFE_DESCENT_M_S = 4.0
"""Faster than this onto the ground is a collision; landings come down at 0.3 to 2 m/s."""
SAFE_SLIDE_M_S = 3.0
"""Faster than this across the ground breaks the vehicle: it tips over, or has hit a slope."""
SAFE_TILT_COS = 0.5
"""Touching the ground with more than 60 degrees of tilt breaks the vehicle, too."""
RESTING_M = 0.05
"""A fallen vehicle comes to rest on an obstacle that is this near to its centre."""

_OBSTACLE, _MOVER, _VEHICLE = int(Crash.OBSTACLE), int(Crash.MOVER), int(Crash.VEHICLE)
_TERRAIN, _GROUND, _NONE = int(Crash.TERRAIN), int(Crash.GROUND), int(Crash.NONE)


@compiled
def crash(v: Any, kind: int, other: int) -> None:
    """Record a vehicle's collision; but for a fall onto the ground it loses its way and its rotors, and falls."""
    if v.crash == _NONE or v.crash == _GROUND:
        v.crash = kind
        v.crash_other = other
        v.velocity_m_s[0] = v.velocity_m_s[1] = 0.0
        v.velocity_m_s[2] = max(v.velocity_m_s[2], 0.0)


@compiled
def touch_ground(v: Any, terrain: Obstacles, lift_g: float) -> None:
    """Stop a vehicle that has come down to the terrain; let it go when its thrust (`lift_g` weights) lifts it."""
    ground_z_m = -terrain_height_at(v.position_m[1], v.position_m[0], terrain)
    if v.position_m[2] < ground_z_m or lift_g > 1.0:
        v.grounded = 0
        return
    if v.grounded == 0:
        across_m_s = math.hypot(v.velocity_m_s[0], v.velocity_m_s[1])
        upright = body_z((v.attitude[0], v.attitude[1], v.attitude[2], v.attitude[3]))[2]
        if across_m_s > SAFE_SLIDE_M_S or upright < SAFE_TILT_COS:
            crash(v, _TERRAIN, 0)
        elif v.velocity_m_s[2] > SAFE_DESCENT_M_S:
            crash(v, _GROUND, 0)
    v.grounded = 1
    v.position_m[2] = ground_z_m
    _stand(v)


@compiled
def touch_obstacles(v: Any, obstacles: Obstacles, movers: Array, radius_m: float) -> None:
    """Collide with what is nearer to the vehicle's centre than its radius.

    Args:
        v: the vehicle.
        obstacles: what is solid, without threats and without peaks, which are ground.
        movers: (k, 4) centre north, east, down and radius [m] of each moving ball.
        radius_m: of the vehicle.
    """
    gap_m = clearance_at(v.position_m[1], v.position_m[0], -v.position_m[2], obstacles)
    if gap_m < radius_m:
        if v.grounded == 0:
            crash(v, _OBSTACLE, 0)
        if v.crash != _NONE and gap_m < RESTING_M:
            v.grounded = 1
            _stand(v)
    for k in range(len(movers)):
        x, y = v.position_m[0] - movers[k, 0], v.position_m[1] - movers[k, 1]
        z = v.position_m[2] - movers[k, 2]
        if x * x + y * y + z * z < (movers[k, 3] + radius_m) ** 2:
            crash(v, _MOVER, k)


@compiled
def touch_each_other(fleet: Any, radius_m: float) -> None:
    """Collide vehicles whose centres are nearer than two radii; two that stand on the ground do not."""
    for i in range(len(fleet)):
        for j in range(i):
            x = fleet[i].position_m[0] - fleet[j].position_m[0]
            y = fleet[i].position_m[1] - fleet[j].position_m[1]
            z = fleet[i].position_m[2] - fleet[j].position_m[2]
            near = x * x + y * y + z * z < 4.0 * radius_m * radius_m
            if near and (fleet[i].grounded == 0 or fleet[j].grounded == 0):
                crash(fleet[i], _VEHICLE, j)
                crash(fleet[j], _VEHICLE, i)


@compiled
def _stand(v: Any) -> None:
    """At rest and level, the nose where it was."""
    yaw_rad = yaw_of((v.attitude[0], v.attitude[1], v.attitude[2], v.attitude[3]))
    v.attitude[0], v.attitude[1] = math.cos(0.5 * yaw_rad), 0.0
    v.attitude[2], v.attitude[3] = 0.0, math.sin(0.5 * yaw_rad)
    for k in range(3):
        v.velocity_m_s[k] = 0.0
        v.rates_rad_s[k] = 0.0
        v.specific_force_m_s2[k] = 0.0
    v.specific_force_m_s2[2] = -GRAVITY_M_S2
