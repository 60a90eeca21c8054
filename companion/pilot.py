"""The pilot: a state machine that flies one vehicle. Events in, instructions out; no clock, no socket, no thread.

Its states are those of `missions.tunnel.CompanionState`; docs/companion.md has their table and drawing. Three rules
stand above all others: nothing is streamed before MISSION_START; a mode that the pilot did not ask for ends its
control; whatever ends a flight early leaves the vehicle in a mode that was chosen on purpose.
"""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from companion import events, instructions
from companion.briefing import Briefing
from companion.crew import Crew
from companion.engagement import Engagement
from companion.events import Event, FlightMode
from companion.fleet.exchange import Exchange
from companion.flight import Flight
from companion.instructions import CommandResult, Instruction
from companion.planner.planner import Plan, Planner
from companion.settings import CompanionSettings
from companion.start_answer import Situation, answer
from companion.states import RESTING, UNDER_WAY, State, assert_possible
from companion.status import StatusDesk
from companion.utc_clock import UtcClock
from companion.vehicle_clock import REBOOT_S
from missions.mission import Mission, OnArrival
from missions.tunnel import Reason

ARRIVAL_MODES = {OnArrival.LAND: FlightMode.LAND, OnArrival.HOLD: FlightMode.HOLD, OnArrival.RTL: FlightMode.RTL}


