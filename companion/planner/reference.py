"""The reference of a local plan: the guide from where the vehicle is, timed within the limits.

It is what a plan would be if there were no splines: the guide's piece within the horizon, joined smoothly from the
vehicle's place, passed at the nominal speeds. The search looks for trajectories around it.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from companion.planner.limits import FlightLimits, Surroundings, fill_standing, free_at, span, speed_limit
from missions.kernels import compiled

Array = npt.NDArray[np.float64]

PATH_SAMPLES = 64
JOIN_SLOPE = 6.0
"""Who is beside the way joins it within this multiple of the distance, but not before a quarter of the plan."""
STANDING_M_S = 0.3
"""Who is slower may leave in any direction."""
ROUNDS, SMOOTHINGS = 4, 3
"""Rounding: as often the path is pushed off obstacles, each time after so many smoothings: about a knot's length."""
SETTLINGS = 8
"""Then it is smoothed and pushed in turn so often: a push alone leaves kinks, which would have to be flown slowly."""
PUSHED_FARTHER_M = 0.02
PROBE_M = 0.01
"""How the path is pushed off obstacles: what is added for the rounding between them, step of the slope."""
CORNER_SHARE = 0.85
"""Of the highest acceleration may be spent on turning."""
CORNER_SAMPLES = 2
"""Turns are measured over so many samples to both sides."""
SHORTEST_S = 1.0
SLOWEST_M_S = 0.05
"""A path is never timed slower than this between two samples, so that times stay finite at rest."""

LEG_SPEED, CORRIDOR = 3, 4
"""Columns of a way after its three coordinates: speed that is aimed at where the mission's speed rule allows it
[m/s], and how far plans may deviate sideways [m]."""

TANGENT, SPEED_CAP, WIDTH = 3, 6, 7
"""Columns of a reference after its three coordinates: unit vector along the path (three, zero where it rests), the
leg's own speed limit [m/s], the corridor [m]."""


class Way(NamedTuple):
    """A polyline to be flown along, as compiled code reads it."""

    samples: Array
    """(m, 5) ENU [m], LEG_SPEED, CORRIDOR."""
    arc_m: Array
    """(m,) distance along it from its beginning."""

    @property
    def points_m(self) -> Array:
        """(m, 3) ENU [m]."""
        return self.samples[:, :3]


class Reference(NamedTuple):
    """A timed way from the start to the goal."""

    samples: Array
    """(K + 1, 8) at equal time steps: ENU [m], TANGENT, SPEED_CAP, WIDTH."""
    duration_s: float
    length_m: float


@compiled
def lay_reference(
    way: Way,
    from_m: float,
    to_m: float,
    start: Array,
    n_samples: int,
    limits: FlightLimits,
    around: Surroundings,
) -> Reference:
    """Time the piece of `way` between two arcs, entered from a state.

    Args:
        way: what is followed.
        from_m: arc [m] beside which the vehicle is.
        to_m: arc [m] where the plan comes to rest.
        start: (3, 3) position, velocity, acceleration; the offset from the way fades out along it.
        n_samples: K + 1.
        limits: of speed and acceleration.
        around: what the speed rule looks at.
    """
    path, aims = np.empty((PATH_SAMPLES, 5)), np.empty(PATH_SAMPLES)
    arc, times = np.zeros(PATH_SAMPLES), np.zeros(PATH_SAMPLES)
    n_pinned = follow(way, from_m, to_m, start, path)
    relax(path, n_pinned, limits, around)
    free_m = np.empty(PATH_SAMPLES)
    fill_standing(path, around, free_m)
    for j in range(PATH_SAMPLES):
        aims[j] = min(path[j, LEG_SPEED], speed_limit(free_m[j], limits) * limits.nominal_ratio)
        aims[j] = min(aims[j], corner_speed(path, j, limits))
        if j > 0:
            arc[j] = arc[j - 1] + apart(path, j, j - 1)
    reach_speeds(arc, aims, span(start[1, 0], start[1, 1], start[1, 2]), limits.braking_m_s2)
    for j in range(1, PATH_SAMPLES):
        times[j] = times[j - 1] + (arc[j] - arc[j - 1]) / max(0.5 * (aims[j] + aims[j - 1]), SLOWEST_M_S)
    settling_s = limits.acceleration_m_s2 / limits.jerk_m_s3
    duration_s = max(times[-1] + settling_s, SHORTEST_S)
    samples = np.zeros((n_samples, 8))
    sample_in_time(path, times, aims, duration_s, limits.nominal_ratio, samples)
    return Reference(samples, duration_s, arc[-1])


