"""The objective of eq. 13, as plans report it: numpy, over dense samples (docs/decisions/0010-objective.md).

f = sum over vehicles of  phi_1 L - phi_2 mean(lambda) - phi_3 mean(h),  means over arc length, lambda and h capped
where the mission caps them. The search computes the same sum from fewer samples (`curve_cost`).
"""

import numpy as np
import numpy.typing as npt

from gcs.planner.curves import lengths
from gcs.planner.limits import clearance_cap_m, height_cap_m
from missions.mission import Mission

Array = npt.NDArray[np.float64]


def objective(mission: Mission, curves_m: Array, clearance_m: Array, height_m: Array) -> float:
    """f of eq. 13 of (vehicles, m, 3) curves, ENU [m], with (vehicles, m) clearances and heights above the terrain."""
    weights = mission.planner
    reward = weights.clearance_weight * np.minimum(clearance_m, clearance_cap_m(mission, mission.world.as_known()))
    reward += weights.height_weight * np.minimum(height_m, height_cap_m(mission))
    sides_m = np.maximum(lengths(np.diff(curves_m, axis=1)), 1e-9)  # one that stays where it is has means, too
    length_m = sides_m.sum(axis=1)
    mean_reward = np.sum(0.5 * (reward[:, 1:] + reward[:, :-1]) * sides_m, axis=1) / length_m
    return float(np.sum(weights.length_weight * length_m - mean_reward))
