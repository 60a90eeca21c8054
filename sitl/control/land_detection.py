"""PX4's multicopter land detector: ground contact, maybe landed, landed, each after the one before has held a while."""

import math
from typing import Any

from missions.kernels import compiled
from sitl.dynamics.state import Guidance

CONTACT_THRUST_SHARE = 0.6
"""Thrust below this share of the way from MPC_THR_MIN to hover hints at ground below."""
LANDED_THRUST_SHARE = 0.1
LANDED_FACTOR = 2.5
"""Who has landed may move this much more before it counts as flying again."""

_MOTORS_OFF, _ATTITUDE, _RATES = (int(Guidance[name]) for name in ("MOTORS_OFF", "ATTITUDE", "RATES"))


@compiled
def detect_landing(v: Any, g: Any, dt_s: float) -> None:
    """One step: updates `ground_contact`, `maybe_landed` and `landed`."""
    if v.guidance == _MOTORS_OFF:
        remember_landed(v, g)  # PX4 takes whoever is disarmed for landed
        return
    hold_s = g.LNDMC_TRIG_TIME / 3.0
    wider = LANDED_FACTOR if v.landed != 0 else 1.0
    v.contact_s = v.contact_s + dt_s if _touches(v, g, wider) else 0.0
    v.ground_contact = 1 if v.contact_s >= hold_s else 0
    least = g.MPC_THR_MIN + LANDED_THRUST_SHARE * (g.MPC_THR_HOVER - g.MPC_THR_MIN)
    turning = math.hypot(v.rates_rad_s[0], v.rates_rad_s[1]) > wider * math.radians(g.LNDMC_ROT_MAX)
    settled = v.ground_contact != 0 and v.setpoint_thrust <= least and not turning
    v.maybe_landed_s = v.maybe_landed_s + dt_s if settled else 0.0
    v.maybe_landed = 1 if v.maybe_landed_s >= hold_s else 0
    v.landed_s = v.landed_s + dt_s if v.maybe_landed != 0 else 0.0
    v.landed = 1 if v.landed_s >= hold_s else 0


@compiled
def remember_landed(v: Any, g: Any) -> None:
    """Put the detector into its landed state."""
    v.contact_s = v.maybe_landed_s = v.landed_s = g.LNDMC_TRIG_TIME
    v.ground_contact = v.maybe_landed = v.landed = 1


@compiled
def _touches(v: Any, g: Any, wider: float) -> bool:
    """Little thrust, no motion, and (until landed) a descent that was ordered and does not happen."""
    low = g.MPC_THR_MIN + CONTACT_THRUST_SHARE * (g.MPC_THR_HOVER - g.MPC_THR_MIN)
    if v.setpoint_thrust > low:
        return False
    by_thrust = v.guidance == _ATTITUDE or v.guidance == _RATES  # little of it is a descent that was ordered
    descending = by_thrust or v.setpoint_velocity_m_s[2] >= 1.1 * g.LNDMC_Z_VEL_MAX  # false for NaN
    if v.maybe_landed == 0 and v.landed == 0 and not descending:
        return False
    vertical = abs(v.velocity_m_s[2] + v.velocity_error_m_s[2])
    across = math.hypot(v.velocity_m_s[0] + v.velocity_error_m_s[0], v.velocity_m_s[1] + v.velocity_error_m_s[1])
    return vertical < wider * g.LNDMC_Z_VEL_MAX and across <= g.LNDMC_XY_VEL_MAX
