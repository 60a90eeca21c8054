"""What is left of a flight in its folder: `report.json` and `flight.png`."""

from pathlib import Path

import msgspec

from gcs.flight.picture import draw_flight
from gcs.flight.report import FlightReport, Flown, flown_from_trail, make_report, read_truth
from gcs.flight.sequence import FleetFlight
from gcs.flight.trails import Trails
from gcs.unwritten import Unwritten

REPORT_FILE = "report.json"


def read_flown(truth_path: Path | None, trails: Trails) -> dict[int, Flown]:
    """What each vehicle has flown, by system id: the simulator's truth if there is one, else what the fleet said."""
    if truth_path is not None and truth_path.exists():
        return read_truth(truth_path)
    return {sysid: flown_from_trail(trail) for sysid, trail in trails.by_sysid.items()}


def write_report(
    folder: Path, flight: FleetFlight, flown: dict[int, Flown], *, reason: str, wall_s: float
) -> FlightReport:
    """Judge a flight that took `wall_s` seconds of wall clock, and write `report.json`."""
    ends_s = [float(part.times_s[-1]) for part in flown.values() if len(part.times_s)]
    report = make_report(flight, flown, reason=reason, wall_s=wall_s, sim_s=max(ends_s, default=0.0))
    with Unwritten("the report", flight.events.complain):
        (folder / REPORT_FILE).write_bytes(msgspec.json.format(msgspec.json.encode(report), indent=2) + b"\n")
    return report


def write_picture(folder: Path, flight: FleetFlight, flown: dict[int, Flown]) -> None:
    """Write `flight.png`; it knows no event loop, so that a thread may do it."""
    names = {vehicle.sysid: vehicle.name for vehicle in flight.mission.vehicles}
    tracks = {names[sysid]: part.in_flight().positions_m for sysid, part in flown.items() if sysid in names}
    draw_flight(folder / "flight.png", flight.mission, flight.plan, tracks)
