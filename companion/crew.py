"""What engagements and flights work with, and the figures that they leave for the status."""

import itertools
from dataclasses import dataclass, field

from companion.figures import Quantiles
from companion.fleet.exchange import Exchange
from companion.planner.planner import Planner
from companion.settings import PilotSettings
from missions.mission import Mission

LEAST_LOST_TRACK_M = 0.75


class Figures:
    """What a companion's status reports of its flights."""

    def __init__(self) -> None:
        self.replans = 0
        self.replan_ms = Quantiles(resolution=0.02, largest=200.0)
        self.tracking_error_m = Quantiles(resolution=0.005, largest=20.0)
        self.lateness_max_ms = 0.0


@dataclass(frozen=True)
class Crew:
    """Planner, settings and figures of one companion."""

    mission: Mission
    planner: Planner
    settings: PilotSettings
    speed: float
    """Vehicle seconds per wall-clock second."""
    exchange: Exchange
    """With the other vehicles."""
    figures: Figures = field(default_factory=Figures)
    _numbers: "itertools.count[int]" = field(default_factory=itertools.count)

    def next_number(self) -> int:
        """Of a plan request; never the same twice."""
        return next(self._numbers)

    @property
    def allowance_s(self) -> float:
        """Vehicle time between the request for a plan and its beginning."""
        return self.settings.planning_allowance_wall_s * self.speed

    @property
    def lateness_s(self) -> float:
        """Vehicle time by which a plan may come later than it begins."""
        return self.settings.lateness_wall_s * self.speed

    @property
    def lost_track_m(self) -> float:
        """A vehicle farther than this from its setpoint is planned for from where it is."""
        return max(LEAST_LOST_TRACK_M, self.mission.limits.clearance_m)
