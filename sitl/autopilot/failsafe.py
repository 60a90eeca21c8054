"""Failsafes: what has failed, what is done about it, and when that ends.

As in PX4: the most severe action of all failures is taken. Return and Land wait in Hold for COM_FAIL_ACT_T first, where
a pilot could still react. Some actions last until the mode is changed or the vehicle disarmed.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum

from sitl.autopilot.modes import Mode
from sitl.autopilot.parameters import Parameters


class Cause(IntEnum):
    """What can fail."""

    OFFBOARD_LOST = 0
    GCS_LOST = 1
    BATTERY_LOW = 2
    BATTERY_CRITICAL = 3
    BATTERY_EMERGENCY = 4
    GEOFENCE = 5
    POSITION_LOST = 6
    ATTITUDE_FAILED = 7
    STICKS_LOST = 8


class Action(IntEnum):
    """What can be done, the worse the later."""

    NONE = 0
    WARN = 1
    DESCEND = 2
    HOLD = 3
    RTL = 4
    LAND = 5
    LAND_BLIND = 6
    """Sink level; what is left to who does not know where it is."""
    DISARM = 7
    TERMINATE = 8


MODE_OF_ACTION = {
    Action.DESCEND: Mode.POSITION,
    Action.HOLD: Mode.HOLD,
    Action.RTL: Mode.RTL,
    Action.LAND: Mode.LAND,
    Action.LAND_BLIND: Mode.LAND,
    Action.TERMINATE: Mode.TERMINATION,
}
"""The mode that is shown while an action is taken. Position has no sticks here, so it descends."""

_OFFBOARD_LOSS = {
    3: Action.RTL,
    4: Action.LAND,
    5: Action.HOLD,
    6: Action.TERMINATE,
    7: Action.DISARM,
}
"""COM_OBL_RC_ACT; the others fall back to modes with sticks."""
_GCS_LOSS = {
    1: Action.HOLD,
    2: Action.RTL,
    3: Action.LAND,
    5: Action.TERMINATE,
    6: Action.DISARM,
}
"""NAV_DLL_ACT; NAV_RCL_ACT has the same values."""
_GEOFENCE = {
    1: Action.WARN,
    2: Action.HOLD,
    3: Action.RTL,
    4: Action.TERMINATE,
    5: Action.LAND,
}
"""GF_ACTION."""
HASTY_DELAY_S = 1.0
_LATCHED = {Action.RTL, Action.LAND, Action.TERMINATE}
_DELAYED = {Cause.GCS_LOST, Cause.STICKS_LOST, Cause.BATTERY_CRITICAL, Cause.BATTERY_EMERGENCY}


@dataclass
class _Active:
    action: Action
    latched: bool
    failing: bool = True
    overruled: bool = False
    """The pilot has chosen another mode since."""


class Failsafes:
    """The failures of one vehicle, and the action that they call for."""

    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters
        self._active: dict[Cause, _Active] = {}
        self._delay_until_s: float | None = None
        self.delay_s = 0.0
        """How long Return and Land wait in Hold."""
        self.action = Action.NONE
        """What is being done now."""
        self.delayed = Action.NONE
        """What will be done when the delay in Hold is over."""

    def clear(self) -> None:
        """Forget everything: armed or disarmed."""
        self._active.clear()
        self._delay_until_s = None
        self.action = self.delayed = Action.NONE

    def mode_changed(self) -> None:
        """The pilot has chosen a mode: what has been done so far ends; a new failure counts again."""
        self._active = {cause: active for cause, active in self._active.items() if active.failing}
        for active in self._active.values():
            active.overruled = True

    def update(self, failing: Mapping[Cause, bool], now_s: float, *, in_haste: bool = False) -> bool:
        """Take in what fails; returns whether something worse is done than before.

        Args:
            failing: what fails now.
            now_s: simulated time.
            in_haste: the delay is short, because the pilot's mode cannot be flown any more.
        """
        self.delay_s = HASTY_DELAY_S if in_haste else self._parameters["COM_FAIL_ACT_T"]
        if not self._active and not any(failing.values()):
            self.action = self.delayed = Action.NONE
            return False
        for cause, fails in failing.items():
            self._update_cause(cause, fails)
        wanted = max((a.action for a in self._active.values() if not a.overruled), default=Action.NONE)
        before = self.action
        self.action, self.delayed = self._after_delay(wanted, now_s)
        return self.action > before and self.action > Action.NONE

    def _update_cause(self, cause: Cause, fails: bool) -> None:
        active = self._active.get(cause)
        if fails and active is None:
            action = self._action(cause)
            latched = (action in _LATCHED and cause is not Cause.OFFBOARD_LOST) or cause is Cause.GEOFENCE
            self._active[cause] = _Active(action, latched)
        elif fails and active is not None:
            active.failing = True
        elif active is not None:
            active.failing = False
            if active.overruled or not active.latched:
                del self._active[cause]

    def _after_delay(self, wanted: Action, now_s: float) -> tuple[Action, Action]:
        """The action for now, and the one that waits behind it."""
        causes = {cause for cause, a in self._active.items() if a.action == wanted and not a.overruled}
        if wanted not in (Action.RTL, Action.LAND) or not causes <= _DELAYED or self.action == wanted:
            self._delay_until_s = None
            return wanted, Action.NONE
        if self._delay_until_s is None:
            self._delay_until_s = now_s + self.delay_s
        if now_s < self._delay_until_s:
            return Action.HOLD, wanted
        return wanted, Action.NONE

    def _action(self, cause: Cause) -> Action:
        match cause:
            case Cause.OFFBOARD_LOST:
                return _OFFBOARD_LOSS.get(int(self._parameters["COM_OBL_RC_ACT"]), Action.DESCEND)
            case Cause.GCS_LOST:
                return _GCS_LOSS.get(int(self._parameters["NAV_DLL_ACT"]), Action.NONE)
            case Cause.STICKS_LOST:
                return _GCS_LOSS.get(int(self._parameters["NAV_RCL_ACT"]), Action.NONE)
            case Cause.POSITION_LOST:
                return Action.LAND_BLIND
            case Cause.ATTITUDE_FAILED:
                return Action.TERMINATE if self._parameters["CBRK_FLIGHTTERM"] == 0 else Action.WARN
            case Cause.GEOFENCE:
                return _GEOFENCE.get(int(self._parameters["GF_ACTION"]), Action.NONE)
            case Cause.BATTERY_LOW | Cause.BATTERY_CRITICAL | Cause.BATTERY_EMERGENCY:
                return self._battery_action(cause)

    def _battery_action(self, cause: Cause) -> Action:
        """COM_LOW_BAT_ACT: 0 warning, 2 land, 3 return when critical and land when it is an emergency."""
        setting = int(self._parameters["COM_LOW_BAT_ACT"])
        if cause is Cause.BATTERY_LOW:
            return Action.WARN
        if setting == 2 or (setting == 3 and cause is Cause.BATTERY_EMERGENCY):
            return Action.LAND
        return Action.RTL if setting == 3 else Action.WARN
