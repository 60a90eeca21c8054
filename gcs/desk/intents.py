"""What an operator can ask for."""

from dataclasses import dataclass
from enum import Enum

from gcs.settings import PlanningMode
from missions.faults import SimulatorFault
from missions.mission import Mission


class Intent(Enum):
    """What an operator can ask for; the value is what a button says."""

    LOAD = "Load"
    MODE = "Mode"
    ALGORITHM = "Algorithm"
    PLAN = "Plan"
    COMPARE = "Compare"
    CANCEL = "Cancel"
    WAIT = "Wait"
    """Nothing begins by itself."""
    FLY = "Fly"
    REPLAN = "Replan"
    UPLOAD = "Upload"
    ARM = "Arm"
    TAKE_OFF = "Take off"
    START = "Start"
    HOLD = "Hold"
    RESUME = "Resume"
    RTL = "RTL"
    LAND = "Land"
    GO_TO = "Go to"
    SPEED = "Speed"
    KILL = "Kill"
    LINK = "Link"

    __hash__ = object.__hash__
    """One object is one intent; Enum's own hash asks for its name, thousands of times a second for a large fleet."""

    @property
    def concerns_vehicles(self) -> bool:
        """It is asked of single vehicles; the others concern the whole flight."""
        return self not in _OF_THE_FLIGHT


_OF_THE_FLIGHT = {
    Intent.LOAD,
    Intent.MODE,
    Intent.ALGORITHM,
    Intent.PLAN,
    Intent.COMPARE,
    Intent.CANCEL,
    Intent.WAIT,
    Intent.FLY,
    Intent.REPLAN,
}


@dataclass(frozen=True)
class NewMission:
    """A mission to be loaded.

    Args:
        mission: as it was read.
        source: its path, or the name of a shipped one, for the programs that read it themselves.
        content: the file itself, if it is not on this machine's disk yet.
    """

    mission: Mission
    source: str
    content: bytes | None = None


@dataclass(frozen=True)
class Details:
    """What some intents need beside themselves.

    Args:
        place_m: where to go, ENU.
        speed_m_s: how fast to fly.
        mode: who plans.
        algorithm: the planner's name.
        new: the mission to load.
        fault: what the simulator shall do to links; its `vehicle` is filled in for each chosen one.
    """

    place_m: tuple[float, float, float] | None = None
    speed_m_s: float | None = None
    mode: PlanningMode | None = None
    algorithm: str | None = None
    new: NewMission | None = None
    fault: SimulatorFault | None = None


NO_DETAILS = Details()