@compiled
def follow(way: Way, from_m: float, to_m: float, start: Array, path: Array) -> int:
    """Sample a piece of `way` at equal arcs into `path` (n, 5), joined smoothly from the start's place and direction.

    Returns:
        how many samples at its beginning the start decides: the second one, too, of a vehicle that moves.
    """
    samples, arc_m = way.samples, way.arc_m
    n, i, length_m = len(path), 0, to_m - from_m
    for j in range(n):
        at_m = from_m + length_m * j / (n - 1)
        while i < len(arc_m) - 2 and arc_m[i + 1] < at_m:
            i += 1
        after = min(i + 1, len(arc_m) - 1)  # the way of a vehicle at its target is one sample
        share = min(max((at_m - arc_m[i]) / max(arc_m[after] - arc_m[i], 1e-9), 0.0), 1.0)
        for column in range(5):
            path[j, column] = samples[i, column] + share * (samples[after, column] - samples[i, column])
    off, turned, step_m, speed_m_s = (
        np.empty(3),
        np.zeros(3),
        length_m / (n - 1),
        span(start[1, 0], start[1, 1], start[1, 2]),
    )
    for axis in range(3):
        off[axis] = start[0, axis] - path[0, axis]
        if speed_m_s > STANDING_M_S:
            turned[axis] = start[1, axis] / speed_m_s - (path[1, axis] - path[0, axis]) / max(step_m, 1e-9)
    joined_m = max(JOIN_SLOPE * span(off[0], off[1], off[2]), 0.25 * length_m)
    joined_m = min(joined_m, length_m)
    for j in range(n):
        u = min(step_m * j / max(joined_m, 1e-9), 1.0)
        left, onwards_m = 1.0 - u * u * (3.0 - 2.0 * u), joined_m * u * (1.0 - u) * (1.0 - u)
        for axis in range(3):
            path[j, axis] += left * off[axis] + onwards_m * turned[axis]
    return 2 if speed_m_s > STANDING_M_S else 1


@compiled
def relax(path: Array, n_pinned: int, limits: FlightLimits, around: Surroundings) -> None:
    """Round the corners of a path (n, 5) as far as a spline would, and push it off what it comes too near to.

    Its end and its first `n_pinned` samples stay.
    """
    free_m, moved = np.empty(len(path)), np.empty((len(path), 3))
    for _ in range(ROUNDS):
        for _ in range(SMOOTHINGS):
            smooth(path, n_pinned, moved)
        push(path, n_pinned, limits, around, free_m)
    for _ in range(SETTLINGS):
        smooth(path, n_pinned, moved)
        push(path, n_pinned, limits, around, free_m)


@compiled
def smooth(path: Array, n_pinned: int, moved: Array) -> None:
    """Move each sample of a path halfway to the middle of its neighbours; `moved` (n, 3) is room to work in."""
    for j in range(n_pinned, len(path) - 1):
        for axis in range(3):
            moved[j, axis] = 0.25 * (path[j - 1, axis] + path[j + 1, axis]) + 0.5 * path[j, axis]
    for j in range(n_pinned, len(path) - 1):
        for axis in range(3):
            path[j, axis] = moved[j, axis]


@compiled
def push(path: Array, n_pinned: int, limits: FlightLimits, around: Surroundings, free_m: Array) -> None:
    """Push a path (n, 5) out to the avoidance distance where it lacks less of it than the corridor is wide.

    Passing an obstacle a little farther off at full speed is better than passing it slowly. Where more lacks, it is
    pushed out to the required clearance. `free_m` (n,) is room to work in.
    """
    slope, clear_m = np.empty(3), limits.clearance_m + limits.reserve_m
    fill_standing(path, around, free_m)
    for j in range(n_pinned, len(path) - 1):
        lack_m = max(limits.avoidance_distance_m, clear_m) + PUSHED_FARTHER_M - free_m[j]
        if lack_m > path[j, CORRIDOR]:
            lack_m = clear_m + PUSHED_FARTHER_M - free_m[j]
        if lack_m <= 0.0 or lack_m > max(path[j, CORRIDOR], limits.clearance_m):
            continue
        for axis in range(3):
            path[j, axis] += PROBE_M
            slope[axis] = (free_at(path[j, 0], path[j, 1], path[j, 2], around) - free_m[j]) / PROBE_M
            path[j, axis] -= PROBE_M
        steepness = max(span(slope[0], slope[1], slope[2]), 1.0)
        for axis in range(3):
            path[j, axis] += lack_m * slope[axis] / steepness


