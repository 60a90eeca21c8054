"""The supervisor: feeds the pilot with what happens, carries out what it wants, and has one way out."""

import asyncio
import math
import time
import traceback
from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from functools import partial
from typing import Protocol, TypeVar

from companion import events, instructions
from companion.deadman import DeadMan
from companion.errors import CommandRefused, CompanionError
from companion.events import Event, FlightMode
from companion.fault_injection import FaultInjection
from companion.fleet.desk import FleetDesk
from companion.fleet.neighbour import Neighbour
from companion.instructions import Instruction
from companion.journal import Journal
from companion.link.autopilot import Autopilot
from companion.observations import Observations
from companion.pilot import Pilot
from companion.planner.planner import Plan, Planner, PlanRequest
from companion.report_budget import ReportBudget
from companion.sensing.scan import Scan
from companion.sensing.sensing import Sensing
from companion.settings import CompanionSettings
from companion.vehicle_clock import VehicleClock
from missions import tunnel
from missions.tunnel import PayloadType, TrajectoryMessage

T = TypeVar("T")

HOLD_TIMEOUT_S = 2.0
"""Wall clock: a vehicle that is left must confirm Hold within this."""
LONGEST_BRAKING_S = 4.0
"""Vehicle time that a vehicle may take to come to rest before it is left."""
BEHIND_S = 0.25
"""Ticks that are late by more than this are dropped instead of made up for (wall clock)."""


class Worker(Protocol):
    """Runs a planning call beside the event loop."""

    async def __call__(self, call: Callable[[], T]) -> T: ...


