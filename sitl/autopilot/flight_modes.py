"""The flight modes apart from Mission and Offboard: Takeoff, Hold, Land, Return.

Each is started when it begins and updated at every tick; `update` returns whether it has come to its end.
"""

import math
from enum import Enum, auto
from typing import Protocol

from sitl.autopilot.craft import Craft, distance_m, is_there
from sitl.autopilot.places import LocalPoint
from sitl.autopilot.reports import Severity
from sitl.snapshot import Snapshot

NAN = math.nan
ORDER_KEPT_S = 0.5
"""An order to Hold waits this long for the mode to begin."""


class FlightMode(Protocol):
    """What the navigator asks of a mode."""

    def start(self, s: Snapshot, now_s: float) -> None: ...

    def update(self, s: Snapshot, now_s: float) -> bool: ...


class Takeoff:
    """Climb to an altitude above where the vehicle stands."""

    def __init__(self, craft: Craft) -> None:
        self._craft = craft
        self._ordered_amsl_m: float | None = None
        self._ordered_yaw_rad = NAN
        self._target: LocalPoint | None = None

    @property
    def target(self) -> LocalPoint | None:
        return self._target

    def order(self, altitude_amsl_m: float, yaw_rad: float) -> None:
        """NAV_TAKEOFF: how high the next take-off goes; NaN is MIS_TAKEOFF_ALT above home."""
        self._ordered_amsl_m = altitude_amsl_m if math.isfinite(altitude_amsl_m) else None
        self._ordered_yaw_rad = yaw_rad if math.isfinite(yaw_rad) else NAN

    def start(self, s: Snapshot, now_s: float) -> None:
        craft = self._craft
        if self._ordered_amsl_m is None:
            height_m = craft.parameters["MIS_TAKEOFF_ALT"]
            craft.say(Severity.INFO, f"Using default takeoff altitude: {height_m:.2f} m")
            z_m = craft.home.z_m - height_m
        else:
            z_m = craft.frame.origin.altitude_m - self._ordered_amsl_m
        if z_m > s.z_m:
            craft.say(Severity.CRITICAL, "Already higher than takeoff altitude")
            z_m = s.z_m
        self._target = LocalPoint(s.x_m, s.y_m, z_m)
        yaw_rad = s.yaw_rad if math.isnan(self._ordered_yaw_rad) else self._ordered_yaw_rad
        craft.control.fly_to(
            self._target,
            cruise_m_s=craft.cruise_m_s,
            acceptance_m=craft.parameters["NAV_ACC_RAD"],
            yaw_rad=yaw_rad,
            taking_off=True,
        )
        self._ordered_amsl_m, self._ordered_yaw_rad = None, NAN

    def update(self, s: Snapshot, now_s: float) -> bool:
        assert self._target is not None  # start() comes before update()
        return not s.landed and is_there(self._craft, s, self._target, self._craft.parameters["NAV_ACC_RAD"])


class Hold:
    """Stay where the vehicle comes to a stop, or where it is sent."""

    def __init__(self, craft: Craft) -> None:
        self._craft = craft
        self._on_ground = False
        self._target: LocalPoint | None = None
        self._yaw_rad = NAN
        self._ordered: LocalPoint | None = None
        self._ordered_until_s = -math.inf

    def order(self, target: LocalPoint, yaw_rad: float, now_s: float) -> None:
        """Where to hold, for when Hold is or soon begins; a NaN coordinate keeps what there is."""
        self._ordered, self._yaw_rad = target, yaw_rad
        self._ordered_until_s = now_s + ORDER_KEPT_S

    def start(self, s: Snapshot, now_s: float) -> None:
        self._on_ground = bool(s.landed)
        if now_s > self._ordered_until_s:
            self._ordered, self._yaw_rad = None, NAN
        if self._on_ground:
            self._craft.control.idle()
        elif self._ordered is None:
            self._fly(self._craft.stop_point(s))

    def update(self, s: Snapshot, now_s: float) -> bool:
        if self._ordered is not None:
            kept = self._target if self._target is not None and not self._on_ground else self._craft.stop_point(s)
            pairs = zip(self._ordered, kept, strict=True)
            self._fly(LocalPoint(*(there if math.isfinite(there) else here for there, here in pairs)))
            self._ordered, self._on_ground = None, False
        return False

    def _fly(self, target: LocalPoint) -> None:
        self._target = target
        self._craft.control.fly_to(
            target,
            cruise_m_s=self._craft.cruise_m_s,
            acceptance_m=self._craft.parameters["NAV_ACC_RAD"],
            yaw_rad=self._yaw_rad,
        )


class Land:
    """Descend where the vehicle comes to a stop; level, and wherever it drifts, while it does not know where it is."""

    def __init__(self, craft: Craft) -> None:
        self._craft = craft
        self._blind = False

    def start(self, s: Snapshot, now_s: float) -> None:
        self._blind = not self._craft.position_valid
        if s.landed:
            self._craft.control.idle()
        elif self._blind:
            speed_m_s = self._craft.parameters["MPC_LAND_SPEED"]
            self._craft.control.track((NAN, NAN, NAN), (NAN, NAN, speed_m_s), (0.0, 0.0, NAN))
        else:
            stop = self._craft.stop_point(s)
            self._craft.control.land_at(stop.x_m, stop.y_m, cruise_m_s=self._craft.cruise_m_s)

    def update(self, s: Snapshot, now_s: float) -> bool:
        if self._blind is self._craft.position_valid:
            self.start(s, now_s)
        return False


