"""What everything that acts on the vehicles of one flight works with."""

from dataclasses import dataclass

from gcs.flight.events import EventLog
from gcs.settings import PlanningMode
from gcs.station import Station
from missions.mission import Mission


@dataclass(frozen=True)
class Operation:
    """One flight's circumstances.

    Args:
        station: the links and the fleet's state.
        mission: with its final origin.
        mode: who plans.
        events: where everything of note is written.
        speed: simulated seconds per wall-clock second.
    """

    station: Station
    mission: Mission
    mode: PlanningMode
    events: EventLog
    speed: float
