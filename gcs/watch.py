"""`gcs watch`: the page alone, attached to whatever is on the links; it starts no program and arms nothing."""

import asyncio
from contextlib import AsyncExitStack
from pathlib import Path

from gcs.app import TRAIL_INTERVAL_S, Page
from gcs.desk import Desk
from gcs.errors import GcsError
from gcs.flight.events import EventLog, Severity
from gcs.flight.journal import Story
from gcs.flight.rejoining import rejoin, told_flight
from gcs.flight.security_watch import SecurityWatch
from gcs.flight.sequence import FleetFlight
from gcs.flight.trails import Trails
from gcs.link.opening import open_link
from gcs.link.tlog import TlogWriter
from gcs.security.audit import AUDIT_FILE, Audit, AuditFile
from gcs.security.key_ring import KeyRing
from gcs.settings import FlightSettings
from gcs.station import Station
from missions.frames import LocalFrame


async def watch(
    settings: FlightSettings, events: EventLog, work_dir: Path, page: Page, story: Story | None = None
) -> None:
    """Serve the page until cancelled; everything is recorded in `work_dir`.

    Args:
        settings: links and keys.
        events: the log.
        work_dir: of the recording.
        page: serves the page.
        story: a flight that is under way: it is shown where it is, and what its vehicles have stored is compared.

    Raises:
        UsageError: a port in use, or a key ring that cannot be used.
    """
    audit = AuditFile(work_dir / AUDIT_FILE, events.complain)
    station = Station(
        recording=TlogWriter(work_dir / "flight.tlog", say=events.complain),
        say=lambda text: events.add("link", text, severity=Severity.WARNING),
    )
    station.audit = Audit(audit.write, station.unix_us)
    station.codec.signing = KeyRing(settings.key_folder()).signing(station.unix_us, events.complain)
    flight = told_flight(story, station, events) if story is not None else None
    desk = Desk(station, events, flight, Trails(flight.mission.frame) if flight is not None else None)
    async with AsyncExitStack() as stack:
        assert station.recording is not None
        stack.callback(station.recording.close)
        stack.callback(audit.close)
        for url in settings.ground_links():
            connection = await open_link(url, station.receive, station.tell)
            stack.callback(connection.close)
            station.connections.append(connection)
            events.add("link", f"listening on {url}")
        async with asyncio.TaskGroup() as group:
            group.create_task(station.send_heartbeats(), name="heartbeats")
            group.create_task(_sample_trails(desk, SecurityWatch(station, events, _names(flight))), name="trails")
            if flight is not None and flight.in_flight:
                group.create_task(_find(desk, flight), name="flight")
            await page(desk, asyncio.Event())


async def _find(desk: Desk, flight: FleetFlight) -> None:
    """Find into a flight, and follow it to its end."""
    try:
        await rejoin(flight, desk.events, desk.follow)
    except GcsError as problem:
        desk.events.add("failed", str(problem), severity=Severity.ERROR)


def _names(flight: FleetFlight | None) -> dict[int, str]:
    return {vehicle.sysid: vehicle.name for vehicle in flight.mission.vehicles} if flight is not None else {}


async def _sample_trails(desk: Desk, security: SecurityWatch) -> None:
    """Without a mission, the frame is that of the first vehicle's home."""
    while True:
        if desk.trails is None:
            home = next((state.home for state in desk.vehicles.values() if state.home is not None), None)
            desk.trails = Trails(LocalFrame(home)) if home is not None else None
        else:
            parts = desk.flight.vehicles if desk.flight is not None else {}
            offsets_m = {sysid: part.monitor.ground_offset_m for sysid, part in parts.items()}
            desk.trails.sample(desk.station.fleet, offsets_m)
        desk.collect_texts()
        security.look(desk.station.now_s)
        await asyncio.sleep(TRAIL_INTERVAL_S)
