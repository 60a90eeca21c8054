"""Watching one vehicle in flight: what phase it is in, when it has arrived, and when the ground must step in.

Sans-IO: `VehicleMonitor.step` is given the vehicle's state and the time, and returns the mode to be commanded, if any.
The companion's own status is believed while its heartbeat is fresh; without it the autopilot's mode decides.
"""

from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from gcs.dialect import Mode
from gcs.fleet.vehicle_state import LINK_TIMEOUT_S, LandedState, VehicleState
from gcs.flight.route import RouteWatch
from missions.frames import LocalFrame
from missions.mission import OnArrival, Target
from missions.tunnel import CompanionState, Reason

COMPANION_SILENCE_S = 1.5
"""A companion that says nothing for so long, on a link that carries, is taken for dead [s, wall clock]."""

TAKEOVER_GRACE_S = 3.0
"""How long after the start a mode may lag behind the truth: HEARTBEAT shows it up to 1 s late [s]."""

HOLD_AGAIN_S = 1.5
"""Between two orders to hold, to a vehicle whose companion took over after the operator's [s, wall clock]."""

NEWS_S = 2.0
"""A vehicle that is heard again has said within this whether it has landed [s, wall clock]."""

ORDER_AGAIN_S = 2.0
"""After an order of the ground's own was refused or not answered, it is given again as soon as this [s, wall clock]."""

STILL_UP_S = 30.0
"""A vehicle that was landed and holds so long after it has been overruled by somebody's late order [s, wall clock]."""

LOST_S = 300.0
"""Who is not heard for longer than it may fly by so much has come down somewhere [s, vehicle time]."""

UNATTENDED_HOLD_S = 5.0
"""With nobody at the page, an interrupted vehicle holds for so long and is then landed [s]."""

IN_CONTROL = {CompanionState.ENGAGING, CompanionState.FLYING, CompanionState.LANDING}
CLOUD_MODES = {Mode.MISSION, Mode.LAND, Mode.RTL, Mode.TAKEOFF}


class Phase(Enum):
    """Where a vehicle is in its flight."""

    WAITING = "waiting"
    PREPARED = "prepared"
    TAKING_OFF = "taking off"
    HOVERING = "hovering"
    FLYING = "flying"
    INTERRUPTED = "interrupted"
    """Holding, because somebody or something ended the companion's control."""
    COMING_DOWN = "coming down"
    """On the ground's order, away from the target or after an interruption."""
    DONE = "done"

    @property
    def in_flight(self) -> bool:
        return self in {Phase.TAKING_OFF, Phase.HOVERING, Phase.FLYING, Phase.INTERRUPTED, Phase.COMING_DOWN}


CAN_COME_DOWN = {Phase.HOVERING, Phase.FLYING, Phase.INTERRUPTED, Phase.COMING_DOWN}


