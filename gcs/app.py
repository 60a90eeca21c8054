"""The composition root: builds the parts of one session, runs them together, and takes them down again."""

import asyncio
import contextlib
import time
from collections.abc import Callable, Coroutine
from contextlib import AsyncExitStack
from pathlib import Path

import msgspec

from gcs.desk import Desk
from gcs.errors import GcsError, KeyRingError, ProcessFailed, UsageError
from gcs.flight.events import EventLog, Severity
from gcs.flight.journal import JOURNAL_FILE, JournalKeeper, Story
from gcs.flight.picture import draw_flight
from gcs.flight.preflight import origin_here
from gcs.flight.preparation import CONNECT_TIMEOUT_S
from gcs.flight.rejoining import rejoin
from gcs.flight.report import FlightReport, Flown, flown_from_trail, make_report, read_truth
from gcs.flight.security_watch import SecurityWatch
from gcs.flight.sequence import FleetFlight, Planner
from gcs.flight.trails import Trails
from gcs.link.opening import open_link
from gcs.link.tlog import TlogWriter
from gcs.processes import Child, Processes
from gcs.security.audit import AUDIT_FILE, Audit, AuditFile
from gcs.security.key_ring import KeyRing
from gcs.settings import Autopilots, FlightSettings, OriginHere
from gcs.station import Station
from missions import lidar_packets, ports
from missions.errors import MissionError
from missions.faults import format_fault
from missions.mission import Mission, SensorKind

TRAIL_INTERVAL_S = 0.05
HOLD_TIMEOUT_S = 5.0
TRUTH_FILE = "truth.csv"

BROWSER_TIMEOUT_S = 15.0
"""A flight with a page waits for a browser, but not longer than this [s]."""

Page = Callable[[Desk, asyncio.Event], Coroutine[None, None, None]]
"""Serves the web page of a desk until it is cancelled; sets the event when the first browser shows it."""


