"""What a candidate trajectory is worth: three objectives (eq. 18) and how far it breaks its constraints.

A candidate is a vector x of 1 + 3 f numbers: the logarithm of its time scale, then the weights of the smooth modes
by which its free control points lie off the fit to the reference, axis by axis. This is the inner loop of all planning.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from companion.planner.limits import FlightLimits, Surroundings, free_space, lacking, span
from companion.planner.reference import SPEED_CAP, TANGENT, WIDTH, Reference, apart
from missions.kernels import compiled

Array = npt.NDArray[np.float64]

LENGTH, CLEARANCE, HEIGHT, HARD, SOFT = range(5)
"""What the (5,) value of a candidate holds: objectives in metres, all to be minimised, then violations."""
OBJECTIVES = 3

SMOOTHNESS_WEIGHT = 0.5
DEVIATION_WEIGHT = 1.5
CLIMB_SLACK_M_S = 0.3
"""A vehicle that hardly moves may climb at any angle."""
TURN_SLACK_SHARE = 0.1
"""Of the highest acceleration: who hardly moves turns on the spot."""


class LocalProblem(NamedTuple):
    """One replan: where from, along what, within which limits; and room for the evaluation to work in."""

    start: Array
    """(3, 3): position, velocity, acceleration, ENU."""
    reference: Reference
    fitted_m: Array
    """(f, 3): the part of the free control points that the reference alone decides."""
    ends: Array
    """(2, 6): start and goal, and what they have of all that is required."""
    limits: FlightLimits
    around: Surroundings
    rows: Array
    layout: Array
    """Of the `SplineShape`."""
    control: Array
    """(n, 3), filled: control points of the candidate that was evaluated last, ENU [m]."""
    motion: Array
    """(K + 1, 9), filled: position, velocity, acceleration at the samples."""
    free_m: Array
    """(K + 1,), filled: clearance."""
    lacking_m: Array
    """(K + 1,), filled: what lacks of clearance, height and flight range ..."""
    scarce_m: Array
    """(K + 1,), filled: ... and what lacks of clearance and reserve."""


@compiled
def evaluate(x: Array, problem: LocalProblem, value: Array) -> float:
    """Judge a candidate.

    Args:
        x: (1 + 3 f,) the candidate.
        problem: what it is to solve; its work arrays are filled.
        value: (5,) is filled with its objectives and violations.

    Returns:
        its knot interval [s].
    """
    control, motion, free_m, lacking_m = problem.control, problem.motion, problem.free_m, problem.lacking_m
    reference, limits = problem.reference, problem.limits
    knot_s = reference.duration_s * np.exp(x[0]) / (len(control) - 3)
    goal_m = reference.samples[len(motion) - 1]
    lay_out(x, problem.start, goal_m, knot_s, problem.fitted_m, problem.layout, control)
    trace(control, knot_s, problem.rows, motion)
    step_s = knot_s * (len(control) - 3) / (len(motion) - 1)
    free_space(motion, step_s, problem.around, free_m)
    lacking(motion, free_m, step_s, problem.around, problem.ends, limits, lacking_m, problem.scarce_m)
    value[HARD] = value[SOFT] = 0.0
    for k in range(1, len(motion)):
        value[HARD] += lacking_m[k] / limits.clearance_m
        value[SOFT] += problem.scarce_m[k] / limits.clearance_m
    judge_motion(motion, free_m, knot_s * (len(control) - 3), problem.start, reference.samples, limits, value)
    judge_way(control, motion, free_m, knot_s, reference, limits, value)
    return knot_s


@compiled
def lay_out(
    x: Array, start: Array, goal_m: Array, knot_s: float, fitted_m: Array, layout: Array, control: Array
) -> None:
    """Write the candidate's control points into `control` (n, 3)."""
    n, n_free = len(control), len(layout)
    for axis in range(3):
        goal = goal_m[axis]
        place, drift, bend = start[0, axis], start[1, axis] * knot_s, start[2, axis] * knot_s * knot_s / 3.0
        first, second, third = place - drift + bend, place - 0.5 * bend, place + drift + bend
        control[0, axis], control[1, axis], control[2, axis] = first, second, third
        control[n - 3, axis] = control[n - 2, axis] = control[n - 1, axis] = goal
        for i in range(n_free):
            at = fitted_m[i, axis] + layout[i, 0] * first + layout[i, 1] * second + layout[i, 2] * third
            at += (layout[i, 3] + layout[i, 4] + layout[i, 5]) * goal
            for j in range(n_free):
                at += layout[i, 6 + j] * x[1 + axis * n_free + j]
            control[3 + i, axis] = at


