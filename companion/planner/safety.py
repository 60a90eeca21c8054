"""Whether the rest of a committed trajectory is still clear: cheap enough to be asked every tick."""

import numpy as np
import numpy.typing as npt

from companion.planner.limits import FlightLimits, Surroundings, ends_of, free_space, lacking, span
from companion.planner.traffic import spline_point
from missions.kernels import compiled

Array = npt.NDArray[np.float64]

CHECKS_PER_SEGMENT = 6
SLACK_SHARE = 0.2
"""Of the reserve: a search looks at fewer places, and what lacks between these is this at most."""
FASTER = 1.05
"""Who is faster than a plan may be beside things by less than this is not too fast."""


@compiled
def first_lack(
    control: Array, knot_s: float, from_segment: float, limits: FlightLimits, around: Surroundings
) -> tuple[float, float, float]:
    """When the rest of a trajectory first lacks something that is required, when dangerously, when it is too fast.

    Args:
        control: (n, 3) control points, ENU [m].
        knot_s: knot interval [s].
        from_segment: where on it the vehicle is, counted in segments.
        limits: what is required.
        around: everything known, what moves from that moment on.

    Returns:
        three times from that moment on [s], infinite where it is safe: when it first lacks something, when it lacks
        more than the reserve, which is more than noise, and when it is faster beside something than it had to be: who
        is fast is given the time to brake.
    """
    left = len(control) - 3 - from_segment
    steps = max(int(np.ceil(left * CHECKS_PER_SEGMENT)), 1)
    points, free_m = np.empty((steps + 1, 3)), np.empty(steps + 1)
    lacking_m, scarce_m = np.empty(steps + 1), np.empty(steps + 1)
    for i in range(steps + 1):
        spline_point(control, from_segment + left * i / steps, points[i])
    step_s = knot_s * left / steps
    free_space(points, step_s, around, free_m)
    lacking(
        points, free_m, step_s, around, ends_of(points[0], control[-1], around, limits), limits, lacking_m, scarce_m
    )
    first_s = dangerous_s = too_fast_s = np.inf
    near_m = limits.avoidance_distance_m - limits.avoidance_reserve_m
    begun = points[1] - points[0]
    first_m_s = span(begun[0], begun[1], begun[2]) / step_s if step_s > 0.0 else 0.0
    for i in range(steps + 1):
        if lacking_m[i] > SLACK_SHARE * limits.reserve_m:
            first_s = min(first_s, i * step_s)
        if lacking_m[i] > limits.reserve_m:
            dangerous_s = min(dangerous_s, i * step_s)
        if i > 0 and free_m[i] < near_m and step_s > 0.0:
            way = points[i] - points[i - 1]
            allowed_m_s = max(FASTER * limits.avoidance_m_s, first_m_s - limits.braking_m_s2 * (i - 1) * step_s)
            if span(way[0], way[1], way[2]) > allowed_m_s * step_s:
                too_fast_s = min(too_fast_s, i * step_s)
    return first_s, dangerous_s, too_fast_s
