"""Finding back into a flight that a crashed ground station has left alone: hear, download, compare; command nothing."""

import asyncio
import math
from collections.abc import Awaitable, Callable
from pathlib import Path

import msgspec

from gcs.errors import FlightAborted, GcsError
from gcs.fleet.vehicle_state import LandedState, VehicleState
from gcs.flight import upload
from gcs.flight.events import EventLog, Severity
from gcs.flight.journal import JOURNAL_FILE, Story, is_written, read_story
from gcs.flight.sequence import FleetFlight
from gcs.flight.vehicle_flight import VehicleFlight
from gcs.microservices.mission_comparison import first_difference
from gcs.planner.flown_plan import NO_FLOWN_PLAN, FlownPlan
from gcs.planner.plan import FleetPlan
from gcs.station import Station
from missions.mission import Mission

HEARD_TIMEOUT_S = 20.0
LOOKED_AT = 20
"""How many of the newest flights are looked at for one that was left in the air."""


def unfinished(folder: Path, mission: Mission) -> Story | None:
    """The flight of this mission that was left in the air by whoever wrote into a folder; None if there is none."""
    story = read_story(folder / JOURNAL_FILE)
    if story is None or story.ended or not story.aloft:
        return None
    same = msgspec.structs.replace(story.began.mission, origin=mission.origin)
    return story if same.digest == mission.digest else None


def left_in_flight(folders: Path, mission: Mission) -> Path | None:
    """The newest of many flights' folders that holds an unfinished flight of a mission, its ground station gone."""
    for folder in _newest(folders):
        if unfinished(folder, mission) is not None and not is_written(folder / JOURNAL_FILE):
            return folder
    return None


def newest_left_in_flight(folders: Path) -> Path | None:
    """The same of whatever mission, for whoever has none to compare."""
    for folder in _newest(folders):
        story = read_story(folder / JOURNAL_FILE)
        if story is not None and not story.ended and story.aloft and not is_written(folder / JOURNAL_FILE):
            return folder
    return None


def _newest(folders: Path) -> list[Path]:
    return sorted(folders.iterdir(), reverse=True)[:LOOKED_AT] if folders.is_dir() else []


def told_flight(story: Story, station: Station, events: EventLog) -> FleetFlight:
    """A flight as a journal tells it: its mission, its plan, and how far each vehicle was; nobody plans it anew."""
    flight = FleetFlight(station, story.mission, story.began.mode, _no_planner, events, story.began.speed)
    flight.passive, flight.unattended = True, False
    story.restore(flight)
    return flight


async def _no_planner(mission: Mission, flown: FlownPlan = NO_FLOWN_PLAN, /) -> FleetPlan:
    raise FlightAborted(f"{mission.name} is only looked at")


async def rejoin(flight: FleetFlight, events: EventLog, follow: Callable[[], Awaitable[None]]) -> None:
    """Look for the vehicles of a restored flight, whether they still fly or have come down meanwhile, and follow it.

    What is stored on them is downloaded and compared with what was uploaded. Nothing is commanded, and nothing will be
    without an operator's order.

    Args:
        flight: from a journal.
        events: where it is told.
        follow: follows the flight to its end; who has not been found is looked for meanwhile.
    """
    flight.passive = True
    aloft = list(flight.in_flight)
    names = ", ".join(part.name for part in aloft)
    events.add("rejoin", f"the last ground station left {names} in flight; looking for them, commanding nothing")
    flight.sought = {part.sysid for part in aloft}
    try:
        async with asyncio.TaskGroup() as group:
            looks = [group.create_task(_look(flight, part, events)) for part in aloft]
            await follow()
            for look in looks:
                look.cancel()
    except* GcsError as failures:
        raise failures.exceptions[0] from None


async def _look(flight: FleetFlight, part: VehicleFlight, events: EventLog) -> None:
    station, fleet = flight.station, flight.station.fleet.vehicles

    def found() -> bool:
        return _is_known(fleet.get(part.sysid))

    if not await station.holds_within(found, HEARD_TIMEOUT_S):
        text = f"not heard within {HEARD_TIMEOUT_S:g} s; it is looked for further"
        events.add("rejoin", text, part.name, Severity.ERROR)
        await station.holds_within(found, math.inf)
    flight.sought.discard(part.sysid)
    try:
        stored = await upload.read(station, part.sysid)
    except GcsError as problem:
        events.add("rejoin", f"its mission could not be compared: {problem}", part.name, Severity.ERROR)
        return
    difference = first_difference(part.items, stored)
    if difference:
        events.add("rejoin", f"another mission is stored than was uploaded: {difference}", part.name, Severity.ERROR)
    else:
        text = f"{fleet[part.sysid].mode.name.lower()}, item {fleet[part.sysid].mission_seq} of the uploaded mission"
        events.add("rejoin", text, part.name)


def _is_known(state: VehicleState | None) -> bool:
    """It has said whether it is in the air, and where."""
    return state is not None and state.landed is not LandedState.UNDEFINED and state.place is not None