class Pilot:
    """Flies one vehicle of a mission.

    Args:
        mission: with its final origin.
        settings: of this companion.
        planner: for its guide, its braking and its checks; plans themselves are asked for by instruction.
        exchange: with the other vehicles; without one it flies alone.
    """

    def __init__(
        self, mission: Mission, settings: CompanionSettings, planner: Planner, exchange: Exchange | None = None
    ) -> None:
        self.state, self.reason = State.CONNECTING, Reason.NONE
        self.done = False
        """The program may end."""
        self._mission = mission
        self._desk = StatusDesk(mission.digest, settings.pilot.status_interval_s)
        self._settings = settings.pilot
        exchange = exchange or Exchange(settings.vehicle, mission)
        self._crew = Crew(mission, planner, settings.pilot, settings.speed, exchange)
        self.figures = self._crew.figures
        self.briefing = Briefing(mission, mission.vehicle(settings.vehicle), settings.mode)
        self._connected = False
        self._odometry: events.Odometry | None = None
        self._mode = FlightMode.OTHER
        self._armed, self._on_ground = False, True
        self._utc = UtcClock()
        self._engagement: Engagement | None = None
        self._flight: Flight | None = None
        self._leaving: FlightMode | None = None  # the mode that has been commanded to end the flight
        self._commanded_at_s = self._released_at_s = self._download_at_s = -np.inf
        self._stopping = self._downloading = False
        self._flown_plan_id = self._track_index = 0
        self._handlers: dict[type, Callable[[Any, float], Iterator[Instruction]]] = {
            events.AutopilotFound: self._on_found,
            events.AutopilotLost: self._on_lost,
            events.Odometry: self._on_odometry,
            events.OriginReported: self._on_origin,
            events.HomeReported: self._on_home,
            events.ModeReported: self._on_mode,
            events.ArmingReported: self._on_arming,
            events.LandedReported: self._on_landed,
            events.UtcReported: self._on_utc,
            events.MissionReported: self._on_mission_reported,
            events.MissionDownloaded: self._on_mission_downloaded,
            events.StartCommanded: self._on_start,
            events.ModeCommandEnded: self._on_mode_command_ended,
            events.PlanReady: self._on_plan,
            events.StopRequested: self._on_stop,
            events.Tick: self._on_tick,
        }

    @property
    def in_control(self) -> bool:
        """Setpoints are being streamed."""
        return self._flight is not None or (self._engagement is not None and self._engagement.plan is not None)

    @property
    def tick_s(self) -> float:
        """How soon it wants the next Tick."""
        return self._settings.resting_tick_s if self.state in RESTING else self._settings.tick_s

    def handle(self, event: Event, now_s: float) -> list[Instruction]:
        """Take in one event at vehicle time `now_s`; what is to be done about it, in order."""
        return [*self._handlers[type(event)](event, now_s), *self._report(now_s)]

    def fail(self, now_s: float) -> list[Instruction]:
        """The program has failed: nothing more comes from this pilot but its last state."""
        self._enter(State.FAILED, Reason.INTERNAL_ERROR)
        return self._report(now_s)

    def _report(self, now_s: float) -> list[Instruction]:
        """The status, if it is due."""
        plan_id = self._flight.order.plan_id if self._flight is not None else self.briefing.plan_id
        status = self._desk.write(self.state, self.reason, plan_id, self._track_index, self.figures, now_s)
        return [] if status is None else [instructions.SendStatus(status)]

    # ------------------------------------------------------------- the autopilot

    def _on_found(self, _: events.AutopilotFound, now_s: float) -> Iterator[Instruction]:
        self._connected = True
        yield instructions.Note("autopilot found")
        self._settle()

    def _on_lost(self, _: events.AutopilotLost, now_s: float) -> Iterator[Instruction]:
        yield instructions.Note("autopilot lost", {"in_control": self.in_control})
        yield from self._end_control()
        self.briefing.forget()
        self._connected, self._odometry, self._mode = False, None, FlightMode.OTHER
        self._enter(State.CONNECTING, Reason.AUTOPILOT_LOST)

    def _on_odometry(self, odometry: events.Odometry, now_s: float) -> Iterator[Instruction]:
        if self._odometry is not None and odometry.time_s < self._odometry.time_s - REBOOT_S:
            yield from self._on_lost(events.AutopilotLost(), now_s)
            yield from self._on_found(events.AutopilotFound(), now_s)
        first, self._odometry = self._odometry is None, odometry
        if self._flight is not None:
            self._flight.observe(odometry)
        if first:
            self._settle()

    def _on_origin(self, event: events.OriginReported, now_s: float) -> Iterator[Instruction]:
        if event.origin == self.briefing.origin:
            return
        yield instructions.Note("origin of the autopilot's frame", {"origin": str(event.origin)})
        self.briefing.origin = event.origin
        if self._flight is not None and self.briefing.frame is not None:
            self._flight.reframe(self.briefing.frame)
        self._rebrief()

    def _on_home(self, event: events.HomeReported, now_s: float) -> Iterator[Instruction]:
        if self.in_control or event.home == self.briefing.home:
            return  # the ground offset does not change under a vehicle that is being flown
        self.briefing.home = event.home
        yield instructions.Note("home", {"ground_offset_m": round(self.briefing.ground_offset_m, 3)})
        self._rebrief()

    def _on_arming(self, event: events.ArmingReported, now_s: float) -> Iterator[Instruction]:
        self._armed = event.armed
        yield from self._on_the_ground()

    def _on_landed(self, event: events.LandedReported, now_s: float) -> Iterator[Instruction]:
        self._on_ground = event.on_ground
        yield from self._on_the_ground()

    def _on_utc(self, event: events.UtcReported, now_s: float) -> Iterator[Instruction]:
        self._utc.ahead_s = event.ahead_s
        yield from ()

    def _on_mode(self, event: events.ModeReported, now_s: float) -> Iterator[Instruction]:
        if event.mode is not self._mode:
            self._mode = event.mode
            yield instructions.Note("mode", {"mode": event.mode.value})
            yield from self._in_mode(now_s)

    def _in_mode(self, now_s: float) -> Iterator[Instruction]:
        """The autopilot is in a mode: the one that was asked for, or somebody has taken control."""
        if self._leaving is self._mode:
            yield from self._left(self._mode)
        elif self._engagement is not None:
            yield from self._mode_while_engaging(self._engagement, now_s)
        elif self._mode is not self._expected_mode:
            yield from self._release(now_s)

    @property
    def _expected_mode(self) -> FlightMode:
        """The mode in which all goes as this pilot wants it."""
        if self._flight is not None:
            return FlightMode.OFFBOARD
        return ARRIVAL_MODES[self._mission.on_arrival] if self.state is State.LANDING else self._mode

    def _on_the_ground(self) -> Iterator[Instruction]:
        if not self._on_ground:
            return
        if self.state is State.LANDING:
            yield instructions.Note("landed")
            self._enter(State.FINISHED, Reason.TARGET_REACHED)
        elif self._armed or self.in_control:
            return
        elif self.state is State.RELEASED:
            self._settle()
        elif self.state is State.HOLDING:
            self._enter(State.FINISHED, Reason.TARGET_REACHED)

    # --------------------------------------------------------------- the mission

    def _on_mission_reported(self, event: events.MissionReported, now_s: float) -> Iterator[Instruction]:
        briefing = self.briefing
        briefing.current_seq = event.current_seq
        if event.identity != briefing.identity:
            briefing.identity = event.identity
            if event.identity == 0:
                briefing.accept(0, ())
                self._settle()
        yield from self._download(now_s)

    def _download(self, now_s: float) -> Iterator[Instruction]:
        if self.briefing.wants_download and not self._downloading and now_s >= self._download_at_s:
            self._downloading = True
            yield instructions.DownloadMission(self.briefing.identity)

    def _on_mission_downloaded(self, event: events.MissionDownloaded, now_s: float) -> Iterator[Instruction]:
        self._downloading = False
        if event.items is None:
            self._download_at_s = now_s + self._settings.command_retry_s
            yield instructions.Note("mission download failed")
            return
        briefing = self.briefing
        briefing.accept(event.identity, event.items)
        yield instructions.Note("mission downloaded", {"plan_id": f"{briefing.plan_id:08x}", "items": len(event.items)})
        if briefing.problem:
            yield instructions.Note("mission not understood", {"problem": briefing.problem})
        self._rebrief()

    def _rebrief(self) -> None:
        """The frame or the mission has changed."""
        briefing = self.briefing
        if self._flight is None:
            briefing.decode()
            self._settle()
        elif briefing.order is not None and briefing.order.plan_id != self._flight.newest_order.plan_id:
            self._flight.change_order(briefing.order)

    def _settle(self) -> None:
        """Be ready, or wait for what is missing; flights, and what is left of them, are not disturbed."""
        resting = {State.FINISHED, State.RELEASED, State.HOLDING}
        over = self.state in resting and self._flight is None
        fresh = self.briefing.plan_id != self._flown_plan_id
        grounded = self.state is State.RELEASED and self._on_ground and not self._armed
        settling = self.state in {State.CONNECTING, State.WAITING, State.READY} or (over and (fresh or grounded))
        if not (self._connected and settling):
            return
        if self._missing is not Reason.NONE:
            self._enter(State.WAITING, self._missing)
        elif self.state is not State.READY:
            self._enter(State.READY, Reason.NONE)

    @property
    def _missing(self) -> Reason:
        """What keeps this vehicle from being flown; NONE when nothing does."""
        return self.briefing.missing if self._odometry is not None else Reason.NO_POSITION

    # ------------------------------------------------------------ start and stop

    def _on_start(self, event: events.StartCommanded, now_s: float) -> Iterator[Instruction]:
        result, reason = self._answer(now_s)
        yield instructions.AcknowledgeStart(event.sender, result, reason)
        if result is not CommandResult.ACCEPTED or self.state in UNDER_WAY or self.in_control:
            return
        order = self.briefing.order
        assert order is not None  # _answer has looked
        yield instructions.Note("start", {"plan_id": f"{order.plan_id:08x}", "mode": self._mode.value})
        self._flown_plan_id = order.plan_id
        self._engagement = Engagement(self._crew, order, self.briefing.current_seq, self._mode, now_s)
        self._enter(State.ENGAGING, Reason.NONE)

    def _answer(self, now_s: float) -> tuple[CommandResult, Reason]:
        """How a MISSION_START is to be answered now."""
        situation = Situation(
            stopping=self._stopping,
            obeyed=self.state in UNDER_WAY or self.in_control,
            missing=self._missing if self._connected else Reason.AUTOPILOT_LOST,
            airborne=self._armed and not self._on_ground,
            just_released=now_s - self._released_at_s < self._settings.start_guard_s,
        )
        return answer(situation)

    def _on_stop(self, _: events.StopRequested, now_s: float) -> Iterator[Instruction]:
        if self._stopping:
            return
        self._stopping = True
        yield instructions.Note("stop requested", {"state": self.state.name})
        if self._flight is not None:
            yield from self._utc.stamped(self._flight.brake(Reason.STOPPED_BY_OPERATOR, now_s))
            self._enter(State.HOLDING, Reason.STOPPED_BY_OPERATOR)
        elif self._engagement is not None and self._engagement.plan is not None:
            yield from self._leave(FlightMode.HOLD, now_s)
        else:
            self.done = True

    def _end_control(self) -> Iterator[Instruction]:
        """Stop streaming, if anything is streamed; the autopilot keeps the mode that it is in."""
        if self.in_control:
            yield instructions.EndSetpoints()
        self._flight = self._engagement = self._leaving = None
        self._crew.exchange.end()
        self.done = self.done or self._stopping

    def _release(self, now_s: float) -> Iterator[Instruction]:
        yield instructions.Note("control taken", {"mode": self._mode.value})
        yield from self._end_control()
        self._released_at_s = now_s
        self._enter(State.RELEASED, Reason.CONTROL_TAKEN)

    def _leave(self, mode: FlightMode, now_s: float) -> Iterator[Instruction]:
        """Hand the vehicle over to one of the autopilot's own modes; setpoints go on until it is in it."""
        self._leaving, self._commanded_at_s = mode, now_s
        yield instructions.CommandMode(mode)

    def _left(self, mode: FlightMode) -> Iterator[Instruction]:
        """The autopilot is in the mode that ends the flight."""
        yield from self._end_control()
        if mode is FlightMode.HOLD:
            self._enter(State.HOLDING, Reason.STOPPED_BY_OPERATOR if self._stopping else Reason.TARGET_REACHED)
        else:
            self._enter(State.LANDING, Reason.TARGET_REACHED)

    # ------------------------------------------------------------------ engaging

    def _engage(self, engagement: Engagement, now_s: float) -> Iterator[Instruction]:
        """One tick of taking over."""
        assert self._odometry is not None
        yield from engagement.tick(self._odometry, now_s)
        if self._leaving is not None:
            yield from self._repeat_command(self._leaving, now_s)
        elif engagement.failure is not Reason.NONE:
            yield from self._retreat(engagement.failure)

    def _mode_while_engaging(self, engagement: Engagement, now_s: float) -> Iterator[Instruction]:
        if self._mode is FlightMode.OFFBOARD and engagement.plan is not None and self._leaving is None:
            yield from self._begin_flight(engagement, engagement.plan, now_s)
        elif (engagement.mode_before, self._mode) == (FlightMode.TAKEOFF, FlightMode.HOLD):
            engagement.mode_before = self._mode  # the take-off has come to its end
        else:
            yield from self._release(now_s)

    def _begin_flight(self, engagement: Engagement, plan: Plan, now_s: float) -> Iterator[Instruction]:
        """OFFBOARD it is: fly."""
        assert self._odometry is not None
        self._engagement = None
        self._flight = Flight(self._crew, engagement.order, plan, self._odometry, now_s)
        self._enter(State.FLYING, Reason.NONE)
        yield instructions.Note("flying", {"guide_m": round(plan.guide.length_m, 2)})
        yield from self._utc.stamped(self._flight.begin(now_s))

    def _retreat(self, reason: Reason) -> Iterator[Instruction]:
        """Control could not be taken: everything is as it was before the start."""
        yield instructions.Note("not engaged", {"reason": reason.name})
        yield from self._end_control()
        self._enter(State.READY, reason)

    def _on_mode_command_ended(self, event: events.ModeCommandEnded, now_s: float) -> Iterator[Instruction]:
        if not event.accepted:
            yield instructions.Note("mode refused", {"mode": event.mode.value})
            if self._engagement is not None and event.mode is FlightMode.OFFBOARD and self._leaving is None:
                yield from self._retreat(Reason.OFFBOARD_REFUSED)
        elif event.mode is self._mode and event.mode in {self._leaving, FlightMode.OFFBOARD}:
            # it was in that mode before, so that no change of mode will be reported
            yield from self._in_mode(now_s)

    # -------------------------------------------------------------------- flying

    def _on_plan(self, event: events.PlanReady, now_s: float) -> Iterator[Instruction]:
        if self._flight is not None:
            yield from self._utc.stamped(self._flight.take(event.plan, event.cpu_ms, now_s))
        elif self._engagement is not None and self._odometry is not None:
            self.figures.replan_ms.add(event.cpu_ms)
            yield from self._engagement.take(event.plan, self._odometry, now_s)

    def _on_tick(self, event: events.Tick, now_s: float) -> Iterator[Instruction]:
        yield from self._download(now_s)
        if event.sensor_silent is not self.briefing.sensor_silent:
            self.briefing.sensor_silent = event.sensor_silent
            yield instructions.Note("sensor silent" if event.sensor_silent else "sensor heard")
            self._settle()
        if self._flight is not None:
            self.figures.lateness_max_ms = max(self.figures.lateness_max_ms, event.lateness_ms)
            yield from self._fly(self._flight, event, now_s)
        elif self._engagement is not None:
            yield from self._engage(self._engagement, now_s)

    def _fly(self, flight: Flight, event: events.Tick, now_s: float) -> Iterator[Instruction]:
        yield from self._utc.stamped(flight.tick(now_s, event.odometry_age_s, sensor_silent=event.sensor_silent))
        self._track_index = flight.track_index
        self._enter(State.FLYING if flight.holding is Reason.NONE else State.HOLDING, flight.holding)
        if self._leaving is not None:
            yield from self._repeat_command(self._leaving, now_s)
        elif self._stopping and flight.is_at_rest(now_s):
            yield from self._leave(FlightMode.HOLD, now_s)
        elif flight.has_arrived(now_s):
            yield instructions.Note("arrived", {"on_arrival": self._mission.on_arrival.value})
            yield from self._leave(ARRIVAL_MODES[self._mission.on_arrival], now_s)

    def _repeat_command(self, mode: FlightMode, now_s: float) -> Iterator[Instruction]:
        if now_s - self._commanded_at_s > self._settings.command_retry_s:
            yield from self._leave(mode, now_s)

    def _enter(self, state: State, reason: Reason) -> None:
        """Change state; a transition that is not in the table is an error of ours."""
        assert_possible(self.state, state, reason)
        self.state, self.reason = state, reason
