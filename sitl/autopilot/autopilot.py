"""One vehicle's autopilot: everything that decides, put together; no MAVLink frames."""

from collections.abc import Callable

from sitl.autopilot.battery import Battery
from sitl.autopilot.commander import BatteryWarning, Commander, Situation
from sitl.autopilot.craft import Craft
from sitl.autopilot.failure_detector import FailureDetector
from sitl.autopilot.flight_control import FlightControl
from sitl.autopilot.geofence import Geofence
from sitl.autopilot.memory import Memory
from sitl.autopilot.modes import Mode
from sitl.autopilot.navigator import Navigator
from sitl.autopilot.offboard import Offboard
from sitl.autopilot.parameter_table import Parameter
from sitl.autopilot.parameters import Parameters
from sitl.autopilot.places import LocalPoint, OwnFrame
from sitl.autopilot.plan import Plan, altitude_amsl_m, latitude_deg, longitude_deg
from sitl.autopilot.reports import Result, Say, Severity
from sitl.autopilot.sticks import Sticks
from sitl.snapshot import Snapshot, is_broken

FENCE_CHECK_S = 0.2
BATTERY_TEXTS = {
    BatteryWarning.LOW: "Low battery",
    BatteryWarning.CRITICAL: "Critical battery",
    BatteryWarning.EMERGENCY: "Emergency battery level",
}
HOME_SET_S = 0.5
"""Home is set when the estimator has settled, this long after boot."""


