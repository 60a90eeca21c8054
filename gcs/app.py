"""The composition root of `gcs fly`: builds the parts of one flight, runs them together, and takes them down again."""

import asyncio
import time
from contextlib import AsyncExitStack
from pathlib import Path

import msgspec

from gcs.errors import GcsError, ProcessFailed, UsageError
from gcs.flight.events import EventLog, Severity
from gcs.flight.picture import draw_flight
from gcs.flight.preflight import origin_here
from gcs.flight.report import FlightReport, Flown, flown_from_trail, make_report, read_truth
from gcs.flight.sequence import CONNECT_TIMEOUT_S, FleetFlight, Planner
from gcs.flight.trails import Trails
from gcs.link.tlog import TlogWriter
from gcs.link.udp import open_udp
from gcs.processes import Child, Processes
from gcs.settings import Fleet as FleetSource
from gcs.settings import FlightSettings, OriginHere
from gcs.station import Station
from missions.faults import format_fault
from missions.frames import GeodeticPoint
from missions.mission import Mission

TRAIL_INTERVAL_S = 0.05
HOLD_TIMEOUT_S = 5.0
TRUTH_FILE = "truth.csv"


class FlightApp:
    """One flight with everything around it.

    Args:
        settings: what the operator chose.
        mission: as it was read.
        planner: makes the cloud's plan.
        events: where everything of note is written.
        work_dir: for the report and the logs of all programs.
    """

    def __init__(
        self, settings: FlightSettings, mission: Mission, planner: Planner, events: EventLog, work_dir: Path
    ) -> None:
        self.settings, self.events, self.work_dir = settings, events, work_dir
        self.station = Station(recording=TlogWriter(work_dir / "flight.tlog"))
        self.flight = FleetFlight(
            station=self.station,
            mission=mission,
            mode=settings.mode,
            planner=planner,
            events=events,
            speed=settings.speed,
            unattended=settings.headless,
        )
        self.trails = Trails(mission.frame)
        self._started_s = time.monotonic()

    @property
    def mission(self) -> Mission:
        return self.flight.mission

    async def fly(self) -> FlightReport:
        """Start what is to be started, fly, end everything, and write the report.

        Raises:
            UsageError: a port in use, or other input that cannot be; nothing has flown.
        """
        reason = ""
        try:
            await self._fly_with_everything()
        except* UsageError as problems:
            raise problems.exceptions[0] from None
        except* GcsError as problems:
            reason = str(problems.exceptions[0])
            self.events.add("failed", reason, severity=Severity.ERROR)
        return self.write_report(reason)

    async def _fly_with_everything(self) -> None:
        async with AsyncExitStack() as stack:
            for url in self.settings.ground_links():
                connection = await open_udp(url, self.station.receive)
                stack.callback(connection.close)
                self.station.connections.append(connection)
            simulator = await stack.enter_async_context(Processes(self.work_dir))
            companions = await stack.enter_async_context(Processes(self.work_dir))
            async with asyncio.TaskGroup() as group:
                background = [
                    group.create_task(self.station.send_heartbeats(), name="heartbeats"),
                    group.create_task(self._sample_trails(), name="trails"),
                ]
                if self.settings.fleet is FleetSource.SIMULATED:
                    child = await self._start_simulator(simulator)
                    background.append(group.create_task(simulator.watch(child), name="watch the simulator"))
                await self._settle_origin()
                if self.settings.fleet is not FleetSource.ATTACHED and self.settings.mode.needs_companions:
                    for child in await self._start_companions(companions):
                        background.append(group.create_task(self._watch_companion(companions, child)))
                await self._fly()
                for task in background:
                    task.cancel()

    async def _fly(self) -> None:
        try:
            await self.flight.fly()
        except BaseException as ended:  # also Ctrl-C, and a simulator that died
            if self.flight.in_flight:
                why = "interrupted" if isinstance(ended, asyncio.CancelledError) else str(ended)
                await asyncio.shield(self._hold_all(why))
            raise

    async def _hold_all(self, why: str) -> None:
        self.events.add("hold", f"commanding Hold to all vehicles in flight: {why}", severity=Severity.WARNING)
        try:
            async with asyncio.timeout(HOLD_TIMEOUT_S):
                await self.flight.hold_all(why)
        except TimeoutError:
            self.events.add("hold", "not every vehicle confirmed Hold", severity=Severity.ERROR)

    async def _start_simulator(self, processes: Processes) -> Child:
        settings = self.settings
        options = ["--seed", str(settings.seed), "--truth", str(self.work_dir / TRUTH_FILE)]
        return await processes.start("sitl", "sitl", settings.mission, *options, *self._common_options())

    async def _start_companions(self, processes: Processes) -> list[Child]:
        children: list[Child] = []
        for vehicle in self.mission.vehicles:
            name = f"companion-{vehicle.sysid}"
            options = ["--vehicle", str(vehicle.sysid), "--mission", self.settings.mission]
            options += ["--mode", self.settings.mode.value, "--seed", str(self.settings.seed)]
            options += ["--log", str(self.work_dir / f"{name}.jsonl")]
            for fault in self.settings.faults:
                if fault.vehicle == vehicle.sysid:
                    options += ["--fault", format_fault(fault)]
            children.append(await processes.start(name, "companion", *options, *self._common_options()))
        return children

    def _common_options(self) -> list[str]:
        origin = self.mission.origin
        place = f"{origin.latitude_deg!r},{origin.longitude_deg!r},{origin.altitude_amsl_m!r}"
        settings = self.settings
        base = ["--speed", f"{settings.speed:g}", "--instance-base", str(settings.instance_base)]
        return [*base, "--origin", place, "--supervised"]

    async def _settle_origin(self) -> None:
        """Move the mission to where it shall be flown."""
        origin = self.settings.origin
        if origin is OriginHere.HERE:
            first = self.mission.vehicles[0]
            vehicles = self.station.fleet.vehicles
            await self.station.wait_until(
                lambda: first.sysid in vehicles and vehicles[first.sysid].place is not None,
                CONNECT_TIMEOUT_S,
                f"vehicle {first.sysid} not heard",
            )
            place = vehicles[first.sysid].home or vehicles[first.sysid].place
            assert place is not None
            origin = origin_here(place, first, self.mission)
        if isinstance(origin, GeodeticPoint):
            self._move_to(origin)

    def _move_to(self, origin: GeodeticPoint) -> None:
        self.flight.mission = self.mission.moved_to(origin)
        self.trails = Trails(self.mission.frame)
        text = f"origin {origin.latitude_deg:.7f}, {origin.longitude_deg:.7f}, {origin.altitude_amsl_m:.1f} m AMSL"
        self.events.add("origin", text)

    async def _watch_companion(self, companions: Processes, child: Child) -> None:
        """A companion that ends in flight is the monitor's business; before that it ends everything."""
        try:
            await companions.watch(child)
        except (ProcessFailed, UsageError) as ended:
            if not self.flight.in_flight:
                raise
            self.events.add("process", str(ended), severity=Severity.ERROR)

    async def _sample_trails(self) -> None:
        while True:
            flights = self.flight.vehicles
            self.trails.sample(self.station.fleet, {i: flights[i].monitor.ground_offset_m for i in flights})
            await asyncio.sleep(TRAIL_INTERVAL_S / self.settings.speed)

    def write_report(self, reason: str) -> FlightReport:
        """Write `report.json` and `flight.png`; close the recordings."""
        assert self.station.recording is not None
        self.station.recording.close()
        flown = self._flown()
        ends_s = [part.times_s[-1] for part in flown.values() if len(part.times_s)]
        wall_s = time.monotonic() - self._started_s
        report = make_report(self.flight, flown, reason=reason, wall_s=wall_s, sim_s=max(ends_s, default=0.0))
        (self.work_dir / "report.json").write_bytes(msgspec.json.format(msgspec.json.encode(report), indent=2) + b"\n")
        names = {vehicle.sysid: vehicle.name for vehicle in self.mission.vehicles}
        tracks = {names[sysid]: part.in_flight().positions_m for sysid, part in flown.items() if sysid in names}
        draw_flight(self.work_dir / "flight.png", self.mission, self.flight.plan, tracks)
        return report

    def _flown(self) -> dict[int, Flown]:
        truth = self.work_dir / TRUTH_FILE
        if self.settings.fleet is FleetSource.SIMULATED and truth.exists():
            return read_truth(truth)
        return {sysid: flown_from_trail(trail) for sysid, trail in self.trails.by_sysid.items()}