@compiled
def trace(control: Array, knot_s: float, rows: Array, motion: Array) -> None:
    """Write position, velocity and acceleration at all samples into `motion` (K + 1, 9) (eq. 21)."""
    per_segment, n = rows.shape[1], len(control)
    rate = 1.0 / knot_s
    for segment in range(n - 3):
        for s in range(per_segment):
            k = segment * per_segment + s
            for axis in range(3):
                place = velocity = acceleration = 0.0
                for i in range(4):
                    at = control[segment + i, axis]
                    place += rows[0, s, i] * at
                    velocity += rows[1, s, i] * at
                    acceleration += rows[2, s, i] * at
                motion[k, axis] = place
                motion[k, 3 + axis] = velocity * rate
                motion[k, 6 + axis] = acceleration * rate * rate
    last = len(motion) - 1
    for axis in range(3):
        motion[last, axis] = control[n - 1, axis]
        motion[last, 3 + axis] = motion[last, 6 + axis] = 0.0


@compiled
def judge_motion(
    motion: Array,
    free_m: Array,
    duration_s: float,
    start: Array,
    reference: Array,
    limits: FlightLimits,
    value: Array,
) -> None:
    """Add by what shares speed, acceleration, climb angle and turn radius exceed their limits.

    Who starts too fast, or accelerating too hard, is given the time that it takes to come back to the limits.

    Args:
        motion: (K + 1, 9) positions [m], velocities [m/s] and accelerations [m/s^2], ENU.
        free_m: (K + 1,) their clearances.
        duration_s: of the whole trajectory.
        start: (3, 3) position, velocity and acceleration to begin with.
        reference: (K + 1, 8) samples of the reference.
        limits: of the flight.
        value: (5,) what is added to.
    """
    n, step_s = len(motion), duration_s / (len(motion) - 1)
    avoidance_m_s, cruise_m_s = limits.avoidance_m_s, limits.cruise_m_s
    avoidance_distance_m, braking_m_s2 = limits.avoidance_distance_m, limits.braking_m_s2
    acceleration_m_s2, jerk_m_s3 = limits.acceleration_m_s2, limits.jerk_m_s3
    climbs_m_s, turns = CLIMB_SLACK_M_S, limits.turn_radius_m > 0.0
    first_m_s, first_m_s2 = span(start[1, 0], start[1, 1], start[1, 2]), span(start[2, 0], start[2, 1], start[2, 2])
    for k in range(1, n):
        v2 = motion[k, 3] ** 2 + motion[k, 4] ** 2 + motion[k, 5] ** 2
        a2 = motion[k, 6] ** 2 + motion[k, 7] ** 2 + motion[k, 8] ** 2
        allowed_m_s = avoidance_m_s if free_m[k] < avoidance_distance_m else cruise_m_s
        allowed_m_s = min(allowed_m_s, reference[k, SPEED_CAP])
        allowed_m_s = max(allowed_m_s, first_m_s - braking_m_s2 * k * step_s)
        allowed_m_s2 = max(acceleration_m_s2, first_m_s2 - jerk_m_s3 * k * step_s)
        if v2 > allowed_m_s * allowed_m_s:
            value[HARD] += np.sqrt(v2) / allowed_m_s - 1.0
        if a2 > allowed_m_s2 * allowed_m_s2:
            value[HARD] += np.sqrt(a2) / allowed_m_s2 - 1.0
        if climbs_m_s * climbs_m_s < motion[k, 5] * motion[k, 5] or turns:
            value[SOFT] += _turn_and_climb(motion, k, v2, a2, limits)


