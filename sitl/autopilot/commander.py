"""Arming, modes and failsafes: which mode is flown, and whether the motors may turn.

The *intended* mode is what the pilot (or the end of a take-off) has chosen. The mode that is flown differs from it only
while a failsafe acts.
"""

from enum import Enum
from typing import NamedTuple

from sitl.autopilot.failsafe import MODE_OF_ACTION, Action, Cause, Failsafes
from sitl.autopilot.modes import Mode
from sitl.autopilot.parameters import Parameters
from sitl.autopilot.reports import Result, Say, Severity
from sitl.autopilot.sticks import HIGH_THROTTLE, RAISED_THROTTLE

BOOT_S = 0.6
"""After this long the estimator has settled and the pre-arm checks may pass."""
LOCKDOWN_S = 5.0
"""A terminated flight is disarmed after this long."""


STICKS_AFTER_OFFBOARD = {1: Mode.ALTITUDE, 2: Mode.STABILIZED}
"""COM_OBL_RC_ACT: what a pilot with sticks flies when Offboard is lost; Position otherwise."""


STICKS_EXCEPTED = {Mode.MISSION: 1, Mode.HOLD: 2, Mode.TAKEOFF: 2, Mode.OFFBOARD: 4}
"""Mode -> its bit in COM_RCL_EXCEPT."""


class BatteryWarning(Enum):
    """How empty the battery is."""

    NONE = 0
    LOW = 1
    CRITICAL = 2
    EMERGENCY = 3


class Situation(NamedTuple):
    """What the commander judges by."""

    landed: bool = True
    offboard_alive: bool = False
    mission_ready: bool = False
    gcs_lost: bool = True
    battery: BatteryWarning = BatteryWarning.NONE
    fence_breached: bool = False
    crashed: bool = False
    at_rest: bool = True
    """It stands on something."""
    position_valid: bool = True
    attitude_failed: bool = False
    sticks_alive: bool = False
    sticks_moved: bool = False
    throttle: float = -1.0
    """In [-1, 1]."""


class SystemStatus(Enum):
    """MAV_STATE, as PX4 fills it in."""

    UNINITIALISED = 0
    STANDBY = 3
    ACTIVE = 4
    CRITICAL = 5
    TERMINATED = 8