class FlightApp:
    """One flight with everything around it.

    Args:
        settings: what the operator chose.
        mission: as it was read.
        planner: makes the cloud's plan.
        events: where everything of note is written.
        work_dir: for the report and the logs of all programs.
        page: serves the web page; None for a headless run, which ends when the flight has ended.
        story: a flight that was left in the air by a ground station that has crashed: it is gone on with.

    Raises:
        UsageError: another ground station, alive, flies with this `work_dir`.
    """

    def __init__(
        self,
        settings: FlightSettings,
        mission: Mission,
        planner: Planner,
        events: EventLog,
        work_dir: Path,
        page: Page | None = None,
        story: Story | None = None,
    ) -> None:
        self.settings, self.work_dir, self._page = settings, work_dir, page
        self._keys = key_ring(settings, mission, work_dir, events)
        self._journal = _journal(work_dir)
        station = Station(
            recording=TlogWriter(work_dir / "flight.tlog", keep=story is not None),
            say=lambda text: events.add("link", text, severity=Severity.WARNING),
        )
        self._audit = AuditFile(work_dir / AUDIT_FILE)
        station.audit = Audit(self._audit.write, station.unix_us)
        station.codec.signing = self._keys.signing(station.unix_us)
        flight = FleetFlight(
            station=station,
            mission=mission,
            mode=settings.mode,
            planner=planner,
            events=events,
            speed=settings.speed,
            unattended=page is None,
        )
        self.flight, self.station, self.events = flight, station, events
        self._restored = story is not None
        if story is not None:
            story.restore(flight)
        simulated = settings.autopilots is Autopilots.SIMULATED
        self.desk = Desk(station, events, flight, Trails(flight.mission.frame), simulated=simulated)
        self._security = SecurityWatch(station, events, {vehicle.sysid: vehicle.name for vehicle in mission.vehicles})
        self.report: FlightReport | None = None
        self._first_browser = asyncio.Event()
        self._started_s = time.monotonic()

    async def run(self) -> FlightReport:
        """Start what is to be started, fly, end everything, and leave a report.

        Raises:
            UsageError: a port in use, or other input that cannot be; nothing has flown.
            MissionError: the mission cannot be planned for.
        """
        reason = ""
        try:
            await self._run_everything()
        except* (UsageError, MissionError) as problems:
            raise _first(problems) from None
        except* GcsError as problems:
            reason = str(_first(problems))
            self.events.add("failed", reason, severity=Severity.ERROR)
        try:
            return self.report or self._write_report(reason)
        finally:
            self._journal.close()

    async def _run_everything(self) -> None:
        async with AsyncExitStack() as stack:
            assert self.station.recording is not None
            stack.callback(self.station.recording.close)
            stack.callback(self._audit.close)
            for url in self.settings.ground_links():
                connection = await open_link(url, self.station.receive, self.station.say)
                stack.callback(connection.close)
                self.station.connections.append(connection)
            simulator = await stack.enter_async_context(Processes(self.work_dir))
            companions = await stack.enter_async_context(Processes(self.work_dir))
            async with asyncio.TaskGroup() as group:
                background = [
                    group.create_task(self.station.send_heartbeats(), name="heartbeats"),
                    group.create_task(self._sample_trails(), name="trails"),
                ]
                if self._page is not None:
                    background.append(group.create_task(self._page(self.desk, self._first_browser), name="page"))
                if self.settings.autopilots is Autopilots.SIMULATED:
                    child = await self._start_simulator(simulator)
                    background.append(group.create_task(simulator.watch(child), name="watch the simulator"))
                await self._settle_origin()
                if self.settings.starts_companions:
                    for child in await self._start_companions(companions):
                        background.append(group.create_task(self._watch_companion(companions, child)))
                await self._fly()
                for task in background:
                    task.cancel()

    async def _fly(self) -> None:
        """The flight, and with a page what the operator does before and after it."""
        try:
            if self._restored:
                await rejoin(self.flight, self.events)
                await self.flight.watch()
            else:
                if self._page is not None:
                    await self._wait_for_browser()
                self._journal.begin(self.flight, self.station.unix_us())
                await self.desk.fly()
            self.report = self._write_report("")
            if self._page is not None:
                await asyncio.Event().wait()
        except GcsError as problem:
            await self._leave_holding(str(problem))
            self.report = self._write_report(str(problem))
            if self._page is None:
                raise
            self.events.add("failed", str(problem), severity=Severity.ERROR)
            await asyncio.Event().wait()
        except BaseException as ended:  # Ctrl-C, a simulator that died, or a defect: nothing is left to itself
            cancelled = isinstance(ended, asyncio.CancelledError)
            await self._leave_holding("interrupted" if cancelled else f"interrupted ({type(ended).__name__})")
            raise
        finally:
            self._journal.look(self.flight, self.station.unix_us())
            await self.desk.close()

    async def _wait_for_browser(self) -> None:
        self.events.add("page", f"page: http://{self.settings.host}:{self.settings.port}")
        self.events.add("page", f"the flight begins when a browser shows it, or in {BROWSER_TIMEOUT_S:g} s")
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(BROWSER_TIMEOUT_S):
                await self._first_browser.wait()

    async def _leave_holding(self, why: str) -> None:
        if not self.flight.in_flight or self.flight.passive:
            return
        self.events.add("hold", f"Hold for all vehicles in flight: {why}", severity=Severity.WARNING)
        orders = asyncio.ensure_future(self.flight.hold_all(why))
        done, _ = await asyncio.shield(asyncio.wait({orders}, timeout=HOLD_TIMEOUT_S))
        if not done:
            orders.cancel()
            self.events.add("hold", "not every vehicle confirmed Hold", severity=Severity.ERROR)

    async def _start_simulator(self, processes: Processes) -> Child:
        settings = self.settings
        self.events.add("process", "starting the simulator; on a fresh machine it is compiled first, in half a minute")
        options = ["--seed", str(settings.seed), "--truth", str(self.work_dir / TRUTH_FILE)]
        options += ["--signing-key", str(self._keys.keys_path)]
        for fault in settings.simulator_faults:
            options += ["--fault", format_fault(fault)]
        options.append("--lidar" if settings.simulates_lidar else "--no-lidar")
        return await processes.start("sitl", "sitl", settings.mission, *options, *self._common_options())

    async def _start_companions(self, processes: Processes) -> list[Child]:
        children: list[Child] = []
        self.events.add("process", f"starting {len(self.flight.mission.vehicles)} companions")
        for vehicle in self.flight.mission.vehicles:
            name = f"companion-{vehicle.sysid}"
            options = ["--vehicle", str(vehicle.sysid), "--mission", self.settings.mission]
            options += ["--mode", self.settings.mode.value, "--seed", str(self.settings.seed)]
            options += ["--log", str(self.work_dir / f"{name}.jsonl")]
            options += self._sensor_options(vehicle.sysid) + self._fleet_options()
            for fault in self.settings.faults:
                if fault.vehicle == vehicle.sysid:
                    options += ["--fault", format_fault(fault)]
            children.append(await processes.start(name, "companion", *options, *self._common_options()))
        return children

    def _sensor_options(self, sysid: int) -> list[str]:
        """What a companion sees with, and where it hears it."""
        settings = self.settings
        port = lidar_packets.FIRST_PORT + sysid - 1 + settings.instance_base
        address = ["--lidar", f"{settings.lidar_host}:{port}"] if settings.sensor is SensorKind.LIDAR else []
        return ["--sensor", settings.sensor.value, *address]

    def _fleet_options(self) -> list[str]:
        """How companions of this machine hear each other where no simulator passes their words on."""
        if self.settings.autopilots is Autopilots.SIMULATED:
            return []
        port = ports.FIRST_FLEET_PORT + self.settings.instance_base
        return ["--fleet-link", f"mcast://{ports.FLEET_GROUP}:{port}/127.0.0.1"]

    def _common_options(self) -> list[str]:
        origin = self.flight.mission.origin
        place = f"{origin.latitude_deg!r},{origin.longitude_deg!r},{origin.altitude_amsl_m!r}"
        settings = self.settings
        shared = ["--speed", f"{settings.speed:g}", "--instance-base", str(settings.instance_base)]
        return [*shared, "--origin", place, "--supervised"]

    async def _settle_origin(self) -> None:
        """With `--origin here`, move the mission to where its first vehicle stands."""
        if self.settings.origin is not OriginHere.HERE or self._restored:
            return
        mission, vehicles = self.flight.mission, self.station.fleet.vehicles
        first = mission.vehicles[0]
        await self.station.wait_until(
            lambda: first.sysid in vehicles and vehicles[first.sysid].home is not None,
            CONNECT_TIMEOUT_S,
            f"vehicle {first.sysid} not heard, or it has no home position",
        )
        home = vehicles[first.sysid].home
        assert home is not None
        origin = origin_here(home, first, mission)
        self.flight.mission = mission.moved_to(origin)
        self.desk.trails = Trails(self.flight.mission.frame)
        text = f"origin {origin.latitude_deg:.7f}, {origin.longitude_deg:.7f}, {origin.altitude_amsl_m:.1f} m AMSL"
        self.events.add("origin", text)

    async def _watch_companion(self, companions: Processes, child: Child) -> None:
        """A companion that ends in flight is the monitor's business; before that it ends everything."""
        try:
            await companions.watch(child)
        except (ProcessFailed, UsageError) as ended:
            if self.report is None and not self.flight.in_flight:
                raise
            self.events.add("process", str(ended), severity=Severity.ERROR)

    async def _sample_trails(self) -> None:
        while True:
            offsets_m = {sysid: part.monitor.ground_offset_m for sysid, part in self.flight.vehicles.items()}
            assert self.desk.trails is not None
            self.desk.trails.sample(self.station.fleet, offsets_m)
            self.desk.collect_texts()
            self._security.look(self.station.now_s)
            self._journal.look(self.flight, self.station.unix_us())
            await asyncio.sleep(TRAIL_INTERVAL_S / self.settings.speed)

    def _write_report(self, reason: str) -> FlightReport:
        """Write `report.json` and `flight.png`."""
        flown = self._flown()
        ends_s = [float(part.times_s[-1]) for part in flown.values() if len(part.times_s)]
        wall_s = time.monotonic() - self._started_s
        report = make_report(self.flight, flown, reason=reason, wall_s=wall_s, sim_s=max(ends_s, default=0.0))
        (self.work_dir / "report.json").write_bytes(msgspec.json.format(msgspec.json.encode(report), indent=2) + b"\n")
        names = {vehicle.sysid: vehicle.name for vehicle in self.flight.mission.vehicles}
        tracks = {names[sysid]: part.in_flight().positions_m for sysid, part in flown.items() if sysid in names}
        draw_flight(self.work_dir / "flight.png", self.flight.mission, self.flight.plan, tracks)
        self._journal.look(self.flight, self.station.unix_us())
        self._journal.end(report.success, self.station.unix_us())
        return report

    def _flown(self) -> dict[int, Flown]:
        truth = self.work_dir / TRUTH_FILE
        if self.settings.autopilots is Autopilots.SIMULATED and truth.exists():
            return read_truth(truth)
        assert self.desk.trails is not None
        return {sysid: flown_from_trail(trail) for sysid, trail in self.desk.trails.by_sysid.items()}


