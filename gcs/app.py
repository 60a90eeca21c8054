"""The composition root: builds the parts of one session, runs them together, and takes them down again."""

import asyncio
import contextlib
import time
from collections.abc import Callable, Coroutine
from contextlib import AsyncExitStack
from pathlib import Path
from typing import cast

from gcs.desk import Desk
from gcs.desk.desk import PlannerChoice
from gcs.desk.intents import NewMission
from gcs.errors import GcsError, ProcessFailed, UsageError
from gcs.flight.events import EventLog, Severity
from gcs.flight.journal import JOURNAL_FILE, JournalKeeper, Story
from gcs.flight.preflight import origin_here
from gcs.flight.preparation import CONNECT_TIMEOUT_S
from gcs.flight.records import REPORT_FILE, read_flown, write_picture, write_report
from gcs.flight.rejoining import rejoin
from gcs.flight.report import FlightReport, Flown
from gcs.flight.security_watch import SecurityWatch
from gcs.flight.sequence import FleetFlight, Planner
from gcs.flight.trails import Trails
from gcs.flight_keys import key_ring
from gcs.link.opening import open_link
from gcs.link.simulator_control import ControlPort
from gcs.link.tlog import TlogWriter
from gcs.processes import Child, Processes
from gcs.programs import FlightPrograms
from gcs.security.audit import AUDIT_FILE, Audit, AuditFile
from gcs.settings import Autopilots, FlightSettings, OriginHere, PlanningMode
from gcs.station import Station
from gcs.unwritten import Unwritten
from missions.errors import MissionError
from missions.frames import GeodeticPoint
from missions.mission import Mission

TRAIL_INTERVAL_S = 0.05
HOLD_TIMEOUT_S = 5.0
REPORT_INTERVAL_S = 0.2

BROWSER_TIMEOUT_S = 15.0
"""A flight with a page waits for a browser, but not longer than this [s]."""
COUNTDOWN_S = 8.0
"""What an operator who has just opened the page has to say that they will do it themselves [s]."""

Page = Callable[[Desk, asyncio.Event], Coroutine[None, None, None]]
"""Serves the web page of a desk until it is cancelled; sets the event when the first browser shows it."""


