"""How far one sees: the nearest surface along rays, among all that is solid in a world; ENU, compiled."""

from typing import Any

import numpy as np
import numpy.typing as npt

from missions.kernels import compiled
from missions.obstacles import Obstacles, terrain_height_at

Array = npt.NDArray[np.float64]

PARALLEL = 1e-12
"""A direction's component below this never meets the planes across it."""
STEEPEST_AT = 0.707107
"""A Gaussian hill is steepest so far from its axis, in units of x_s."""
TOLERANCE_M = 1e-3
MOST_STEPS = 1000


@compiled
def cast_rays(origin_enu_m: Array, directions_enu: Array, world: Obstacles, balls: Array, range_m: float) -> Array:
    """Distances to what is hit first; infinite where nothing is within range.

    Args:
        origin_enu_m: (3,) where the rays begin.
        directions_enu: (n, 3) unit vectors.
        world: boxes, cylinders and peaks are solid, the ground is the sum of the peaks (eq. 23); threats are not seen.
        balls: (k, 4) centre ENU and radius [m] of all that moves.
        range_m: how far is looked.

    Returns:
        (n,) distances [m]; 0 from inside of something.
    """
    out = np.empty(len(directions_enu))
    for i in range(len(directions_enu)):
        nearest = range_m
        for k in range(len(world.boxes)):
            nearest = min(nearest, _to_box(origin_enu_m, directions_enu[i], world.boxes[k]))
        for k in range(len(world.cylinders)):
            nearest = min(nearest, _to_cylinder(origin_enu_m, directions_enu[i], world.cylinders[k]))
        for k in range(len(balls)):
            nearest = min(nearest, _to_ball(origin_enu_m, directions_enu[i], balls[k]))
        nearest = min(nearest, _to_ground(origin_enu_m, directions_enu[i], world, nearest))
        out[i] = nearest if nearest < range_m else np.inf
    return out


@compiled
def _between(position: float, direction: float, low: float, high: float) -> Any:
    """Where a ray is between two parallel planes: from, to; from > to for never."""
    if abs(direction) < PARALLEL:
        return (-np.inf, np.inf) if low <= position <= high else (np.inf, -np.inf)
    one, other = (low - position) / direction, (high - position) / direction
    return min(one, other), max(one, other)


@compiled
def _within(a: float, half_b: float, c: float) -> Any:
    """Where a t^2 + 2 half_b t + c <= 0, a >= 0: from, to; from > to for never."""
    if a < PARALLEL:
        return (-np.inf, np.inf) if c <= 0.0 else (np.inf, -np.inf)
    discriminant = half_b * half_b - a * c
    if discriminant < 0.0:
        return np.inf, -np.inf
    root = np.sqrt(discriminant)
    return (-half_b - root) / a, (-half_b + root) / a


@compiled
def _entry(begin: float, end: float) -> float:
    """Distance at which a ray enters what it is inside of from `begin` to `end`; infinite if that is behind it."""
    return max(begin, 0.0) if begin <= end and end >= 0.0 else np.inf


@compiled
def _to_box(o: Array, d: Array, box: Array) -> float:
    begin, end = -np.inf, np.inf
    for k in range(3):
        enters, leaves = _between(o[k], d[k], box[k] - box[3 + k], box[k] + box[3 + k])
        begin, end = max(begin, enters), min(end, leaves)
    return _entry(begin, end)


@compiled
def _to_cylinder(o: Array, d: Array, cylinder: Array) -> float:
    east, north = o[0] - cylinder[0], o[1] - cylinder[1]
    c = east * east + north * north - cylinder[2] * cylinder[2]
    enters, leaves = _within(d[0] * d[0] + d[1] * d[1], east * d[0] + north * d[1], c)
    begin, end = _between(o[2], d[2], cylinder[3], cylinder[4])
    return _entry(max(begin, enters), min(end, leaves))


@compiled
def _to_ball(o: Array, d: Array, ball: Array) -> float:
    east, north, up = o[0] - ball[0], o[1] - ball[1], o[2] - ball[2]
    c = east * east + north * north + up * up - ball[3] * ball[3]
    begin, end = _within(1.0, east * d[0] + north * d[1] + up * d[2], c)
    return _entry(begin, end)


@compiled
def _to_ground(o: Array, d: Array, world: Obstacles, nearer_than: float) -> float:
    """Flat ground at once; hills by steps that the steepest ground along the ray cannot overtake."""
    level = np.sqrt(d[0] * d[0] + d[1] * d[1])
    closing = _steepest_along(o, d, world.peaks, level, nearer_than) * level - d[2]
    t = 0.0
    for _ in range(MOST_STEPS):
        gap = o[2] + t * d[2] - terrain_height_at(o[0] + t * d[0], o[1] + t * d[1], world)
        if gap <= TOLERANCE_M:
            return t
        if closing <= 0.0:
            return np.inf
        t += gap / closing
        if t >= nearer_than:
            return np.inf
    return t


@compiled
def _steepest_along(o: Array, d: Array, peaks: Array, level: float, length_m: float) -> float:
    """The ground below a ray is nowhere steeper than this: the peaks' slopes where it comes nearest to their axes."""
    steepest = 0.0
    for k in range(len(peaks)):
        east, north, slope = o[0] - peaks[k, 0], o[1] - peaks[k, 1], peaks[k, 2]
        along = 0.0 if level < PARALLEL else -(east * d[0] + north * d[1]) / (level * level)
        along = min(max(along, 0.0), length_m)
        nearest = np.hypot(east + along * d[0], north + along * d[1]) / slope
        u = max(nearest, STEEPEST_AT)
        steepest += 2.0 * u * peaks[k, 3] / slope * np.exp(-u * u)
    return steepest
