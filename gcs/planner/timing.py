"""When vehicles are where: one law of progress, by which all fly the same fraction of their paths at any time.

The paper wants all vehicles to arrive together. Each flies at cruise speed in the open and at avoidance speed near
obstacles; whoever has the shorter path, or no obstacle, flies slower, so that all keep step. Separation that was
planned at equal fractions of the paths then holds at every time.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gcs.planner.curves import path_lengths
from missions import time_law
from missions.mission import Mission

Array = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]
IntArray = npt.NDArray[np.int64]

UP_TO_SPEED = 0.95
"""Where the fleet does not get to this share of cruise speed between two obstacles, it does not speed up at all."""


@dataclass(frozen=True)
class Timing:
    """The law of progress for curves of m samples each, equally spaced along every curve.

    Args:
        times_s: (m,) seconds since T0 at which all vehicles pass their samples.
        allowed_1_s: (m,) the progress [share of the path per second] that obstacles allow to all of them together.
        held_back: (m,) whether some vehicle flies at avoidance speed there, or brakes for it.
    """

    times_s: Array
    allowed_1_s: Array
    held_back: BoolArray


def common_timing(mission: Mission, curves_m: Array, clearance_m: Array, curvature_1_m: Array) -> Timing:
    """The fastest common progress along the curves under the mission's limits of speed and acceleration.

    Both speeds and the sideways acceleration in turns are kept by every vehicle; the acceleration along the path by
    the one with the longest path, and so by all.

    Args:
        mission: for its limits.
        curves_m: (vehicles, m, 3) samples, ENU [m].
        clearance_m: (vehicles, m) at them.
        curvature_1_m: (vehicles, m) likewise.
    """
    kept = mission.limits
    lengths_m = np.maximum(path_lengths(curves_m), 1e-6)
    near = clearance_m < kept.avoidance_distance_m
    speeds_m_s = np.where(near, kept.avoidance_speed_m_s, kept.cruise_speed_m_s)
    turning_m_s = np.sqrt(kept.acceleration_m_s2 / np.maximum(curvature_1_m, 1e-9))
    allowed_1_s = np.min(speeds_m_s / lengths_m[:, None], axis=0)
    limit_1_s = np.minimum(allowed_1_s, np.min(turning_m_s / lengths_m[:, None], axis=0))
    longest = np.zeros((len(allowed_1_s), 3))
    longest[:, 0] = np.linspace(0.0, lengths_m.max(), len(allowed_1_s))
    law_m_s = time_law.speeds_along(longest, limit_1_s * lengths_m.max(), kept.acceleration_m_s2)
    held_back = _held_back(np.any(near, axis=0), law_m_s, kept.cruise_speed_m_s)
    return Timing(time_law.times_along(longest, law_m_s), allowed_1_s, held_back)


def _held_back(slow: BoolArray, law_m_s: Array, cruise_m_s: float) -> BoolArray:
    """`slow`, drawn out backwards over the braking before it, and over gaps too short to get up to speed in."""
    if not slow.any():
        return slow
    braking = np.append(np.diff(law_m_s) < 0.0, False)
    held = _first_from_here(slow) <= _first_from_here(~braking)
    for run in np.split(np.arange(len(held)), np.flatnonzero(np.diff(held)) + 1)[1:-1]:
        held[run] |= law_m_s[run].max() < UP_TO_SPEED * cruise_m_s
    return held


def _first_from_here(true: BoolArray) -> IntArray:
    """(m,) for every sample, the index of the first one from it on where something is true; m if there is none."""
    m = len(true)
    return np.minimum.accumulate(np.where(true, np.arange(m), m)[::-1])[::-1]
