"""Mission mode: the items of a plan, one after the other.

Items that name a place are flown to; DO items take effect in passing. A plan that is swapped in flight begins at its
item 0, without a stop.
"""

import math
from collections.abc import Callable
from enum import Enum, auto

from missions.mission_items import MissionItem
from sitl.autopilot.craft import Craft, distance_m, is_there
from sitl.autopilot.places import HIGHEST_M, LocalPoint
from sitl.autopilot.plan import (
    PLACES,
    TAKEOFF_AND_LANDING,
    Cmd,
    Plan,
    acceptance_m,
    altitude_amsl_m,
    has_place,
    hold_s,
    latitude_deg,
    longitude_deg,
)
from sitl.autopilot.reports import Severity
from sitl.dynamics.rotation import wrap_pi
from sitl.snapshot import Snapshot

NAN = math.nan


class Outcome(Enum):
    """What becomes of a mission in one tick."""

    GOING_ON = auto()
    FINISHED = auto()
    """Come to its end in the air."""
    RETURN = auto()
    """Its item is RETURN_TO_LAUNCH, a mode of its own."""


class MissionFlight:
    """Progress through one mission.

    Args:
        craft: the vehicle.
        on_reached: called with the sequence number of every item that has been reached.
    """

    def __init__(self, craft: Craft, on_reached: Callable[[int], None]) -> None:
        self._craft = craft
        self._on_reached = on_reached
        self.plan = Plan()
        self.current = 0
        self._jumps_left: dict[int, int] = {}
        self._active = False
        self._begun = False
        """Whether the current item has been ordered."""
        self._climbing_to: LocalPoint | None = None
        self._target: LocalPoint | None = None
        self._landing = False
        self._arrived_s: float | None = None
        self._finished = False

    # ------------------------------------------------------------------- plan
    @property
    def target(self) -> LocalPoint | None:
        """What was flown to last."""
        return self._target

    def set_plan(self, plan: Plan) -> None:
        """Take a new plan; it begins at item 0, at once if a mission is being flown."""
        self.plan = plan
        self._jumps_left = {}
        self._craft.speed_override_m_s = None
        self._go_to(0)

    def set_current(self, seq: int) -> bool:
        """Continue at another item; False if there is none of this number."""
        if not 0 <= seq < len(self.plan.items):
            return False
        self._go_to(seq)
        return True

    # ------------------------------------------------------------------- mode
    def start(self, s: Snapshot, now_s: float) -> None:
        self._active = True
        if self._finished and s.landed:
            self._go_to(0)
        self._craft.say(Severity.INFO, "Executing Mission")
        first = self.plan.items[self.current] if self.plan.items else None
        if first is not None and (s.landed or first.command == Cmd.NAV_TAKEOFF) and first.command != Cmd.NAV_LAND:
            self._climb(first, s)
        self._begun = False

    def stop(self) -> None:
        """Another mode has begun."""
        self._active = False
        self._climbing_to = None

    def update(self, s: Snapshot, now_s: float) -> Outcome:
        """Fly on."""
        if not self.plan.items:
            self._craft.say(Severity.CRITICAL, "No valid mission available, loitering")
            return Outcome.FINISHED
        if self._climbing_to is not None:
            if s.landed or not is_there(self._craft, s, self._climbing_to, math.inf):
                return Outcome.GOING_ON
            self._climbing_to = None
        if self._finished:
            return Outcome.GOING_ON if self._landing else Outcome.FINISHED
        if self.plan.items[self.current].command == Cmd.NAV_RETURN_TO_LAUNCH:
            return Outcome.RETURN
        if not self._begun:
            self._begin(s)
        if self._is_done(s, now_s):
            self._complete()
        return Outcome.GOING_ON

    def land_detected(self) -> None:
        """The vehicle has landed: the end of a LAND item."""
        if self._active and self._landing and not self._finished:
            self._on_reached(self.current)
            self._finished = True
            self._craft.say(Severity.INFO, "Mission finished, landed")

    # ---------------------------------------------------------------- details
    def _go_to(self, seq: int) -> None:
        self.current = seq
        self._begun = self._finished = self._landing = False
        self._climbing_to = self._arrived_s = None

    def _climb(self, item: MissionItem, s: Snapshot) -> None:
        """Go straight up first: to the item's height, from the ground at least to MIS_TAKEOFF_ALT."""
        craft = self._craft
        z_m = craft.home.z_m - (craft.parameters["MIS_TAKEOFF_ALT"] if s.landed else 0.0)
        if item.command in PLACES or item.command == Cmd.NAV_TAKEOFF:
            z_m = min(z_m, craft.frame.origin.altitude_m - altitude_amsl_m(item, craft.home_altitude_m))
        craft.say(Severity.INFO, f"Climb to {craft.home.z_m - z_m:.1f} meters above home")
        self._climbing_to = LocalPoint(s.x_m, s.y_m, z_m)
        craft.control.fly_to(
            self._climbing_to,
            cruise_m_s=craft.cruise_m_s,
            acceptance_m=craft.parameters["NAV_ACC_RAD"],
            yaw_rad=s.yaw_rad,
            taking_off=True,
        )

    def _begin(self, s: Snapshot) -> None:
        """Order the current item."""
        item = self.plan.items[self.current]
        self._begun, self._arrived_s, self._landing = True, None, False
        craft = self._craft
        match item.command:
            case Cmd.NAV_LAND:
                self._fly(item, s, keep_height=True)
            case (
                Cmd.NAV_TAKEOFF | Cmd.NAV_WAYPOINT | Cmd.NAV_LOITER_UNLIM | Cmd.NAV_LOITER_TIME | Cmd.NAV_LOITER_TO_ALT
            ):
                self._fly(item, s)
            case Cmd.DO_CHANGE_SPEED:
                craft.change_speed(item.param2)
            case Cmd.DO_SET_ROI_LOCATION | Cmd.DO_SET_ROI:
                craft.look_at(self._place(item, s) if has_place(item) else None)
            case Cmd.DO_SET_ROI_NONE:
                craft.look_at(None)
            case Cmd.DO_SET_HOME if abs(item.z) <= HIGHEST_M:
                place = self._place(item, s)
                craft.set_home(LocalPoint(place.x_m, place.y_m, place.z_m), craft.home_yaw_rad, craft.home_set_s)
            case _:
                pass

    def _fly(self, item: MissionItem, s: Snapshot, *, keep_height: bool = False) -> None:
        craft = self._craft
        place = self._place(item, s)
        if keep_height:
            place = place._replace(z_m=s.z_m)
        previous, self._target = self._target, place
        craft.control.fly_to(
            place,
            previous=previous,
            onwards=self._onwards(item, s),
            cruise_m_s=craft.cruise_m_s,
            acceptance_m=acceptance_m(item, craft.parameters["NAV_ACC_RAD"]),
            yaw_rad=_yaw(item),
        )

    def _is_done(self, s: Snapshot, now_s: float) -> bool:
        item = self.plan.items[self.current]
        if item.command == Cmd.NAV_LAND:
            self._land_when_there(item, s)
            return False
        if item.command in PLACES or item.command == Cmd.NAV_TAKEOFF:
            assert self._target is not None  # _begin() has set it
            there = is_there(self._craft, s, self._target, acceptance_m(item, self._craft.parameters["NAV_ACC_RAD"]))
            if not there and self._arrived_s is None:
                return False
            if self._arrived_s is None and not self._is_aligned(item, s):
                return False
        if self._arrived_s is None:
            self._arrived_s = now_s
        return now_s - self._arrived_s >= hold_s(item)

    def _is_aligned(self, item: MissionItem, s: Snapshot) -> bool:
        """Whether an ordered heading is taken."""
        yaw_rad = _yaw(item)
        limit_rad = math.radians(self._craft.parameters["MIS_YAW_ERR"])
        return math.isnan(yaw_rad) or abs(wrap_pi(yaw_rad - s.yaw_rad)) <= limit_rad

    def _land_when_there(self, item: MissionItem, s: Snapshot) -> None:
        """A landing first flies to its place at the height that it has."""
        assert self._target is not None  # _begin() has set it
        if self._landing or distance_m(s, self._target) > self._craft.parameters["NAV_ACC_RAD"]:
            return
        self._landing = True
        self._craft.control.land_at(
            self._target.x_m, self._target.y_m, cruise_m_s=self._craft.cruise_m_s, yaw_rad=_yaw(item)
        )

    def _complete(self) -> None:
        """The current item has been reached: go on to the next, or end."""
        self._on_reached(self.current)
        following = self._after(self.current)
        if following is None:
            self._finished = True
            self._craft.say(Severity.INFO, "Mission finished, loitering")
        else:
            finished_jumps = self._jumps_left
            self._go_to(following)
            self._jumps_left = finished_jumps

    def _after(self, seq: int) -> int | None:
        """The item that follows, jumps taken; None at the end."""
        item = self.plan.items[seq]
        if item.command == Cmd.DO_JUMP:
            left = self._jumps_left.get(seq, int(item.param2))
            if left != 0 and 0 <= item.param1 < len(self.plan.items):
                self._jumps_left[seq] = left - 1
                return int(item.param1)
        return seq + 1 if seq + 1 < len(self.plan.items) else None

    def _onwards(self, item: MissionItem, s: Snapshot) -> LocalPoint | None:
        """The place after the current one, if the vehicle flies through without a stop."""
        if item.command != Cmd.NAV_WAYPOINT or hold_s(item) > 0.0:
            return None
        for following in self.plan.items[self.current + 1 :]:
            if following.command in PLACES and has_place(following):
                return self._place(following, s)
            if following.command != Cmd.DO_CHANGE_SPEED:
                return None
        return None

    def _place(self, item: MissionItem, s: Snapshot) -> LocalPoint:
        """Where an item is, in the autopilot's frame; here, where it does not say."""
        craft = self._craft
        altitude_m = altitude_amsl_m(item, craft.home_altitude_m)
        anywhere = item.command in TAKEOFF_AND_LANDING and item.x == 0 and item.y == 0
        if not has_place(item) or anywhere:
            return LocalPoint(s.x_m, s.y_m, craft.frame.origin.altitude_m - altitude_m)
        return craft.frame.local(latitude_deg(item), longitude_deg(item), altitude_m)


def _yaw(item: MissionItem) -> float:
    """An item's heading [rad], NaN where it has none."""
    ordered = item.command in PLACES or item.command in (Cmd.NAV_LAND, Cmd.NAV_TAKEOFF)
    return math.radians(item.param4) if ordered and math.isfinite(item.param4) else NAN
