"""Coming to rest along a trajectory: on its path, as soon as the limits allow, without a jump."""

import numpy as np
import numpy.typing as npt

from companion.planner.spline_shape import sample_rows
from missions.trajectory import Trajectory

Array = npt.NDArray[np.float64]

CONTROL_POINTS = 12
SHORTEST_S = 0.4


def brake_along(trajectory: Trajectory, now_s: float, acceleration_m_s2: float) -> Trajectory:
    """A trajectory on the same path that begins in the state at `now_s` and comes to rest.

    The path's own time runs slower and slower: its rate falls from 1 to 0 as (1 + cos(pi t / D)) / 2, whose steepest
    slope is pi / (2 D); D is chosen so that this brakes with the given acceleration. The result is fitted by a spline
    that begins exactly in the state at `now_s`; the last metre of a path that ends at rest anyway is simply flown.

    Args:
        trajectory: what is flown.
        now_s: vehicle time [s] at which braking begins.
        acceleration_m_s2: how hard.
    """
    motion = trajectory.at(now_s)
    speed_m_s = float(np.linalg.norm(motion.velocity_m_s))
    duration_s = max(np.pi * speed_m_s / (2.0 * acceleration_m_s2), SHORTEST_S)
    knot_s = duration_s / (CONTROL_POINTS - 3)
    rows = sample_rows(CONTROL_POINTS)
    u = np.linspace(0.0, 1.0, len(rows))
    passed_s = 0.5 * duration_s * (u + np.sin(np.pi * u) / np.pi)  # the path's own time, integrated
    path = trajectory.sample(now_s + passed_s).position_m
    place, drift = motion.position_m, motion.velocity_m_s * knot_s
    bend = motion.acceleration_m_s2 * knot_s**2 / 3.0
    fixed = np.vstack((place - drift + bend, place - 0.5 * bend, place + drift + bend, np.tile(path[-1], (3, 1))))
    ends = np.r_[0:3, CONTROL_POINTS - 3 : CONTROL_POINTS]
    inner = np.linalg.lstsq(rows[:, 3:-3], path - rows[:, ends] @ fixed, rcond=None)[0]
    return Trajectory(np.vstack((fixed[:3], inner, fixed[3:])).astype(float), now_s, knot_s)
