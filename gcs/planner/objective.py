"""The objective of eq. 13, as plans report it: numpy, over dense samples (docs/decisions/0010-objective.md).

f = sum over vehicles of  phi_1 L - phi_2 mean(lambda) - phi_3 mean(h),  means over arc length, lambda and h capped
where the mission caps them. The search computes the same sum from fewer samples (`curve_cost`).
"""

from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from gcs.planner.limits import clearance_cap_m, height_cap_m
from missions import obstacles
from missions.mission import Mission

Array = npt.NDArray[np.float64]


def objective(mission: Mission, curves_m: Iterable[Array]) -> float:
    """f of eq. 13 of (m, 3) curves, ENU [m], in the mission's world as it is known."""
    world = mission.world.as_known()
    solid = obstacles.pack(world)
    weights, total = mission.planner, 0.0
    for curve_m in curves_m:
        clearance_m = np.minimum(obstacles.clearance(curve_m, solid), clearance_cap_m(mission, world))
        height_m = np.minimum(curve_m[:, 2] - obstacles.terrain_height(curve_m, solid), height_cap_m(mission))
        sides_m = np.linalg.norm(np.diff(curve_m, axis=0), axis=1)
        reward = weights.clearance_weight * clearance_m + weights.height_weight * height_m
        length_m = sides_m.sum()
        mean_reward = (
            float(0.5 * (reward[1:] + reward[:-1]) @ sides_m / length_m) if length_m > 0.0 else float(reward[0])
        )
        total += weights.length_weight * float(length_m) - mean_reward
    return total
