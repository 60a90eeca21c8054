"""When vehicles are where: one law of progress, by which all fly the same fraction of their paths at any time.

The paper wants all vehicles to arrive together. Each flies at cruise speed in the open and at avoidance speed near
obstacles; whoever has the shorter path, or no obstacle, flies slower, so that all keep step. Separation that was
planned at equal fractions of the paths then holds at every time.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from missions import obstacles, time_law
from missions.mission import Mission

Array = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]


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


def common_timing(mission: Mission, curves_m: list[Array]) -> Timing:
    """The fastest common progress along (m, 3) curves under the mission's limits of speed and acceleration.

    Both speeds and the sideways acceleration in turns are kept by every vehicle; the acceleration along the path by
    the one with the longest path, and so by all.
    """
    kept, solid = mission.limits, obstacles.pack(mission.world.as_known())
    lengths_m = np.array([max(float(time_law.arc_length(curve_m)[-1]), 1e-6) for curve_m in curves_m])
    near = np.array([obstacles.clearance(curve_m, solid) < kept.avoidance_distance_m for curve_m in curves_m])
    speeds_m_s = np.where(near, kept.avoidance_speed_m_s, kept.cruise_speed_m_s)
    turning_m_s = np.array([np.sqrt(kept.acceleration_m_s2 / np.maximum(curvature(curve), 1e-9)) for curve in curves_m])
    allowed_1_s = np.min(speeds_m_s / lengths_m[:, None], axis=0)
    limit_1_s = np.minimum(allowed_1_s, np.min(turning_m_s / lengths_m[:, None], axis=0))
    longest = np.zeros((len(allowed_1_s), 3))
    longest[:, 0] = np.linspace(0.0, lengths_m.max(), len(allowed_1_s))
    law_m_s = time_law.speeds_along(longest, limit_1_s * lengths_m.max(), kept.acceleration_m_s2)
    return Timing(time_law.times_along(longest, law_m_s), allowed_1_s, _held_back(np.any(near, axis=0), law_m_s))


def curvature(curve_m: Array) -> Array:
    """(m,) curvature [1/m] of a densely sampled (m, 3) curve: of the circle through each sample and its neighbours."""
    before, after = np.diff(curve_m, axis=0)[:-1], np.diff(curve_m, axis=0)[1:]
    sides = np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1) * np.linalg.norm(before + after, axis=1)
    inner = 2.0 * np.linalg.norm(np.cross(before, after), axis=1) / np.maximum(sides, 1e-12)
    return np.concatenate((inner[:1], inner, inner[-1:]))


def _held_back(slow: BoolArray, law_m_s: Array) -> BoolArray:
    """`slow`, drawn out backwards over the braking before it."""
    held = slow.copy()
    braking = np.append(np.diff(law_m_s) < 0.0, False)
    for i in range(len(held) - 2, -1, -1):
        held[i] |= held[i + 1] and braking[i]
    return held
