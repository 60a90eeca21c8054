"""When two vehicles come too near to each other, if both do what they said."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from companion.fleet.neighbour import Neighbour
from missions.mission import Limits
from missions.trajectory import Trajectory

Array = npt.NDArray[np.float64]

STEP_S = 0.05
LONGEST_S = 12.0
"""So far ahead is looked; by then everything has been planned anew."""
EASING_M = 0.02
"""Who is too near already may stay as near as that, and no nearer."""
RESTING_S = 1.0
"""After the end of all trajectories nothing changes any more: looked at once more so much later."""


def first_conflict_s(
    trajectory: Trajectory, neighbours: Sequence[Neighbour], limits: Limits, now_s: float
) -> tuple[float, Neighbour | None]:
    """When (vehicle time) a trajectory first comes too near to a neighbour's, and to whose; infinity and None if never.

    Where two are too near now, they may come apart from there.
    """
    first_s, whose = float("inf"), None
    if not neighbours:
        return first_s, whose
    end_s = max(trajectory.end_s, *(n.trajectory.end_s for n in neighbours)) + RESTING_S
    begin_s = max(now_s, trajectory.start_s)
    times_s = np.arange(begin_s, min(max(end_s, begin_s + RESTING_S), begin_s + LONGEST_S), STEP_S)
    own_m = trajectory.sample(times_s).position_m
    for neighbour in neighbours:
        apart_m = np.linalg.norm(neighbour.trajectory.sample(times_s).position_m - own_m, axis=1)
        least_m = min(neighbour.distance_m(limits), apart_m[0] - EASING_M)
        too_near = np.flatnonzero(apart_m < least_m)
        if len(too_near) and times_s[too_near[0]] < first_s:
            first_s, whose = float(times_s[too_near[0]]), neighbour
    return first_s, whose
