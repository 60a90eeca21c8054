"""The whole system in one process: ground station, simulator and companions on one virtual clock."""

import asyncio
import functools
from collections import deque
from collections.abc import Awaitable, Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from typing import TypeVar

import msgspec
import numpy as np
import numpy.typing as npt

from companion.app import App
from companion.fault_injection import FaultInjection
from companion.fleet.desk import FleetDesk
from companion.fleet.exchange import Exchange
from companion.journal import Journal
from companion.link.fleet_frames import FleetFrames
from companion.pilot import Pilot
from companion.planner.planner import Planner
from companion.sensing.sensing import Sensing, driver_of, ring_hz_of
from companion.settings import CompanionSettings
from gcs.dialect import Mode
from gcs.errors import GcsError
from gcs.flight.events import EventLog
from gcs.flight.report import FlightReport, Flown, make_report
from gcs.flight.sequence import FleetFlight
from gcs.planner import NO_FLOWN_PLAN, FlownPlan, plan_mission
from gcs.planner.plan import FleetPlan
from gcs.settings import PlanningMode
from gcs.station import Station
from missions.faults import Fault
from missions.mission import Mission, SensorKind, Vehicle
from sitl.fleet import TICK_S
from sitl.microservices.outbox import Link
from sitl.simulator import Simulator
from tests.simulation import virtual_time
from tests.simulation.simulated_autopilot import SimulatedAutopilot, quieten

Array = npt.NDArray[np.float64]
T = TypeVar("T")


@functools.cache
def planned(mission_json: bytes, seed: int) -> FleetPlan:
    """A plan, made once for all tests that fly the same mission with the same seed."""
    return plan_mission(msgspec.json.decode(mission_json, type=Mission), seed=seed)


MOST_WAITING = 1000
"""Datagrams of a lidar that nobody reads; as many fit into a socket's buffer."""
PLANNING_TIME_S = 0.01
"""A companion's plan takes so long in vehicle time; it is made at once, so that no run depends on the machine."""


CLOUD_PLANNING_TIME_S = 0.2
"""Likewise a plan of the cloud's."""


class Died(BaseException):
    """A fault has ended a companion; no `except Exception` of the companion's may catch it."""


class NoDeadMan:
    """The kernel's timer would end the whole simulation."""

    def feed(self) -> None: ...

    def disarm(self) -> None: ...


class Mortality(FaultInjection):
    """Ends one companion instead of the process."""

    def carry_out(self, fault: Fault) -> None:
        raise Died


async def _work(call: Callable[[], T]) -> T:
    result = call()
    await asyncio.sleep(PLANNING_TIME_S)
    return result


class LidarWire:
    """The way from one vehicle's lidar to its companion, in memory."""

    def __init__(self) -> None:
        self.waiting: deque[bytes] = deque(maxlen=MOST_WAITING)

    def poll(self) -> Iterator[bytes]:
        while self.waiting:
            yield self.waiting.popleft()


class GroundWire:
    """The ground links of all vehicles, in memory: the station's connection to the simulator."""

    peer = None
    budget_bytes_s = None

    def __init__(self, simulator: Simulator) -> None:
        self._simulator = simulator
        self.bytes = 0
        """Sent and received by the station."""

    def send(self, datagram: bytes, address: tuple[str, int]) -> None:
        self.bytes += len(datagram)
        self._simulator.receive(address[1], Link.GROUND, datagram)


