"""The supervisor: what it carries out, when the dead-man is armed, and its one way out, on a virtual clock."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np

from companion import events
from companion.app import HOLD_TIMEOUT_S, LONGEST_BRAKING_S, App
from companion.errors import CommandRefused
from companion.events import FlightMode
from companion.fault_injection import FaultInjection
from companion.instructions import CommandResult
from companion.journal import Journal
from companion.pilot import Pilot
from companion.planner.planner import Plan, PlanRequest
from companion.setpoints import Setpoint
from companion.settings import CompanionSettings
from companion.states import State
from missions.frames import AutopilotFrame
from missions.mission_items import MissionItem
from missions.tunnel import CompanionStatus, PayloadType, Reason, decode_status
from tests.simulation import virtual_time
from tests.unit.companion.rig import GCS, HOME, INDOOR, LEVEL, START_M, StraightPlanner, items_of

T = TypeVar("T")
ODOMETRY_INTERVAL_S = 0.03
FRAME = AutopilotFrame(HOME, INDOOR.frame, HOME.altitude_amsl_m - INDOOR.origin.altitude_amsl_m)


class BenchVehicle:
    """Hovers, goes where setpoints say, and takes every mode but those that it is told to refuse."""

    def __init__(self, refused: set[FlightMode]) -> None:
        self.refused = refused
        self.commanded: list[FlightMode] = []
        self.answers: list[tuple[CommandResult, Reason]] = []
        self.statuses: list[CompanionStatus] = []
        self.streaming = False
        self.closed = False
        self._place_ned_m = FRAME.ned(START_M)
        self._queue: asyncio.Queue[events.Event] = asyncio.Queue()

    async def open(self) -> None:
        for event in (
            events.AutopilotFound(),
            events.ModeReported(FlightMode.HOLD),
            events.OriginReported(HOME),
            events.HomeReported(HOME),
            events.ArmingReported(True),
            events.LandedReported(False),
            events.MissionReported(7, 0),
        ):
            self._queue.put_nowait(event)

    async def receive(self) -> events.Event:
        if self._queue.empty():
            await asyncio.sleep(ODOMETRY_INTERVAL_S)
            now_s = asyncio.get_running_loop().time()
            return events.Odometry(100.0 + now_s, self._place_ned_m, np.zeros(3), LEVEL)
        return self._queue.get_nowait()

    def say(self, event: events.Event) -> None:
        self._queue.put_nowait(event)

    def send_setpoint(self, setpoint: Setpoint) -> None:
        self.streaming, self._place_ned_m = True, setpoint.position_m

    def end_setpoints(self) -> None:
        self.streaming = False

    async def command_mode(self, mode: FlightMode) -> None:
        self.commanded.append(mode)
        if mode in self.refused:
            raise CommandRefused(f"mode {mode.value}: denied")
        self.say(events.ModeReported(mode))

    async def download_mission(self) -> tuple[MissionItem, ...]:
        return items_of()

    async def set_current_item(self, seq: int) -> None:
        pass

    def acknowledge_start(self, sender: events.Sender, result: CommandResult, reason: Reason) -> None:
        self.answers.append((result, reason))

    def send_tunnel(self, kind: PayloadType, payload: bytes) -> None:
        if kind is PayloadType.COMPANION_STATUS:
            self.statuses.append(decode_status(payload))

    def close(self) -> None:
        self.streaming, self.closed = False, True


class WatchedDeadMan:
    """Counts how often it is fed."""

    def __init__(self) -> None:
        self.fed, self.armed = 0, False

    def feed(self) -> None:
        self.fed, self.armed = self.fed + 1, True

    def disarm(self) -> None:
        self.armed = False


class FailingPlanner(StraightPlanner):
    """Breaks down at its second plan."""

    def __init__(self) -> None:
        super().__init__()
        self._plans = 0

    def plan(self, request: PlanRequest) -> Plan:
        self._plans += 1
        if self._plans > 1:
            raise ZeroDivisionError("no such plan")
        return super().plan(request)


@dataclass
class Desk:
    """A companion on a bench vehicle."""

    planner: Any = field(default_factory=StraightPlanner)
    refused: set[FlightMode] = field(default_factory=set)
    said: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        settings = CompanionSettings(vehicle=1, system_url="")
        self.vehicle, self.deadman = BenchVehicle(self.refused), WatchedDeadMan()
        self.pilot = Pilot(INDOOR, settings, self.planner)
        self.app = App(
            settings,
            self.pilot,
            self.planner,
            self.vehicle,
            work,
            self.deadman,
            FaultInjection([], 1),
            Journal(1, None, say=self.said.append),
            cpu_clock=lambda: 0.0,
        )

    async def reach(self, state: State) -> None:
        for _ in range(3000):
            if self.pilot.state is state:
                return
            await asyncio.sleep(0.01)
        raise AssertionError(f"still {self.pilot.state.name} after 30 s, expected {state.name}")

    async def fly(self) -> None:
        """From MISSION_START to OFFBOARD."""
        await self.reach(State.READY)
        self.vehicle.say(events.StartCommanded(GCS))
        await self.reach(State.FLYING)


async def work(call: Callable[[], T]) -> T:
    await asyncio.sleep(0.005)
    return call()


async def stopped_in_flight(desk: Desk) -> tuple[bool, float]:
    """Fly for half a second and ask it to stop; whether the vehicle was left well, and how long that took [s]."""
    running = asyncio.ensure_future(desk.app.run())
    await desk.fly()
    await asyncio.sleep(0.5)
    asked_s = asyncio.get_running_loop().time()
    desk.app.request_stop()
    return await running, asyncio.get_running_loop().time() - asked_s


def test_stopped_in_flight_it_ends_when_the_vehicle_holds():
    desk = Desk()
    left_well, took_s = virtual_time.run(stopped_in_flight(desk))
    assert left_well
    assert took_s < LONGEST_BRAKING_S
    assert desk.vehicle.commanded == [FlightMode.OFFBOARD, FlightMode.HOLD]
    assert desk.pilot.state is State.HOLDING
    assert desk.vehicle.closed


def test_when_hold_is_not_confirmed_it_says_so_and_ends_all_the_same():
    desk = Desk(refused={FlightMode.HOLD})
    left_well, took_s = virtual_time.run(stopped_in_flight(desk))
    assert not left_well
    assert abs(took_s - LONGEST_BRAKING_S - HOLD_TIMEOUT_S) < 0.1
    assert "companion 1: Hold was not confirmed in time" in desk.said
    assert desk.vehicle.commanded.count(FlightMode.HOLD) > 1
    assert desk.vehicle.closed
    assert not desk.vehicle.streaming


def test_an_error_of_its_own_in_flight_leaves_the_vehicle_in_hold():
    desk = Desk(planner=FailingPlanner())

    async def fail() -> bool:
        running = asyncio.ensure_future(desk.app.run())
        await desk.fly()
        return await running

    assert not virtual_time.run(fail())
    told = desk.vehicle.statuses[-1]
    assert (told.state, told.reason) == (State.FAILED, Reason.INTERNAL_ERROR)
    assert desk.vehicle.commanded == [FlightMode.OFFBOARD, FlightMode.HOLD]
    assert (desk.vehicle.closed, desk.deadman.armed) == (True, False)
    assert any("ZeroDivisionError: no such plan" in line for line in desk.said)


def test_the_dead_man_is_fed_every_tick_in_control_and_never_otherwise():
    desk = Desk()

    async def look() -> tuple[int, int, bool]:
        running = asyncio.ensure_future(desk.app.run())
        await desk.reach(State.READY)
        await asyncio.sleep(1.0)
        fed_before = desk.deadman.fed
        await desk.fly()
        fed_at_start = desk.deadman.fed
        await asyncio.sleep(1.0)
        fed_in_flight = desk.deadman.fed - fed_at_start
        desk.vehicle.say(events.ModeReported(FlightMode.LAND))
        await desk.reach(State.RELEASED)
        await asyncio.sleep(0.1)
        armed_after = desk.deadman.armed
        desk.app.request_stop()
        assert await running
        return fed_before, fed_in_flight, armed_after

    fed_before, fed_in_flight, armed_after = virtual_time.run(look())
    assert fed_before == 0
    assert 49 <= fed_in_flight <= 51
    assert not armed_after


def test_stopped_while_idle_it_ends_at_once():
    desk = Desk()

    async def stop() -> bool:
        running = asyncio.ensure_future(desk.app.run())
        await desk.reach(State.READY)
        desk.app.request_stop()
        return await running

    assert virtual_time.run(stop())
    assert desk.vehicle.commanded == []