class Commander:
    """The state of one vehicle between its pilot and its motors."""

    def __init__(self, parameters: Parameters, say: Say) -> None:
        self._parameters = parameters
        self._say = say
        self._failsafes = Failsafes(parameters)
        self._situation = Situation()
        self._now_s = 0.0
        self._mode_after_disarm = Mode.HOLD
        self._landed_since_s: float | None = None
        self._flown_since_arming = False
        self._sticks_expected = False
        """Whether there have been sticks since arming: who arms without does not miss them."""
        self._terminated_s: float | None = None
        self.intended = Mode.HOLD
        self.armed = False
        self.armed_s: float | None = None
        """When this or the last flight was armed for."""
        self.airborne_s: float | None = None
        """When it left the ground."""
        self.n_armed = 0
        """How often, since boot."""

    # ------------------------------------------------------------------ state
    @property
    def mode(self) -> Mode:
        """The mode that is flown."""
        if self._terminated_s is not None:
            return Mode.TERMINATION
        action = self._failsafes.action
        if action <= Action.WARN:
            return self._without_position(self.intended)
        mode = MODE_OF_ACTION.get(action, self.intended)
        if action is Action.DESCEND and self._situation.sticks_alive:
            mode = STICKS_AFTER_OFFBOARD.get(int(self._parameters["COM_OBL_RC_ACT"]), mode)
        return mode if self._situation.position_valid or not mode.value.needs_position else Mode.LAND

    @property
    def failsafe(self) -> Action:
        return self._failsafes.action

    @property
    def ready(self) -> bool:
        """Whether the selected mode may be armed."""
        s = self._situation
        intact = self._terminated_s is None and not s.crashed
        charged = s.battery.value < BatteryWarning.CRITICAL.value
        return (
            self._booted and intact and charged and not s.fence_breached and self._may_run(self.intended, arming=True)
        )

    @property
    def system_status(self) -> SystemStatus:
        if self._terminated_s is not None:
            return SystemStatus.TERMINATED
        if self.armed:
            return SystemStatus.CRITICAL if self._failsafes.action > Action.WARN else SystemStatus.ACTIVE
        return SystemStatus.STANDBY if self.ready else SystemStatus.UNINITIALISED

    @property
    def _booted(self) -> bool:
        return self._now_s >= BOOT_S

    def observe(self, situation: Situation, now_s: float) -> None:
        """Take note of the situation; requests are judged by the last one."""
        self._situation, self._now_s = situation, now_s

    # --------------------------------------------------------------- requests
    def arm(self, reason: str, *, forced: bool = False) -> Result:
        """Arm if the checks pass; `forced` arms without them."""
        if self.armed:
            return Result.ACCEPTED
        lost_gcs = self._parameters["NAV_DLL_ACT"] > 0 and self._situation.gcs_lost
        if self._terminated_s is not None or (not forced and (not self.ready or lost_gcs)):
            self._say(Severity.CRITICAL, "Arming denied: Resolve system health failures first")
            return Result.TEMPORARILY_REJECTED
        if not forced and self._throttle_is_up():
            self._say(Severity.CRITICAL, "Arming denied: high throttle")
            return Result.TEMPORARILY_REJECTED
        self.armed = True
        self.armed_s, self.airborne_s = self._now_s, None
        self.n_armed += 1
        self._flown_since_arming, self._landed_since_s = False, None
        self._sticks_expected = False
        self._failsafes.clear()
        self._say(Severity.INFO, f"Armed by {reason}")
        return Result.ACCEPTED

    def disarm(self, reason: str, *, forced: bool = False) -> Result:
        """Stop the motors: on the ground, or `forced` anywhere."""
        if not self.armed:
            return Result.ACCEPTED
        if not self._situation.landed and not forced:
            self._say(Severity.CRITICAL, "Disarming denied: not landed")
            return Result.TEMPORARILY_REJECTED
        self.armed = False
        self._failsafes.clear()
        self.intended = self._mode_after_disarm
        self._say(Severity.INFO, f"Disarmed by {reason}")
        return Result.ACCEPTED

    def request_mode(self, mode: Mode) -> Result:
        """Change the intended mode, as a pilot does."""
        if self._terminated_s is not None:
            return Result.TEMPORARILY_REJECTED
        if self.armed and not self._may_run(mode):
            self._say(Severity.CRITICAL, f"Switching to {mode.label} is currently not available")
            return Result.TEMPORARILY_REJECTED
        self._failsafes.mode_changed()
        self._intend(mode)
        return Result.ACCEPTED

    def start_mission(self) -> Result:
        """Fly the mission, and arm for it if need be."""
        if not self._situation.mission_ready:
            self._say(Severity.CRITICAL, "Mission start denied! No valid mission")
            return Result.DENIED
        result = self.request_mode(Mode.MISSION)
        return self.arm("mission start") if result is Result.ACCEPTED else result

    def terminate(self) -> Result:
        """End the flight where it is; who is not armed has none."""
        if not self.armed:
            return Result.DENIED
        self._terminated_s = self._now_s
        return Result.ACCEPTED

    def mode_finished(self, mode: Mode, following: Mode) -> None:
        """The navigator has come to the end of a mode, which turns into another."""
        if self.intended is mode:
            self._intend(following)

    # ------------------------------------------------------------------- tick
    def update(self) -> None:
        """Let time pass: failsafes, automatic disarming."""
        if not self.armed:
            return
        if self._terminated_s is not None:
            if self._now_s - self._terminated_s >= LOCKDOWN_S:
                self.disarm("lockdown", forced=True)
            return
        self._let_pilot_take_over()
        self._update_failsafes()
        if self._situation.crashed and self._situation.at_rest:
            self.disarm("failure detector", forced=True)
        elif self._situation.landed:
            self._disarm_when_landed()
        else:
            self._fly_on()

    def _fly_on(self) -> None:
        """In the air: an attitude that fails right after take-off stops the motors."""
        if not self._flown_since_arming:
            self.airborne_s = self._now_s
        self._flown_since_arming, self._landed_since_s = True, None
        airborne_s = self._now_s - (self.airborne_s or 0.0)
        if self._situation.attitude_failed and airborne_s < self._parameters["COM_LKDOWN_TKO"]:
            self.disarm("lockdown", forced=True)

    def _let_pilot_take_over(self) -> None:
        """Sticks that move end an auto mode (COM_RC_OVERRIDE bit 0) or Offboard (bit 1)."""
        s, allowed = self._situation, int(self._parameters["COM_RC_OVERRIDE"])
        if not s.sticks_alive or not s.sticks_moved:
            return
        if (allowed & 1 and self.mode.is_auto) or (allowed & 2 and self.mode is Mode.OFFBOARD):
            self._say(Severity.INFO, "Pilot took over using sticks")
            self._failsafes.mode_changed()
            self._intend(Mode.POSITION if s.position_valid else Mode.ALTITUDE)

    def _misses_sticks(self) -> bool:
        """Whether a pilot's sticks are gone, where COM_RCL_EXCEPT does not do without them."""
        if self._situation.sticks_alive:
            self._sticks_expected = True
        if self._situation.sticks_alive or not self._sticks_expected:
            return False
        excepted = int(self._parameters["COM_RCL_EXCEPT"]) & STICKS_EXCEPTED.get(self.intended, 0)
        return not excepted and self.intended is not Mode.LAND

    def _throttle_is_up(self) -> bool:
        """Whether the motors would spin up, or the vehicle climb, as soon as it is armed."""
        s, mode = self._situation, self.intended
        if not s.sticks_alive or not mode.value.needs_sticks:
            return False
        by_thrust = mode in (Mode.MANUAL, Mode.STABILIZED, Mode.ACRO)
        return s.throttle > (HIGH_THROTTLE if by_thrust else RAISED_THROTTLE)

    def _update_failsafes(self) -> None:
        s = self._situation
        failing = {
            Cause.OFFBOARD_LOST: self.intended is Mode.OFFBOARD and not s.offboard_alive,
            Cause.GCS_LOST: s.gcs_lost and self.intended is not Mode.LAND and self._parameters["NAV_DLL_ACT"] > 0,
            Cause.BATTERY_LOW: s.battery is BatteryWarning.LOW,
            Cause.BATTERY_CRITICAL: s.battery is BatteryWarning.CRITICAL,
            Cause.BATTERY_EMERGENCY: s.battery is BatteryWarning.EMERGENCY,
            Cause.GEOFENCE: s.fence_breached and not s.landed,
            Cause.POSITION_LOST: not s.position_valid and self._without_position(self.intended).value.needs_position,
            Cause.STICKS_LOST: self._misses_sticks(),
            Cause.ATTITUDE_FAILED: s.attitude_failed and self.intended is not Mode.ACRO,
        }
        worse = self._failsafes.update(failing, self._now_s, in_haste=self.intended.value.needs_sticks)
        if worse and self._failsafes.delayed > Action.NONE:
            text = f"Failsafe activated: entering Hold for {self._failsafes.delay_s:.0f} seconds"
            self._say(Severity.CRITICAL, text)
        elif worse:
            self._say(Severity.CRITICAL, "Failsafe activated")
        if self._failsafes.action is Action.DISARM:
            self.disarm("failsafe", forced=True)
        elif self._failsafes.action is Action.TERMINATE:
            self._terminated_s = self._now_s

    def _disarm_when_landed(self) -> None:
        """COM_DISARM_LAND after a flight, COM_DISARM_PRFLT when it never took off; not positive: never."""
        if self._landed_since_s is None:
            self._landed_since_s = self._now_s
        name = "COM_DISARM_LAND" if self._flown_since_arming else "COM_DISARM_PRFLT"
        limit_s = self._parameters[name]
        if limit_s > 0.0 and self._now_s - self._landed_since_s >= limit_s:
            self.disarm("landing" if self._flown_since_arming else "auto preflight disarming")

    # ---------------------------------------------------------------- details
    def _intend(self, mode: Mode) -> None:
        self.intended = mode
        if mode.value.allows_arming:
            self._mode_after_disarm = mode

    def _without_position(self, mode: Mode) -> Mode:
        """A pilot who flies by position goes on by altitude where that gets lost."""
        s = self._situation
        if s.position_valid or not s.sticks_alive:
            return mode
        return Mode.ALTITUDE if mode in (Mode.POSITION, Mode.POSITION_SLOW) else mode

    def _may_run(self, mode: Mode, *, arming: bool = False) -> bool:
        """Whether what the mode needs is there."""
        if arming and not mode.value.allows_arming:
            return False
        if mode.value.needs_position and not self._situation.position_valid:
            return False
        if mode is Mode.OFFBOARD:
            return self._situation.offboard_alive
        if mode is Mode.MISSION:
            return self._situation.mission_ready
        return self._situation.sticks_alive or not mode.value.needs_sticks
