"""Follow mode: keep a distance and a side to somebody who says where it is (FOLLOW_TARGET), nose to it."""

import math
from typing import NamedTuple

from sitl.autopilot.craft import Craft
from sitl.autopilot.places import LocalPoint
from sitl.snapshot import Snapshot

WALKING_M_S = 0.5
"""A target that is slower than this has no course; the last one counts."""
LEAST_DISTANCE_M = 1.0
TRACKS_ALTITUDE = 2
"""FLW_TGT_ALT_M: as high above the target, not above home."""


class Target(NamedTuple):
    """What somebody has said of itself."""

    point: LocalPoint
    velocity_m_s: tuple[float, float]
    """North, east."""
    time_s: float


class Follow:
    """Beside a target; where the vehicle comes to a stop without one, or when it is silent for COM_OBC_LOSS_T."""

    def __init__(self, craft: Craft) -> None:
        self._craft = craft
        self._target: Target | None = None
        self._side_rad: float | None = None
        """From the target to the vehicle's place, north over east; None until it is known."""
        self._stop: LocalPoint | None = None
        self._updated_s = 0.0

    def receive(self, point: LocalPoint, velocity_m_s: tuple[float, float], now_s: float) -> None:
        """FOLLOW_TARGET: the target is here; FLW_TGT_RS smooths its velocity."""
        if self._target is not None:
            old, share = self._target.velocity_m_s, self._craft.parameters["FLW_TGT_RS"]
            north, east = (share * o + (1.0 - share) * n for o, n in zip(old, velocity_m_s, strict=True))
            velocity_m_s = north, east
        self._target = Target(point, velocity_m_s, now_s)

    def start(self, s: Snapshot, now_s: float) -> None:
        self._side_rad, self._stop, self._updated_s = None, None, now_s

    def update(self, s: Snapshot, now_s: float) -> bool:
        dt_s, self._updated_s = now_s - self._updated_s, now_s
        target = self._target
        if s.landed:
            self._craft.control.idle()
        elif target is None or now_s - target.time_s > self._craft.parameters["COM_OBC_LOSS_T"]:
            self._wait(s)
        else:
            self._stop = None
            self._go(target, s, now_s, dt_s)
        return False

    def _wait(self, s: Snapshot) -> None:
        if self._stop is None:
            self._stop = self._craft.stop_point(s)
            self._fly(self._stop)

    def _go(self, target: Target, s: Snapshot, now_s: float, dt_s: float) -> None:
        """To the place beside the target; led by as far as a follower lags behind a point that moves."""
        p = self._craft.parameters
        north, east = target.velocity_m_s
        age_s = now_s - target.time_s
        x_m, y_m = target.point.x_m + north * age_s, target.point.y_m + east * age_s
        distance_m = max(p["FLW_TGT_DST"], LEAST_DISTANCE_M)
        side_rad = self._side(target, math.atan2(s.y_m - y_m, s.x_m - x_m), distance_m, dt_s)
        lead_s = 1.0 / p["MPC_XY_TRAJ_P"]
        below = target.point if p["FLW_TGT_ALT_M"] == TRACKS_ALTITUDE else self._craft.home
        place = LocalPoint(
            x_m + distance_m * math.cos(side_rad) + north * lead_s,
            y_m + distance_m * math.sin(side_rad) + east * lead_s,
            below.z_m - p["FLW_TGT_HT"],
        )
        self._fly(place)
        self._craft.control.turn_to(math.atan2(y_m - s.y_m, x_m - s.x_m))

    def _side(self, target: Target, here_rad: float, distance_m: float, dt_s: float) -> float:
        """FLW_TGT_FA clockwise from the target's course, taken up at FLW_TGT_MAX_VEL along the circle."""
        p, (north, east) = self._craft.parameters, target.velocity_m_s
        if self._side_rad is None:
            self._side_rad = here_rad
        if math.hypot(north, east) > WALKING_M_S:
            wanted_rad = math.atan2(east, north) + math.radians(p["FLW_TGT_FA"])
            change = math.remainder(wanted_rad - self._side_rad, 2.0 * math.pi)
            most = p["FLW_TGT_MAX_VEL"] / distance_m * dt_s
            self._side_rad += min(max(change, -most), most)
        return self._side_rad

    def _fly(self, place: LocalPoint) -> None:
        p = self._craft.parameters
        self._craft.control.fly_to(place, cruise_m_s=p["MPC_XY_VEL_MAX"], acceptance_m=p["NAV_ACC_RAD"])