class Descend:
    """What is left of a mode with sticks when they are gone: stop, and sink at the landing speed."""

    def __init__(self, craft: Craft) -> None:
        self._craft = craft

    def start(self, s: Snapshot, now_s: float) -> None:
        if s.landed:
            self._craft.control.idle()
            return
        sink = (0.0, 0.0, self._craft.parameters["MPC_LAND_SPEED"])
        self._craft.control.track((NAN, NAN, NAN), sink, (NAN, NAN, NAN))

    def update(self, s: Snapshot, now_s: float) -> bool:
        return False


class _ReturnStage(Enum):
    GROUND = auto()
    CLIMB = auto()
    RETURN = auto()
    DESCEND = auto()
    WAIT = auto()
    LAND = auto()


class Return:
    """Climb to a safe height, fly home or to the nearest rally point, and land there."""

    def __init__(self, craft: Craft) -> None:
        self._craft = craft
        self._stage = _ReturnStage.GROUND
        self._target = self._destination = craft.home
        self._yaw_rad = NAN
        self._wait_until_s = math.inf

    def start(self, s: Snapshot, now_s: float) -> None:
        if s.landed:
            self._stage = _ReturnStage.GROUND
            self._craft.control.idle()
            return
        self._choose_destination(s)
        z_m = self._return_z_m(s)
        above_m = round(self._destination.z_m - z_m)
        altitude_m = round(self._craft.frame.origin.altitude_m - z_m)
        text = f"RTL: start return at {altitude_m} m ({above_m} m above destination)"
        self._craft.say(Severity.INFO, text)
        self._stage = _ReturnStage.CLIMB
        stop = self._craft.stop_point(s)
        self._fly(LocalPoint(stop.x_m, stop.y_m, z_m), s.yaw_rad)

    def update(self, s: Snapshot, now_s: float) -> bool:
        if self._stage in (_ReturnStage.GROUND, _ReturnStage.LAND):
            return False
        if self._stage is _ReturnStage.WAIT:
            if now_s >= self._wait_until_s:
                self._land()
        elif is_there(self._craft, s, self._target, self._craft.parameters["NAV_ACC_RAD"]):
            self._go_on(s, now_s)
        return False

    def _choose_destination(self, s: Snapshot) -> None:
        """What is nearest of the places that RTL_TYPE allows; home if there are none."""
        craft = self._craft
        home, rally = (craft.home,), craft.rally_points
        landing = () if craft.mission_landing is None else (craft.mission_landing,)
        allowed = {0: home + rally, 1: rally + landing, 2: landing, 3: home + rally + landing}
        places = allowed[int(craft.parameters["RTL_TYPE"])] or home
        self._destination = min(places, key=lambda place: distance_m(s, place))
        self._yaw_rad = craft.home_yaw_rad if self._destination is craft.home else NAN

    def _go_on(self, s: Snapshot, now_s: float) -> None:
        there, delay_s = self._destination, self._craft.parameters["RTL_LAND_DELAY"]
        if self._stage is _ReturnStage.CLIMB:
            self._stage = _ReturnStage.RETURN
            near = distance_m(s, there) < self._craft.parameters["RTL_MIN_DIST"]
            yaw_rad = self._yaw_rad if near else NAN
            self._fly(LocalPoint(there.x_m, there.y_m, self._target.z_m), yaw_rad)
        elif self._stage is _ReturnStage.RETURN and delay_s != 0.0:
            self._stage = _ReturnStage.DESCEND
            z_m = max(there.z_m - self._craft.parameters["RTL_DESCEND_ALT"], self._target.z_m)
            self._fly(LocalPoint(there.x_m, there.y_m, z_m), self._yaw_rad)
        elif self._stage is _ReturnStage.DESCEND:
            self._stage = _ReturnStage.WAIT
            self._wait_until_s = now_s + delay_s if delay_s > 0.0 else math.inf
            if delay_s < 0.0:
                self._craft.say(Severity.INFO, "RTL: completed, loitering")
        else:
            self._land()

    def _land(self) -> None:
        self._stage = _ReturnStage.LAND
        craft, there = self._craft, self._destination
        craft.say(Severity.INFO, "RTL: land at destination")
        craft.control.land_at(there.x_m, there.y_m, cruise_m_s=craft.cruise_m_s, yaw_rad=self._yaw_rad)

    def _fly(self, target: LocalPoint, yaw_rad: float) -> None:
        self._target = target
        self._craft.control.fly_to(
            target,
            cruise_m_s=self._craft.cruise_m_s,
            acceptance_m=self._craft.parameters["NAV_ACC_RAD"],
            yaw_rad=yaw_rad,
        )

    def _return_z_m(self, s: Snapshot) -> float:
        """How high to fly there: RTL_RETURN_ALT, or on the cone above it when near; never down."""
        p, there = self._craft.parameters, self._destination
        away_m = distance_m(s, there)
        highest_m = p["RTL_RETURN_ALT"]
        if away_m <= p["NAV_ACC_RAD"]:
            height_m = 2.0 * away_m
        elif away_m <= p["RTL_MIN_DIST"]:
            half_angle_rad = math.radians(min(max(p["RTL_CONE_ANG"], 1.0), 89.0))
            height_m = max(min(away_m / math.tan(half_angle_rad), highest_m), 2.0 * p["NAV_ACC_RAD"])
        else:
            height_m = highest_m
        return min(there.z_m - min(height_m, highest_m), s.z_m)
