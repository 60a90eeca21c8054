"""Another vehicle, as this one's planner sees it."""

from dataclasses import dataclass

from missions.mission import Limits, Site
from missions.trajectory import Trajectory
from missions.tunnel import TrajectoryKind

POSITION_ERROR_M = {Site.INDOOR: 0.1, Site.OUTDOOR: 1.0}
"""How far off an estimate of position may be: about three standard deviations of good positioning."""


@dataclass(frozen=True)
class Neighbour:
    """Another vehicle and what it will do, as far as is known.

    Args:
        sysid: its MAVLink system id.
        trajectory: mission ENU, its times on *this* vehicle's clock; it stands in its first state before it begins and
            rests at its end for good.
        radius_m: how far from the trajectory its body reaches: the body itself, and all that is uncertain.
        kind: what it said of the trajectory; OPTIMISED is not flown yet.
        heard_s: when it was last heard, this vehicle's time [s].
    """

    sysid: int
    trajectory: Trajectory
    radius_m: float
    kind: TrajectoryKind
    heard_s: float

    def distance_m(self, limits: Limits) -> float:
        """The least distance between its trajectory and this vehicle's at the same time [m].

        It is the mission's separation, and more by as much as the neighbour's radius exceeds a body.
        """
        return limits.separation_m + max(self.radius_m - limits.body_radius_m, 0.0)