class FlightApp:
    """One session with everything around it: one flight, or with a page as many as the operator loads.

    Args:
        settings: what the operator chose.
        mission: as it was read.
        planner: makes the cloud's plan.
        events: where everything of note is written.
        work_dir: for the report and the logs of all programs; further flights have folders of their own in it.
        page: serves the web page; None for a headless run, which ends when the flight has ended.
        choice: the planner, as far as it can be chosen on the page.
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
        choice: PlannerChoice | None = None,
        story: Story | None = None,
    ) -> None:
        self.settings, self.work_dir, self.events = settings, work_dir, events
        self._planner, self._page = planner, page
        self._journal = _journal(work_dir, events)
        self.station = Station(
            recording=TlogWriter(work_dir / "flight.tlog", keep=story is not None, say=events.complain),
            say=lambda text: events.add("link", text, severity=Severity.WARNING),
        )
        self._audit = AuditFile(work_dir / AUDIT_FILE, events.complain)
        self.station.audit = Audit(self._audit.write, self.station.unix_us)
        self.programs = self._new_programs(mission, settings.mission, work_dir)
        self.flight = self._new_flight(mission, settings.mode)
        self._restored = story is not None
        if story is not None:
            story.restore(self.flight)
        self.desk = Desk(
            self.station,
            events,
            self.flight,
            Trails(self.flight.mission.frame),
            simulated=self._simulated,
            opener=self.open if page is not None else None,
            planner=choice,
            simulator=ControlPort(settings.instance_base) if self._simulated else None,
        )
        self.report: FlightReport | None = None
        self._flights = 1
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

    async def open(self, new: NewMission | None, mode: PlanningMode | None) -> None:
        """Put another mission onto the desk, or the same one in another mode; its programs are started.

        Raises:
            LinkLost: with `--origin here`, no vehicle was heard.
        """
        mode = mode or self.flight.mode
        if new is None and mode is self.flight.mode:
            return
        mission, source = (new.mission, new.source) if new else (self.flight.mission, self.programs.source)
        await self.programs.end()
        self._flights += 1
        log_dir = self.work_dir / f"flight-{self._flights}"
        log_dir.mkdir(exist_ok=True)
        if new is not None and new.content is not None:
            source = str(log_dir / f"{mission.name}.yaml")
            await asyncio.to_thread(Path(source).write_bytes, new.content)
        self.programs = self._new_programs(mission, source, log_dir)
        if self._simulated:
            self.station.forget()
        if isinstance(self.settings.origin, GeodeticPoint):
            mission = mission.moved_to(self.settings.origin)
        self.flight = self.desk.flight = self._new_flight(mission, mode)
        self.desk.trails = Trails(mission.frame)
        self.desk.plan_progress.clear()
        self.desk.observations.histories.clear()
        self.report, self._started_s = None, time.monotonic()
        self._journal.begin(self.flight, self.station.unix_us())
        self.events.add("loaded", f"mission {mission.name}, {len(mission.vehicles)} vehicles, mode {mode.value}")
        await self._start_programs()

    @property
    def _simulated(self) -> bool:
        return self.settings.autopilots is Autopilots.SIMULATED

    def _new_programs(self, mission: Mission, source: str, log_dir: Path) -> FlightPrograms:
        """The programs of a mission, and the keys with which its vehicles sign."""
        keys = key_ring(self.settings, mission, log_dir, self.events)
        self.station.codec.signing = keys.signing(self.station.unix_us, self.events.complain)
        names = {vehicle.sysid: vehicle.name for vehicle in mission.vehicles}
        self._security = SecurityWatch(self.station, self.events, names)
        return FlightPrograms(self.settings, source, self.events, log_dir, keys.keys_path)

    def _new_flight(self, mission: Mission, mode: PlanningMode) -> FleetFlight:
        return FleetFlight(
            station=self.station,
            mission=mission,
            mode=mode,
            planner=self._planner,
            events=self.events,
            speed=self.settings.speed,
            unattended=self._page is None,
        )

    async def _run_everything(self) -> None:
        async with AsyncExitStack() as stack:
            assert self.station.recording is not None
            stack.callback(self.station.recording.close)
            stack.callback(self._audit.close)
            for url in self.settings.ground_links():
                connection = await open_link(url, self.station.receive, self.station.tell)
                stack.callback(connection.close)
                self.station.connections.append(connection)
            stack.push_async_callback(self._end_programs)
            async with asyncio.TaskGroup() as self._group:
                background = [
                    self._group.create_task(self.station.send_heartbeats(), name="heartbeats"),
                    self._group.create_task(self._sample_trails(), name="trails"),
                ]
                if self._page is not None:
                    background.append(self._group.create_task(self._page(self.desk, self._first_browser), name="page"))
                    background.append(self._group.create_task(self._write_reports(), name="reports"))
                await self._start_programs()
                await self._fly()
                for task in background + self.programs.watches:
                    task.cancel()

    async def _fly(self) -> None:
        """The flight, and with a page whatever the operator does until the session is ended."""
        try:
            if self._restored:
                await rejoin(self.flight, self.events, self.desk.follow)
            else:
                self._journal.begin(self.flight, self.station.unix_us())
            if self._page is not None:
                await self._serve_operator()
            if not self._restored:
                await self.desk.fly()
            self.report = self._write_report("")
        except GcsError as problem:
            await self._leave_holding(str(problem))
            self.report = self._write_report(str(problem))
            raise
        except BaseException as ended:  # Ctrl-C, a simulator that died, or a defect: nothing is left to itself
            cancelled = isinstance(ended, asyncio.CancelledError)
            await self._leave_holding("interrupted" if cancelled else f"interrupted ({type(ended).__name__})")
            raise
        finally:
            self._journal.look(self.flight, self.station.unix_us())
            await self.desk.close()

    async def _serve_operator(self) -> None:
        """In the simulator the flight begins by itself, unless the operator takes over; on real vehicles never."""
        self.events.add("page", f"page: {self.settings.page_url}")
        begins = self._simulated and not self.settings.waits and not self._restored
        if begins and await self._nobody_takes_over():
            try:
                await self.desk.fly()
            except GcsError as problem:
                await self._leave_holding(str(problem))
                self.report = self._write_report(str(problem))
                self.events.add("failed", str(problem), severity=Severity.ERROR)
        await asyncio.Event().wait()

    async def _nobody_takes_over(self) -> bool:
        """Wait for a browser and for its operator; True if the flight is to begin by itself."""
        without_s, with_s = f"{BROWSER_TIMEOUT_S:g} s", f"{COUNTDOWN_S:g} s"
        self.events.add("page", f"the flight begins {with_s} after a browser shows it, or in {without_s} without one")
        if await _is_set(self._first_browser, BROWSER_TIMEOUT_S):
            self.desk.begins_s = self.station.now_s + COUNTDOWN_S
            self.events.add("page", f"the flight begins by itself in {COUNTDOWN_S:g} s, unless an operator takes over")
            await _is_set(self.desk.taken_over, COUNTDOWN_S)
            self.desk.begins_s = None
        return not self.desk.taken_over.is_set()

    async def _leave_holding(self, why: str) -> None:
        if not self.flight.in_flight or self.flight.passive:
            return
        self.events.add("hold", f"Hold for all vehicles in flight: {why}", severity=Severity.WARNING)
        orders = asyncio.ensure_future(self.flight.hold_all(why))
        done, _ = await asyncio.shield(asyncio.wait({orders}, timeout=HOLD_TIMEOUT_S))
        if not done:
            orders.cancel()
            self.events.add("hold", "not every vehicle confirmed Hold", severity=Severity.ERROR)

    async def _start_programs(self) -> None:
        """Start simulator and companions, as far as the settings ask for them."""
        programs, mission = self.programs, self.flight.mission
        if self._simulated:
            processes, child = await programs.start_simulator(mission, self.flight.mode)
            programs.watches.append(self._group.create_task(processes.watch(child), name="watch the simulator"))
        await self._settle_origin()
        if self.settings.starts_companions_in(self.flight.mode):
            processes, children = await programs.start_companions(self.flight.mission, self.flight.mode)
            for child in children:
                programs.watches.append(self._group.create_task(self._watch_companion(processes, child)))

    async def _end_programs(self) -> None:
        await self.programs.end()

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

    async def _write_reports(self) -> None:
        """With a page, each flight's report is written when its last vehicle is down."""
        while True:
            await asyncio.sleep(REPORT_INTERVAL_S)
            if self.flight.finished and self.report is None:
                flown = self._flown()
                self.report = self._judge(flown, "")
                with Unwritten("the flight's picture", self.events.complain):  # drawing takes a second
                    await asyncio.to_thread(write_picture, self.programs.log_dir, self.flight, flown)
                self.events.add("ended", f"{'success' if self.report.success else 'failed'}: {self.report.reason}")
                self.events.add("report", f"report: {self.programs.log_dir / REPORT_FILE}")

    def _write_report(self, reason: str) -> FlightReport:
        """Write `report.json` and `flight.png`."""
        flown = self._flown()
        report = self._judge(flown, reason)
        with Unwritten("the flight's picture", self.events.complain):
            write_picture(self.programs.log_dir, self.flight, flown)
        return report

    def _judge(self, flown: dict[int, Flown], reason: str) -> FlightReport:
        """Write `report.json`, and the flight's end into the journal."""
        wall_s = time.monotonic() - self._started_s
        report = write_report(self.programs.log_dir, self.flight, flown, reason=reason, wall_s=wall_s)
        self._journal.look(self.flight, self.station.unix_us())
        self._journal.end(report.success, self.station.unix_us())
        return report

    def _flown(self) -> dict[int, Flown]:
        assert self.desk.trails is not None
        return read_flown(self.programs.truth_path if self._simulated else None, self.desk.trails)


async def _is_set(event: asyncio.Event, timeout_s: float) -> bool:
    """Wait for an event, but not longer than this; whether it came."""
    with contextlib.suppress(TimeoutError):
        async with asyncio.timeout(timeout_s):
            await event.wait()
    return event.is_set()


def _journal(work_dir: Path, events: EventLog) -> JournalKeeper:
    try:
        return JournalKeeper(work_dir / JOURNAL_FILE, events.complain)
    except BlockingIOError:
        raise UsageError(f"{work_dir}: another ground station is flying with this folder") from None


def _first(group: BaseExceptionGroup[BaseException]) -> BaseException:
    """The first error of a group, however deeply it is nested."""
    first = group.exceptions[0]
    return _first(cast(BaseExceptionGroup[BaseException], first)) if isinstance(first, BaseExceptionGroup) else first
