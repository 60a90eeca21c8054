"""The whole system in one process: ground station and simulator, and what flies between them, on one virtual clock."""

import asyncio
import functools
from dataclasses import dataclass, field

import msgspec
import numpy as np
import numpy.typing as npt

from gcs.errors import GcsError
from gcs.flight.events import EventLog
from gcs.flight.report import FlightReport, Flown, make_report
from gcs.flight.sequence import FleetFlight
from gcs.planner import plan_mission
from gcs.planner.plan import FleetPlan
from gcs.settings import PlanningMode
from gcs.station import Station
from missions.mission import Mission
from sitl.fleet import TICK_S
from sitl.microservices.outbox import Link
from sitl.simulator import Simulator
from tests.simulation import virtual_time

Array = npt.NDArray[np.float64]


@functools.cache
def planned(mission_json: bytes, seed: int) -> FleetPlan:
    """A plan, made once for all tests that fly the same mission with the same seed."""
    return plan_mission(msgspec.json.decode(mission_json, type=Mission), seed=seed)


class GroundWire:
    """The ground links of all vehicles, in memory: the station's connection to the simulator."""

    peer = None

    def __init__(self, simulator: Simulator) -> None:
        self._simulator = simulator

    def send(self, datagram: bytes, address: tuple[str, int]) -> None:
        self._simulator.receive(address[1], Link.GROUND, datagram)


@dataclass
class WholeSystem:
    """One flight of a mission, in process.

    Args:
        mission: what is flown.
        mode: who plans.
        seed: of planner and simulator.
    """

    mission: Mission
    mode: PlanningMode = PlanningMode.CLOUD
    seed: int = 0
    truth: list[tuple[float, Array, Array]] = field(default_factory=list)
    """(time [s], positions (n, 3), velocities (n, 3)) of every tick."""

    def __post_init__(self) -> None:
        self.simulator = Simulator(self.mission, seed=self.seed)
        self.station = Station(unix_us=lambda: 0)
        self.wire = GroundWire(self.simulator)
        self.station.connections.append(self.wire)
        self.error: GcsError | None = None

    def fly(self) -> FlightReport:
        """The whole flight; what ends it early is kept in `error`."""
        return virtual_time.run(self._fly())

    async def _fly(self) -> FlightReport:
        self.events = EventLog(asyncio.get_running_loop().time)
        self.flight = FleetFlight(self.station, self.mission, self.mode, self._plan, self.events)
        async with asyncio.TaskGroup() as group:
            background = [group.create_task(self.simulate()), group.create_task(self.station.send_heartbeats())]
            try:
                await self.flight.fly()
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

    async def _plan(self, mission: Mission) -> FleetPlan:
        return planned(msgspec.json.encode(mission), self.seed)

    async def simulate(self) -> None:
        """Advance the simulator and carry its messages, until cancelled."""
        while True:
            self.simulator.step()
            truth = self.simulator.truth
            self.truth.append((truth.time_s, truth.position_enu_m, truth.velocity_enu_m_s))
            for sysid, link, frame in self.simulator.transmissions():
                if link is Link.GROUND:
                    self.station.receive(self.wire, frame, ("simulator", sysid))
            await asyncio.sleep(TICK_S)
