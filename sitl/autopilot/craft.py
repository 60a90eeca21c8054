"""What every flight mode needs of its vehicle: the controls, the parameters, where home is, and a voice."""

import math
from dataclasses import dataclass

from sitl.autopilot.flight_control import FlightControl
from sitl.autopilot.parameters import Parameters
from sitl.autopilot.places import LocalPoint, OwnFrame
from sitl.autopilot.reports import Say
from sitl.snapshot import Snapshot

BRAKE_DELAY_SHARE = 0.6
"""A brake takes this share of a second, at full jerk, to build up."""


@dataclass
class Craft:
    """One vehicle, as its flight modes see it."""

    control: FlightControl
    parameters: Parameters
    frame: OwnFrame
    say: Say
    home: LocalPoint
    home_yaw_rad: float = 0.0
    home_set_s: float = 0.0
    speed_override_m_s: float | None = None
    """Cruise speed ordered by DO_CHANGE_SPEED."""
    position_valid: bool = True
    """Whether the vehicle knows where it is."""
    rally_points: tuple[LocalPoint, ...] = ()
    mission_landing: LocalPoint | None = None
    """Where the mission's own landing is, if it has one to return to."""
    region_of_interest: LocalPoint | None = None
    """Where auto modes turn the nose to."""

    @property
    def cruise_m_s(self) -> float:
        """Horizontal speed of auto modes."""
        if self.speed_override_m_s is None:
            return self.parameters["MPC_XY_CRUISE"]
        return min(self.speed_override_m_s, self.parameters["MPC_XY_VEL_MAX"])

    @property
    def home_altitude_m(self) -> float:
        """AMSL, as this autopilot sees it."""
        return self.frame.origin.altitude_m - self.home.z_m

    def change_speed(self, speed_m_s: float) -> None:
        """DO_CHANGE_SPEED: positive values count, others are taken without effect."""
        if speed_m_s > 0.0:
            self.speed_override_m_s = speed_m_s
            self.control.set_cruise(self.cruise_m_s)

    def set_home(self, point: LocalPoint, yaw_rad: float, now_s: float) -> None:
        self.home, self.home_yaw_rad, self.home_set_s = point, yaw_rad, now_s
        self.control.set_ground(point.z_m)

    def look_at(self, point: LocalPoint | None) -> None:
        """Turn the nose to a point in auto modes, or along the way again."""
        if point is None and self.region_of_interest is not None:
            self.control.turn_to(math.nan)
        self.region_of_interest = point

    def stop_point(self, s: Snapshot) -> LocalPoint:
        """Where the vehicle comes to a stop if it brakes now."""
        speed = s.ground_speed_m_s
        if speed < 1e-3:
            return LocalPoint(s.x_m, s.y_m, s.z_m)
        travel_s = speed / (2.0 * self.parameters["MPC_ACC_HOR"]) + BRAKE_DELAY_SHARE
        return LocalPoint(s.x_m + s.vx_m_s * travel_s, s.y_m + s.vy_m_s * travel_s, s.z_m)


def distance_m(s: Snapshot, point: LocalPoint) -> float:
    """Horizontal distance of a vehicle to a point."""
    return math.hypot(point.x_m - s.x_m, point.y_m - s.y_m)


def is_there(craft: Craft, s: Snapshot, point: LocalPoint, acceptance_m: float) -> bool:
    """Whether a waypoint counts as reached."""
    near = distance_m(s, point) <= acceptance_m
    return near and abs(point.z_m - s.z_m) <= craft.parameters["NAV_MC_ALT_RAD"]