class Autopilot:
    """Commander, navigator and what they need.

    Args:
        control: the way to the vehicle's control.
        frame: its own NED frame.
        table: its parameters.
        speed: simulated seconds per wall-clock second; the loss timeouts grow with it.
        say: where texts for the pilot go.
        on_reached: called with the sequence number of every mission item that has been reached.
        memory: what it has kept from before this boot, and keeps from now on.
    """

    def __init__(
        self,
        control: FlightControl,
        frame: OwnFrame,
        table: tuple[Parameter, ...],
        speed: float,
        say: Say,
        on_reached: Callable[[int], None],
        memory: Memory,
    ) -> None:
        self.parameters = Parameters(table, speed, control.set_gain, memory.parameters)
        self.craft = Craft(control, self.parameters, frame, say, home=LocalPoint(0.0, 0.0, 0.0))
        self.battery = Battery(self.parameters, memory.charge)
        self.commander = Commander(self.parameters, say)
        self.failure_detector = FailureDetector(self.parameters)
        self.offboard = Offboard(self.parameters, say)
        self.sticks = Sticks(self.parameters)
        self.fence = Geofence(self.craft)
        self.navigator = Navigator(self.craft, self.offboard, self.sticks, self.fence, on_reached)
        self.rally = Plan()
        self.reboot_ordered = False
        self.home_known = False
        self.gcs_lost = True
        """Kept up to date by whoever hears the ground station."""
        self._memory = memory
        self._say = say
        self._snapshot: Snapshot | None = None
        self._now_s = 0.0
        self._mission_problem: str | None = ""
        self._fence_breached = False
        self._fence_inside = True
        self._next_fence_s = 0.0
        self._battery_said = BatteryWarning.NONE
        self._reckoned_s = 0.0
        self._was_landed = True
        self._was_armed = False

    # ------------------------------------------------------------------ state
    @property
    def snapshot(self) -> Snapshot:
        """The last view of the vehicle."""
        assert self._snapshot is not None  # nobody asks before the first tick
        return self._snapshot

    @property
    def now_s(self) -> float:
        return self._now_s

    @property
    def armed(self) -> bool:
        return self.commander.armed

    @property
    def mode(self) -> Mode:
        return self.commander.mode

    @property
    def mission_ready(self) -> bool:
        return self._mission_problem is None

    # --------------------------------------------------------------- requests
    def situation(self, *, sticks_moved: bool = False) -> Situation:
        s = self.snapshot
        return Situation(
            landed=bool(s.landed),
            offboard_alive=self.offboard.is_alive(self._now_s)
            and (self.craft.position_valid or not self.offboard.needs_position),
            mission_ready=self.mission_ready,
            gcs_lost=self.gcs_lost,
            battery=self.battery.warning,
            fence_breached=self._fence_breached,
            crashed=is_broken(s),
            at_rest=bool(s.grounded),
            position_valid=self.craft.position_valid,
            attitude_failed=self.failure_detector.attitude_failed,
            sticks_alive=self.sticks.is_alive(self._now_s),
            sticks_moved=sticks_moved,
            throttle=self.sticks.throttle,
        )

    def refresh(self) -> Commander:
        """The commander, up to date with what has come in since the last tick."""
        self.commander.observe(self.situation(), self._now_s)
        return self.commander

    def arm(self, *, forced: bool = False) -> Result:
        return self.refresh().arm("external command", forced=forced)

    def disarm(self, *, forced: bool = False) -> Result:
        return self.refresh().disarm("external command", forced=forced)

    def request_mode(self, mode: Mode) -> Result:
        return self.refresh().request_mode(mode)

    def set_mission(self, plan: Plan) -> None:
        """Store a mission; whether it can be flown is found out at once, and said."""
        self._memory.mission = plan
        craft, item = self.craft, plan.landing
        craft.mission_landing = None
        if item is not None:
            altitude_m = altitude_amsl_m(item, craft.home_altitude_m)
            craft.mission_landing = craft.frame.local(latitude_deg(item), longitude_deg(item), altitude_m)
        self.navigator.set_mission(plan)
        self._check_mission()

    def set_fence(self, plan: Plan) -> None:
        """Store a fence; one that the vehicle is outside of is not enforced until it has been inside."""
        self._memory.fence = plan
        self.fence.set_plan(plan)
        s = self.snapshot
        self._fence_inside = self.fence.zones_allow(LocalPoint(s.x_m, s.y_m, s.z_m))
        if not self._fence_inside:
            self._say(Severity.CRITICAL, "Geofence invalid, doesn't contain current vehicle position")
        self._check_mission()

    def set_rally(self, plan: Plan) -> None:
        self._memory.rally = self.rally = plan
        craft = self.craft
        self.craft.rally_points = tuple(
            craft.frame.local(latitude_deg(i), longitude_deg(i), altitude_amsl_m(i, craft.home_altitude_m))
            for i in plan.items
        )

    def remember(self) -> None:
        """After boot: take up the plans that have been stored before it."""
        if self._memory.fence.items:
            self.set_fence(self._memory.fence)
        if self._memory.mission.items:
            self.set_mission(self._memory.mission)
        self.set_rally(self._memory.rally)

    def set_home(self, point: LocalPoint | None = None) -> None:
        """Home is here, or at a point."""
        s = self.snapshot
        self.craft.set_home(point or LocalPoint(s.x_m, s.y_m, s.z_m), s.yaw_rad, self._now_s)
        self.home_known = True

    # ------------------------------------------------------------------- tick
    def tick(self, s: Snapshot, now_s: float, dt_s: float) -> None:
        """Let the autopilot look at its vehicle and decide what the control does next."""
        self._snapshot, self._now_s = s, now_s
        self._drain(dt_s)
        self._reckon(s, dt_s)
        self.failure_detector.update(s, dt_s)
        if now_s >= self._next_fence_s:
            self._next_fence_s = now_s + FENCE_CHECK_S
            self._check_fence(s)
        self._announce_landing(bool(s.landed))
        self.commander.observe(self.situation(sticks_moved=self.sticks.take_movement()), now_s)
        self.commander.update()
        if not self.home_known and now_s >= HOME_SET_S:
            self.set_home()
        self._fly(s, now_s)

    def _fly(self, s: Snapshot, now_s: float) -> None:
        commander = self.commander
        if commander.armed and not self._was_armed:  # home is where the vehicle stands
            self.set_home()
            self.craft.speed_override_m_s = None
        self._was_armed = commander.armed
        if not commander.armed or commander.mode is Mode.TERMINATION:
            self.navigator.stop()
        else:
            following = self.navigator.update(commander.mode, s, now_s)
            if following is not None:
                commander.mode_finished(commander.mode, following)

    def _reckon(self, s: Snapshot, dt_s: float) -> None:
        """Without a source of its position a vehicle knows for EKF2_NOAID_TOUT longer where it is."""
        self._reckoned_s = self._reckoned_s + dt_s if s.dead_reckoning else 0.0
        self.craft.position_valid = self._reckoned_s <= 1e-6 * self.parameters["EKF2_NOAID_TOUT"]

    def _drain(self, dt_s: float) -> None:
        """Let the battery run, and say how empty it has become."""
        self.battery.update(self.commander.armed, dt_s)
        warning = self.battery.warning
        if warning.value > self._battery_said.value:
            self._say(Severity.EMERGENCY, BATTERY_TEXTS[warning])
        self._battery_said = warning

    def _announce_landing(self, landed: bool) -> None:
        landed = landed or not self.commander.armed
        if self.commander.mode is Mode.TERMINATION:
            return
        if self._was_landed and not landed:
            self._say(Severity.INFO, "Takeoff detected")
        elif landed and not self._was_landed and self.commander.armed:
            self._say(Severity.INFO, "Landing detected")
            self.navigator.land_detected()
        self._was_landed = landed

    def _check_mission(self) -> None:
        self._mission_problem = self.navigator.mission_problem()
        if self._mission_problem:
            self._say(Severity.CRITICAL, self._mission_problem)

    def _check_fence(self, s: Snapshot) -> None:
        if not self.craft.position_valid:
            return
        here = LocalPoint(s.x_m, s.y_m, s.z_m)
        allowed = self.fence.allows(here)
        self._fence_inside = self._fence_inside or self.fence.zones_allow(here)
        breached = self._fence_inside and not allowed and self.parameters["GF_ACTION"] > 0
        if breached and not self._fence_breached:
            self._say(Severity.CRITICAL, "Geofence violation: approaching or outside geofence")
        self._fence_breached = breached