@compiled
def corner_speed(path: Array, j: int, limits: FlightLimits) -> float:
    """Speed [m/s] at which the turn of a path (n, 3 or more) about its j-th sample can be flown."""
    j = min(max(j, CORNER_SAMPLES), len(path) - 1 - CORNER_SAMPLES)
    before, after, across2, along = j - CORNER_SAMPLES, j + CORNER_SAMPLES, 0.0, 0.0
    for axis in range(3):
        second = path[after, axis] - 2.0 * path[j, axis] + path[before, axis]
        across2 += second * second
    along = 0.5 * (apart(path, j, before) + apart(path, after, j))
    return np.sqrt(CORNER_SHARE * limits.acceleration_m_s2 * along * along / max(np.sqrt(across2), 1e-9))


@compiled
def reach_speeds(arc_m: Array, speeds_m_s: Array, start_m_s: float, braking_m_s2: float) -> None:
    """Cut the (n,) speeds along a path to what acceleration and braking allow from `start_m_s` to rest.

    Who starts faster than it may brakes as hard as it can.
    """
    n, first = len(arc_m), start_m_s * start_m_s
    for j in range(n):
        speeds_m_s[j] *= speeds_m_s[j]
    speeds_m_s[0], speeds_m_s[n - 1] = min(speeds_m_s[0], first), 0.0
    for j in range(1, n):
        speeds_m_s[j] = min(speeds_m_s[j], speeds_m_s[j - 1] + 2.0 * braking_m_s2 * (arc_m[j] - arc_m[j - 1]))
    for j in range(n - 2, -1, -1):
        speeds_m_s[j] = min(speeds_m_s[j], speeds_m_s[j + 1] + 2.0 * braking_m_s2 * (arc_m[j + 1] - arc_m[j]))
    for j in range(n):
        slowest = 0.0 if j == n - 1 else first - 2.0 * braking_m_s2 * arc_m[j]
        speeds_m_s[j] = np.sqrt(max(speeds_m_s[j], slowest))


@compiled
def sample_in_time(
    path: Array, times_s: Array, speeds_m_s: Array, duration_s: float, nominal_ratio: float, samples: Array
) -> None:
    """Fill `samples` (K + 1, 8) from a path (n, 5) that is passed at (n,) times and speeds; it rests in its end."""
    n, j = len(samples), 0
    for k in range(n):
        time_s = min(duration_s * k / (n - 1), times_s[-1])
        while j < len(path) - 2 and times_s[j + 1] < time_s:
            j += 1
        passed = (time_s - times_s[j]) / max(times_s[j + 1] - times_s[j], 1e-9)
        gain = (speeds_m_s[j + 1] - speeds_m_s[j]) / max(speeds_m_s[j + 1] + speeds_m_s[j], 1e-9)
        share = passed * (1.0 - gain * (1.0 - passed))  # constant acceleration between two samples
        for axis in range(3):
            samples[k, axis] = path[j, axis] + share * (path[j + 1, axis] - path[j, axis])
        samples[k, SPEED_CAP] = max(path[j, LEG_SPEED], path[j + 1, LEG_SPEED]) / nominal_ratio
        samples[k, WIDTH] = path[j, CORRIDOR] + share * (path[j + 1, CORRIDOR] - path[j, CORRIDOR])
    for k in range(n):
        ahead, behind = min(k + 1, n - 1), max(k - 1, 0)
        length_m = apart(samples, ahead, behind)
        for axis in range(3):
            along_m = samples[ahead, axis] - samples[behind, axis]
            samples[k, TANGENT + axis] = along_m / length_m if length_m > 1e-6 else 0.0


@compiled
def apart(points_m: Array, i: int, j: int) -> float:
    """Distance between the i-th and the j-th point of (m, 3 or more)."""
    return span(points_m[i, 0] - points_m[j, 0], points_m[i, 1] - points_m[j, 1], points_m[i, 2] - points_m[j, 2])
