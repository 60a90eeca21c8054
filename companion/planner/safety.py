"""Whether the rest of a committed trajectory is still clear: cheap enough to be asked every tick."""

import numpy as np
import numpy.typing as npt

from companion.planner.limits import FlightLimits, Surroundings, ends_of, free_space, lacking
from missions.kernels import compiled

Array = npt.NDArray[np.float64]

CHECKS_PER_SEGMENT = 6


@compiled
def worst_lack(control: Array, from_segment: float, limits: FlightLimits, around: Surroundings) -> float:
    """The most that the rest of a trajectory lacks of clearance, height and flight range [m]; 0 when it is safe.

    Args:
        control: (n, 3) control points, ENU [m].
        from_segment: where on it the vehicle is, counted in segments.
        limits: what is required.
        around: everything known.
    """
    left = len(control) - 3 - from_segment
    steps = max(int(np.ceil(left * CHECKS_PER_SEGMENT)), 1)
    points, free_m, lacking_m = np.empty((steps + 1, 3)), np.empty(steps + 1), np.empty(steps + 1)
    for i in range(steps + 1):
        spline_point(control, from_segment + left * i / steps, points[i])
    free_space(points, around.obstacles, free_m)
    lacking(points, free_m, around, ends_of(points[0], control[-1], around, limits), limits, lacking_m)
    worst_m = 0.0
    for i in range(steps + 1):
        worst_m = max(worst_m, lacking_m[i])
    return worst_m


@compiled
def spline_point(control: Array, at_segment: float, out: Array) -> None:
    """Write the point of a uniform cubic B-spline (eq. 21) at a parameter counted in segments into `out` (3,)."""
    segment = min(max(int(at_segment), 0), len(control) - 4)
    u = min(max(at_segment - segment, 0.0), 1.0)
    w0, w3 = (1.0 - u) ** 3 / 6.0, u**3 / 6.0
    w1 = (3.0 * u**3 - 6.0 * u**2 + 4.0) / 6.0
    w2 = (-3.0 * u**3 + 3.0 * u**2 + 3.0 * u + 1.0) / 6.0
    for axis in range(3):
        out[axis] = (
            w0 * control[segment, axis]
            + w1 * control[segment + 1, axis]
            + w2 * control[segment + 2, axis]
            + w3 * control[segment + 3, axis]
        )