def key_ring(settings: FlightSettings, mission: Mission, work_dir: Path, events: EventLog) -> KeyRing:
    """The keys of a flight. Simulated vehicles are given theirs: they are made here when they are needed first.

    Raises:
        KeyRingError: keys of real vehicles cannot be used; simulated ones get keys for this flight alone.
    """
    ring = KeyRing(settings.key_folder())
    if settings.autopilots is not Autopilots.SIMULATED:
        return ring
    sysids = [vehicle.sysid for vehicle in mission.vehicles]
    try:
        ring.ensure(sysids)
    except KeyRingError as problem:
        if settings.keys is not None:
            raise
        events.add("security", f"{problem}; this flight has keys of its own", severity=Severity.WARNING)
        ring = KeyRing(work_dir / "keys")
        ring.ensure(sysids)
    return ring


def _journal(work_dir: Path) -> JournalKeeper:
    try:
        return JournalKeeper(work_dir / JOURNAL_FILE)
    except BlockingIOError:
        raise UsageError(f"{work_dir}: another ground station is flying with this folder") from None


def _first(group: BaseExceptionGroup) -> BaseException:
    """The first error of a group, however deeply it is nested."""
    first = group.exceptions[0]
    return _first(first) if isinstance(first, BaseExceptionGroup) else first
