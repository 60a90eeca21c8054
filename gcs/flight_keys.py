"""The signing keys of one flight: the operator's own, or for simulated vehicles made when they are needed first."""

from pathlib import Path

from gcs.errors import KeyRingError
from gcs.flight.events import EventLog, Severity
from gcs.security.key_ring import KeyRing
from gcs.settings import Autopilots, FlightSettings
from missions.mission import Mission


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
