"""The receive paths that are fuzzed; each takes hostile traffic and says now and then whether it is still sound."""

import asyncio
from collections.abc import Callable

import numpy as np

from gcs.errors import GcsError
from gcs.flight import actions
from gcs.link.frames import LONGEST_FRAME_BYTES, FrameSplitter
from gcs.microservices.command_client import CommandClient
from gcs.microservices.current_item import CurrentItem
from gcs.microservices.mission_download import MissionDownload
from gcs.microservices.parameter_client import ParameterExchange
from gcs.microservices.parameter_fetch import ParameterFetch
from gcs.microservices.verified_upload import VerifiedUpload
from gcs.station import Station
from sitl.microservices.outbox import Link
from sitl.simulator import Simulator
from tests.benchmarks.link.conditions import waypoints
from tests.fuzz import file_targets
from tests.fuzz.target import Target
from tests.fuzz.traffic import Traffic

GCS_READS = tuple(
    """HEARTBEAT SYS_STATUS GLOBAL_POSITION_INT ATTITUDE ATTITUDE_QUATERNION EXTENDED_SYS_STATE HOME_POSITION STATUSTEXT
    MISSION_CURRENT COMMAND_ACK PARAM_VALUE MISSION_REQUEST MISSION_REQUEST_INT MISSION_ACK MISSION_COUNT TUNNEL
    MISSION_ITEM_INT TIMESYNC AUTOPILOT_VERSION""".split()  # noqa: SIM905 - a list of one word a line says no more
)
SITL_READS = tuple(
    """COMMAND_LONG COMMAND_INT SET_MODE SET_POSITION_TARGET_LOCAL_NED SET_POSITION_TARGET_GLOBAL_INT PARAM_SET
    SET_ATTITUDE_TARGET PARAM_REQUEST_READ PARAM_REQUEST_LIST MISSION_COUNT MISSION_ITEM_INT MISSION_REQUEST_LIST
    MISSION_REQUEST_INT MISSION_ACK MISSION_CLEAR_ALL MISSION_SET_CURRENT TIMESYNC PING MANUAL_CONTROL
    HEARTBEAT""".split()  # noqa: SIM905 - as above
)


class _Wire:
    peer = None
    budget_bytes_s = None

    def send(self, datagram: bytes, address: tuple[str, int]) -> None:
        """Answers go nowhere."""


class GroundStationTarget(Target):
    """The station with every microservice at work, on an event loop of its own that is stepped by hand."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng, self._traffic = rng, Traffic(rng, GCS_READS)
        self._loop = asyncio.new_event_loop()
        self._station, self._wire = Station(unix_us=lambda: 0), _Wire()
        self._tasks: set[asyncio.Task[None]] = set()
        self._failures: list[BaseException] = []

    def feed(self) -> None:
        self._loop.run_until_complete(self._feed())

    def close(self) -> None:
        for task in self._tasks:
            task.cancel()
        self._loop.run_until_complete(asyncio.gather(*self._tasks, return_exceptions=True))
        self._loop.close()

    def check(self) -> None:
        station = self._station
        if self._failures:
            raise self._failures[0]
        assert len(station.fleet.vehicles) <= 254
        assert len(station.codec.sources) <= 2048
        assert all(len(station.routes.qualities(sysid, 0.0)) <= 8 for sysid in range(256))
        assert all(len(vehicle.texts) <= 50 for vehicle in station.fleet.vehicles.values())

    async def _feed(self) -> None:
        if len(self._tasks) < 6:
            self._begin()
        for _ in range(50):
            address = ("10.0.0.1", int(self._rng.integers(1, 60_000)))
            self._station.receive(self._wire, self._traffic.datagram(), address)
        await asyncio.sleep(0)

    def _begin(self) -> None:
        items = waypoints(5, self._rng)
        services = (
            CommandClient(actions.arm(), (1, 1)),
            VerifiedUpload(items, (1, 1)),
            MissionDownload((2, 1)),
            CurrentItem((1, 1), 0),
            ParameterExchange((1, 1), "NAV_DLL_ACT", new_value=1),
            ParameterFetch((1, 1)),
        )
        for service in services:
            task = asyncio.get_running_loop().create_task(self._run(service))
            self._tasks.add(task)
            task.add_done_callback(self._tasks.discard)

    async def _run(self, service) -> None:
        try:
            async with asyncio.timeout(2.0):
                await self._station.run(service)
        except (GcsError, TimeoutError):
            return  # forged refusals may end an exchange with a sentence, and with nothing else
        except Exception as failure:
            self._failures.append(failure)


class StreamTarget(Target):
    """Byte streams cut anywhere."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng, self._traffic, self._splitter = rng, Traffic(rng, GCS_READS), FrameSplitter()

    def feed(self) -> None:
        data = b"".join(self._traffic.datagram() for _ in range(20))
        for at in range(0, len(data), 97):
            for frame in self._splitter.feed(data[at : at + 97]):
                assert frame[0] in (0xFD, 0xFE)

    def check(self) -> None:
        assert len(self._splitter._pending) < LONGEST_FRAME_BYTES


class SimulatorTarget(Target):
    """The simulator's two links, a tick now and then."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng, self._traffic, self._simulator = rng, Traffic(rng, SITL_READS), Simulator(2, seed=1)

    def feed(self) -> None:
        for _ in range(20):
            link = Link.GROUND if self._rng.random() < 0.5 else Link.ONBOARD
            self._simulator.receive(1, link, self._traffic.datagram())
        self._simulator.step()
        for _, _, frame in self._simulator.transmissions():
            assert frame[0] in (0xFD, 0xFE)  # forwarded frames stay as they are

    def check(self) -> None:
        truth = self._simulator.truth
        assert np.isfinite(truth.position_enu_m).all()
        assert np.isfinite(truth.velocity_enu_m_s).all()


TARGETS: dict[str, Callable[[np.random.Generator], Target]] = {
    "ground station": GroundStationTarget,
    "streams": StreamTarget,
    "simulator": SimulatorTarget,
    "plan files": file_targets.PlanFileTarget,
    "recordings": file_targets.RecordingTarget,
    "parameter files": file_targets.ParameterFileTarget,
    "key rings": file_targets.KeyRingTarget,
    "journals": file_targets.JournalTarget,
}
"""Name -> builder."""
