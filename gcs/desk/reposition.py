"""Whether a vehicle can be sent straight to a place: inside the fence, clear of what is known. Pure."""

import numpy as np
import numpy.typing as npt

from missions import obstacles
from missions.mission import Mission

Array = npt.NDArray[np.float64]

STEP_M = 0.1
MOST_STEPS = 5000


def why_not_there(mission: Mission, from_m: Array, to_m: Array, others_m: Array) -> str | None:
    """Why a vehicle cannot be sent there, as a phrase; None if it can.

    Args:
        mission: its world, as it is known, and its limits.
        from_m: (3,) where the vehicle is.
        to_m: (3,) where it shall go.
        others_m: (n, 3) where the other vehicles in the air are.
    """
    limits, bounds = mission.limits, mission.world.bounds
    if not bounds.contains((float(to_m[0]), float(to_m[1]), float(to_m[2]))):
        return "the place lies outside of the flight range"
    solid = obstacles.pack(mission.world.as_known())
    free_m = float(obstacles.clearance(to_m[None], solid)[0])
    if free_m < limits.clearance_m:
        return f"the place has {max(free_m, 0.0):.1f} m clearance, required is {limits.clearance_m:g} m"
    ground_m = float(obstacles.terrain_height(to_m[None, :2], solid)[0])
    if to_m[2] - ground_m < limits.clearance_m:
        return f"the place is {to_m[2] - ground_m:.1f} m above the ground, required is {limits.clearance_m:g} m"
    way_m = _way(from_m, to_m)
    clear_m = obstacles.clearance(way_m, solid)
    # a vehicle that is near something already may leave it, not come nearer
    required_m = np.minimum(limits.clearance_m, np.maximum(clear_m[0], limits.body_radius_m))
    if np.any(clear_m < required_m - 1e-9):
        nearest = way_m[int(np.argmin(clear_m))]
        return f"something is in the straight way, at east {nearest[0]:.0f} m, north {nearest[1]:.0f} m"
    return _why_not_beside(mission, way_m, others_m)


def _why_not_beside(mission: Mission, way_m: Array, others_m: Array) -> str | None:
    """The separation holds; who is nearer already (on the pads) may go away, not come nearer."""
    if len(others_m) == 0:
        return None
    apart_m = np.linalg.norm(way_m[:, None] - others_m[None], axis=2)
    touching_m = 2.0 * mission.limits.body_radius_m
    required_m = np.minimum(mission.limits.separation_m, np.maximum(apart_m[0], touching_m))
    if np.any(apart_m < required_m - 1e-9):
        required = f"required are {mission.limits.separation_m:g} m"
        return f"it would come within {float(apart_m.min()):.1f} m of another vehicle, {required}"
    return None


def _way(from_m: Array, to_m: Array) -> Array:
    """(n, 3) points of the straight way."""
    steps = int(np.clip(np.linalg.norm(to_m - from_m) / STEP_M, 1, MOST_STEPS))
    return from_m + np.linspace(0.0, 1.0, steps + 1)[:, None] * (to_m - from_m)
