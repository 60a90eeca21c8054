"""The whole system with a ground station that crashes, hangs and is started again, and companions that come back."""

import asyncio
import resource
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

from gcs.dialect import AUTOPILOT, COMPANION, Mode, mavlink
from gcs.errors import GcsError
from gcs.flight import actions
from gcs.flight.events import Event, EventLog
from gcs.flight.journal import JOURNAL_FILE, JournalKeeper
from gcs.flight.monitor import Phase
from gcs.flight.rejoining import rejoin, told_flight, unfinished
from gcs.flight.report import FlightReport, make_report
from gcs.flight.sequence import FleetFlight
from gcs.link.codec import Codec
from gcs.link.connection import Address, Connection
from gcs.station import Station
from missions.mission import Vehicle
from missions.mission_items import plan_id
from sitl.autopilot.modes import Mode as AutopilotMode
from sitl.autopilot.plan import Plan
from sitl.microservices.outbox import Link
from sitl.simulator import UTC_START_US
from tests.simulation.whole_system import MOST_WAITING, GroundWire, LidarWire, WholeSystem
from tests.soak.mishaps import (
    CompanionRestart,
    DiskFull,
    GroundCrash,
    GroundHang,
    LidarSilence,
    Mishap,
    Namesake,
    OtherOrder,
    SecondStation,
    Timed,
    WallClockJump,
)

LOOK_INTERVAL_S = 0.1
OPERATOR_S = 10.0
"""Whoever sits at the page of a restarted ground station lands what has not flown its mission for so long."""
LONGEST_S = 900.0
"""No flight is watched for longer after a restart; endurance is over by then."""
LONGEST_FLIGHT_S = 3600.0
"""Whatever goes wrong, a flight ends within an hour; minutes of that may be an upload over a bad link."""
HELD_WITHIN_S = 2.5
"""After the end of its companion a vehicle holds within this."""
SECOND_STATION = 254
VISIT_S, GOING_ON_AFTER_S = 12.0, 6.0
"""So long the second ground station stays; who was held by it is let go on after this."""
ELSEWHERE = ("elsewhere", 9)
PHASES = list(Phase)


class FailingLidar(LidarWire):
    """A lidar's wire that can be dead for a while."""

    def __init__(self) -> None:
        super().__init__()
        self.dead = False

    def poll(self) -> Iterator[bytes]:
        if self.dead:
            self.waiting.clear()
        yield from super().poll()


class GroundProcess:
    """What of the ground station ends with its process: the station, its wire, and what waits in its socket."""

    def __init__(self, system: "TroubledSystem") -> None:
        self.station = DeafStation(self, system.wall_clock_us)
        self.wire = HaltedWire(self, system)
        self.station.connections.append(self.wire)
        self.halted = self.ended = False
        self.waiting_in: deque[tuple[bytes, Address]] = deque(maxlen=MOST_WAITING)
        self.waiting_out: list[tuple[bytes, Address]] = []

    def go_on(self) -> None:
        """End a hang: what has waited comes and goes at once."""
        self.halted = False
        while self.waiting_in:
            self.station.receive(self.wire, *self.waiting_in.popleft())
        for datagram, address in self.waiting_out:
            self.wire.send(datagram, address)
        self.waiting_out = []


class DeafStation(Station):
    """A station that takes in nothing while its process hangs, and never again when that has ended."""

    def __init__(self, process: GroundProcess, unix_us: Callable[[], int]) -> None:
        super().__init__(unix_us=unix_us)
        self._process = process

    def receive(self, connection: Connection, datagram: bytes, address: Address) -> None:
        if self._process.ended:
            return
        if self._process.halted:
            self._process.waiting_in.append((datagram, address))
            return
        super().receive(connection, datagram, address)