@dataclass
class App:
    """One companion at work.

    Args:
        settings: speed factor, tick.
        pilot: decides.
        planner: plans, in `work`.
        autopilot: the vehicle.
        work: runs plans beside the setpoint stream.
        deadman: fed every tick while in control.
        faults: what an experimenter has ordered.
        journal: where decisions are written.
        sensing: what the vehicle sees; None for one that sees nothing.
        fleet: its link to the other companions; None for one that is alone.
        cpu_clock: CPU time [s] of the thread in which a plan is made, for the figures alone.
    """

    settings: CompanionSettings
    pilot: Pilot
    planner: Planner
    autopilot: Autopilot
    work: Worker
    deadman: DeadMan
    faults: FaultInjection
    journal: Journal
    sensing: Sensing | None = None
    fleet: FleetDesk | None = None
    cpu_clock: Callable[[], float] = time.thread_time

    def __post_init__(self) -> None:
        self._clock = VehicleClock(self.settings.speed)
        self._stop = asyncio.Event()
        self._ended = asyncio.Event()
        self._state = self.pilot.state
        self._actions: set[asyncio.Task[None]] = set()
        self.budget = ReportBudget(self.settings.report_bytes_s, self.settings.speed)
        self.observations = Observations(self.planner.voxel_m, self.budget)
        self._noted_s = -math.inf
        self._unseen: Scan | None = None
        self._observing = False

    def request_stop(self) -> None:
        """Leave the vehicle in a chosen state and end; may be called again."""
        self._stop.set()

    async def run(self) -> bool:
        """Work until a stop is requested; whether everything was left as it should be.

        Raises:
            UsageError: the connection cannot be opened.
        """
        await self.autopilot.open()
        try:
            await self._supervise()
        except* Exception as problems:
            await self._leave_after_error(problems)
        finally:
            self.deadman.disarm()
            self.autopilot.close()
        return self.pilot.done

    async def _supervise(self) -> None:
        async with asyncio.TaskGroup() as group:
            self._group = group
            helpers = [
                group.create_task(self._listen(), name="listen"),
                group.create_task(self._tick(), name="tick"),
                group.create_task(self._wait_for_stop(), name="stop"),
            ]
            await self._ended.wait()
            for task in (*helpers, *self._actions):
                task.cancel()

    async def _listen(self) -> None:
        loop = asyncio.get_running_loop()
        while True:
            event = await self.autopilot.receive()
            if isinstance(event, events.Odometry):
                self._clock.observe(event.time_s, loop.time())
            now_s = self._now_s
            if self.sensing is not None:
                notice(self.sensing, event, now_s)
            if self.fleet is not None:
                self.fleet.notice(event)
            if isinstance(event, events.ReceiptHeard):
                self.budget.take(event.sender, event.receipt, now_s)
            elif not isinstance(event, events.RingReported):
                self._handle(event, now_s)

    async def _tick(self) -> None:
        loop = asyncio.get_running_loop()
        due_s = loop.time()
        while True:
            due_s = max(due_s + self.pilot.tick_s / self._clock.pace, loop.time() - BEHIND_S)
            await asyncio.sleep(due_s - loop.time())
            late_s, age_s, now_s = loop.time() - due_s, self._clock.age_s(loop.time()), self._now_s
            if self.fleet is not None:
                self.fleet.listen(now_s)
            self._handle(events.Tick(age_s, lateness_ms=late_s * 1e3, sensor_silent=self._look(now_s)), now_s)
            if self.fleet is not None:
                self.fleet.speak(self.pilot.briefing.frame, now_s)
            if self.pilot.in_control:
                self.deadman.feed()
            else:
                self.deadman.disarm()
            self.faults.tick(in_control=self.pilot.in_control, now_s=now_s)

    def _look(self, now_s: float) -> bool:
        """Let the planner see what the sensor has seen; whether the sensor is silent."""
        if self.sensing is None:
            return False
        scan = self.sensing.look(self.pilot.briefing.frame, now_s)
        if scan is not None:
            self._unseen = scan  # one that the planner had no time for is overtaken
            if not self._observing:
                self._observing = True
                self._later(self._observe())
        return self.sensing.is_silent(now_s)

    async def _observe(self) -> None:
        """Show scans to the planner until there is none."""
        while (scan := self._unseen) is not None:
            self._unseen = None
            others = self.fleet.exchange.neighbours(self._now_s) if self.fleet is not None else ()
            await self.work(partial(self._take_in, scan, others))
            for block in self.observations.due(scan.sensor_enu_m, scan.time_s):
                self.autopilot.send_tunnel(PayloadType.OCCUPANCY, block)
        self._observing = False

    def _take_in(self, scan: Scan, others: tuple[Neighbour, ...]) -> None:
        """Show a scan to the planner; now and then, note what the ground does not know of yet."""
        self.planner.observe(scan, others)
        if scan.time_s - self._noted_s >= self.settings.pilot.report_interval_s:
            self._noted_s = scan.time_s
            self.observations.update(*self.planner.certain(), scan.time_s)

    async def _wait_for_stop(self) -> None:
        await self._stop.wait()
        self._handle(events.StopRequested(), self._now_s)
        await asyncio.sleep(LONGEST_BRAKING_S / self.settings.speed + HOLD_TIMEOUT_S)
        self.journal.tell("Hold was not confirmed in time")
        self._ended.set()

    @property
    def _now_s(self) -> float:
        """Vehicle time [s]."""
        return self._clock.now_s(asyncio.get_running_loop().time())

    def _handle(self, event: Event, now_s: float) -> None:
        for instruction in self.pilot.handle(event, now_s):
            self._carry_out(instruction)
        if (state := self.pilot.state) is not self._state:
            self._state, reason = state, self.pilot.reason
            self.journal.write(self._now_s, "state", state=state.name, reason=reason.name)
            self.journal.tell(state.name + (f" ({reason.name})" if reason else ""))
        if self.pilot.done:
            self._ended.set()

    def _carry_out(self, instruction: Instruction) -> None:
        match instruction:
            case instructions.SendSetpoint(setpoint):
                self.autopilot.send_setpoint(setpoint)
            case instructions.EndSetpoints():
                self.autopilot.end_setpoints()
            case instructions.CommandMode(mode):
                self._later(self._command(mode))
            case instructions.AcknowledgeStart(sender, result, reason):
                self.autopilot.acknowledge_start(sender, result, reason)
                self.journal.write(self._now_s, "acknowledge", result=result.name, reason=reason.name)
            case instructions.RequestPlan(request):
                self._later(self._plan(request))
            case instructions.DownloadMission(identity):
                self._later(self._download(identity))
            case instructions.SetCurrentItem(seq):
                self._later(self._set_current_item(seq))
            case instructions.SendStatus(status):
                self.autopilot.send_tunnel(PayloadType.COMPANION_STATUS, tunnel.encode_status(status))
            case instructions.SendTrajectory(message):
                self._announce(message)
            case instructions.Note(text, fields):
                self.journal.write(self._now_s, text, **fields)

    def _announce(self, message: TrajectoryMessage) -> None:
        """Tell the others; what cannot be told is flown all the same."""
        try:
            self.autopilot.send_tunnel(PayloadType.TRAJECTORY, tunnel.encode_trajectory(message))
        except ValueError as too_large:
            self.journal.write(self._now_s, "trajectory not announced", problem=str(too_large))

    def _later(self, action: Coroutine[None, None, None]) -> None:
        """Carry out something that takes time, beside everything else."""
        task = self._group.create_task(action)
        self._actions.add(task)
        task.add_done_callback(self._actions.discard)

    async def _command(self, mode: FlightMode) -> None:
        accepted = True
        try:
            await self.autopilot.command_mode(mode)
        except CommandRefused as refused:
            accepted = False
            self.journal.tell(str(refused))
        self._handle(events.ModeCommandEnded(mode, accepted), self._now_s)

    async def _plan(self, request: PlanRequest) -> None:
        plan, cpu_s = await self.work(lambda: self._timed_plan(request))
        self._handle(events.PlanReady(plan, cpu_s * 1e3), self._now_s)

    def _timed_plan(self, request: PlanRequest) -> tuple[Plan, float]:
        began_s = self.cpu_clock()
        plan = self.planner.plan(request)
        return plan, self.cpu_clock() - began_s

    async def _download(self, identity: int) -> None:
        items = None
        try:
            items = await self.autopilot.download_mission()
        except CommandRefused as refused:
            self.journal.tell(str(refused))
        self._handle(events.MissionDownloaded(identity, items), self._now_s)

    async def _set_current_item(self, seq: int) -> None:
        try:
            await self.autopilot.set_current_item(seq)
        except CommandRefused as refused:  # progress is shown wrongly; the flight itself does not depend on it
            self.journal.write(self._now_s, "progress refused", problem=str(refused))

    async def _leave_after_error(self, problems: ExceptionGroup[Exception]) -> None:
        """Our own error: do what can still be done for the vehicle, and say what happened."""
        was_in_control = self.pilot.in_control
        for instruction in self.pilot.fail(self._now_s):
            self._carry_out(instruction)
        first: BaseException = problems
        while isinstance(first, BaseExceptionGroup):
            first = first.exceptions[0]
        text = str(first) if isinstance(first, CompanionError) else "".join(traceback.format_exception(first)).rstrip()
        self.journal.write(self._now_s, "failed", problem=text)
        self.journal.tell(f"failed: {text}")
        if was_in_control:
            try:
                async with asyncio.timeout(HOLD_TIMEOUT_S):
                    await self.autopilot.command_mode(FlightMode.HOLD)
            except (TimeoutError, CompanionError) as unheld:
                self.journal.tell(f"the vehicle did not confirm Hold: {unheld}")


def notice(sensing: Sensing, event: Event, now_s: float) -> None:
    """What a vehicle reports, as far as it has to do with seeing."""
    match event:
        case events.Odometry():
            sensing.observe(event.time_s, event.position_m, event.attitude)
        case events.RingReported(fields_json):
            sensing.receive(fields_json, now_s)
        case events.OriginReported():
            sensing.reframe()
        case events.AutopilotLost():
            sensing.forget()
        case _:
            pass