@dataclass
class VehicleMonitor:
    """One vehicle's flight from the start of its mission on.

    Args:
        target: where it shall arrive.
        on_arrival: what it does there.
        tolerance_m: how near to the target counts as reached.
        endurance_s: longest flight, in vehicle time.
        flown_by_companion: False in cloud mode, where the autopilot flies the mission itself.
        unattended: nobody is there to resume an interrupted flight, so it is ended by landing.
        speed: simulated seconds per wall-clock second.
        route: the targets on the way.
    """

    target: Target
    on_arrival: OnArrival
    tolerance_m: float
    endurance_s: float
    flown_by_companion: bool
    unattended: bool
    frame: LocalFrame
    ground_offset_m: float
    speed: float = 1.0
    route: RouteWatch = field(default_factory=lambda: RouteWatch((), 0.0))
    phase: Phase = Phase.WAITING
    reached: bool = False
    reason: str = ""
    paused_by_operator: bool = False
    offboard_losses: int = 0
    started_s: float = 0.0
    """Vehicle time of the start."""
    _started_wall_s: float = 0.0
    _interrupted_wall_s: float = 0.0
    _hold_again_wall_s: float = 0.0
    _missing_since_s: float | None = None
    _land_again_s: float | None = None
    _was_at_target: bool = False

    def start(self, state: VehicleState, now_s: float) -> None:
        """The mission has been started (or resumed) on this vehicle."""
        if self.phase is not Phase.INTERRUPTED:
            self.started_s = state.vehicle_time_s(now_s, self.speed)
        self.phase, self.reason, self.paused_by_operator = Phase.FLYING, "", False
        self._started_wall_s = now_s

    def pause(self, state: VehicleState, now_s: float) -> None:
        """The operator is about to order the vehicle away from its mission: to hold, or to go somewhere and hold."""
        self.paused_by_operator = True
        self._hold_again_wall_s = now_s + (HOLD_AGAIN_S if state.mode is Mode.OFFBOARD else 0.0)

    def step(self, state: VehicleState, now_s: float) -> Mode | None:
        """Look at the vehicle; the mode that the ground has to command now, or None."""
        if now_s - state.telemetry_s > LINK_TIMEOUT_S:
            self.miss(now_s)
        else:
            self._missing_since_s = None
        if self.phase in CAN_COME_DOWN and self._down(state):
            return self._finish(state)
        match self.phase:
            case Phase.FLYING:
                return self._flying(state, now_s)
            case Phase.INTERRUPTED:
                return self._interrupted(state, now_s)
            case Phase.COMING_DOWN:
                return self._coming_down(state, now_s)
            case _:
                return None

    def miss(self, now_s: float) -> None:
        """It is not heard; after longer than it can fly the flight is over for it."""
        self._missing_since_s = now_s if self._missing_since_s is None else self._missing_since_s
        missing_s = (now_s - self._missing_since_s) * self.speed
        if missing_s > self.endurance_s + LOST_S:
            self.give_up(f"not heard for {missing_s:.0f} s, longer than it can fly")

    def order_failed(self, now_s: float) -> None:
        """The landing that the ground ordered by itself was refused, or not answered."""
        self._land_again_s = now_s + ORDER_AGAIN_S

    def come_down(self, reason: str) -> None:
        """The ground has ordered a landing or a return."""
        self.phase, self.reason = Phase.COMING_DOWN, self.reason or reason

    def give_up(self, reason: str) -> None:
        """The flight is over for this vehicle, wherever it is."""
        self.phase, self.reason = Phase.DONE, self.reason or reason

    def distance_to_target_m(self, state: VehicleState, *, horizontal: bool = False) -> float:
        """Distance [m] from where the vehicle says it is; infinite before it says anything."""
        position_m = state.position_m(self.frame, self.ground_offset_m)
        if position_m is None:
            return np.inf
        axes = 2 if horizontal else 3
        return float(np.linalg.norm((position_m - np.array(self.target.position_m))[:axes]))

    def _flying(self, state: VehicleState, now_s: float) -> Mode | None:
        if self._is_overdue(state, now_s):
            self.come_down(f"not at its target after {self.endurance_s:g} s, its endurance")
            return Mode.LAND
        self._was_at_target = self._was_at_target or self.distance_to_target_m(state) <= self.tolerance_m
        position_m = state.position_m(self.frame, self.ground_offset_m)
        if position_m is not None:
            self.route.see(position_m, state.boot_time_s, state.mission_seq)
        if self._holds_at_target(state):
            self._arrive("holding at its target")
            return None
        return self._companion_flight(state, now_s) if self.flown_by_companion else self._cloud_flight(state, now_s)

    def _is_overdue(self, state: VehicleState, now_s: float) -> bool:
        """It flies longer than it may, as it says itself: of one that was not heard for long nobody knows that."""
        heard = now_s - state.telemetry_s < LINK_TIMEOUT_S and now_s - state.link_since_s > NEWS_S
        return heard and state.vehicle_time_s(now_s, self.speed) - self.started_s > self.endurance_s

    def _companion_flight(self, state: VehicleState, now_s: float) -> Mode | None:
        if state.companion_silence_s(now_s) > COMPANION_SILENCE_S:
            self._interrupt("the companion fell silent", now_s)
            return Mode.HOLD if state.mode is Mode.OFFBOARD else None
        if self.paused_by_operator and state.mode is Mode.OFFBOARD:
            return self._hold_again(now_s)
        if now_s - self._started_wall_s < TAKEOVER_GRACE_S:
            return None
        status = state.companion.status
        if status is not None and status.state not in IN_CONTROL | {CompanionState.HOLDING, CompanionState.FINISHED}:
            self._interrupt(f"the companion is {describe(status.state, status.reason)}", now_s)
        return None

    def _hold_again(self, now_s: float) -> Mode | None:
        """A companion that is about to take over does not see the operator's Hold: the vehicle was holding before."""
        if now_s < self._hold_again_wall_s:
            return None
        self._hold_again_wall_s = now_s + HOLD_AGAIN_S
        return Mode.HOLD

    def _cloud_flight(self, state: VehicleState, now_s: float) -> Mode | None:
        if now_s - self._started_wall_s > TAKEOVER_GRACE_S and state.mode not in CLOUD_MODES:
            self._interrupt(f"the autopilot left its mission for {state.mode.name}", now_s)
        return None

    def _interrupt(self, reason: str, now_s: float) -> None:
        self.phase, self._interrupted_wall_s = Phase.INTERRUPTED, now_s
        self.reason = "paused by the operator" if self.paused_by_operator else reason
        if not self.paused_by_operator:
            self.offboard_losses += 1

    def _interrupted(self, state: VehicleState, now_s: float) -> Mode | None:
        status = state.companion.status
        alive = now_s - state.companion.heard_s < COMPANION_SILENCE_S
        if alive and status is not None and status.state in IN_CONTROL:
            self.phase, self.reason, self.paused_by_operator = Phase.FLYING, "", False
            return None  # a heartbeat was late, or another station resumed the flight
        overdue = now_s - self._interrupted_wall_s > UNATTENDED_HOLD_S
        if self.unattended and overdue and state.mode in {Mode.HOLD, Mode.OFFBOARD}:  # never against a pilot's mode
            self.phase = Phase.COMING_DOWN
            return Mode.LAND
        return None

    def _coming_down(self, state: VehicleState, now_s: float) -> Mode | None:
        """A landing that was not carried out is ordered again, once it is heard; never against a pilot's mode."""
        if self._land_again_s is None and self.unattended:
            self._land_again_s = now_s + STILL_UP_S
        if self._land_again_s is None or now_s < self._land_again_s or now_s - state.telemetry_s > LINK_TIMEOUT_S:
            return None
        self._land_again_s = None
        return Mode.LAND if state.mode in {Mode.HOLD, Mode.OFFBOARD, Mode.MISSION} else None

    def _holds_at_target(self, state: VehicleState) -> bool:
        if self.on_arrival is not OnArrival.HOLD or self.distance_to_target_m(state) > self.tolerance_m:
            return False
        if state.mode is not Mode.HOLD or not self.flown_by_companion:
            return state.mode is Mode.HOLD
        status = state.companion.status
        return status is not None and (status.state, status.reason) == (CompanionState.HOLDING, Reason.TARGET_REACHED)

    def _down(self, state: VehicleState) -> bool:
        return state.landed is LandedState.ON_GROUND and not state.armed

    def _finish(self, state: VehicleState) -> None:
        missed_m = self.distance_to_target_m(state, horizontal=True)
        at_home = self.on_arrival is OnArrival.RTL and self._was_at_target
        if self.phase is Phase.FLYING and (missed_m <= self.tolerance_m or at_home):
            self._arrive("landed at its target")
            return
        if self.phase is Phase.FLYING:
            self.reason = f"landed {missed_m:.1f} m from its target"
        if self.phase is Phase.HOVERING:
            self.reason = "landed before its mission began"
        self.phase, self.reason = Phase.DONE, self.reason or "landed"

    def _arrive(self, how: str) -> None:
        """It is at its last target; it has reached its goal if it came to all those on the way, too."""
        missed = self.route.missed
        self.phase, self.reached = Phase.DONE, not missed
        self.reason = how if not missed else f"{how}, but never came to {', '.join(missed)}"


def describe(state: CompanionState, reason: Reason) -> str:
    """A companion's state in words."""
    words = state.name.lower()
    return words if reason is Reason.NONE else f"{words} ({reason.name.lower().replace('_', ' ')})"