class HaltedWire(GroundWire):
    """Likewise the way out."""

    def __init__(self, process: GroundProcess, system: "TroubledSystem") -> None:
        super().__init__(system.simulator)
        self._process = process

    def send(self, datagram: bytes, address: Address) -> None:
        if self._process.halted:
            self._process.waiting_out.append((datagram, address))
        elif not self._process.ended and address != ELSEWHERE:
            super().send(datagram, address)


@dataclass
class TroubledSystem(WholeSystem):
    """One flight in which more goes wrong than links, vehicles and companions.

    Args:
        mishaps: what, and when.
    """

    mishaps: tuple[Mishap, ...] = ()
    restarts: list[tuple[float, str]] = field(default_factory=list)
    """(simulated time, what) of everything that came back."""
    false_beliefs: list[str] = field(default_factory=list)
    """What the ground station said to be stored, and was not at that moment."""
    unwritten: list[str] = field(default_factory=list)
    """What the ground station says of files that it cannot write."""
    mistakes: list[str] = field(default_factory=list)
    """What should not have happened on the way."""
    modes_in_truth: dict[int, list[tuple[float, AutopilotMode]]] = field(default_factory=dict)
    """(simulated time, mode) of every change of each autopilot's mode."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self._clock_ahead_us = 0
        self._alive_again: set[int] = set()
        """Vehicles whose companion has been started again."""
        self._begin_process()
        self.lidars = {vehicle.sysid: FailingLidar() for vehicle in self.mission.vehicles}

    def wall_clock_us(self) -> int:
        """UTC as the ground's machine has it."""
        return UTC_START_US + round(self.simulator.time_s * 1e6) + self._clock_ahead_us

    def _begin_process(self) -> None:
        self.process = GroundProcess(self)
        self.station, self.wire = self.process.station, self.process.wire

    # ---------------------------------------------------------------- the flight
    async def _fly(self) -> FlightReport:
        unlimited = resource.getrlimit(resource.RLIMIT_FSIZE)
        with TemporaryDirectory() as folder:
            self._folder = Path(folder)
            try:
                return await self._fly_with_mishaps()
            finally:
                resource.setrlimit(resource.RLIMIT_FSIZE, unlimited)

    async def _fly_with_mishaps(self) -> FlightReport:
        async with asyncio.TaskGroup() as group:
            self._group = group
            background = [group.create_task(self.simulate()), group.create_task(self._watch_autopilots())]
            background += [group.create_task(self._befall(m)) for m in self.mishaps if isinstance(m, Timed)]
            if self.mode.needs_companions:
                background += [group.create_task(self._companion(vehicle)) for vehicle in self.mission.vehicles]
            self._ended = asyncio.Event()
            self._start_ground()
            try:
                await asyncio.wait_for(self._ended.wait(), LONGEST_FLIGHT_S)
            except TimeoutError:
                self.mistakes.append(f"the flight has not ended after {LONGEST_FLIGHT_S:g} s")
            for task in (*background, *self._ground):
                task.cancel()
        reason = str(self.error) if self.error else ""
        time_s = self.simulator.time_s
        return make_report(self.flight, self.flown(), reason=reason, wall_s=time_s, sim_s=time_s)

    def _start_ground(self) -> None:
        """A process of the ground station begins: back into the flight that its journal tells of, or with a new one."""
        story, mission = unfinished(self._folder, self.mission), self.mission
        self._journal = JournalKeeper(self._folder / JOURNAL_FILE, self.unwritten.append)
        if not hasattr(self, "events"):
            self.events = EventLog(asyncio.get_running_loop().time, listeners=[self._check_belief])
        if story is not None:
            self.flight = told_flight(story, self.station, self.events)
        else:
            self.flight = FleetFlight(self.station, mission, self.mode, self._plan, self.events)
            self._journal.begin(self.flight, self.station.unix_us())
        tasks = (self._operate(story is not None), self.station.send_heartbeats(), self._keep_journal())
        self._ground = [self._group.create_task(task) for task in tasks]

    async def _operate(self, rejoining: bool) -> None:
        """The flight, or what is left of it with somebody at the page."""
        try:
            if rejoining:
                async with asyncio.timeout(LONGEST_S), asyncio.TaskGroup() as group:
                    operator = group.create_task(self._land_who_waits())
                    await rejoin(self.flight, self.events, self.flight.watch)
                    operator.cancel()
            else:
                await self.operate(self.flight)
        except GcsError as problem:
            self.error = problem
        self._ended.set()

    async def _land_who_waits(self) -> None:
        """What an operator does after a restart: who does not fly its mission is landed, again until it lands."""
        since_s: dict[int, float] = {}
        while True:
            for part in self.flight.in_flight:
                now_s = self.station.now_s
                if part.monitor.phase is Phase.FLYING:
                    since_s.pop(part.sysid, None)
                elif now_s - since_s.setdefault(part.sysid, now_s) > OPERATOR_S:
                    since_s[part.sysid] = now_s
                    try:
                        await self.flight.orders.land(part)
                    except GcsError as problem:
                        self.events.add("refused", str(problem), part.name)
            await asyncio.sleep(1.0)

    async def _keep_journal(self) -> None:
        try:
            while True:
                self._journal.look(self.flight, self.station.unix_us())
                await asyncio.sleep(LOOK_INTERVAL_S)
        finally:
            if not self.process.ended:  # as the program does when it ends, and cannot when it is killed
                self._journal.look(self.flight, self.station.unix_us())
            self._journal.close()

    async def _companion(self, vehicle: Vehicle) -> None:
        await super()._companion(vehicle)
        back = [m for m in self.mishaps if isinstance(m, CompanionRestart) and m.vehicle == vehicle.sysid]
        if back and vehicle.sysid in self.deaths:
            await asyncio.sleep(back[0].down_s)
            self.faults = tuple(fault for fault in self.faults if fault.vehicle != vehicle.sysid)
            self.restarts.append((self.simulator.time_s, f"companion {vehicle.sysid}"))
            self._alive_again.add(vehicle.sysid)
            await super()._companion(vehicle)

    def _check_belief(self, event: Event) -> None:
        """Whoever says that a mission is stored has to be right in this very moment."""
        if event.kind not in {"uploaded", "swapped"}:
            return
        sysid = next(vehicle.sysid for vehicle in self.mission.vehicles if vehicle.name == event.vehicle)
        stored = plan_id(self.simulator.vehicles[sysid].autopilot.navigator.mission.plan.items)
        if stored != event.data["plan_id"]:
            self.false_beliefs.append(f"{event.vehicle} {event.kind} {event.data['plan_id']:08x}, has {stored:08x}")

    async def _watch_autopilots(self) -> None:
        """Note each autopilot's modes; nobody stays in Offboard without a companion, and no mission begins anew."""
        flown: dict[int, tuple[Plan, int]] = {}
        while True:
            now_s = self.simulator.time_s
            for sysid, vehicle in self.simulator.vehicles.items():
                commander, mission = vehicle.autopilot.commander, vehicle.autopilot.navigator.mission
                noted = self.modes_in_truth.setdefault(sysid, [])
                if not noted or noted[-1][1] is not commander.mode:
                    noted.append((now_s, commander.mode))
                flies = commander.mode if commander.armed else None
                died_s = now_s if sysid in self._alive_again else self.deaths.get(sysid, now_s)
                if flies is AutopilotMode.OFFBOARD and now_s - died_s > HELD_WITHIN_S:
                    self.mistakes.append(f"vehicle {sysid} is in Offboard, and its companion ended at {died_s:.1f} s")
                    self._alive_again.add(sysid)  # said once
                if flies is not AutopilotMode.MISSION:
                    flown.pop(sysid, None)
                    continue
                plan, seq = flown.get(sysid, (None, 0))
                if plan is mission.plan and mission.current < seq:
                    self.mistakes.append(f"vehicle {sysid} turned back from item {seq} to {mission.current}")
                flown[sysid] = mission.plan, mission.current
            await asyncio.sleep(LOOK_INTERVAL_S)

    # ------------------------------------------------------------------- mishaps
    async def _befall(self, mishap: Timed) -> None:
        """Wait until it is time, and let it happen."""
        await self.station.holds_within(lambda: self._has_come_to(mishap.phase), float("inf"), LOOK_INTERVAL_S)
        await asyncio.sleep(mishap.after_s)
        match mishap:
            case GroundCrash():
                await self._crash(mishap.down_s)
            case GroundHang():
                process, process.halted = self.process, True
                await asyncio.sleep(mishap.lasts_s)
                process.go_on()
            case WallClockJump():
                self._clock_ahead_us += round(mishap.by_s * 1e6)
            case LidarSilence():
                lidar = self.lidars[mishap.vehicle]
                lidar.dead = True
                await asyncio.sleep(mishap.lasts_s)
                lidar.dead = False
            case DiskFull():
                self._fill_disk()
            case SecondStation():
                await self._visit(mishap.vehicle, mishap.order)
            case Namesake():
                await self._resound(mishap.vehicle, mishap.lasts_s)

    def _has_come_to(self, phase: Phase) -> bool:
        if phase is Phase.WAITING:
            return True
        parts = self.flight.vehicles.values()
        return any(PHASES.index(part.monitor.phase) >= PHASES.index(phase) for part in parts)

    async def _crash(self, down_s: float) -> None:
        """As by SIGKILL: nothing more is sent, whatever the cancelled coroutines want to say."""
        self.process.ended = True
        tasks = self._ground
        for task in tasks:
            task.cancel()
        await asyncio.wait(tasks)
        self._begin_process()
        self.process.ended = True  # nobody listens until it is started
        await asyncio.sleep(down_s)
        self.process.ended = False
        self.restarts.append((self.simulator.time_s, "ground station"))
        self._start_ground()

    @staticmethod
    def _fill_disk() -> None:
        """No file of this process may grow any more: writing fails as on a full disk, with another number."""
        _, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (0, hard))

    async def _visit(self, sysid: int, order: OtherOrder) -> None:
        """A second ground station on a vehicle's link: its heartbeats, and its orders, a second after another."""
        codec, peer = Codec(SECOND_STATION), (sysid, AUTOPILOT)
        starter = (sysid, COMPANION) if self.mode.needs_companions else peer
        hold, go_on = actions.set_mode(Mode.HOLD).message(peer, 0), actions.start_mission().message(starter, 0)
        orders = {
            OtherOrder.NOTHING: {},
            OtherOrder.LAND: {1.0: actions.set_mode(Mode.LAND).message(peer, 0)},
            OtherOrder.RETURN: {1.0: actions.set_mode(Mode.RTL).message(peer, 0)},
            OtherOrder.HOLD_AND_GO_ON: {1.0: hold, 1.0 + GOING_ON_AFTER_S: go_on},
        }[order]
        heartbeat = mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, 4, 3)
        for second in range(round(VISIT_S)):
            for message in (heartbeat, *(order for at_s, order in orders.items() if at_s <= second < at_s + 4.0)):
                self.simulator.receive(sysid, Link.GROUND, codec.pack(message))
            await asyncio.sleep(1.0)

    async def _resound(self, sysid: int, lasts_s: float) -> None:
        """A second vehicle with this system id, which stands about somewhere else."""
        codec = Codec(sysid, AUTOPILOT)
        heartbeat = mavlink.MAVLink_heartbeat_message(
            mavlink.MAV_TYPE_QUADROTOR, mavlink.MAV_AUTOPILOT_PX4, 0, int(Mode.HOLD), mavlink.MAV_STATE_STANDBY, 3
        )
        for _ in range(round(lasts_s)):
            self.station.receive(self.wire, codec.pack(heartbeat), ELSEWHERE)
            await asyncio.sleep(1.0)
