"""Flies what the commander has decided: one flight mode at a time, and the orders that pilots give to them."""

import math
from collections.abc import Callable

from missions.mission_items import MissionItem
from sitl.autopilot.craft import Craft
from sitl.autopilot.flight_modes import Descend, FlightMode, Hold, Land, Return, Takeoff
from sitl.autopilot.follow import Follow
from sitl.autopilot.geofence import Geofence
from sitl.autopilot.mission_flight import MissionFlight, Outcome
from sitl.autopilot.modes import Mode
from sitl.autopilot.offboard import Offboard
from sitl.autopilot.orbit import Orbit, OrbitOrder
from sitl.autopilot.places import LocalPoint
from sitl.autopilot.plan import PLACES, Cmd, Plan, latitude_deg, longitude_deg
from sitl.autopilot.reports import Severity
from sitl.autopilot.stick_flight import AcroSticks, AltitudeSticks, PositionSticks, StabilizedSticks
from sitl.autopilot.sticks import Sticks
from sitl.dynamics.state import Guidance
from sitl.snapshot import Snapshot


class Navigator:
    """The flight modes of one vehicle."""

    def __init__(
        self, craft: Craft, offboard: Offboard, sticks: Sticks, fence: Geofence, on_reached: Callable[[int], None]
    ) -> None:
        self._craft = craft
        self._offboard = offboard
        self._fence = fence
        self._takeoff = Takeoff(craft)
        self._hold = Hold(craft)
        self.orbit = Orbit(craft)
        self.follow = Follow(craft)
        self.mission = MissionFlight(craft, on_reached)
        self._modes: dict[Mode, FlightMode] = {
            Mode.TAKEOFF: self._takeoff,
            Mode.HOLD: self._hold,
            Mode.ORBIT: self.orbit,
            Mode.FOLLOW: self.follow,
            Mode.LAND: Land(craft),
            Mode.RTL: Return(craft),
            Mode.POSITION: PositionSticks(craft, sticks),
            Mode.POSITION_SLOW: PositionSticks(craft, sticks, speed="MC_SLOW_DEF_HVEL", turn="MC_SLOW_DEF_YAWR"),
            Mode.ALTITUDE: AltitudeSticks(craft, sticks),
            Mode.STABILIZED: StabilizedSticks(craft, sticks),
            Mode.MANUAL: StabilizedSticks(craft, sticks),
            Mode.ACRO: AcroSticks(craft, sticks),
        }
        self._descend = Descend(craft)
        self._sticks = sticks
        self._flown: Mode | None = None
        self._flying: FlightMode | None = None

    # ----------------------------------------------------------------- orders
    def order_takeoff(self, altitude_amsl_m: float, yaw_rad: float) -> None:
        """NAV_TAKEOFF: for the next time that Takeoff begins."""
        self._takeoff.order(altitude_amsl_m, yaw_rad)

    def order_orbit(self, order: OrbitOrder) -> None:
        """DO_ORBIT: for when Orbit is flown, now or very soon."""
        self.orbit.order(order)

    def reposition(self, target: LocalPoint, yaw_rad: float, s: Snapshot, now_s: float) -> None:
        """DO_REPOSITION: for Hold, now or very soon; a NaN coordinate keeps what there is, all NaN is a pause."""
        if all(math.isnan(coordinate) for coordinate in target):
            target = self._craft.stop_point(s)
        finite = LocalPoint(*(c if math.isfinite(c) else here for c, here in zip(target, s, strict=False)))
        if self._fence.allows(finite):
            self._hold.order(target, yaw_rad, now_s)
        else:
            self._craft.say(Severity.CRITICAL, "Reposition is outside geofence")

    def set_mission(self, plan: Plan) -> None:
        self.mission.set_plan(plan)

    def mission_problem(self) -> str | None:
        """Why the stored mission cannot be flown; an empty string for one that is not there."""
        items = self.mission.plan.items
        if not items:
            return ""
        outside = self._fence.first_outside(items)
        if outside is not None:
            return f"Geofence violation for waypoint {outside + 1}"
        first = next((item for item in items if item.command in PLACES), None)
        if first is not None and self._is_too_far(first):
            return "First waypoint too far away"
        if all(item.command in (Cmd.DO_CHANGE_SPEED, Cmd.DO_JUMP) for item in items):
            return "Mission has nothing to fly"
        return None

    def _is_too_far(self, first: MissionItem) -> bool:
        """Farther from home than MIS_DIST_1WP; 0 is no limit."""
        craft = self._craft
        place = craft.frame.local(latitude_deg(first), longitude_deg(first), 0.0)
        away_m = math.hypot(place.x_m - craft.home.x_m, place.y_m - craft.home.y_m)
        return 0.0 < craft.parameters["MIS_DIST_1WP"] < away_m

    # ------------------------------------------------------------------- tick
    def stop(self) -> None:
        """Disarmed or terminated: the motors stand."""
        self._leave()
        self._craft.control.motors_off()

    def update(self, mode: Mode, s: Snapshot, now_s: float) -> Mode | None:
        """Fly a mode for one tick; returns the mode that follows when it has come to its end."""
        following = self._fly(mode, s, now_s)
        point, control = self._craft.region_of_interest, self._craft.control
        if point is not None and control.guidance is Guidance.WAYPOINT:
            control.turn_to(math.atan2(point.y_m - s.y_m, point.x_m - s.x_m))
        return following

    def _fly(self, mode: Mode, s: Snapshot, now_s: float) -> Mode | None:
        entering = mode is not self._flown
        if entering:
            self._leave()
            self._flown = mode
        if mode is Mode.OFFBOARD:
            self._offboard.apply(self._craft.control, entering=entering)
            return None
        if mode is Mode.MISSION:
            return self._fly_mission(s, now_s, entering)
        flight_mode = self._modes[mode]
        if mode.value.needs_sticks and not self._sticks.is_alive(now_s):
            flight_mode = self._descend
        if entering or flight_mode is not self._flying:
            self._flying = flight_mode
            flight_mode.start(s, now_s)
        if not flight_mode.update(s, now_s):
            return None
        self._hold_at(self._takeoff.target, now_s)  # no other mode comes to an end
        return Mode.HOLD

    def land_detected(self) -> None:
        self.mission.land_detected()

    def _fly_mission(self, s: Snapshot, now_s: float, entering: bool) -> Mode | None:
        if entering:
            self.mission.start(s, now_s)
        outcome = self.mission.update(s, now_s)
        if outcome is Outcome.RETURN:
            self._craft.say(Severity.INFO, "Returning to launch")
            return Mode.RTL
        if outcome is Outcome.FINISHED:
            self._hold_at(self.mission.target, now_s)
            return Mode.HOLD
        return None

    def _hold_at(self, target: LocalPoint | None, now_s: float) -> None:
        """Hold, which follows, shall stay where the mode before has come to."""
        if target is not None:
            self._hold.order(target, math.nan, now_s)

    def _leave(self) -> None:
        if self._flown is Mode.MISSION:
            self.mission.stop()
        self._flown = None
