"""`gcs fly FILE.plan`: a plan of another tool as settings, mission and plan of a flight in cloud mode."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import msgspec

from gcs.errors import UsageError
from gcs.planner.flown_plan import NO_FLOWN_PLAN, FlownPlan
from gcs.planner.plan import FleetPlan, Progress
from gcs.settings import FlightSettings, PlanningMode
from missions.mission import Mission

SUFFIXES = {".plan", ".waypoints"}


@dataclass
class GivenPlanner:
    """Stands where a planner would, with a plan that is there already."""

    given: FleetPlan
    on_progress: list[Callable[[Progress], None]] = field(default_factory=list[Callable[[Progress], None]])

    async def plan(self, mission: Mission, flown: FlownPlan = NO_FLOWN_PLAN, /) -> FleetPlan:
        """The plan, whatever the mission: it was made from it."""
        return self.given


def is_plan_file(mission: str) -> bool:
    """Whether a MISSION is the file of another tool."""
    return Path(mission).suffix in SUFFIXES


def settings_and_plan(settings: FlightSettings, sysid: int) -> tuple[FlightSettings, Mission, FleetPlan]:
    """The flight that a plan amounts to.

    Raises:
        BadFile: the plan cannot be read, or not be flown.
        UsageError: the settings contradict it.
    """
    from gcs.files.conversion import read_document
    from gcs.files.flying import mission_of, plan_of

    if settings.origin is not None:
        raise UsageError("--origin: a plan of another tool has its own places")
    document, _ = read_document(Path(settings.mission))
    mission = mission_of(document, settings.mission, sysid, set_parameters=settings.simulated)
    return msgspec.structs.replace(settings, mode=PlanningMode.CLOUD), mission, plan_of(document, mission)


def kept_mission(settings: FlightSettings, mission: Mission, work_dir: Path) -> FlightSettings:
    """Write the mission down for the programs that are started; JSON is YAML."""
    path = work_dir / "mission.yaml"
    path.write_bytes(msgspec.json.format(msgspec.json.encode(mission), indent=2) + b"\n")
    return msgspec.structs.replace(settings, mission=str(path))
