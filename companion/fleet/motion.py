"""Trajectories of others, made from what is known: straight on, and plans with what comes before them."""

import numpy as np
import numpy.typing as npt

from missions.trajectory import Trajectory

Array = npt.NDArray[np.float64]

STRAIGHT_POINTS = 9
STANDING_M_S = 0.15
"""Slower than this is noise."""


def straight_on(position_m: Array, velocity_m_s: Array, at_s: float, duration_s: float) -> Trajectory:
    """A trajectory from a place at a constant velocity, which ends at rest.

    Args:
        position_m: (3,) where it begins.
        velocity_m_s: (3,) how it goes on.
        at_s: when it begins.
        duration_s: for how long it goes on; the last third of that it slows down.
    """
    knot_s = duration_s / (STRAIGHT_POINTS - 3)
    steps = np.minimum(np.arange(STRAIGHT_POINTS) - 1.0, STRAIGHT_POINTS - 4.0)
    moves = velocity_m_s if float(np.linalg.norm(velocity_m_s)) > STANDING_M_S else np.zeros(3)
    return Trajectory(position_m + steps[:, None] * knot_s * moves, at_s, knot_s)


def with_lead_in(trajectory: Trajectory, before: Trajectory, from_s: float, most_points: int) -> Trajectory:
    """The same trajectory, begun earlier: with the end of the one that is flown until then.

    Whoever hears it needs nothing else to know where the vehicle is from now on. Each added control point makes the
    spline pass where the other one passes a knot interval earlier.

    Args:
        trajectory: begins in the state in which `before` is then.
        before: what is flown until then.
        from_s: what lies before this time is not needed.
        most_points: control points that the result may have.
    """
    control_m, knot_s, start_s = trajectory.control_points_m, trajectory.knot_interval_s, trajectory.start_s
    while start_s > from_s and len(control_m) < most_points:
        start_s -= knot_s
        passed_m = before.at(start_s).position_m
        control_m = np.vstack((6.0 * passed_m - 4.0 * control_m[0] - control_m[1], control_m))
    return Trajectory(control_m, start_s, knot_s)