@dataclass
class WholeSystem:
    """One flight of a mission, in process.

    Args:
        mission: what is flown.
        mode: who plans.
        seed: of planner and simulator.
        sensor: what the companions see with.
        truth_mission: what the simulator has of the world; the mission, unless that is wrong about it.
    """

    mission: Mission
    mode: PlanningMode = PlanningMode.END_CLOUD
    seed: int = 0
    truth: list[tuple[float, Array, Array]] = field(default_factory=list)
    """(time [s], positions (n, 3), velocities (n, 3)) of every tick."""

    faults: tuple[Fault, ...] = ()
    operate: Callable[[FleetFlight], Awaitable[None]] = FleetFlight.fly
    """Who lets it fly, from the connection to the end."""
    sensor: SensorKind = SensorKind.LIDAR
    truth_mission: Mission | None = None

    def __post_init__(self) -> None:
        looking = self.mode.needs_companions and self.sensor is not SensorKind.NONE
        self.simulator = Simulator(self.truth_mission or self.mission, seed=self.seed, lidar=looking)
        for sysid in self.simulator.vehicles:
            quieten(self.simulator, sysid)
        self.lidars = {vehicle.sysid: LidarWire() for vehicle in self.mission.vehicles}
        self.station = Station(unix_us=lambda: 0)
        self.wire = GroundWire(self.simulator)
        self.station.connections.append(self.wire)
        self.autopilots: dict[int, SimulatedAutopilot] = {}
        self.companions: dict[int, App] = {}
        self.radio_inboxes: dict[int, deque[bytes]] = {}
        """What companions have not heard yet of each other's words."""
        self.companion_missions = {vehicle.sysid: self.mission for vehicle in self.mission.vehicles}
        """What each companion has read; tests may give one something else."""
        self.deaths: dict[int, float] = {}
        """When a fault ended a companion, in simulated time."""
        self.modes: dict[int, list[tuple[float, Mode]]] = {vehicle.sysid: [] for vehicle in self.mission.vehicles}
        """(time, mode) of every change of mode that the ground station heard of."""
        self.error: GcsError | None = None

    def fly(self) -> FlightReport:
        """The whole flight; what ends it early is kept in `error`."""
        return virtual_time.run(self._fly())

    async def _fly(self) -> FlightReport:
        self.events = EventLog(asyncio.get_running_loop().time)
        self.flight = FleetFlight(self.station, self.mission, self.mode, self._plan, self.events)
        async with asyncio.TaskGroup() as group:
            background = [group.create_task(self.simulate()), group.create_task(self.station.send_heartbeats())]
            if self.mode.needs_companions:
                background += [group.create_task(self._companion(vehicle)) for vehicle in self.mission.vehicles]
            try:
                await self.operate(self.flight)
            except GcsError as problem:
                self.error = problem
            for task in background:
                task.cancel()
        reason = str(self.error) if self.error else ""
        flown, time_s = self.flown(), self.simulator.time_s
        return make_report(self.flight, flown, reason=reason, wall_s=time_s, sim_s=time_s)

    def flown(self) -> dict[int, Flown]:
        """What really happened, by system id."""
        times_s = np.array([time_s for time_s, _, _ in self.truth])
        positions_m = np.array([positions for _, positions, _ in self.truth])
        velocities_m_s = np.array([velocities for _, _, velocities in self.truth])
        return {
            sysid: Flown(times_s, positions_m[:, index], velocities_m_s[:, index])
            for index, sysid in enumerate(self.simulator.vehicles)
        }

    async def _plan(self, mission: Mission, flown: FlownPlan = NO_FLOWN_PLAN, /) -> FleetPlan:
        if flown.curves_m:
            plan = plan_mission(mission, seed=self.seed, flown=flown)
        else:
            plan = planned(msgspec.json.encode(mission), self.seed)
        await asyncio.sleep(CLOUD_PLANNING_TIME_S)
        return plan

    async def _companion(self, vehicle: Vehicle) -> None:
        """One companion, until it is cancelled or a fault ends it."""
        mission = self.companion_missions[vehicle.sysid]
        settings = CompanionSettings(vehicle=vehicle.sysid, system_url="", seed=self.seed, sensor=self.sensor)
        zones_m = np.array([mission.start_m(vehicle), *(target.position_m for target in mission.targets)])
        rng = np.random.default_rng(self.seed)
        planner = Planner(mission, settings.reserve, settings.search, rng, zones_m)
        driver = driver_of(settings.sensor, mission)
        sensing = driver and Sensing(driver, mission.sensor.rate_hz, self.lidars[vehicle.sysid].poll)
        autopilot = self.autopilots[vehicle.sysid] = SimulatedAutopilot(
            self.simulator, vehicle.sysid, ring_hz_of(settings.sensor, mission)
        )
        fleet = self._fleet_desk(mission, vehicle.sysid)
        companion = App(
            settings,
            Pilot(mission, settings, planner, fleet.exchange),
            planner,
            autopilot,
            _work,
            NoDeadMan(),
            Mortality(self.faults, vehicle.sysid),
            Journal(vehicle.sysid, None, say=lambda _: None),
            sensing,
            fleet=fleet,
            cpu_clock=lambda: 0.0,
        )
        self.companions[vehicle.sysid] = companion
        try:
            await companion.run()
        except* Died:
            autopilot.close()
            self.deaths[vehicle.sysid] = self.simulator.time_s

    def _fleet_desk(self, mission: Mission, sysid: int) -> FleetDesk:
        """A companion's end of the fleet link, in memory."""
        heard = self.radio_inboxes.setdefault(sysid, deque())

        def poll() -> Iterator[bytes]:
            while heard:
                yield heard.popleft()

        frames = FleetFrames(sysid, mission.frame)
        return FleetDesk(Exchange(sysid, mission), mission, frames, poll, partial(self.simulator.receive_radio, sysid))

    async def simulate(self) -> None:
        """Advance the simulator and carry its messages, until cancelled."""
        while True:
            self.simulator.step()
            self.truth.append((self.simulator.time_s, *self.simulator.motion))
            for sysid, link, frame in self.simulator.transmissions():
                if link is Link.GROUND:
                    self.wire.bytes += len(frame)
                    self.station.receive(self.wire, frame, ("simulator", sysid))
                elif sysid in self.autopilots:
                    self.autopilots[sysid].receive_frame(frame)
            for sysid, datagram in self.simulator.lidar_datagrams():
                self.lidars[sysid].waiting.append(datagram)
            for sysid, datagram in self.simulator.radio_datagrams():
                if sysid in self.radio_inboxes:
                    self.radio_inboxes[sysid].append(datagram)
            self._note_modes()
            await asyncio.sleep(TICK_S)

    def _note_modes(self) -> None:
        for sysid, changes in self.modes.items():
            state = self.station.fleet.vehicles.get(sysid)
            if state is not None and (not changes or changes[-1][1] is not state.mode):
                changes.append((self.simulator.time_s, state.mode))
