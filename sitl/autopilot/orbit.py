"""Orbit mode: fly to a circle, then around it, nose to its centre."""

import math
from typing import NamedTuple

from sitl.autopilot.craft import Craft
from sitl.autopilot.places import LocalPoint
from sitl.snapshot import Snapshot

NAN = math.nan
DEFAULT_RADIUS_M, DEFAULT_SPEED_M_S = 10.0, 1.0
LEAST_RADIUS_M, MOST_RADIUS_M = 1.0, 1000.0
HARDEST_TURN_M_S2 = 2.0
"""Centripetal acceleration; an orbit that asks for more is flown slower."""
SPEED_UP_M_S2 = 1.0
ON_CIRCLE_M = 0.5


class OrbitOrder(NamedTuple):
    """What DO_ORBIT asks for; NaN leaves it to the autopilot."""

    centre: LocalPoint | None
    """None: where the vehicle is."""
    radius_m: float
    """Negative for counter-clockwise."""
    speed_m_s: float
    z_m: float


class Orbit:
    """Around a centre, at a speed that is built up slowly."""

    def __init__(self, craft: Craft) -> None:
        self._craft = craft
        self._ordered = OrbitOrder(None, NAN, NAN, NAN)
        self._is_new = False
        self._centre = craft.home
        self._radius_m = DEFAULT_RADIUS_M
        self._full_speed_m_s = DEFAULT_SPEED_M_S
        """Along the circle, positive clockwise."""
        self._speed_m_s = 0.0
        self._angle_rad: float | None = None
        """Where on the circle the vehicle shall be, north over east; None while it flies there."""
        self._updated_s = 0.0

    def order(self, order: OrbitOrder) -> None:
        """DO_ORBIT: for when Orbit is flown, now or very soon."""
        self._ordered, self._is_new = order, True

    @property
    def circle(self) -> tuple[LocalPoint, float]:
        """Its centre, and its radius [m], negative for counter-clockwise."""
        return self._centre, math.copysign(self._radius_m, self._full_speed_m_s)

    def start(self, s: Snapshot, now_s: float) -> None:
        self._is_new = True

    def update(self, s: Snapshot, now_s: float) -> bool:
        if s.landed:
            self._craft.control.idle()
        elif self._is_new:
            self._is_new = False
            self._approach(s)
        elif self._angle_rad is None:
            self._join(s)
        else:
            self._circle(self._angle_rad, now_s - self._updated_s)
        self._updated_s = now_s
        return False

    def _approach(self, s: Snapshot) -> None:
        """Fly to the nearest point of the circle."""
        o = self._ordered
        radius_m = o.radius_m if math.isfinite(o.radius_m) and o.radius_m != 0.0 else DEFAULT_RADIUS_M
        speed_m_s = o.speed_m_s if math.isfinite(o.speed_m_s) else DEFAULT_SPEED_M_S
        self._radius_m = min(max(abs(radius_m), LEAST_RADIUS_M), MOST_RADIUS_M)
        most_m_s = min(math.sqrt(HARDEST_TURN_M_S2 * self._radius_m), self._craft.parameters["MPC_XY_VEL_MAX"])
        self._full_speed_m_s = math.copysign(min(abs(speed_m_s), most_m_s), radius_m * speed_m_s)
        centre = o.centre or LocalPoint(s.x_m, s.y_m, s.z_m)
        z_m = o.z_m if math.isfinite(o.z_m) else s.z_m
        self._centre = LocalPoint(centre.x_m, centre.y_m, z_m)
        self._angle_rad, self._speed_m_s = None, 0.0
        start = self._at(math.atan2(s.y_m - centre.y_m, s.x_m - centre.x_m))
        self._craft.control.fly_to(
            start,
            cruise_m_s=self._craft.cruise_m_s,
            acceptance_m=ON_CIRCLE_M,
            yaw_rad=math.atan2(centre.y_m - start.y_m, centre.x_m - start.x_m),
        )

    def _join(self, s: Snapshot) -> None:
        """Begin to circle once the circle is reached."""
        away_m = math.hypot(s.x_m - self._centre.x_m, s.y_m - self._centre.y_m) - self._radius_m
        slow = s.ground_speed_m_s < ON_CIRCLE_M
        if abs(away_m) < ON_CIRCLE_M and abs(s.z_m - self._centre.z_m) < ON_CIRCLE_M and slow:
            self._angle_rad = math.atan2(s.y_m - self._centre.y_m, s.x_m - self._centre.x_m)

    def _circle(self, angle_rad: float, dt_s: float) -> None:
        change = self._full_speed_m_s - self._speed_m_s
        self._speed_m_s += math.copysign(min(abs(change), SPEED_UP_M_S2 * dt_s), change)
        rate_rad_s = self._speed_m_s / self._radius_m
        self._angle_rad = angle_rad = math.remainder(angle_rad + rate_rad_s * dt_s, 2.0 * math.pi)
        cosine, sine = math.cos(angle_rad), math.sin(angle_rad)
        inwards_m_s2 = self._speed_m_s * rate_rad_s
        self._craft.control.track(
            self._at(angle_rad),
            (-sine * self._speed_m_s, cosine * self._speed_m_s, 0.0),
            (-cosine * inwards_m_s2, -sine * inwards_m_s2, 0.0),
            yaw_rad=math.remainder(angle_rad + math.pi, 2.0 * math.pi),
            yawspeed_rad_s=rate_rad_s,
        )

    def _at(self, angle_rad: float) -> LocalPoint:
        """A point of the circle."""
        x_m = self._centre.x_m + self._radius_m * math.cos(angle_rad)
        return LocalPoint(x_m, self._centre.y_m + self._radius_m * math.sin(angle_rad), self._centre.z_m)