@compiled
def judge_way(
    control: Array,
    motion: Array,
    free_m: Array,
    knot_s: float,
    reference: Reference,
    limits: FlightLimits,
    value: Array,
) -> None:
    """Set the objectives; add by what share the jerk exceeds its limit, and the deviation the corridor.

    Length stands for the way as a whole [m]: it bears what is added for roughness, for time off the nominal one and for
    deviating from the reference.
    """
    n, n_segments, samples = len(motion), len(control) - 3, reference.samples
    length = clearance = height = deviation = rough = 0.0
    for k in range(1, n):
        length += apart(motion, k, k - 1)
        clearance += min(free_m[k], limits.clearance_cap_m)
        height += abs(motion[k, 2] - samples[k, 2])
        beside = _beside_squared(motion, k, samples)
        deviation += beside
        if beside > samples[k, WIDTH] * samples[k, WIDTH]:
            value[SOFT] += np.sqrt(beside) / samples[k, WIDTH] - 1.0
    jerk_limit_m = limits.jerk_m_s3 * knot_s * knot_s * knot_s
    for segment in range(n_segments):
        third2 = _third_difference_squared(control, segment)
        rough += third2
        if third2 > jerk_limit_m * jerk_limit_m:
            value[HARD] += np.sqrt(third2) / jerk_limit_m - 1.0
    value[LENGTH] = (
        length
        + SMOOTHNESS_WEIGHT * rough * n_segments / max(reference.length_m, 1e-3)
        + abs(knot_s * n_segments - reference.duration_s) * reference.length_m / reference.duration_s
        + DEVIATION_WEIGHT * deviation / (n - 1) / limits.corridor_m
    )
    value[CLEARANCE], value[HEIGHT] = -clearance / (n - 1), height / (n - 1)


@compiled
def _turn_and_climb(motion: Array, k: int, v2: float, a2: float, limits: FlightLimits) -> float:
    """By how much one sample's climb is too steep and its turn too tight."""
    climb_m_s, broken = abs(motion[k, 5]) - CLIMB_SLACK_M_S, 0.0
    level2 = v2 - motion[k, 5] * motion[k, 5]
    if climb_m_s > 0.0 and climb_m_s * climb_m_s > limits.climb_tangent * limits.climb_tangent * level2:
        broken += (climb_m_s - limits.climb_tangent * np.sqrt(max(level2, 0.0))) / limits.cruise_m_s
    if limits.turn_radius_m > 0.0 and v2 > 0.25 * limits.avoidance_m_s * limits.avoidance_m_s:
        along = motion[k, 3] * motion[k, 6] + motion[k, 4] * motion[k, 7] + motion[k, 5] * motion[k, 8]
        across2 = a2 - along * along / v2
        allowed_m_s2 = TURN_SLACK_SHARE * limits.acceleration_m_s2 + v2 / limits.turn_radius_m
        if across2 > allowed_m_s2 * allowed_m_s2:
            broken += (np.sqrt(across2) - allowed_m_s2) / limits.acceleration_m_s2
    return broken


@compiled
def _beside_squared(motion: Array, k: int, reference: Array) -> float:
    """Squared distance of the k-th sample to the tangent of the reference's k-th sample."""
    squared = along = 0.0
    for axis in range(3):
        off = motion[k, axis] - reference[k, axis]
        squared += off * off
        along += off * reference[k, TANGENT + axis]
    return max(squared - along * along, 0.0)


@compiled
def _third_difference_squared(control: Array, segment: int) -> float:
    """Squared length of the third difference of a segment's control points: jerk times the knot interval cubed."""
    squared = 0.0
    for axis in range(3):
        third = control[segment + 3, axis] - control[segment, axis]
        third += 3.0 * (control[segment + 1, axis] - control[segment + 2, axis])
        squared += third * third
    return squared
